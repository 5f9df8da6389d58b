//! Images, reports and the command line of luxel.
