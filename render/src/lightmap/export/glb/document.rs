//! A glTF document with its one buffer, as it grows, and the container that both go into.
//!
//! Source: glTF 2.0, chapters 3.6 (buffers, views, accessors) and 4 (GLB): a header of 12 bytes, then chunks of a length, a
//! type and a content that is padded to four bytes, JSON by spaces and BIN by zeros. Keys are in alphabetical order, so that the
//! same document gives the same bytes.

use super::GlbError;
use serde_json::{Map, Value, json};

/// `target` of a buffer view with vertices.
pub(super) const ARRAY_BUFFER: u32 = 34962;
/// `target` of a buffer view with indices.
pub(super) const ELEMENT_ARRAY_BUFFER: u32 = 34963;

/// Extensions that luxel's own lights and materials need.
pub(super) const PUNCTUAL: &str = "KHR_lights_punctual";

/// A document and the bytes of its buffer.
#[derive(Debug, Default)]
pub(super) struct Document {
    /// The document; it names no buffer before it is written.
    pub(super) root: Value,
    /// The buffer.
    pub(super) binary: Vec<u8>,
}

impl Document {
    /// Appends to one of the document's arrays, and returns the index there.
    pub(super) fn push(&mut self, array: &str, item: Value) -> usize {
        let items = self.items_mut(array);
        items.push(item);
        items.len() - 1
    }

    /// One of the document's arrays, made where there is none.
    pub(super) fn items_mut(&mut self, array: &str) -> &mut Vec<Value> {
        items_mut(object_mut(&mut self.root), array)
    }

    /// One of the document's arrays, empty where there is none.
    pub(super) fn items(&self, array: &str) -> &[Value] {
        let items = self.root.get(array).and_then(Value::as_array);
        items.map_or(&[], Vec::as_slice)
    }

    /// Appends bytes to the buffer at a multiple of four, and returns where they are.
    pub(super) fn append(&mut self, bytes: &[u8]) -> usize {
        self.binary.resize(self.binary.len().next_multiple_of(4), 0);
        let offset = self.binary.len();
        self.binary.extend_from_slice(bytes);
        offset
    }

    /// Adds a buffer view with these bytes and further members.
    pub(super) fn view(&mut self, bytes: &[u8], members: Value) -> usize {
        let mut view = members;
        let offset = self.append(bytes);
        set(&mut view, "buffer", 0);
        set(&mut view, "byteOffset", offset);
        set(&mut view, "byteLength", bytes.len());
        self.push("bufferViews", view)
    }

    /// Names an extension as used.
    pub(super) fn use_extension(&mut self, name: &str) {
        let used = self.items_mut("extensionsUsed");
        if !used.iter().any(|known| known == name) {
            used.push(name.into());
        }
    }

    /// The file's bytes.
    pub(super) fn into_glb(mut self) -> Result<Vec<u8>, GlbError> {
        let length = self.binary.len().next_multiple_of(4);
        self.binary.resize(length, 0);
        let root = object_mut(&mut self.root);
        root.remove("buffers");
        if length > 0 {
            root.insert("buffers".to_owned(), json!([{"byteLength": length}]));
        }
        root.retain(|_, value| value.as_array().is_none_or(|items| !items.is_empty()));
        let mut text = serde_json::to_vec(&self.root)?;
        text.resize(text.len().next_multiple_of(4), b' ');

        let chunks = [(b"JSON", &text), (b"BIN\0", &self.binary)];
        let chunks = chunks
            .into_iter()
            .filter(|(_, content)| !content.is_empty());
        let total = 12 + chunks.clone().map(|(_, c)| 8 + c.len()).sum::<usize>();
        let word = |x: usize| u32::try_from(x).map(u32::to_le_bytes);
        let Ok(length) = word(total) else {
            return Err(GlbError::TooLarge(total));
        };
        let mut file = Vec::with_capacity(total);
        file.extend_from_slice(b"glTF\x02\0\0\0");
        file.extend_from_slice(&length);
        for (kind, content) in chunks {
            file.extend_from_slice(&(content.len() as u32).to_le_bytes());
            file.extend_from_slice(kind);
            file.extend_from_slice(content);
        }
        Ok(file)
    }
}

/// The members of an object; anything else becomes one first.
pub(super) fn object_mut(value: &mut Value) -> &mut Map<String, Value> {
    if !value.is_object() {
        *value = Value::Object(Map::new());
    }
    match value {
        Value::Object(members) => members,
        _ => unreachable!("it was made an object"),
    }
}

/// An array among an object's members, made where there is none.
pub(super) fn items_mut<'m>(members: &'m mut Map<String, Value>, key: &str) -> &'m mut Vec<Value> {
    let value = members.entry(key).or_insert(Value::Null);
    if !value.is_array() {
        *value = Value::Array(Vec::new());
    }
    match value {
        Value::Array(items) => items,
        _ => unreachable!("it was made an array"),
    }
}

/// Sets a member of an object.
pub(super) fn set(value: &mut Value, key: &str, to: impl Into<Value>) {
    object_mut(value).insert(key.to_owned(), to.into());
}

/// An object among an object's members, made where there is none.
pub(super) fn child_mut<'v>(value: &'v mut Value, key: &str) -> &'v mut Value {
    object_mut(value).entry(key).or_insert_with(|| json!({}))
}

/// The extras of an item as an object. What is there and no object, which the format allows and advises against, becomes its member
/// `extras`.
pub(super) fn extras_mut(item: &mut Value) -> &mut Value {
    let extras = child_mut(item, "extras");
    if !extras.is_object() && !extras.is_null() {
        *extras = json!({"extras": extras.take()});
    }
    extras
}

/// A member that is an index or a count.
pub(super) fn index(value: &Value, key: &str) -> Option<usize> {
    usize::try_from(value.get(key)?.as_u64()?).ok()
}
