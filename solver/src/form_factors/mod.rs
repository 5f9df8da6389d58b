//! Form factors, by three estimators.
//!
//! F_ij is the fraction of the flux leaving the front of i that arrives at the front of j, and
//! A_i F_ij = A_j F_ji = S_ij, the exchange area.
//!
//! | estimator | error | cost |
//! |---|---|---|
//! | analytic, nothing between ([`exchange_area`]) | the accuracy asked for, to 1e-12 or so | 0.3–10 µs a pair |
//! | analytic, past occluders ([`occluded_exchange_area`]) | standard error, 1e-4 or less with 1000 points | 1 µs a point and occluder |
//! | ray-cast ([`ray_cast`], as an operator [`ray_cast_rows`]) | standard error, N^-0.5 to N^-0.75 | N rays a row, whatever the scene |
//! | hemicube ([`hemicube()`]) | biased, order 1 and better in the resolution | see [`hemicube`](mod@hemicube) |
//!
//! From an element to a polygon, [`point_to_polygon`] is exact; it is the kernel of direct light, too.

mod angle;
mod area;
mod assembly;
mod between_objects;
mod clip;
mod contour;
mod edges;
mod gauss;
pub mod hemicube;
mod lattice;
mod occluded;
mod point_to_polygon;
mod polygon;
mod polygon_to_polygon;
mod ray_cast;
mod ray_cast_rows;
mod repair;
mod report;
mod scene;
mod segments;
mod shaft;
mod visible;

pub use assembly::unoccluded_matrix;
pub use between_objects::{ObjectFactors, between_objects, ray_cast_between_objects};
pub use clip::{Plane, clip};
pub use hemicube::{Facet, FacetSide, Hemicube, HemicubeConfig, hemicube};
pub use occluded::{AnalyticConfig, AnalyticFactors, Exchange, analytic, occluded_exchange_area};
pub use point_to_polygon::point_to_polygon;
pub use polygon::{Polygon, PolygonError};
pub use polygon_to_polygon::{exchange_area, polygon_to_polygon};
pub use ray_cast::{REPLICATES, RayCastConfig, RayCastFactors, ray_cast, ray_cast_row};
pub use ray_cast_rows::{RayCastRowsConfig, ray_cast_rows};
pub use repair::{Repair, RepairError, Target, repair};
pub use report::{Closure, closure, reciprocity_defect, reciprocity_defect_of_largest};
pub use scene::{analytic_factors, hemicube_factors};
