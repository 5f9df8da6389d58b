//! What is wrong with a result, and by how much: estimates of error.
//!
//! Every result has three errors of different kinds:
//!
//! | part | what it is | how it is known |
//! |---|---|---|
//! | solver | what the iteration leaves | a rigorous bound from the residual ([`crate::solvers`]) |
//! | sampling | noise of rows, of shadow rays and of the gather | the scatter of independent randomisations, [moderated](moderate) |
//! | discretisation | patches of finite size | larger patches looked up by the same rays ([`crate::gather`], [`fn@coarsening`]) |

mod coarsening;
mod discretisation;
mod moderate;

pub(crate) use coarsening::average;
pub use coarsening::{coarsening, parents};
pub use discretisation::discretisation;
pub use moderate::moderate;
