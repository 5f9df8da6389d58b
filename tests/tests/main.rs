//! The integration tests of luxel, one module per subject.

mod sampling;
