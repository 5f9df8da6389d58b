//! The bytes that a document refers to: buffers and images, in the file, beside it, or in URIs.

use super::error::GltfError;
use crate::load::{LoadError, Place, read_file};
use gltf::buffer;
use gltf::json;
use std::path::{Path, PathBuf};

/// A document with its buffers.
pub(super) struct Source<'f> {
    pub(super) file: &'f Path,
    pub(super) document: gltf::Document,
    buffers: Vec<Vec<u8>>,
}

impl<'f> Source<'f> {
    /// Reads a file and the buffers that it names, and checks what the parser does not.
    pub(super) fn read(file: &'f Path, named_at: Option<&Place>) -> Result<Self, LoadError> {
        let bytes = read_file(file, named_at)?;
        let document_error = |source| GltfError::Document {
            file: file.to_owned(),
            source: Box::new(source),
        };
        let gltf::Gltf { document, mut blob } =
            gltf::Gltf::from_slice_without_validation(&bytes).map_err(document_error)?;
        check_positions(file, document.as_json())?;
        let document = gltf::Document::from_json(document.into_json()).map_err(document_error)?;
        check(file, document.as_json())?;
        let mut buffers = Vec::new();
        for (index, entry) in document.as_json().buffers.iter().enumerate() {
            let data = match &entry.uri {
                Some(uri) => read_uri(file, uri, |problem| {
                    let file = file.to_owned();
                    GltfError::Buffer {
                        file,
                        index,
                        problem,
                    }
                    .into()
                })?,
                None => blob.take().unwrap_or_default(),
            };
            if (data.len() as u64) < entry.byte_length.0 {
                let problem = format!("has {} of {} bytes", data.len(), entry.byte_length.0);
                let file = file.to_owned();
                return Err(GltfError::Buffer {
                    file,
                    index,
                    problem,
                }
                .into());
            }
            buffers.push(data);
        }
        Ok(Self {
            file,
            document,
            buffers,
        })
    }

    /// The bytes of all buffers.
    pub(super) fn into_buffers(self) -> Vec<Vec<u8>> {
        self.buffers
    }

    /// The bytes of a buffer.
    pub(super) fn buffer(&self, index: usize) -> Option<&[u8]> {
        self.buffers.get(index).map(Vec::as_slice)
    }

    /// The bytes of a buffer view, or nothing when it reaches beyond its buffer.
    pub(super) fn view(&self, view: &buffer::View) -> Option<&[u8]> {
        let end = view.offset().checked_add(view.length())?;
        self.buffer(view.buffer().index())?.get(view.offset()..end)
    }

    /// The encoded bytes of an image and a name for it.
    pub(super) fn image(&self, index: usize) -> Result<(Vec<u8>, PathBuf), LoadError> {
        let missing = |problem| GltfError::Image {
            file: self.file.to_owned(),
            index,
            problem,
        };
        let image = self.document.as_json().images.get(index);
        let image = image.ok_or_else(|| missing("does not exist"))?;
        let name = image
            .name
            .clone()
            .unwrap_or_else(|| format!("image {index}"));
        if let Some(uri) = &image.uri {
            let bytes = read_uri(self.file, uri, |_| {
                missing("has a URI that cannot be read").into()
            })?;
            let name = if uri.starts_with("data:") {
                name
            } else {
                uri.clone()
            };
            return Ok((bytes, PathBuf::from(name)));
        }
        let view = image
            .buffer_view
            .and_then(|view| self.document.views().nth(view.value()))
            .ok_or_else(|| missing("has neither a URI nor a buffer view"))?;
        let bytes = self
            .view(&view)
            .ok_or_else(|| missing("reaches beyond its buffer"))?;
        Ok((bytes.to_vec(), PathBuf::from(name)))
    }
}

/// What the parser's own validation takes for granted and would panic on.
fn check_positions(file: &Path, root: &json::Root) -> Result<(), GltfError> {
    let key = json::validation::Checked::Valid(gltf::Semantic::Positions);
    for (index, mesh) in root.meshes.iter().enumerate() {
        for (primitive, content) in mesh.primitives.iter().enumerate() {
            let accessor = content.attributes.get(&key).map_or(0, json::Index::value);
            if accessor >= root.accessors.len() {
                return Err(GltfError::Attribute {
                    file: file.to_owned(),
                    attribute: "POSITION",
                    primitive,
                    mesh: index.to_string(),
                    problem: format!("names accessor {accessor}, which does not exist"),
                });
            }
        }
    }
    Ok(())
}

/// What the parser takes for granted and would panic on.
fn check(file: &Path, root: &json::Root) -> Result<(), GltfError> {
    use json::camera::Type;
    use json::validation::Checked::Valid;
    let value = |element: String, problem| GltfError::Value {
        file: file.to_owned(),
        element,
        problem,
    };
    for (index, camera) in root.cameras.iter().enumerate() {
        let is_complete = match camera.type_ {
            Valid(Type::Perspective) => camera.perspective.is_some(),
            _ => camera.orthographic.is_some(),
        };
        if !is_complete {
            return Err(value(
                format!("camera {index}"),
                "has no projection of its type",
            ));
        }
    }
    let lights = root
        .extensions
        .as_ref()
        .and_then(|extensions| extensions.khr_lights_punctual.as_ref())
        .map_or(0, |extension| extension.lights.len());
    for (index, node) in root.nodes.iter().enumerate() {
        let light = node
            .extensions
            .as_ref()
            .and_then(|extensions| extensions.khr_lights_punctual.as_ref());
        if light.is_some_and(|reference| reference.light.value() >= lights) {
            return Err(value(
                format!("node {index}"),
                "names a light that does not exist",
            ));
        }
    }
    Ok(())
}

/// The bytes of a URI: base64 data, or a file relative to the document.
fn read_uri(
    file: &Path,
    uri: &str,
    error: impl Fn(String) -> LoadError,
) -> Result<Vec<u8>, LoadError> {
    if uri.starts_with("data:") {
        // The parser decodes base64; it is not asked for files, whose names it may panic on.
        let data = buffer::Data::from_source(buffer::Source::Uri(uri), None);
        return data
            .map(|data| data.0)
            .map_err(|source| error(source.to_string()));
    }
    let path = percent_decoded(uri)
        .filter(|_| !uri.contains(':'))
        .ok_or_else(|| {
            error("has a URI that is neither data nor a relative file name".to_owned())
        })?;
    let folder = file.parent().unwrap_or(Path::new(""));
    read_file(&folder.join(path), Some(&Place::file(file)))
}

/// A URI with `%20` and its like replaced by what they stand for.
fn percent_decoded(uri: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        rest = after;
        if first == b'%' {
            let (digits, after) = rest.split_at_checked(2)?;
            let digits = std::str::from_utf8(digits).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = after;
        } else {
            bytes.push(first);
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uris_are_decoded() {
        assert_eq!(percent_decoded("a%20b.png").as_deref(), Some("a b.png"));
        for bad in ["a%2", "%zz", "%ff"] {
            assert_eq!(percent_decoded(bad), None, "{bad}");
        }
    }
}
