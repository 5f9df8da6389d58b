//! Scenes, atlases and files for the tests of what is exported.

use crate::lightmap::atlas::Atlas;
use crate::lightmap::unwrap::{Density, UnwrapConfig, Unwrapper, UvUnwrap};
use luxel_scenes::{Loaded, Scene, load};
use std::path::{Path, PathBuf};

/// A file of an example scene.
pub(super) fn data(scene: &str, file: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/data");
    folder.join(scene).join(file)
}

pub(super) fn pavilion() -> Loaded {
    load(data("pavilion", "pavilion.toml")).expect("the example loads")
}

pub(super) fn cornell() -> Scene {
    let loaded = load(data("cornell", "cornell.toml"));
    loaded.expect("the example loads").scene
}

/// One page of so many texels a side.
pub(super) fn atlas(scene: &Scene, side: usize) -> Atlas {
    unwrapped(scene, Density::Page(side))
}

/// Pages of so many texels a side, and so many texels a metre.
pub(super) fn pages(scene: &Scene, texels_per_metre: f64, page: usize) -> Atlas {
    let density = Density::Fixed {
        texels_per_metre,
        page,
    };
    unwrapped(scene, density)
}

fn unwrapped(scene: &Scene, density: Density) -> Atlas {
    let config = UnwrapConfig {
        density,
        padding: 1,
        block_align: false,
    };
    let atlas = UvUnwrap.unwrap(scene, &[], &config, &|_, _| true);
    atlas.expect("the scene can be unwrapped")
}

/// Writes files and loads one of them.
pub(super) fn reloaded(file: &str, files: &[(&str, &[u8])]) -> Loaded {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).expect("the file is written");
    }
    match load(folder.path().join(file)) {
        Ok(loaded) => loaded,
        Err(error) => panic!("{error}"),
    }
}
