//! Files are read by others and compared with the master; what is told of them is computed anew.

use super::*;
use crate::image::exr::Baked;
use ::exr::prelude::f16;
use proptest::prelude::*;
use std::f64::consts::FRAC_1_PI;

/// All formats that this program can make.
fn formats() -> impl Iterator<Item = Format> {
    use clap::ValueEnum;
    let all = Format::value_variants().iter().copied();
    all.filter(|format| format.require().is_ok())
}

fn origin() -> Origin {
    Origin::Baked(Baked {
        software: "luxel 0".into(),
        scene: "room".into(),
        include: "all".into(),
        quantity: "irradiance".into(),
        unit: "lx".into(),
        error: 0.01,
        page: 0,
        seed: 0,
    })
}

/// A square of so many texels a side.
fn image(side: usize, value: impl Fn(usize, usize) -> [f32; 3]) -> Image {
    let texels = (0..side * side).map(|i| value(i % side, i / side));
    Image {
        width: side,
        height: side,
        pixels: texels.collect(),
    }
}

/// Light that falls off smoothly from a lamp of one colour and a wall of another.
fn smooth(side: usize) -> Image {
    image(side, |x, y| {
        let [x, y] = [x, y].map(|i| i as f32 / side as f32);
        let lamp = 3.0 / (1.0 + 9.0 * (x - 0.3).powi(2) + 9.0 * (y - 0.4).powi(2)).powi(2);
        [lamp + 0.2 * x, lamp + 0.1, 0.8 * lamp + 0.05 * y]
    })
}

fn encoded(master: &Image, factor: f64, format: Format) -> Encoded {
    let map = Scaled { master, factor };
    map.encode(format, &origin()).expect("encodable")
}

/// What another reader finds in a file, by the formula of the manifest.
fn read(file: &Encoded, format: Format) -> Vec<[f64; 3]> {
    let wide = |pixels: Vec<[f32; 3]>| pixels.into_iter().map(|p| p.map(f64::from)).collect();
    match format {
        Format::Exr => {
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join("map.exr");
            std::fs::write(&path, &file.bytes).expect("written");
            let picture = exr::read(&path).expect("an EXR file");
            assert_eq!(picture.origin, Some(origin()));
            wide(picture.image.pixels)
        }
        Format::Hdr => {
            let image = image::load_from_memory_with_format(&file.bytes, image::ImageFormat::Hdr);
            let image = image.expect("an HDR file").into_rgb32f();
            wide(image.pixels().map(|pixel| pixel.0).collect())
        }
        Format::Rgbm => {
            let image = image::load_from_memory(&file.bytes).expect("a PNG file");
            let texel = |[r, g, b, a]: [u8; 4]| {
                let unit = |x: u8| f64::from(x) / 255.0;
                [r, g, b].map(|c| unit(c) * unit(a) * file.scale)
            };
            image.into_rgba8().pixels().map(|p| texel(p.0)).collect()
        }
        Format::Ktx2 => {
            let reader = ::ktx2::Reader::new(&file.bytes).expect("a KTX2 file");
            let level = reader.levels().next().expect("a level").data;
            let half = |pair: &[u8]| f16::from_le_bytes([pair[0], pair[1]]).to_f64();
            let texels = level
                .chunks(8)
                .map(|texel| [0, 2, 4].map(|at| half(&texel[at..])));
            texels.collect()
        }
        Format::Bc6h => {
            let reader = ::ktx2::Reader::new(&file.bytes).expect("a KTX2 file");
            let header = reader.header();
            let size = [header.pixel_width, header.pixel_height].map(|side| side as usize);
            blocks(reader.levels().next().expect("a level").data, size)
        }
    }
}

#[cfg(feature = "bc6h")]
fn blocks(level: &[u8], size: [usize; 2]) -> Vec<[f64; 3]> {
    let texels = crate::image::bc6h::decode(level, size).into_iter();
    texels.map(|texel| texel.map(f64::from)).collect()
}

#[cfg(not(feature = "bc6h"))]
fn blocks(_: &[u8], _: [usize; 2]) -> Vec<[f64; 3]> {
    unreachable!("no file was made")
}

/// The bound that the table states for a channel; `None` where there is none.
fn bound(format: Format, value: f64, largest: f64, scale: f64) -> Option<f64> {
    let relative = |bits: i32| 2.0_f64.powi(-bits);
    Some(match format {
        Format::Exr => value * relative(24),
        Format::Hdr => largest * hdr::BOUND,
        Format::Ktx2 => (value * relative(11)).max(relative(25)),
        Format::Rgbm if largest >= scale / 255.0 => largest / 255.0 * (1.0 + 1e-12),
        Format::Rgbm => scale / 130_050.0 * (1.0 + 1e-12),
        Format::Bc6h => return None,
    })
}

