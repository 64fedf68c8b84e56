//! A model file, checked once and then read where it lies.

use super::dense::{ENDS, LARGEST, parts, record_length};
use super::error::ModelError;
use super::format::{self, ALIGNMENT, CHECKSUM, HEADER, MAGIC, MAX_BIAS, SCALE, VERSION};
use super::shape::{Kind, MAX_LAYERS, Shape};
use crate::checksum::CRC;

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
        let kind = format::kind(kind).ok_or(ModelError::Kind)?;
        let outputs = outputs.map(usize::from);
        let shape = outputs
            .get(..usize::from(layers))
            .and_then(|outputs| Shape::new(kind, usize::from(u16::from_le_bytes([n0, n1])), outputs))
            .ok_or(ModelError::Shape)?;
        let names = usize::from(u16::from_le_bytes([t0, t1]));
        if format::length(&shape, names) != found {
            return Err(ModelError::Shape);
        }
        Self {
            shape,
            temperature: f32::from_le_bytes([b0, b1, b2, b3]),
            names: "",
            scales: &[],
            layers: [&[]; MAX_LAYERS],
        }
        .with_content(content.get(HEADER..).unwrap_or(&[]), names)
    }

    /// Reads what follows the header.
    fn with_content(mut self, content: &'m [u8], names: usize) -> Result<Self, ModelError> {
        let (text, content) = content
            .split_at_checked(names.next_multiple_of(4))
            .ok_or(ModelError::Shape)?;
        // Split as bytes: the search for a character in a string has a panic in it.
        let one_each = |text: &&[u8]| {
            let mut names = text.split(|&byte| byte == b',');
            names.clone().count() == self.shape.inputs() && names.all(|name| !name.is_empty())
        };
        self.names = text
            .get(..names)
            .filter(|text| text.is_ascii())
            .filter(one_each)
            .and_then(|text| core::str::from_utf8(text).ok())
            .ok_or(ModelError::Names)?;
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
