//! Runs a model: from features to probabilities.

use core::fmt;
use core::marker::PhantomData;
use core::mem::swap;

use super::dense::{LARGEST, Quad};
use super::kernels::{Kernels, Native};
use super::model::{InputScale, Model};
use super::probability::Probabilities;
use super::shape::{MAX_WIDTH, STATES};

/// A model and the kernel that it runs on. Needs 512 bytes of stack for the activations.
#[derive(Clone, Copy, Debug)]
pub struct Network<'m, K = Native> {
    model: Model<'m>,
    kernels: PhantomData<K>,
}

/// Why features could not be classified.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InferenceError {
    /// The model takes another number of inputs.
    Count {
        /// What the model takes.
        expected: usize,
        /// What there was.
        found: usize,
    },
    /// An input is NaN or infinite.
    NotFinite {
        /// Which, from 0.
        input: usize,
    },
}

impl fmt::Display for InferenceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Count { expected, found } => write!(f, "{found} inputs, the model takes {expected}"),
            Self::NotFinite { input } => write!(f, "input {input} is not finite"),
        }
    }
}

impl core::error::Error for InferenceError {}

impl<'m, K: Kernels> Network<'m, K> {
    /// Runs a model on this kernel.
    pub fn new(model: Model<'m>) -> Self {
        Self {
            model,
            kernels: PhantomData,
        }
    }

    /// The model.
    pub fn model(&self) -> &Model<'m> {
        &self.model
    }

    /// Calibrated probabilities of the states.
    ///
    /// `inputs` are in the units and the order of [`Model::input_names`].
    ///
    /// # Errors
    /// [`InferenceError`] for another number of inputs, or one that is not finite.
    pub fn classify(&self, inputs: &[f32]) -> Result<Probabilities, InferenceError> {
        Ok(Probabilities::softmax(
            self.logits(inputs)?,
            self.model.temperature(),
        ))
    }

    /// Logits before the temperature: the sums of the last layer times the scales of its rows.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn logits(&self, inputs: &[f32]) -> Result<[f32; STATES], InferenceError> {
        let [a, b, c, _] = self.sums(inputs)?;
        let [x, y, z, _] = self.model.logit_scales();
        Ok([a as f32 * x, b as f32 * y, c as f32 * z])
    }

    /// Sums of the last layer, the fourth of them padding: all that integer arithmetic gives.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn sums(&self, inputs: &[f32]) -> Result<[i32; 4], InferenceError> {
        let shape = self.model.shape();
        if inputs.len() != shape.inputs() {
            return Err(InferenceError::Count {
                expected: shape.inputs(),
                found: inputs.len(),
            });
        }
        let mut buffers = [[Quad::ZERO; MAX_WIDTH / 4]; 2];
        let [from, to] = &mut buffers;
        let (head, others) = inputs.split_at_checked(shape.head()).unwrap_or((inputs, &[]));
        let mut scales = self.model.input_scales();
        let finite = quantise(head, &mut scales, from)
            // The other inputs join the outputs of the first layer.
            & quantise(others, &mut scales, to.get_mut(shape.groups(0)..).unwrap_or(&mut []));
        if !finite {
            let input = inputs.iter().position(|x| !x.is_finite()).unwrap_or(0);
            return Err(InferenceError::NotFinite { input });
        }
        let (mut from, mut to) = (from, to);
        let mut sums = [0; 4];
        for layer in 0..shape.layers() {
            let input = from.get(..shape.quads(layer)).unwrap_or(&[]);
            sums = K::dense(self.model.layer(layer), input, to);
            swap(&mut from, &mut to);
        }
        Ok(sums)
    }
}

/// Makes int8 of inputs, in order; whether all of them are finite.
fn quantise(inputs: &[f32], scales: &mut impl Iterator<Item = InputScale>, quads: &mut [Quad]) -> bool {
    let mut finite = true;
    for (inputs, quad) in inputs.chunks(4).zip(quads) {
        for ((&x, q), scale) in inputs.iter().zip(&mut quad.0).zip(&mut *scales) {
            finite &= x.is_finite();
            *q = int8(x, scale);
        }
    }
    finite
}

/// `round((x - offset) steps)`, half up, within +-127. The rounding is that of the sum in `f32`: a value within 2^-17 of a
/// half may go either way, the same on every machine.
#[expect(
    clippy::manual_clamp,
    reason = "a NaN, of infinity times zero, is to become the lowest"
)]
fn int8(x: f32, scale: InputScale) -> i16 {
    const LIMIT: f32 = LARGEST as f32;
    let steps = ((x - scale.offset) * scale.steps).max(-LIMIT).min(LIMIT);
    // Positive, so that cutting the fraction off rounds down.
    (steps + (LIMIT + 1.5)) as i16 - (LARGEST as i16 + 1)
}
