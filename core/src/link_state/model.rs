//! A model file, checked once and then read where it lies.

use super::error::ModelError;
use super::format::{self, ALIGNMENT, Header, MAX_BIAS, SCALE};
use super::shape::{Kind, MAX_LAYERS, Shape};
use crate::kernels::dense::{ENDS, LARGEST, parts, record_length};

/// A network in a model file: see [`format`](mod@format) for the layout. Borrows the file; nothing is copied but the header.
#[derive(Clone, Copy, Debug)]
pub struct Model<'m> {
    shape: Shape,
    temperature: f32,
    names: &'m str,
    scales: &'m [[u8; SCALE]],
    layers: [&'m [u8]; MAX_LAYERS],
}

/// How an input becomes an int8.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InputScale {
    /// Value that becomes 0, in the input's unit.
    pub offset: f32,
    /// Steps of the int8 for one unit of the input.
    pub steps: f32,
}

impl InputScale {
    /// The int8 that an input becomes, see [`format`](mod@format).
    #[must_use]
    pub fn int8(self, x: f32) -> i8 {
        self.quantised(x) as i8
    }

    /// `floor((x - offset) steps + 1/2)`, within +-127, where the sum is rounded to `f32` near 2^8: a value within 2^-16 of a half
    /// may go either way, the same on every machine.
    #[expect(
        clippy::manual_clamp,
        reason = "a NaN, of infinity times zero, is to become the lowest"
    )]
    pub(super) fn quantised(self, x: f32) -> i16 {
        const LIMIT: f32 = LARGEST as f32;
        let steps = ((x - self.offset) * self.steps).max(-LIMIT).min(LIMIT);
        // From 256 to 512 a float's fraction is its distance from 256 in steps of 2^-15: the integer part is there to be taken.
        ((((steps + 384.5).to_bits() >> 15) & 0xff) as i16) - 128
    }

    /// Offset and steps as they lie in a file.
    pub(super) fn from_bytes(&[a, b, c, d, e, f, g, h]: &[u8; SCALE]) -> Self {
        Self {
            offset: f32::from_le_bytes([a, b, c, d]),
            steps: f32::from_le_bytes([e, f, g, h]),
        }
    }
}

impl<'m> Model<'m> {
    /// Checks a model file and reads its header.
    ///
    /// Afterwards nothing that the network does with it can fail or overflow. Time: one pass for the checksum, one for the
    /// weights.
    ///
    /// # Errors
    /// The first [`ModelError`] in the order of its variants.
    pub fn parse(file: &'m [u8]) -> Result<Self, ModelError> {
        if !file.as_ptr().addr().is_multiple_of(ALIGNMENT) {
            return Err(ModelError::Misaligned);
        }
        let (header, content) = Header::parse(file)?;
        let kind = format::kind(header.kind).ok_or(ModelError::Kind)?;
        let outputs = header.outputs.map(usize::from);
        let shape = outputs
            .get(..usize::from(header.layers))
            .and_then(|outputs| Shape::new(kind, header.inputs, outputs))
            .ok_or(ModelError::Shape)?;
        if format::length(&shape, header.names) != file.len() {
            return Err(ModelError::Shape);
        }
        let (names, content) = format::names(content, header.names, shape.inputs())?;
        Self {
            shape,
            temperature: header.temperature,
            names,
            scales: &[],
            layers: [&[]; MAX_LAYERS],
        }
        .with_content(content)
    }

    /// Reads what follows the names.
    fn with_content(mut self, content: &'m [u8]) -> Result<Self, ModelError> {
        if !(self.temperature.is_finite() && self.temperature > 0.0) {
            return Err(ModelError::Temperature);
        }
        let (scales, mut records) = content
            .split_at_checked(SCALE * self.shape.inputs())
            .ok_or(ModelError::Shape)?;
        self.scales = scales.as_chunks().0;
        if !self
            .input_scales()
            .all(|scale| scale.offset.is_finite() && scale.steps.is_finite())
        {
            return Err(ModelError::InputScale);
        }
        let count = self.shape.layers();
        for (index, layer) in self.layers.iter_mut().enumerate().take(count) {
            let length = format::layer_length(&self.shape, index);
            (*layer, records) = records.split_at_checked(length).ok_or(ModelError::Shape)?;
            check(layer, record_length(self.shape.quads(index)), index + 1 == count)?;
        }
        Ok(self)
    }

    /// Its topology.
    pub fn shape(&self) -> &Shape {
        &self.shape
    }

    /// What it takes and tells.
    pub fn kind(&self) -> Kind {
        self.shape.kind()
    }

    /// Temperature by which its logits are divided, positive.
    pub fn temperature(&self) -> f32 {
        self.temperature
    }

    /// Names of the inputs, in order.
    pub fn input_names(&self) -> impl Iterator<Item = &'m str> + use<'m> {
        self.names.split(',')
    }

    /// How each input becomes an int8, in order.
    pub fn input_scales(&self) -> impl Iterator<Item = InputScale> + use<'m> {
        self.scales.iter().map(InputScale::from_bytes)
    }

    /// The same as it lies in the file.
    pub(super) fn scales(&self) -> &'m [[u8; SCALE]] {
        self.scales
    }

    /// Records of a layer; none for a layer that does not exist.
    pub(super) fn layer(&self, index: usize) -> &'m [u8] {
        self.layers.get(index).copied().unwrap_or(&[])
    }

    /// Scales of the last layer's sums.
    pub(super) fn logit_scales(&self) -> [f32; 4] {
        let last = self.layer(self.shape.layers().saturating_sub(1));
        parts(last).2.map(|bits| f32::from_bits(bits as u32))
    }
}

/// Whether the records of a layer hold what keeps the arithmetic within its bounds.
fn check(records: &[u8], length: usize, last: bool) -> Result<(), ModelError> {
    for record in records.chunks_exact(length) {
        let (biases, _, multipliers) = parts(record);
        let weights = record.get(ENDS..length - ENDS).unwrap_or(&[]);
        let small = |weight: &[u8; 2]| (-LARGEST..=LARGEST).contains(&i16::from_le_bytes(*weight).into());
        if !weights.as_chunks::<2>().0.iter().all(small) {
            return Err(ModelError::Weight);
        }
        if !biases.iter().all(|bias| (-MAX_BIAS..=MAX_BIAS).contains(bias)) {
            return Err(ModelError::Bias);
        }
        let sound = |&m: &i32| {
            if last {
                f32::from_bits(m as u32).is_finite()
            } else {
                m >= 0
            }
        };
        if !multipliers.iter().all(sound) {
            return Err(ModelError::Multiplier);
        }
    }
    Ok(())
}
