//! BC6H: blocks of 4 × 4 texels of half floats in 16 bytes, a sixth of what half floats of three channels take.
//!
//! Each block is one or two lines in colour space between end points that the block's mode quantises, and a place of three or four bits
//! on them for each texel. Source: Khronos Group, "Khronos Data Format Specification", version 1.4, 2024, chapter "BC6H"; the
//! choice of modes and end points is that of Intel's ISPC Texture Compressor, ported by the crate `block_compression`; blocks are
//! decoded by another's code, `bcdec_rs`.
//!
//! Valid for values from 0 to 65504. There is no bound on the error of a texel: what a line cannot follow is lost, at the outlines of sharp
//! coloured shadows above all. So every map is decoded again and the
//! error that it has is told. Of a baked Cornell box of 256² texels it is 1.1 % of the mean, and 0.7 % where each chart has blocks of its own
//! (`--block-align`); of smooth light it is less than a per cent (tests). Cost: linear, some microseconds a texel.

use super::ktx2::half;
use block_compression::encode::compress_rgba16;
use block_compression::{BC6HSettings, CompressionVariant};
use exr::prelude::f16;
use rayon::prelude::*;

/// Texels of a block along each side.
pub const SIDE: usize = 4;

/// Bytes of a block.
const BLOCK: usize = 16;

/// All modes are tried: a bake takes longer.
const VARIANT: CompressionVariant = CompressionVariant::BC6H(BC6HSettings::very_slow());

/// The blocks of an image, row by row from the top. Values are moved into the format's range.
///
/// # Panics
/// When a side of the image is no multiple of [`SIDE`], or there are not as many pixels as its `size` (width, height) says.
pub fn encode(pixels: impl Iterator<Item = [f64; 3]>, size: [usize; 2]) -> Vec<u8> {
    let [width, height] = size;
    assert!(
        width % SIDE == 0 && height % SIDE == 0,
        "whole blocks of {width} × {height}"
    );
    let halves: Vec<f16> = pixels
        .flat_map(|[r, g, b]| [r, g, b, 1.0].map(|value| half(value.max(0.0))))
        .collect();
    assert_eq!(halves.len(), 4 * width * height, "a value each");
    let mut blocks = vec![0; width * height / (SIDE * SIDE) * BLOCK];
    // Rows of blocks stand for themselves: the same bytes at any number of threads.
    let rows = blocks.par_chunks_mut((width / SIDE * BLOCK).max(1));
    rows.zip(halves.par_chunks((4 * SIDE * width).max(1)))
        .for_each(|(blocks, halves)| {
            let [side, stride] = [SIDE, 4 * width].map(|x| x as u32);
            compress_rgba16(VARIANT, halves, blocks, width as u32, side, stride);
        });
    blocks
}

/// The values that blocks stand for, row by row from the top.
///
/// # Panics
/// When there are more blocks than the `size` (width, height) says.
pub fn decode(blocks: &[u8], size: [usize; 2]) -> Vec<[f32; 3]> {
    let [width, height] = size;
    let mut texels = vec![[0.0; 3]; width * height];
    let across = (width / SIDE).max(1);
    for (index, block) in blocks.chunks_exact(BLOCK).enumerate() {
        let mut found = [0.0_f32; 3 * SIDE * SIDE];
        bcdec_rs::bc6h_float(block, &mut found, 3 * SIDE, false);
        let first = index / across * SIDE * width + index % across * SIDE;
        for (row, own) in found.chunks_exact(3 * SIDE).enumerate() {
            let (own, _) = own.as_chunks::<3>();
            texels[first + row * width..][..SIDE].copy_from_slice(own);
        }
    }
    texels
}
