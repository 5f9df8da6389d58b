//! A glTF file and all that it refers to as one document with one buffer.
//!
//! Buffers are put one behind another, and images that were files or data URIs behind them as buffer views, with the bytes
//! that they had. Compressed twins of buffer views and primitives (`EXT_meshopt_compression`, `KHR_draco_mesh_compression`) are left out:
//! the reader refuses files that have nothing beside them. Cost: one copy of all bytes.

use super::GlbError;
use super::document::{Document, child_mut, index, items_mut, object_mut, set};
use luxel_scenes::GltfBytes;
use serde_json::{Value, json};

/// Compressions whose content also stands uncompressed in the files that the reader takes.
const COMPRESSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_draco_mesh_compression"];

/// The document of these bytes; `changed` makes the error for what a valid file does not have.
pub(super) fn document(
    bytes: &GltfBytes,
    changed: &dyn Fn(&str) -> GlbError,
) -> Result<Document, GlbError> {
    let mut document = Document {
        root: serde_json::from_slice(&bytes.json)?,
        binary: Vec::new(),
    };
    set(child_mut(&mut document.root, "asset"), "generator", "luxel");

    let mut starts = Vec::new();
    for (buffer, content) in document
        .items("buffers")
        .to_vec()
        .iter()
        .zip(&bytes.buffers)
    {
        let length = index(buffer, "byteLength").unwrap_or(0);
        let content = content
            .get(..length)
            .ok_or_else(|| changed("a buffer is shorter"))?;
        starts.push(document.append(content));
    }
    for view in document.items_mut("bufferViews") {
        let start = index(view, "buffer").and_then(|buffer| starts.get(buffer));
        let start = start.ok_or_else(|| changed("a buffer view has no buffer"))?;
        // One beyond all bytes stays there: the reader did not need it.
        let offset = start.saturating_add(index(view, "byteOffset").unwrap_or(0));
        set(view, "buffer", 0);
        set(view, "byteOffset", offset);
        uncompress(view);
    }
    for mesh in document.items_mut("meshes") {
        let primitives = items_mut(object_mut(mesh), "primitives");
        primitives.iter_mut().for_each(uncompress);
    }
    for key in ["extensionsUsed", "extensionsRequired"] {
        let names = document.items_mut(key);
        names.retain(|name| !COMPRESSIONS.iter().any(|known| name == known));
    }

    for (number, content) in bytes.images.iter().enumerate() {
        let Some(content) = content else { continue };
        let view = document.view(content, json!({}));
        let images = document.items_mut("images");
        let image = images
            .get_mut(number)
            .ok_or_else(|| changed("an image is missing"))?;
        let mime = mime_type(image, content);
        object_mut(image).remove("uri");
        set(image, "bufferView", view);
        set(image, "mimeType", mime);
    }
    Ok(document)
}

/// Takes the compressed twin of an element out.
fn uncompress(element: &mut Value) {
    let Some(extensions) = element.get_mut("extensions") else {
        return;
    };
    let extensions = object_mut(extensions);
    for name in COMPRESSIONS {
        extensions.remove(name);
    }
    if extensions.is_empty() {
        object_mut(element).remove("extensions");
    }
}

/// The type of an image by what it begins with, or else by what the file says.
fn mime_type(image: &Value, content: &[u8]) -> String {
    let known: [(&[u8], &str); 3] = [
        (b"\x89PNG\r\n\x1a\n", "image/png"),
        (b"\xff\xd8\xff", "image/jpeg"),
        (b"\xabKTX 20\xbb", "image/ktx2"),
    ];
    if let Some((_, mime)) = known.iter().find(|(magic, _)| content.starts_with(magic)) {
        return (*mime).to_owned();
    }
    if content.starts_with(b"RIFF") && content.get(8..12) == Some(b"WEBP") {
        return "image/webp".to_owned();
    }
    let text = |key| image.get(key).and_then(Value::as_str);
    let in_uri = text("uri")
        .and_then(|uri| uri.strip_prefix("data:"))
        .and_then(|rest| rest.split([';', ',']).next())
        .filter(|mime| !mime.is_empty());
    let mime = text("mimeType").or(in_uri);
    mime.unwrap_or("application/octet-stream").to_owned()
}
