//! Files against the `ktx2` reader, which shares no code with the writer, and against the rules of the format.

use super::*;
use ktx2::{ColorModel, ColorPrimaries, Format, Reader, TransferFunction, dfd};
use proptest::prelude::*;

/// A word of a file.
fn word(file: &[u8], at: usize) -> usize {
    u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes")) as usize
}

fn long(file: &[u8], at: usize) -> usize {
    u64::from_le_bytes(file[at..at + 8].try_into().expect("eight bytes")) as usize
}

/// What the format demands of every file, and of those without supercompression, layers, faces and mipmaps in particular.
fn assert_rules(file: &[u8], block: usize) {
    assert_eq!(file[..12], IDENTIFIER);
    let [depth, layers, faces, levels, scheme] = [28, 32, 36, 40, 44].map(|at| word(file, at));
    assert_eq!([depth, layers, faces, levels, scheme], [0, 0, 1, 1, 0]);
    // Parts lie in order, without gaps but for alignment.
    let [descriptor, descriptor_bytes, values, values_bytes] =
        [48, 52, 56, 60].map(|at| word(file, at));
    assert_eq!(descriptor, 80 + 24 * levels);
    assert_eq!(descriptor + descriptor_bytes, values);
    assert_eq!([long(file, 64), long(file, 72)], [0, 0], "no global data");
    let [level, level_bytes, uncompressed] = [80, 88, 96].map(|at| long(file, at));
    assert_eq!(level % block, 0);
    assert_eq!(level % 4, 0);
    assert!((values + values_bytes..values + values_bytes + block).contains(&level));
    assert!(file[values + values_bytes..level].iter().all(|&b| b == 0));
    assert_eq!(level_bytes, uncompressed, "nothing is supercompressed");
    assert_eq!(level + level_bytes, file.len());
    // The descriptor knows its own size, and that of its one block.
    assert_eq!(word(file, descriptor), descriptor_bytes);
    assert_eq!(word(file, descriptor + 8) >> 16, descriptor_bytes - 4);
    assert_eq!((descriptor_bytes - 28) % 16, 0, "whole samples");
    // Keys are in order and differ, values end with zero, pairs are padded with zeros.
    let (mut at, mut last) = (values, Vec::new());
    while at < values + values_bytes {
        let length = word(file, at);
        let pair = &file[at + 4..at + 4 + length];
        let end = pair.iter().position(|&b| b == 0).expect("a key ends");
        assert!(
            pair[..end] > last[..],
            "{:?}",
            String::from_utf8_lossy(pair)
        );
        last = pair[..end].to_vec();
        assert_eq!(pair.last(), Some(&0));
        let next = (at + 4 + length).next_multiple_of(4);
        assert!(file[at + 4 + length..next].iter().all(|&b| b == 0));
        at = next;
    }
    assert_eq!(at, values + values_bytes);
}

#[test]
fn half_floats_are_read_by_another_reader() {
    let texels = [[0.0, 1.0, 0.5], [65504.0, 1e9, -1e9]];
    let level = half_floats(texels.into_iter());
    let file = encode(
        Texels::HalfFloat,
        [2, 1],
        &level,
        &[("luxel", "{}"), ("a", "b")],
    );
    assert_rules(&file, 8);
    let reader = Reader::new(&file).expect("a KTX2 file");
    let header = reader.header();
    assert_eq!(header.format, Some(Format::R16G16B16A16_SFLOAT));
    assert_eq!([header.pixel_width, header.pixel_height], [2, 1]);
    assert_eq!(header.type_size, 2);
    assert!(header.supercompression_scheme.is_none());
    let keys: Vec<(&str, &[u8])> = reader.key_value_data().collect();
    assert_eq!(keys[0], ("KTXorientation", &b"rd\0"[..]));
    assert!(keys[1].0 == "KTXwriter" && keys[1].1.starts_with(b"luxel "));
    assert_eq!(keys[2..], [("a", &b"b\0"[..]), ("luxel", &b"{}\0"[..])]);
    let found = reader.levels().next().expect("a level").data;
    let halves: Vec<f32> = found
        .chunks(2)
        .map(|pair| f16::from_le_bytes([pair[0], pair[1]]).to_f32())
        .collect();
    assert_eq!(
        halves,
        [0.0, 1.0, 0.5, 1.0, 65504.0, 65504.0, -65504.0, 1.0]
    );
}

fn basic(file: &[u8]) -> dfd::Basic {
    let reader = Reader::new(file).expect("a KTX2 file");
    let [dfd::Block::Basic(basic)] = reader.dfd_blocks() else {
        panic!("one basic block");
    };
    basic.clone()
}

