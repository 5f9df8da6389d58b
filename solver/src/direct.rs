//! Direct light at a point.
