//! The integration tests of luxel, one module per subject.

mod form_factors;
mod sampling;
