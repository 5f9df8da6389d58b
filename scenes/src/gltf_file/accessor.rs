//! Checks an accessor before the parser's readers, which may panic on wrong ones, see it.

use super::source::Source;
use gltf::accessor::{Accessor, DataType, Dimensions};

/// Largest number of items that an accessor may have without data, all zero but for sparse ones:
/// larger is memory that a small file asks for, smaller would refuse large morph bases.
const MAX_ZEROS: usize = 1 << 28;

/// Says why `accessor` cannot be read as one of `types` with `dimensions`, or nothing.
pub(super) fn check(
    source: &Source,
    accessor: &Accessor,
    dimensions: Dimensions,
    types: &[DataType],
) -> Result<(), String> {
    if accessor.dimensions() != dimensions || !types.contains(&accessor.data_type()) {
        return Err(format!(
            "holds {:?} of {:?}",
            accessor.dimensions(),
            accessor.data_type()
        ));
    }
    if accessor.count() == 0 {
        return Err("is empty".to_owned());
    }
    let Some(sparse) = accessor.sparse() else {
        let view = accessor.view().ok_or("has no buffer view")?;
        return check_span(
            source,
            &view,
            accessor.offset(),
            accessor.count(),
            accessor.size(),
        );
    };
    match accessor.view() {
        Some(view) => {
            check_span(
                source,
                &view,
                accessor.offset(),
                accessor.count(),
                accessor.size(),
            )?;
        }
        None if accessor.count() > MAX_ZEROS => return Err("is too large".to_owned()),
        None => {}
    }
    let (indices, values) = (sparse.indices(), sparse.values());
    if sparse.count() == 0 {
        return Err("has no sparse values".to_owned());
    }
    let index_size = indices.index_type().size();
    check_span(
        source,
        &indices.view(),
        indices.offset(),
        sparse.count(),
        index_size,
    )?;
    check_span(
        source,
        &values.view(),
        values.offset(),
        sparse.count(),
        accessor.size(),
    )
}

/// `count` items of `size` bytes from `offset` on lie within the view, and the view in its buffer.
fn check_span(
    source: &Source,
    view: &gltf::buffer::View,
    offset: usize,
    count: usize,
    size: usize,
) -> Result<(), String> {
    let stride = view.stride().unwrap_or(size);
    if stride < size {
        return Err(format!(
            "has a stride of {stride} for items of {size} bytes"
        ));
    }
    let available = source.view(view).map_or(0, <[u8]>::len);
    let end = (count - 1)
        .checked_mul(stride)
        .and_then(|bytes| bytes.checked_add(size))
        .and_then(|bytes| bytes.checked_add(offset));
    match end {
        Some(end) if end <= available => Ok(()),
        _ => Err(format!(
            "reaches beyond the {available} bytes of its buffer view"
        )),
    }
}
