//! The convergence report: every method against one reference, error against cost, as a page.
//!
//! A [`study`] runs each [`family`] of methods over sizes that grow geometrically and measures, at the
//! same receivers ([`target`]), the error against a [`mod@reference`], the error that the method states
//! itself, and what it cost. [`order`] reads orders of convergence from the rows, [`page`] shows
//! everything as one HTML file, [`table`] as CSV. Rows depend on the input and the seed alone; how many
//! there are depends on the clock, unless their number is given.

mod axis;
pub mod budget;
pub mod checks;
mod classical;
pub mod exact;
pub mod false_colour;
pub mod family;
pub(crate) mod html;
pub mod machine;
mod measure;
mod memory;
mod methods;
pub mod metrics;
mod numbers;
mod operators;
pub mod order;
pub mod page;
mod palette;
mod plot;
mod rates;
pub mod reference;
pub mod solver;
pub mod solver_study;
pub mod study;
mod surface_points;
pub mod table;
pub mod target;
