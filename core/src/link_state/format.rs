//! The model file, version 1. Little endian; every part starts at a multiple of four bytes.
//!
//! | offset | bytes | what |
//! |---|---|---|
//! | 0 | 4 | `LSCN` |
//! | 4 | 2 | version, 1 |
//! | 6 | 1 | kind: 1 paper, 2 geometric; 3 are trees, see [`Trees`](super::Trees) |
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

use super::error::ModelError;
use super::shape::{Kind, Shape};
use crate::kernels::dense::record_length;
use crate::numeric::CRC;

/// First bytes of a model file.
pub const MAGIC: [u8; 4] = *b"LSCN";
pub use super::layout::{ALIGNMENT, HEADER, MAX_BIAS, VERSION};

/// Bytes of the checksum at the end.
pub const CHECKSUM: usize = 4;
/// Bytes of the offset and the steps of an input.
pub(super) const SCALE: usize = 8;

/// Number of the kind of trees.
pub(super) const TREES: u8 = 3;

/// First bytes of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub(super) kind: u8,
    pub(super) layers: u8,
    pub(super) inputs: usize,
    /// Bytes of the names.
    pub(super) names: usize,
    pub(super) temperature: f32,
    pub(super) outputs: [u8; 4],
}

impl Header {
    /// Header of a file, and what lies between it and the checksum.
    ///
    /// # Errors
    /// [`ModelError`] of what all kinds have in common.
    pub(super) fn parse(file: &[u8]) -> Result<(Self, &[u8]), ModelError> {
        let (header, _) = file.split_first_chunk::<HEADER>().ok_or(ModelError::TooShort)?;
        let [
            m0,
            m1,
            m2,
            m3,
            v0,
            v1,
            kind,
            layers,
            l0,
            l1,
            l2,
            l3,
            n0,
            n1,
            t0,
            t1,
            rest @ ..,
        ] = *header;
        let [b0, b1, b2, b3, outputs @ ..] = rest;
        if [m0, m1, m2, m3] != MAGIC {
            return Err(ModelError::Magic);
        }
        let found = u16::from_le_bytes([v0, v1]);
        if found != VERSION {
            return Err(ModelError::Version { found });
        }
        let (stated, found) = (u32::from_le_bytes([l0, l1, l2, l3]), file.len());
        if usize::try_from(stated) != Ok(found) {
            return Err(ModelError::Length { stated, found });
        }
        let (content, checksum) = file.split_last_chunk::<CHECKSUM>().ok_or(ModelError::TooShort)?;
        if CRC.checksum(content) != u32::from_le_bytes(*checksum) {
            return Err(ModelError::Checksum);
        }
        let header = Self {
            kind,
            layers,
            inputs: usize::from(u16::from_le_bytes([n0, n1])),
            names: usize::from(u16::from_le_bytes([t0, t1])),
            temperature: f32::from_le_bytes([b0, b1, b2, b3]),
            outputs,
        };
        Ok((header, content.get(HEADER..).unwrap_or(&[])))
    }
}

/// Names of so many inputs, and what follows their padding.
///
/// # Errors
/// [`ModelError::Shape`] when there are fewer bytes, [`ModelError::Names`].
pub(super) fn names(content: &[u8], bytes: usize, inputs: usize) -> Result<(&str, &[u8]), ModelError> {
    let (text, rest) = content
        .split_at_checked(bytes.next_multiple_of(4))
        .ok_or(ModelError::Shape)?;
    // Split as bytes: the search for a character in a string has a panic in it.
    let one_each = |text: &&[u8]| {
        let mut names = text.split(|&byte| byte == b',');
        names.clone().count() == inputs && names.all(|name| !name.is_empty())
    };
    let names = text
        .get(..bytes)
        .filter(|text| text.is_ascii())
        .filter(one_each)
        .and_then(|text| core::str::from_utf8(text).ok())
        .ok_or(ModelError::Names)?;
    Ok((names, rest))
}

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
