//! A GLB file of a bake with other names of maps: what [`super::glb`] would have written had they been the names.
//!
//! Numbers survive the way through text and back, since the shortest text that tells a number from all others is written and read exactly.
//! The binary chunk is not looked into.

use super::GlbError;
use super::document::Document;
use serde_json::Value;

/// The bytes with the map of page i called `maps[i]` wherever nodes and primitives name it.
///
/// # Errors
/// When these are not the bytes of such a file, or it names a page that has no map.
pub fn renamed(glb: &[u8], maps: &[String]) -> Result<Vec<u8>, GlbError> {
    let mut document = parsed(glb).ok_or(GlbError::NotOurs("it is no GLB file with a document"))?;
    let root = &mut document.root;
    for node in items(root, "nodes") {
        rename(node, maps)?;
    }
    for mesh in items(root, "meshes") {
        for primitive in items(mesh, "primitives") {
            rename(primitive, maps)?;
        }
    }
    document.into_glb()
}

/// The document and the buffer of a file.
fn parsed(glb: &[u8]) -> Option<Document> {
    let rest = glb.strip_prefix(b"glTF\x02\0\0\0")?.get(4..)?;
    let (json, rest) = chunk(rest, *b"JSON")?;
    let binary = chunk(rest, *b"BIN\0").map_or(&[][..], |(binary, _)| binary);
    Some(Document {
        root: serde_json::from_slice(json).ok()?,
        binary: binary.to_vec(),
    })
}

/// The content of a chunk of a kind, and what follows it.
fn chunk(bytes: &[u8], kind: [u8; 4]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    let rest = rest.strip_prefix(&kind)?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

/// The items of an array of an object; none where there is no such array.
fn items<'v>(value: &'v mut Value, key: &str) -> impl Iterator<Item = &'v mut Value> {
    let items = value.get_mut(key).and_then(Value::as_array_mut);
    items.into_iter().flatten()
}

fn rename(item: &mut Value, maps: &[String]) -> Result<(), GlbError> {
    let Some(lightmap) = item.pointer_mut("/extras/luxel_lightmap") else {
        return Ok(());
    };
    let page = super::document::index(lightmap, "page");
    let map = page.and_then(|page| maps.get(page));
    let map = map.ok_or(GlbError::NotOurs("a node names a page that there is not"))?;
    super::document::set(lightmap, "file", map.as_str());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lightmap::export::glb::glb;
    use crate::lightmap::export::testing::{cornell, pages, pavilion};
    use luxel_scenes::{GltfOrigin, Scene};
    use proptest::prelude::*;

    fn names(count: usize, extension: &str) -> Vec<String> {
        let name = |page| format!("lightmap_{page:03}.{extension}");
        (0..count).map(name).collect()
    }

    fn assert_same(scene: &Scene, origin: Option<&GltfOrigin>, texels_per_metre: f64) {
        let atlas = pages(scene, texels_per_metre, 160);
        assert!(atlas.pages > 1);
        let [old, new] = ["exr", "ktx2"].map(|extension| {
            let names = names(atlas.pages, extension);
            (
                glb(scene, origin, None, &atlas, &names).expect("written"),
                names,
            )
        });
        let found = renamed(&old.0, &new.1).expect("renamed");
        assert!(found == new.0, "byte by byte");
        let error = renamed(&old.0, &new.1[..1]).expect_err("too few names");
        assert!(error.to_string().contains("a page that there is not"));
    }

    #[test]
    fn a_renamed_file_is_the_one_that_would_have_been_written() {
        assert_same(&cornell(), None, 200.0);
        let loaded = pavilion();
        assert_same(&loaded.scene, loaded.origin.as_ref(), 16.0);
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes: Vec<u8>, length: u32) {
            prop_assert!(renamed(&bytes, &[]).is_err());
            let mut file = b"glTF\x02\0\0\0----".to_vec();
            file.extend(length.to_le_bytes());
            file.extend(b"JSON");
            file.extend(bytes);
            let _ = renamed(&file, &[]);
        }
    }
}
