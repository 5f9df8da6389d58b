//! KTX2 files with one image: the container, uncompressed half floats, or blocks of BC6H that are made elsewhere.
//!
//! Sources: Khronos Group, "KTX File Format Specification", version 2.0, 2024, chapters 3 (structure, alignment of levels) and 5
//! (keys and values); Khronos Group, "Khronos Data Format Specification", version 1.4, 2024, chapter 5 (basic descriptor block), for
//! whose fields the Khronos Group's `dfdutils` stands as an example. A file is
//!
//!   header (48 bytes) · index (32) · index of levels (24) · data format descriptor · keys and values · padding · level 0,
//!
//! all numbers little-endian, the level at a multiple of the bytes of a texel block and of four. Rows go down (`KTXorientation` is
//! `rd`), which is what glTF's coordinates count. There are no mipmaps, whose texels would mix charts, and no supercompression:
//! every reader of the format reads such files. Half floats have four channels, because graphics processors have no textures of
//! three; alpha is 1.
//!
//! Valid up to 65504, the largest half float; values of 2⁻¹⁴ and above are rounded by at most 2⁻¹¹ of themselves, smaller ones by at
//! most 2⁻²⁵. Cost: linear, 8 bytes a texel.

use exr::prelude::f16;

/// The largest finite half float.
pub const LARGEST: f64 = 65504.0;

/// What a level holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Texels {
    /// `VK_FORMAT_R16G16B16A16_SFLOAT`: four half floats a texel.
    HalfFloat,
    /// `VK_FORMAT_BC6H_UFLOAT_BLOCK`: 16 bytes for 4 × 4 texels.
    Bc6h,
}

/// The first bytes of every file.
const IDENTIFIER: [u8; 12] = *b"\xABKTX 20\xBB\r\n\x1A\n";
/// Bytes before the data format descriptor.
const DESCRIPTOR_AT: usize = 104;

/// Channels of the descriptor's samples, and marks for floats and for signs.
const ALPHA: u8 = 15;
const FLOAT: u8 = 0x80;
const SIGNED: u8 = 0x40;

impl Texels {
    /// Number in Vulkan's list of formats.
    fn vulkan(self) -> u32 {
        match self {
            Self::HalfFloat => 97,
            Self::Bc6h => 143,
        }
    }

    /// Bytes of the type that an endian swap would turn.
    fn type_size(self) -> u32 {
        match self {
            Self::HalfFloat => 2,
            Self::Bc6h => 1,
        }
    }

    /// Bytes of a texel block.
    fn block_bytes(self) -> u8 {
        match self {
            Self::HalfFloat => 8,
            Self::Bc6h => 16,
        }
    }

    /// Texels of a block along each side.
    fn block_side(self) -> usize {
        match self {
            Self::HalfFloat => 1,
            Self::Bc6h => 4,
        }
    }

    /// The colour model of the descriptor: red, green, blue and alpha, or BC6H.
    fn model(self) -> u8 {
        match self {
            Self::HalfFloat => 1,
            Self::Bc6h => 133,
        }
    }

    /// Samples of the descriptor: first bit, bits, channel with marks, and what stands for the lower end of the range.
    fn samples(self) -> Vec<(u16, u8, u8, f32)> {
        match self {
            Self::HalfFloat => [0, 1, 2, ALPHA]
                .into_iter()
                .zip([0, 16, 32, 48])
                .map(|(channel, bit)| (bit, 16, channel | FLOAT | SIGNED, -1.0))
                .collect(),
            Self::Bc6h => vec![(0, 128, FLOAT, 0.0)],
        }
    }
}

