//! The numbers that accessors of a glTF give, of the bytes in its buffers.

use gltf::{
    Accessor,
    accessor::{DataType, Dimensions},
};

/// The elements of an accessor of finite numbers, one component after the other.
pub(super) fn numbers(
    accessor: &Accessor<'_>,
    expected: Dimensions,
    buffers: &[Vec<u8>],
) -> Result<Vec<f32>, String> {
    let find = || {
        let found = accessor.dimensions();
        if found != expected {
            return Err(format!("found {found:?}, expected {expected:?}"));
        }
        let component: fn(&[u8]) -> f32 = match (accessor.data_type(), accessor.normalized()) {
            (DataType::F32, _) => |bytes| f32::from_le_bytes(array(bytes)),
            (DataType::U8, true) => |bytes| f32::from(bytes[0]) / 255.0,
            (DataType::U16, true) => |bytes| f32::from(u16::from_le_bytes(array(bytes))) / 65535.0,
            (other, _) => return Err(format!("found components {other:?}, expected F32")),
        };
        let mut list = Vec::new();
        for (index, element) in elements(accessor, buffers)?.enumerate() {
            for bytes in element.chunks_exact(accessor.data_type().size()) {
                let number = component(bytes);
                if !number.is_finite() {
                    return Err(format!(
                        "element {index}: found {number}, expected finite numbers"
                    ));
                }
                list.push(number);
            }
        }
        Ok(list)
    };
    find().map_err(|what| format!("accessors[{}]: {what}", accessor.index()))
}

/// The elements of an accessor of indices.
pub(super) fn whole_numbers(
    accessor: &Accessor<'_>,
    buffers: &[Vec<u8>],
) -> Result<Vec<u32>, String> {
    let find = || {
        let found = accessor.dimensions();
        if found != Dimensions::Scalar {
            return Err(format!("found {found:?}, expected Scalar"));
        }
        let number: fn(&[u8]) -> u32 = match accessor.data_type() {
            DataType::U8 => |bytes| bytes[0].into(),
            DataType::U16 => |bytes| u16::from_le_bytes(array(bytes)).into(),
            DataType::U32 => |bytes| u32::from_le_bytes(array(bytes)),
            other => return Err(format!("found indices {other:?}, expected U8, U16 or U32")),
        };
        Ok(elements(accessor, buffers)?.map(number).collect())
    };
    find().map_err(|what| format!("accessors[{}]: {what}", accessor.index()))
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    *bytes.first_chunk().expect("elements are as long as their type")
}

/// The bytes of each element of an accessor, all as long as its type.
fn elements<'a>(
    accessor: &Accessor<'_>,
    buffers: &'a [Vec<u8>],
) -> Result<impl Iterator<Item = &'a [u8]>, String> {
    if accessor.sparse().is_some() {
        return Err("found sparse values, expected all of them".to_owned());
    }
    let view = accessor.view().ok_or_else(|| "found no bufferView, expected one".to_owned())?;
    let buffer: &'a [u8] = &buffers[view.buffer().index()];
    let bytes =
        view.offset().checked_add(view.length()).and_then(|end| buffer.get(view.offset()..end));
    let bytes = bytes.ok_or_else(|| {
        let (length, offset, found) = (view.length(), view.offset(), buffer.len());
        format!("found {length} bytes from {offset} in a buffer of {found}, expected them inside")
    })?;
    let (size, count) = (accessor.size(), accessor.count());
    let stride = view.stride().unwrap_or(size);
    // Where the last of them ends.
    let end = count.checked_sub(1).map_or(Some(accessor.offset()), |last| {
        last.checked_mul(stride)?.checked_add(accessor.offset())?.checked_add(size)
    });
    if end.is_none_or(|end| end > bytes.len()) {
        let found = bytes.len();
        return Err(format!("found a view of {found} bytes, expected room for {count} elements"));
    }
    let offset = accessor.offset();
    Ok((0..count).map(move |index| &bytes[offset + index * stride..][..size]))
}
