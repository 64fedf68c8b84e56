//! Writes model files, next to [`Model`] that reads them: for the quantiser and for tests.

use core::fmt;

use super::error::ModelError;
use super::format::{self, CHECKSUM, MAGIC, VERSION};
use super::model::{InputScale, Model};
use super::shape::{MAX_LAYERS, Shape};
use crate::kernels::dense::{ENDS, record_length};
use crate::numeric::CRC;

/// A network to be written.
#[derive(Clone, Copy, Debug)]
pub struct Description<'a> {
    /// Topology.
    pub shape: Shape,
    /// Temperature of the softmax.
    pub temperature: f32,
    /// Names of the inputs, separated by commas.
    pub names: &'a str,
    /// Offset and steps of each input.
    pub inputs: &'a [InputScale],
    /// One entry a layer.
    pub layers: &'a [Rows<'a>],
}

/// The rows of a layer.
#[derive(Clone, Copy, Debug)]
pub struct Rows<'a> {
    /// Weights, row by row, with [`Shape::columns`] columns.
    pub weights: &'a [i8],
    /// A bias for each row.
    pub biases: &'a [i32],
    /// What becomes of each row's sum.
    pub outputs: Outputs<'a>,
}

/// What becomes of the sums of a layer.
#[derive(Clone, Copy, Debug)]
pub enum Outputs<'a> {
    /// Hidden layer: multipliers `round(scale 2^32)`, 0 <= scale < 1/2.
    Requantised(&'a [i32]),
    /// Last layer: what a sum is multiplied by.
    Logits(&'a [f32]),
}

/// Why a model file could not be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum WriteError {
    /// The buffer is shorter than the file.
    Buffer {
        /// Bytes needed: [`format::length`].
        needed: usize,
    },
    /// A slice does not have the length that the shape asks for, or a layer has the other kind of outputs.
    Parts,
    /// The finished file does not pass the reader's checks.
    Model(ModelError),
}

impl fmt::Display for WriteError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Buffer { needed } => write!(f, "the model takes {needed} bytes"),
            Self::Parts => f.write_str("parts of the model do not have the sizes of its shape"),
            Self::Model(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for WriteError {}

/// Writes a model file to the start of `out`, which begins at a multiple of [`format::ALIGNMENT`]; gives its length.
///
/// # Errors
/// [`WriteError`]; nothing that the reader would refuse is reported as written.
pub fn write(description: &Description<'_>, out: &mut [u8]) -> Result<usize, WriteError> {
    let shape = &description.shape;
    let needed = format::length(shape, description.names.len());
    let file = out.get_mut(..needed).ok_or(WriteError::Buffer { needed })?;
    if description.inputs.len() != shape.inputs() || description.layers.len() != shape.layers() {
        return Err(WriteError::Parts);
    }
    let mut sink = Sink { rest: file };
    sink.put(&MAGIC)?;
    sink.put(&VERSION.to_le_bytes())?;
    sink.put(&[format::code(shape.kind()), shape.layers() as u8])?;
    sink.put(&(needed as u32).to_le_bytes())?;
    sink.put(&(shape.inputs() as u16).to_le_bytes())?;
    sink.put(&(description.names.len() as u16).to_le_bytes())?;
    sink.put(&description.temperature.to_le_bytes())?;
    for layer in 0..MAX_LAYERS {
        sink.put(&[shape.outputs(layer) as u8])?;
    }
    sink.put(description.names.as_bytes())?;
    for _ in description.names.len()..description.names.len().next_multiple_of(4) {
        sink.put(&[0])?;
    }
    for input in description.inputs {
        sink.put(&input.offset.to_le_bytes())?;
        sink.put(&input.steps.to_le_bytes())?;
    }
    for (index, rows) in description.layers.iter().enumerate() {
        put_layer(&mut sink, shape, index, rows)?;
    }
    let (content, checksum) = file.split_last_chunk_mut::<CHECKSUM>().ok_or(WriteError::Parts)?;
    *checksum = CRC.checksum(content).to_le_bytes();
    Model::parse(file).map(|_| needed).map_err(WriteError::Model)
}

/// The records of a layer.
fn put_layer(sink: &mut Sink<'_>, shape: &Shape, layer: usize, rows: &Rows<'_>) -> Result<(), WriteError> {
    let (columns, outputs) = (shape.columns(layer), shape.outputs(layer));
    let ends = match (rows.outputs, layer + 1 == shape.layers()) {
        (Outputs::Requantised(m), false) => m.len(),
        (Outputs::Logits(scales), true) => scales.len(),
        _ => return Err(WriteError::Parts),
    };
    if rows.weights.len() != columns * outputs || rows.biases.len() != outputs || ends != outputs {
        return Err(WriteError::Parts);
    }
    for group in 0..shape.groups(layer) {
        for row in 4 * group..4 * group + 4 {
            sink.put(&rows.biases.get(row).copied().unwrap_or(0).to_le_bytes())?;
        }
        let weights = sink.take(record_length(shape.quads(layer)) - 2 * ENDS)?;
        weights.fill(0);
        for row in 0..4 {
            let Some(values) = rows.weights.chunks_exact(columns).nth(4 * group + row) else {
                break;
            };
            for (column, &value) in values.iter().enumerate() {
                let place = shape.place(layer, column);
                let at = 32 * (place / 4) + 8 * row + 2 * (place % 4);
                let bytes = weights.get_mut(at..at + 2).ok_or(WriteError::Parts)?;
                bytes.copy_from_slice(&i16::from(value).to_le_bytes());
            }
        }
        for row in 4 * group..4 * group + 4 {
            let bits = match rows.outputs {
                Outputs::Requantised(m) => m.get(row).copied().unwrap_or(0),
                Outputs::Logits(scales) => scales.get(row).copied().unwrap_or(0.0).to_bits() as i32,
            };
            sink.put(&bits.to_le_bytes())?;
        }
    }
    Ok(())
}

/// The part of the file not yet written.
struct Sink<'a> {
    rest: &'a mut [u8],
}

impl<'a> Sink<'a> {
    fn put(&mut self, bytes: &[u8]) -> Result<(), WriteError> {
        self.take(bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }

    fn take(&mut self, length: usize) -> Result<&'a mut [u8], WriteError> {
        let (taken, rest) = core::mem::take(&mut self.rest)
            .split_at_mut_checked(length)
            .ok_or(WriteError::Parts)?;
        self.rest = rest;
        Ok(taken)
    }
}