/// As `dfdutils` describes `VK_FORMAT_R16G16B16A16_SFLOAT`.
#[test]
fn half_floats_are_described() {
    let file = encode(Texels::HalfFloat, [1, 1], &[0; 8], &[]);
    let basic = basic(&file);
    assert_eq!(basic.color_model, Some(ColorModel::RGBSDA));
    assert_eq!(basic.color_primaries, Some(ColorPrimaries::BT709));
    assert_eq!(basic.transfer_function, Some(TransferFunction::Linear));
    assert!(basic.flags.is_empty(), "alpha is straight");
    assert_eq!(basic.texel_block_dimensions.map(u8::from), [1; 4]);
    assert_eq!(basic.bytes_planes, [8, 0, 0, 0, 0, 0, 0, 0]);
    let samples = &basic.sample_information;
    assert_eq!(samples.len(), 4);
    for (index, sample) in samples.iter().enumerate() {
        assert_eq!(usize::from(sample.bit_offset), 16 * index);
        assert_eq!(u8::from(sample.bit_length), 16);
        assert_eq!(sample.channel_type, [0, 1, 2, 15][index]);
        let qualifiers = dfd::ChannelTypeQualifiers::FLOAT | dfd::ChannelTypeQualifiers::SIGNED;
        assert_eq!(sample.channel_type_qualifiers, qualifiers);
        assert_eq!(sample.sample_positions, [0; 4]);
        assert_eq!(f32::from_bits(sample.lower), -1.0);
        assert_eq!(f32::from_bits(sample.upper), 1.0);
    }
}

/// As `dfdutils` describes `VK_FORMAT_BC6H_UFLOAT_BLOCK`.
#[test]
fn blocks_are_described() {
    let file = encode(Texels::Bc6h, [6, 3], &[7; 32], &[]);
    assert_rules(&file, 16);
    let reader = Reader::new(&file).expect("a KTX2 file");
    assert_eq!(reader.header().format, Some(Format::BC6H_UFLOAT_BLOCK));
    assert_eq!(reader.header().type_size, 1);
    let basic = basic(&file);
    assert_eq!(basic.color_model, Some(ColorModel::BC6H));
    assert_eq!(basic.texel_block_dimensions.map(u8::from), [4, 4, 1, 1]);
    assert_eq!(basic.bytes_planes[0], 16);
    let [sample] = basic.sample_information.as_slice() else {
        panic!("one sample");
    };
    assert_eq!(u8::from(sample.bit_length), 128);
    assert_eq!(sample.channel_type, 0);
    assert_eq!(
        sample.channel_type_qualifiers,
        dfd::ChannelTypeQualifiers::FLOAT
    );
    assert_eq!([sample.lower, f32::to_bits(1.0)], [0, sample.upper]);
}

proptest! {
    /// Half a unit in the last of eleven bits, or of the smallest number.
    #[test]
    fn halves_are_rounded_by_the_stated_bound(exponent in -40.0..16.0_f64) {
        let value = exponent.exp2().min(LARGEST);
        let error = (half(value).to_f64() - value).abs();
        let bound = (value * (-11.0_f64).exp2()).max((-25.0_f64).exp2());
        prop_assert!(error <= bound, "{value}: {error}");
    }

    #[test]
    fn every_file_follows_the_rules(width in 1..9_usize, height in 1..9_usize, note in "[ -~]{0,9}", blocks: bool) {
        let (texels, block) = if blocks { (Texels::Bc6h, 16) } else { (Texels::HalfFloat, 8) };
        let side = texels.block_side();
        let level = vec![1; width.div_ceil(side) * height.div_ceil(side) * block];
        let file = encode(texels, [width, height], &level, &[("note", &note)]);
        assert_rules(&file, block);
        prop_assert!(Reader::new(&file).is_ok());
    }
}

/// Rounded once: what lies beyond the middle of two half floats by less than 32 bits tell goes to the nearer.
#[test]
fn halves_are_the_nearest() {
    for bits in 0..=0x7bff_u16 {
        let exact = f16::from_bits(bits);
        let [value, next] = [bits, bits + 1].map(|bits| f16::from_bits(bits).to_f64());
        for sign in [1.0, -1.0] {
            assert_eq!(half(sign * value), f16::from_f64(sign * value));
        }
        // The next above the largest is infinite.
        if next.is_finite() {
            let middle = 0.5 * (value + next);
            let least = middle * 2.0_f64.powi(-50);
            assert_eq!(half(middle - least), exact);
            assert_eq!(half(middle + least).to_bits(), bits + 1);
            assert_eq!(half(middle).to_bits(), bits + bits % 2);
        }
    }
    assert_eq!(half(1e9).to_f64(), LARGEST);
    assert_eq!(half(-1e9).to_f64(), -LARGEST);
    assert!(half(f64::NAN).is_nan());
}
