//! Runs a model: from features to probabilities.

use core::fmt;
use core::marker::PhantomData;
use core::mem::swap;

use super::format::SCALE;
use super::model::{InputScale, Model};
use super::probability::Probabilities;
use super::shape::{MAX_WIDTH, STATES};
use crate::kernels::dense::Quad;
use crate::kernels::{Kernels, Native};

/// Room for the activations of a network, 512 bytes. Any network, one inference at a time; what is left in it does not
/// matter to the next.
#[derive(Clone, Debug)]
pub struct Activations([[Quad; MAX_WIDTH / 4]; 2]);

impl Activations {
    /// Room for any network.
    pub const fn new() -> Self {
        Self([[Quad::ZERO; MAX_WIDTH / 4]; 2])
    }
}

impl Default for Activations {
    fn default() -> Self {
        Self::new()
    }
}

/// A model and the kernel that it runs on.
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
    pub fn classify(&self, inputs: &[f32], work: &mut Activations) -> Result<Probabilities, InferenceError> {
        // Its paths are all of one state or another.
        let [los, one, several] = self.logits(inputs, work)?;
        let logits = [los, one, several, f32::NEG_INFINITY];
        Ok(Probabilities::softmax(logits, self.model.temperature()))
    }

    /// Logits before the temperature: the sums of the last layer times the scales of its rows.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn logits(&self, inputs: &[f32], work: &mut Activations) -> Result<[f32; STATES], InferenceError> {
        let [a, b, c, _] = self.sums(inputs, work)?;
        let [x, y, z, _] = self.model.logit_scales();
        Ok([a as f32 * x, b as f32 * y, c as f32 * z])
    }

    /// Sums of the last layer, the fourth of them padding: all that integer arithmetic gives.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn sums(&self, inputs: &[f32], work: &mut Activations) -> Result<[i32; 4], InferenceError> {
        self.sums_observed(inputs, work, || ())
    }

    /// As [`Self::sums`]; calls `step_done` when the inputs are rounded and after every layer, for those who count what a
    /// step costs.
    ///
    /// # Errors
    /// As [`Self::classify`].
    pub fn sums_observed(
        &self,
        inputs: &[f32],
        work: &mut Activations,
        mut step_done: impl FnMut(),
    ) -> Result<[i32; 4], InferenceError> {
        let shape = self.model.shape();
        if inputs.len() != shape.inputs() {
            return Err(InferenceError::Count {
                expected: shape.inputs(),
                found: inputs.len(),
            });
        }
        let [from, to] = &mut work.0;
        let (head, others) = inputs.split_at_checked(shape.head()).unwrap_or((inputs, &[]));
        let (head_scales, other_scales) = self
            .model
            .scales()
            .split_at_checked(head.len())
            .unwrap_or_default();
        let finite = quantise(head, head_scales, from)
            // The other inputs join the outputs of the first layer.
            & quantise(others, other_scales, to.get_mut(shape.groups(0)..).unwrap_or(&mut []));
        if !finite {
            let input = inputs.iter().position(|x| !x.is_finite()).unwrap_or(0);
            return Err(InferenceError::NotFinite { input });
        }
        step_done();
        let (mut from, mut to) = (from, to);
        let mut sums = [0; 4];
        for layer in 0..shape.layers() {
            let input = from.get(..shape.quads(layer)).unwrap_or(&[]);
            sums = K::dense(self.model.layer(layer), input, to);
            swap(&mut from, &mut to);
            step_done();
        }
        Ok(sums)
    }
}

/// Makes int8 of inputs, in order; whether all of them are finite.
fn quantise(inputs: &[f32], scales: &[[u8; SCALE]], quads: &mut [Quad]) -> bool {
    // Stays 0 as long as all are finite: zero times infinity is no number.
    let mut fault = 0.0;
    let mut each = |x: f32, scale: &[u8; SCALE], q: &mut i16| {
        fault += x * 0.0;
        *q = InputScale::from_bytes(scale).quantised(x);
    };
    let ((inputs, last_inputs), (scales, last_scales)) = (inputs.as_chunks::<4>(), scales.as_chunks::<4>());
    let (quads, last_quad) = quads.split_at_mut_checked(inputs.len()).unwrap_or_default();
    for ((x, scale), quad) in inputs.iter().zip(scales).zip(quads) {
        for ((&x, scale), q) in x.iter().zip(scale).zip(&mut quad.0) {
            each(x, scale, q);
        }
    }
    if let (Some(quad), false) = (last_quad.first_mut(), last_inputs.is_empty()) {
        *quad = Quad::ZERO;
        for ((&x, scale), q) in last_inputs.iter().zip(last_scales).zip(&mut quad.0) {
            each(x, scale, q);
        }
    }
    fault == 0.0
}