/// The bytes of a file of `size` (width, height) texels. `level` are the texel blocks, row by row from the top; `notes` become keys
/// and values beside those that the format defines.
///
/// # Panics
/// When the level has not as many bytes as the size needs, or a key begins with `KTX`, which is the format's own.
pub fn encode(texels: Texels, size: [usize; 2], level: &[u8], notes: &[(&str, &str)]) -> Vec<u8> {
    let [across, down] = size.map(|side| side.div_ceil(texels.block_side()));
    let block = usize::from(texels.block_bytes());
    assert_eq!(level.len(), across * down * block, "bytes of a level");
    let descriptor = descriptor(texels);
    let values = values(notes);
    let values_at = DESCRIPTOR_AT + descriptor.len();
    // Both sizes of blocks are multiples of four.
    let level_at = (values_at + values.len()).next_multiple_of(block);

    let mut file = Vec::with_capacity(level_at + level.len());
    file.extend(IDENTIFIER);
    let mut words = |words: &[usize]| {
        for &word in words {
            file.extend((word as u32).to_le_bytes());
        }
    };
    let [format, type_size] = [texels.vulkan(), texels.type_size()].map(|x| x as usize);
    // No depth, no layers, one face, one level, no supercompression.
    words(&[format, type_size, size[0], size[1], 0, 0, 1, 1, 0]);
    words(&[DESCRIPTOR_AT, descriptor.len(), values_at, values.len()]);
    // No global data of a supercompression, at nowhere.
    for long in [0, 0, level_at, level.len(), level.len()] {
        file.extend((long as u64).to_le_bytes());
    }
    file.extend(descriptor);
    file.extend(values);
    file.resize(level_at, 0);
    file.extend(level);
    file
}

/// The data format descriptor: one basic block, linear with the primaries of BT.709, alpha straight.
fn descriptor(texels: Texels) -> Vec<u8> {
    let samples = texels.samples();
    let block = 24 + 16 * samples.len();
    let mut bytes = Vec::with_capacity(4 + block);
    bytes.extend((4 + block as u32).to_le_bytes());
    // Khronos, a basic block, of version 2.
    bytes.extend(0_u32.to_le_bytes());
    bytes.extend(2_u16.to_le_bytes());
    bytes.extend((block as u16).to_le_bytes());
    bytes.extend([texels.model(), 1, 1, 0]);
    let side = texels.block_side() as u8 - 1;
    bytes.extend([side, side, 0, 0]);
    bytes.extend([texels.block_bytes(), 0, 0, 0, 0, 0, 0, 0]);
    for (bit, bits, channel, lower) in samples {
        bytes.extend(bit.to_le_bytes());
        bytes.extend([bits - 1, channel, 0, 0, 0, 0]);
        bytes.extend(lower.to_bits().to_le_bytes());
        bytes.extend(1.0_f32.to_bits().to_le_bytes());
    }
    bytes
}

/// Keys and values in the order of the keys, each padded to four bytes.
fn values(notes: &[(&str, &str)]) -> Vec<u8> {
    let writer = concat!("luxel ", env!("CARGO_PKG_VERSION"));
    let mut all = vec![("KTXorientation", "rd"), ("KTXwriter", writer)];
    assert!(
        notes.iter().all(|(key, _)| !key.starts_with("KTX")),
        "keys of the format's own"
    );
    all.extend(notes);
    all.sort_unstable();
    let mut bytes = Vec::new();
    for (key, value) in all {
        bytes.extend(((key.len() + value.len() + 2) as u32).to_le_bytes());
        for text in [key, value] {
            bytes.extend(text.as_bytes());
            bytes.push(0);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    bytes
}

/// The nearest half float, of two the even one; values beyond the largest are moved to it.
pub fn half(value: f64) -> f16 {
    let value = value.clamp(-LARGEST, LARGEST);
    // Rounded here: `from_f64` rounds by way of 32 bits where the processor has such an instruction, and drops the lowest bits
    // where it has not, so that files would differ between machines.
    let exponent = (value.abs().to_bits() >> 52) as i32 - 1023;
    let step = 2.0_f64.powi(exponent.max(-14) - 10);
    f16::from_f64((value / step).round_ties_even() * step)
}

/// A level of half floats, alpha 1.
pub fn half_floats(texels: impl Iterator<Item = [f64; 3]>) -> Vec<u8> {
    texels
        .flat_map(|[r, g, b]| [half(r), half(g), half(b), f16::ONE])
        .flat_map(f16::to_le_bytes)
        .collect()
}

#[cfg(test)]
mod tests;
