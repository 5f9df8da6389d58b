//! The integration tests of luxel, one module per subject.

mod agreement;
mod ambient_occlusion;
mod bad_input;
mod bounces;
mod cie171;
mod delivery;
mod determinism;
mod directional;
mod enclosures;
mod extremes;
mod form_factors;
mod golden;
mod hard_cases;
mod hemicube;
mod honesty;
mod irradiance_fields;
mod leaks;
mod lightmap_contents;
mod lightmaps;
mod ray_cast;
mod references;
mod sampling;
mod solve_errors;
mod solvers;
mod specular;
mod stress_rays;
