//! Sample points and the warps that turn them into directions and positions.
