//! Values of vertices: read from accessors as they are, and written to new ones.
//!
//! Source: glTF 2.0, chapter 3.6.2: items of one to sixteen components lie at a stride in a view; columns of matrices begin at
//! multiples of four bytes; a sparse accessor replaces some items of a base, which is zero where there is no view. Vertices
//! that are written begin at multiples of four bytes. Cost: one copy.

use super::document::{ARRAY_BUFFER, Document, ELEMENT_ARRAY_BUFFER, index, object_mut, set};
use crate::lightmap::cut::Weights;
use serde_json::{Value, json};

/// Component type of f32.
const FLOAT: usize = 5126;

/// What the mean of an attribute is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mixing {
    /// That of each component.
    Components,
    /// The same, of three components that keep their length; a fourth is a sign.
    Direction,
    /// There is none: the value of the vertex with the largest weight stands for it.
    Largest,
}

impl Mixing {
    /// Of an attribute with this name. Joints and features are numbers of things, and the weights of joints belong to them.
    pub(super) fn of(attribute: &str) -> Self {
        match attribute {
            "NORMAL" | "TANGENT" => Self::Direction,
            name if name.starts_with("TEXCOORD_") || name.starts_with("COLOR_") => Self::Components,
            "POSITION" => Self::Components,
            _ => Self::Largest,
        }
    }
}

/// Values of one attribute, packed without gaps.
#[derive(Clone, Debug)]
pub(super) struct Attribute {
    /// The accessor without its place, count and bounds.
    accessor: Value,
    /// Bytes of an item.
    size: usize,
    data: Vec<u8>,
}

impl Attribute {
    /// An attribute of f32 vectors.
    pub(super) fn floats<const N: usize>(items: impl IntoIterator<Item = [f32; N]>) -> Self {
        Self {
            accessor: json!({"componentType": FLOAT, "type": format!("VEC{N}")}),
            size: 4 * N,
            data: items
                .into_iter()
                .flatten()
                .flat_map(f32::to_le_bytes)
                .collect(),
        }
    }

    /// Reads an accessor of so many items; `None` when it is not as the format says.
    pub(super) fn read(document: &Document, accessor: usize, count: usize) -> Option<Self> {
        let accessor = document.items("accessors").get(accessor)?;
        let size = item_size(accessor)?;
        if index(accessor, "count")? != count {
            return None;
        }
        let view = accessor.get("bufferView");
        let mut data = match view {
            Some(_) => items(document, accessor, size, count)?,
            None => vec![0; size.checked_mul(count)?],
        };
        if let Some(sparse) = accessor.get("sparse") {
            let count = index(sparse, "count")?;
            let (places, values) = (sparse.get("indices")?, sparse.get("values")?);
            let width = component_size(index(places, "componentType")?)?;
            let places = items(document, places, width, count)?;
            let values = items(document, values, size, count)?;
            for (place, value) in places.chunks_exact(width).zip(values.chunks_exact(size)) {
                let place = place
                    .iter()
                    .rev()
                    .fold(0, |sum, &byte| sum << 8 | usize::from(byte));
                let start = place.checked_mul(size)?;
                data.get_mut(start..start.checked_add(size)?)?
                    .copy_from_slice(value);
            }
        }
        let mut accessor = accessor.clone();
        for key in ["bufferView", "byteOffset", "sparse", "min", "max", "count"] {
            object_mut(&mut accessor).remove(key);
        }
        Some(Self {
            accessor,
            size,
            data,
        })
    }

    /// Some of its items, by number, or means of several.
    ///
    /// # Panics
    /// When there are not so many.
    pub(super) fn pick(&self, numbers: &[Weights], mixing: Mixing) -> Self {
        let item = |number: u32| {
            let start = number as usize * self.size;
            &self.data[start..start + self.size]
        };
        let mut data = Vec::with_capacity(numbers.len() * self.size);
        for weights in numbers {
            let mixed = Some(weights).filter(|weights| weights.len() > 1);
            if let Some(mixed) = mixed.and_then(|weights| self.mix(weights, mixing)) {
                data.extend_from_slice(&mixed);
            } else if let Some(&(number, _)) = weights.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
                data.extend_from_slice(item(number));
            }
        }
        Self {
            accessor: self.accessor.clone(),
            size: self.size,
            data,
        }
    }

    /// The bytes of a mean of items; `None` where there is no mean.
    fn mix(&self, weights: &Weights, mixing: Mixing) -> Option<Vec<u8>> {
        let directions = match mixing {
            Mixing::Largest => return None,
            Mixing::Components => 0,
            Mixing::Direction => 3,
        };
        let kind = index(&self.accessor, "componentType")?;
        let width = component_size(kind)?;
        let mut sums = vec![0.0; self.size / width];
        for &(number, weight) in weights {
            let start = number as usize * self.size;
            let item = self.data[start..start + self.size].chunks_exact(width);
            for (sum, bytes) in sums.iter_mut().zip(item) {
                *sum += weight * component(kind, bytes)?;
            }
        }
        if let Some(direction) = sums.get_mut(..directions) {
            let item = &self.data[weights[0].0 as usize * self.size..];
            let mut square = 0.0;
            for bytes in item.chunks_exact(width).take(directions) {
                square += component(kind, bytes)?.powi(2);
            }
            let length: f64 = direction.iter().map(|x| x * x).sum();
            let scale = (square / length.max(f64::MIN_POSITIVE)).sqrt();
            for x in direction {
                *x *= scale;
            }
        }
        let bytes = sums.iter().map(|&sum| component_bytes(kind, sum));
        Some(bytes.collect::<Option<Vec<_>>>()?.concat())
    }

    /// Adds it to a document as a view and an accessor of its own; `is_bounded` for positions, of which the format wants
    /// the bounds.
    pub(super) fn write(&self, document: &mut Document, is_bounded: bool) -> usize {
        let stride = self.size.next_multiple_of(4);
        let count = self.data.len() / self.size.max(1);
        let mut padded = Vec::with_capacity(count * stride);
        for item in self.data.chunks_exact(self.size.max(1)) {
            padded.extend_from_slice(item);
            padded.resize(padded.len().next_multiple_of(4), 0);
        }
        // Strides are at most 252 bytes, and matrices of f32 are far below.
        let members = if stride == self.size {
            json!({"target": ARRAY_BUFFER})
        } else {
            json!({"target": ARRAY_BUFFER, "byteStride": stride})
        };
        let view = document.view(&padded, members);
        let mut accessor = self.accessor.clone();
        set(&mut accessor, "bufferView", view);
        set(&mut accessor, "count", count);
        if is_bounded && let Some([min, max]) = self.bounds() {
            set(&mut accessor, "min", min);
            set(&mut accessor, "max", max);
        }
        document.push("accessors", accessor)
    }

    /// Least and largest value of each component.
    fn bounds(&self) -> Option<[Vec<Value>; 2]> {
        let kind = index(&self.accessor, "componentType")?;
        let width = component_size(kind)?;
        let mut bounds = vec![(f64::INFINITY, f64::NEG_INFINITY); self.size / width];
        for item in self.data.chunks_exact(self.size) {
            for (bound, bytes) in bounds.iter_mut().zip(item.chunks_exact(width)) {
                let value = component(kind, bytes)?;
                *bound = (bound.0.min(value), bound.1.max(value));
            }
        }
        let number = |x: f64| match kind {
            FLOAT => json!(x),
            _ => json!(x as i64),
        };
        let [min, max]: [Vec<f64>; 2] = [
            bounds.iter().map(|b| b.0).collect(),
            bounds.iter().map(|b| b.1).collect(),
        ];
        Some([min, max].map(|side| side.into_iter().map(number).collect()))
    }
}

