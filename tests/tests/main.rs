//! The integration tests of luxel.
