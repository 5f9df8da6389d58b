//! Images and their files.

#[cfg(feature = "bc6h")]
pub mod bc6h;
pub mod exr;
pub mod hdr;
pub mod ktx2;
pub mod png;
pub mod rgbm;

/// A linear RGB image, row-major, row 0 at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Linear values, Rec. 709 primaries, `width * height` of them.
    pub pixels: Vec<[f32; 3]>,
}
