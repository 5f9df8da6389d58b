//! The scene as rays see it: triangles in a frame of unit size.