/// Adds indices to a document, in two bytes where they fit. The largest value of a type is not an index.
pub(super) fn write_indices(document: &mut Document, indices: &[u32]) -> usize {
    let largest = indices.iter().copied().max().unwrap_or(0);
    let (kind, bytes): (_, Vec<u8>) = if largest < u32::from(u16::MAX) {
        let narrow = indices.iter().map(|&i| (i as u16).to_le_bytes());
        (5123, narrow.flatten().collect())
    } else {
        let wide = indices.iter().map(|&i| i.to_le_bytes());
        (5125, wide.flatten().collect())
    };
    let view = document.view(&bytes, json!({"target": ELEMENT_ARRAY_BUFFER}));
    let accessor = json!({
        "bufferView": view, "componentType": kind, "count": indices.len(), "type": "SCALAR",
    });
    document.push("accessors", accessor)
}

/// Items of a view, packed.
fn items(document: &Document, place: &Value, size: usize, count: usize) -> Option<Vec<u8>> {
    let view = document
        .items("bufferViews")
        .get(index(place, "bufferView")?)?;
    let start = index(view, "byteOffset").unwrap_or(0);
    let bytes = document
        .binary
        .get(start..start.checked_add(index(view, "byteLength")?)?)?;
    let stride = index(view, "byteStride").unwrap_or(size);
    let mut at = index(place, "byteOffset").unwrap_or(0);
    let mut data = Vec::new();
    for _ in 0..count {
        data.extend_from_slice(bytes.get(at..at.checked_add(size)?)?);
        at = at.checked_add(stride)?;
    }
    Some(data)
}

/// Bytes of an item.
fn item_size(accessor: &Value) -> Option<usize> {
    let width = component_size(index(accessor, "componentType")?)?;
    let columns = |n: usize| n * (n * width).next_multiple_of(4);
    Some(match accessor.get("type")?.as_str()? {
        "SCALAR" => width,
        "VEC2" => 2 * width,
        "VEC3" => 3 * width,
        "VEC4" => 4 * width,
        "MAT2" => columns(2),
        "MAT3" => columns(3),
        "MAT4" => columns(4),
        _ => return None,
    })
}

/// Bytes of a component type.
fn component_size(kind: usize) -> Option<usize> {
    match kind {
        5120 | 5121 => Some(1),
        5122 | 5123 => Some(2),
        5125 | FLOAT => Some(4),
        _ => None,
    }
}

/// The value of a component.
fn component(kind: usize, bytes: &[u8]) -> Option<f64> {
    Some(match (kind, bytes) {
        (5120, &[a]) => f64::from(i8::from_le_bytes([a])),
        (5121, &[a]) => f64::from(a),
        (5122, &[a, b]) => f64::from(i16::from_le_bytes([a, b])),
        (5123, &[a, b]) => f64::from(u16::from_le_bytes([a, b])),
        (5125, &[a, b, c, d]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (FLOAT, &[a, b, c, d]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => return None,
    })
}

/// The bytes of a component, rounded where they are those of an integer.
fn component_bytes(kind: usize, value: f64) -> Option<Vec<u8>> {
    let rounded = value.round();
    Some(match kind {
        5120 => (rounded as i8).to_le_bytes().to_vec(),
        5121 => (rounded as u8).to_le_bytes().to_vec(),
        5122 => (rounded as i16).to_le_bytes().to_vec(),
        5123 => (rounded as u16).to_le_bytes().to_vec(),
        5125 => (rounded as u32).to_le_bytes().to_vec(),
        FLOAT => (value as f32).to_le_bytes().to_vec(),
        _ => return None,
    })
}
