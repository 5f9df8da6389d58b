//! Support for the tests of luxel.