/// Root mean square of the differences over the mean.
fn loss(expected: &[[f64; 3]], found: &[[f64; 3]]) -> f64 {
    let (expected, found) = (expected.as_flattened(), found.as_flattened());
    let pairs = expected.iter().zip(found);
    let squares: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
    let count = expected.len() as f64;
    (squares / count).sqrt() / (expected.iter().sum::<f64>() / count)
}

fn products(master: &Image, factor: f64) -> Vec<[f64; 3]> {
    let pixels = master.pixels.iter();
    pixels.map(|p| p.map(|x| f64::from(x) * factor)).collect()
}

proptest! {
    /// Whatever is in a map, channels differ by no more than is stated, and the loss that is told is the one that is had.
    #[test]
    fn maps_are_as_near_as_stated(
        values in proptest::collection::vec(proptest::array::uniform3(-26.0..12.0_f32), 64..65), is_white: bool
    ) {
        let master = image(8, |x, y| values[8 * y + x].map(f32::exp2));
        let factor = if is_white { FRAC_1_PI } else { 1.0 };
        let expected = products(&master, factor);
        for format in formats() {
            let file = encoded(&master, factor, format);
            prop_assert_eq!(file.clamped, 0);
            let found = read(&file, format);
            for (expected, found) in expected.iter().zip(&found) {
                let largest = expected.iter().copied().fold(0.0, f64::max);
                for (value, found) in expected.iter().zip(found) {
                    if let Some(bound) = bound(format, *value, largest, file.scale) {
                        prop_assert!((value - found).abs() <= bound, "{format:?}: {value} {found}");
                    }
                }
            }
            let loss = loss(&expected, &found);
            // Of readers that count in 32 bits.
            prop_assert!((file.error - loss).abs() <= 1e-6 * loss + 1e-8, "{format:?}: {} {loss}", file.error);
        }
    }
}

/// Of light as it is baked every format keeps the better part of a per cent.
#[test]
fn losses_are_small() {
    let master = smooth(64);
    for format in formats() {
        let error = encoded(&master, FRAC_1_PI, format).error;
        // Uniform rounding over a step has 1/√12 of it; steps are relative to values of one to two times the mean.
        let most = match format {
            Format::Exr => 2.0_f64.powi(-24),
            Format::Ktx2 => 2.0_f64.powi(-11),
            Format::Hdr => 2.0_f64.powi(-8),
            Format::Rgbm => 1.0 / 255.0,
            // Within a block of these few texels light varies by a fifth to a half of its mean, of which lines have 8 or 16 places: half
            // a step of the worst is 0.5/15 of it, its root mean square a √3rd of that. Measured: 0.8 %.
            Format::Bc6h => 0.5 * 0.5 / 15.0 / 3.0_f64.sqrt(),
        };
        println!("{format:?}: {error:e}");
        assert!(error > 0.0 && error <= most, "{format:?}: {error}");
    }
}

#[test]
fn what_is_out_of_range_is_moved_and_counted() {
    let master = image(4, |x, _| [100_000.0 * x as f32, -1.0, f32::NAN]);
    for format in formats() {
        let file = encoded(&master, 1.0, format);
        let is_half = format.largest() == Some(ktx2::LARGEST);
        // No number everywhere; above the largest half in three columns of four. What is below zero is noise, not lost light.
        let expected = 16 + if is_half { 12 } else { 0 };
        assert_eq!(file.clamped, expected, "{format:?}");
        assert!(file.error.is_finite(), "{format:?}: {}", file.error);
        let found = read(&file, format);
        assert!(found.as_flattened().iter().all(|&x| x >= 0.0), "{found:?}");
        let most = if is_half { 65504.0 } else { 300_000.0 };
        let largest = found.as_flattened().iter().copied().fold(0.0, f64::max);
        assert!(
            (largest / most - 1.0).abs() <= 1.0 / 255.0,
            "{format:?}: {largest}"
        );
    }
}

#[test]
fn darkness_stays_dark() {
    let master = image(4, |_, _| [0.0; 3]);
    for format in formats() {
        let file = encoded(&master, FRAC_1_PI, format);
        assert_eq!((file.error, file.clamped), (0.0, 0));
        assert!(file.scale > 0.0);
        assert_eq!(read(&file, format), vec![[0.0; 3]; 16]);
        let again = encoded(&master, FRAC_1_PI, format);
        assert_eq!(again.bytes, file.bytes, "the same bytes every time");
    }
}

#[cfg(not(feature = "bc6h"))]
#[test]
fn what_was_left_out_is_named() {
    let master = image(4, |_, _| [0.0; 3]);
    let map = Scaled {
        master: &master,
        factor: 1.0,
    };
    let error = map.encode(Format::Bc6h, &origin()).expect_err("left out");
    assert!(error.to_string().contains("--features bc6h"), "{error}");
}
