//! The integration tests of luxel, one module per subject.

mod enclosures;
mod form_factors;
mod hemicube;
mod sampling;
