//! The hemicube: form factors from one point to everything at once, by rasterising onto half a cube.
//!
//! F(x → j) = Σ ΔF over the pixels in which j is nearest, seen from x on the five faces of a cube of half
//! side 1 around it: N×N pixels on top, N×N/2 on each of four sides. ΔF is the exact form factor of each
//! pixel, so that all of them sum to 1. From patch to patch, F_ij is the mean over origins on i.
//!
//! Source: M. F. Cohen, D. P. Greenberg, "The hemi-cube: a radiosity solution for complex
//! environments", SIGGRAPH 1985. Valid for any scene of planar convex polygons; occlusion comes with
//! the depth buffer. Cost: 3N² pixels per origin beside the area that polygons cover.
//!
//! # Known biases
//!
//! * *Aliasing*: a pixel belongs to one polygon entirely. Polygons smaller than a pixel appear or not;
//!   the error of one origin falls as N^-1 to N^-1.5. Each origin turns its cube by another angle, which
//!   makes the errors of the origins independent.
//! * *Few origins*: F_ij is a mean over M points of the patch. Where F jumps across the patch, because the
//!   plane of another patch cuts it or an occluder touches it, the error is about 2/M; smooth parts cost
//!   less. [`HemicubeConfig::balanced`] takes M = N/4, so that both errors fall together.
//! * *Proximity*: what one origin sees stands for its surroundings, so that with a single origin a
//!   neighbour nearer than the size of the patch is misjudged by tens of per cent.
//!
//! Closure is exact in closed scenes whatever the resolution; reciprocity is not, and its defect is of
//! the size of the error.
//!
//! # Error
//!
//! Root mean square of the relative error over the exact cases with F ≥ 0.01, balanced configuration,
//! and its order in 1/N over the three doublings (tests/tests/hemicube.rs prints and holds it):
//!
//! | group | N = 64 | 128 | 256 | 512 | order |
//! |---|---|---|---|---|---|
//! | parallel rectangles | 1.1e-3 | 1.7e-4 | 1.1e-5 | 3.0e-6 | 2.8 |
//! | perpendicular, shared edge | 5.8e-3 | 1.2e-3 | 1.5e-4 | 2.3e-5 | 2.7 |
//! | at an angle, shared edge | 1.9e-3 | 9.8e-4 | 9.5e-5 | 4.3e-5 | 1.8 |
//! | offset rectangles | 3.8e-3 | 3.6e-3 | 2.9e-4 | 8.5e-5 | 1.8 |
//! | triangles | 1.5e-3 | 6.9e-4 | 1.3e-4 | 3.8e-5 | 1.8 |
//! | slivers | 6.4e-4 | 3.0e-4 | 3.3e-5 | 1.0e-5 | 2.0 |
//! | crossing the horizon | 2.4e-1 | 3.7e-2 | 1.9e-2 | 1.2e-2 | 1.4 |
//! | occluded | 7.0e-2 | 9.6e-3 | 6.4e-3 | 3.5e-3 | 1.4 |
//!
//! One patch takes about 4 ms at N = 64, 20 ms at 128, 100 ms at 256 and 700 ms at 512.

mod factors;
mod pixels;
mod raster;

pub(super) use factors::hemicube_of;
pub use factors::{HemicubeConfig, hemicube};
pub use raster::{Facet, FacetSide, Hemicube};
