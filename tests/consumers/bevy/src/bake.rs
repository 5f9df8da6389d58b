//! A bake by the command, and what it says of itself.

use serde::Deserialize;
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

/// A folder of assets with a bake in `baked`.
pub struct Bake {
    folder: TempDir,
    scene: &'static str,
    format: &'static str,
    manifest: Value,
    masters: Vec<Vec<[f32; 3]>>,
}

/// What a node says of its map.
#[derive(Deserialize)]
pub struct Said {
    pub page: usize,
    pub file: String,
    pub rect: Rectangle<f32>,
}

/// Two corners.
#[derive(Clone, Copy, Debug, Deserialize)]
pub struct Rectangle<T> {
    pub min: [T; 2],
    pub max: [T; 2],
}

/// What extras say of a map.
pub fn said(extras: &str) -> Said {
    let mut extras: Value = serde_json::from_str(extras).expect("extras are JSON");
    serde_json::from_value(extras["luxel_lightmap"].take()).expect("a lightmap")
}

/// A half float as a number.
pub fn half(bits: u16) -> f32 {
    let [exponent, fraction] = [i32::from(bits >> 10 & 31), i32::from(bits & 1023)];
    let size = match exponent {
        0 => fraction as f32 * 2.0_f32.powi(-24),
        _ => (1024 + fraction) as f32 * 2.0_f32.powi(exponent - 25),
    };
    if bits >> 15 == 1 { -size } else { size }
}

impl Bake {
    /// Bakes an example scene; `None` when the program was built without the format.
    pub fn new(scene: &'static str, format: &'static str) -> Option<Self> {
        let luxel = std::env::var("LUXEL").unwrap_or("../../../target/release/luxel".into());
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../scenes/data");
        let folder = tempfile::tempdir().expect("a folder");
        let baked = folder.path().join("baked");
        let output = Command::new(&luxel)
            .arg("bake")
            .arg(file.join(format!("{scene}/{scene}.toml")))
            .arg("-o")
            .arg(&baked)
            .args(["--for", "bevy", "--format", format, "--size", "128", "--error", "5%"])
            .output();
        let output = output.unwrap_or_else(|error| panic!("{luxel}: {error}; set LUXEL"));
        let told = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            assert!(format == "bc6h" && told.contains("--features bc6h"), "{told}");
            return None;
        }
        let manifest = std::fs::read(baked.join("manifest.json")).expect("a manifest");
        let manifest: Value = serde_json::from_slice(&manifest).expect("JSON");
        let pages = manifest["lightmap"]["pages"].as_array().expect("pages");
        let masters = pages.iter().map(|page| master(&baked.join(text(&page["master"]))));
        Some(Self {
            masters: masters.collect(),
            folder,
            scene,
            format,
            manifest,
        })
    }

    pub fn assets(&self) -> &Path {
        self.folder.path()
    }

    pub fn scene(&self) -> &str {
        self.scene
    }

    pub fn format(&self) -> &str {
        self.format
    }

    /// Whether the scene had no glTF document of its own.
    pub fn is_made_anew(&self) -> bool {
        self.scene != "pavilion"
    }

    fn page(&self, page: usize) -> &Value {
        &self.manifest["lightmap"]["pages"][page]
    }

    /// Width and height of a page.
    pub fn size(&self, page: usize) -> [usize; 2] {
        ["width", "height"].map(|side| self.page(page)[side].as_u64().expect("a size") as usize)
    }

    /// E of a page.
    pub fn master(&self, page: usize) -> &[[f32; 3]] {
        assert_eq!(self.manifest["units"]["quantity"], "white-radiance");
        let factor = self.page(page)["encoding"]["factor"].as_f64().expect("a factor");
        assert_eq!(factor, std::f64::consts::FRAC_1_PI);
        &self.masters[page]
    }

    /// Where the manifest says that objects lie on a page; nodes of one name are told apart there by a number.
    pub fn rectangles(&self, object: &str, page: usize) -> Vec<Rectangle<usize>> {
        let objects = self.manifest["objects"].as_array().expect("objects");
        let own = objects.iter().filter(|own| {
            let rest = text(&own["name"]).strip_prefix(object);
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
        });
        own.flat_map(|own| own["rectangles"].as_array().expect("rectangles"))
            .filter(|own| own["page"] == page)
            .map(|own| serde_json::from_value(own.clone()).expect("a rectangle"))
            .collect()
    }

    /// The number that the manifest states.
    pub fn manifest_exposure(&self) -> f32 {
        self.manifest["bevy"]["lightmap_exposure"].as_f64().expect("a number") as f32
    }

    /// The number that the delivered snippet states.
    pub fn stated_exposure(&self) -> f32 {
        let text = std::fs::read_to_string(self.assets().join("baked/bevy.rs")).expect("a snippet");
        let (_, rest) = text.split_once("LIGHTMAP_EXPOSURE: f32 = ").expect("a constant");
        let (number, _) = rest.split_once(';').expect("its end");
        number.parse().expect("a number")
    }
}

fn text(value: &Value) -> &str {
    value.as_str().expect("a text")
}

/// The pixels of an EXR file.
fn master(path: &Path) -> Vec<[f32; 3]> {
    let image = exr::prelude::read_first_rgba_layer_from_file(
        path,
        |size, _| (size.width(), vec![[0.0; 3]; size.area()]),
        |(width, pixels), place, (r, g, b, _): (f32, f32, f32, f32)| {
            pixels[place.y() * *width + place.x()] = [r, g, b];
        },
    );
    let image = image.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    image.layer_data.channel_data.pixels.1
}
