//! The model file, version 1. Little endian; every part starts at a multiple of four bytes.
//!
//! | offset | bytes | what |
//! |---|---|---|
//! | 0 | 4 | `LSCN` |
//! | 4 | 2 | version, 1 |
//! | 6 | 1 | kind: 1 paper, 2 geometric |
//! | 7 | 1 | number of layers L, 1 to 4 |
//! | 8 | 4 | length of the file, checksum included |
//! | 12 | 2 | number of inputs n, 1 to 64 |
//! | 14 | 2 | bytes of the names, padding excluded |
//! | 16 | 4 | temperature of the softmax, f32, positive |
//! | 20 | 4 | outputs of each layer, u8 each, 0 for layers that do not exist; the last layer has 3 |
//! | 24 | | names of the inputs, ASCII, separated by commas, padded with zeros to a multiple of four bytes |
//! | | 8 n | offset and steps of each input, f32: the int8 input is `floor(steps (x - offset) + 1/2)`, clamped to +-127 |
//! | | | the layers' records, in order: `ceil(outputs / 4)` records each (biases, weights, multipliers or scales; see `dense.rs` and docs/link-state.md) |
//! | | 4 | CRC-32/ISO-HDLC of all before |
//!
//! A file is read in place, so its first byte lies at an address that is a multiple of [`ALIGNMENT`].

use super::dense::record_length;
use super::shape::{Kind, Shape};

/// First bytes of a model file.
pub const MAGIC: [u8; 4] = *b"LSCN";
/// Version of the layout that this crate reads and writes.
pub const VERSION: u16 = 1;
/// What the address of the first byte is a multiple of.
pub const ALIGNMENT: usize = 4;
/// Bytes before the names.
pub const HEADER: usize = 24;
/// Bytes of the checksum at the end.
pub const CHECKSUM: usize = 4;
/// Largest magnitude of a bias: keeps sums within `i32`.
pub const MAX_BIAS: i32 = 1 << 30;

/// Bytes of the offset and the steps of an input.
pub(super) const SCALE: usize = 8;

/// The kind's number in a file.
pub(super) const fn code(kind: Kind) -> u8 {
    match kind {
        Kind::Paper => 1,
        Kind::Geometric => 2,
    }
}

/// The kind of a number.
pub(super) const fn kind(code: u8) -> Option<Kind> {
    match code {
        1 => Some(Kind::Paper),
        2 => Some(Kind::Geometric),
        _ => None,
    }
}

/// Bytes of a layer's records.
pub(super) fn layer_length(shape: &Shape, layer: usize) -> usize {
    shape.groups(layer) * record_length(shape.quads(layer))
}

/// Bytes of the file of a network whose names take `names` bytes.
pub fn length(shape: &Shape, names: usize) -> usize {
    let layers: usize = (0..shape.layers()).map(|layer| layer_length(shape, layer)).sum();
    HEADER + names.next_multiple_of(4) + SCALE * shape.inputs() + layers + CHECKSUM
}
