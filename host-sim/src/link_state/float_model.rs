//! A trained network in f32, as the trainer leaves it and as quantisation takes it.
//!
//! ```text
//! geometric   n inputs -> dense + ReLU -> ... -> dense -> 3 logits, one path at a time
//! paper       3K inputs; the first three -> F1 (dense + ReLU); [F1's outputs, the other 3K - 3 inputs]
//!                        -> dense + ReLU -> ... -> dense -> 3 logits, one link at a time
//! ```
//!
//! Logits stand for line of sight, first order and higher order. Inputs are normalised to -1..=1 by
//! `(x - offset) * scale` and clamped there; probabilities are the softmax of `logits / temperature`.

/// Link states that the network tells apart: line of sight, first order, higher order.
pub const STATES: usize = 3;

/// Inputs of each path of the paper's network: c tau, zenith, azimuth.
pub const PAPER_INPUTS_PER_PATH: usize = 3;

/// Greatest number of paths that the paper's network takes.
pub const MAX_K: usize = 15;

/// What the network looks at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The paper's: the K strongest paths of a link.
    Paper {
        /// Number of paths, 1 to [`MAX_K`].
        k: usize,
    },
    /// Geometric features of one path.
    Geometric,
}

/// A dense layer `y = W x + b`.
#[derive(Clone, Debug, PartialEq)]
pub struct Layer {
    /// Number of inputs.
    pub inputs: usize,
    /// W, row by row: the weights of an output lie together.
    pub weight: Vec<f32>,
    /// b, one for each output.
    pub bias: Vec<f32>,
}

impl Layer {
    /// Number of outputs.
    pub fn outputs(&self) -> usize {
        self.bias.len()
    }

    /// `W x + b`.
    pub fn apply(&self, x: &[f32]) -> Vec<f32> {
        let rows = self.weight.chunks_exact(self.inputs);
        rows.zip(&self.bias)
            .map(|(row, bias)| row.iter().zip(x).fold(*bias, |sum, (w, x)| sum + w * x))
            .collect()
    }
}

/// A float network with all that is needed to use it. Its shapes fit each other.
#[derive(Clone, Debug, PartialEq)]
pub struct FloatModel {
    kind: Kind,
    inputs: Vec<String>,
    input_offset: Vec<f32>,
    input_scale: Vec<f32>,
    temperature: f32,
    layers: Vec<Layer>,
}

impl FloatModel {
    /// A network of its parts.
    ///
    /// # Errors
    /// What does not fit, in words.
    pub fn new(
        kind: Kind,
        inputs: Vec<String>,
        input_offset: Vec<f32>,
        input_scale: Vec<f32>,
        temperature: f32,
        layers: Vec<Layer>,
    ) -> Result<Self, String> {
        let n = inputs.len();
        if input_offset.len() != n || input_scale.len() != n {
            return Err(format!(
                "expected {n} input offsets and scales, one for each of inputs, not {} and {}",
                input_offset.len(),
                input_scale.len()
            ));
        }
        if !(temperature.is_finite() && temperature > 0.0) {
            return Err(format!("temperature must be above 0, not {temperature}"));
        }
        let mut width = n;
        if let Kind::Paper { k } = kind {
            if !(1..=MAX_K).contains(&k) || n != PAPER_INPUTS_PER_PATH * k {
                return Err(format!(
                    "expected 3 k inputs with k from 1 to {MAX_K}, not {n} with k = {k}"
                ));
            }
            width = PAPER_INPUTS_PER_PATH;
        }
        if layers.is_empty() {
            return Err("expected at least one layer".into());
        }
        for (index, layer) in layers.iter().enumerate() {
            let name = index + 1;
            if layer.inputs != width || layer.weight.len() != width * layer.outputs() || layer.bias.is_empty()
            {
                return Err(format!(
                    "f{name}.weight: expected {} x {width} values, not {} with {} inputs",
                    layer.outputs(),
                    layer.weight.len(),
                    layer.inputs
                ));
            }
            width = layer.outputs();
            if index == 0 && matches!(kind, Kind::Paper { .. }) {
                width += n - PAPER_INPUTS_PER_PATH;
            }
        }
        if width != STATES {
            return Err(format!(
                "expected {STATES} outputs of the last layer, not {width}"
            ));
        }
        let weights = layers.iter().flat_map(|l| l.weight.iter().chain(&l.bias));
        let mut all = weights.chain(&input_offset).chain(&input_scale);
        if !all.all(|x| x.is_finite()) {
            return Err("a weight, bias, offset or scale is not finite".into());
        }
        Ok(Self {
            kind,
            inputs,
            input_offset,
            input_scale,
            temperature,
            layers,
        })
    }

    /// What the network looks at.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Names of the inputs, in order.
    pub fn inputs(&self) -> &[String] {
        &self.inputs
    }

    /// Value of each input that is normalised to 0.
    pub fn input_offset(&self) -> &[f32] {
        &self.input_offset
    }

    /// Factor of each input after the offset.
    pub fn input_scale(&self) -> &[f32] {
        &self.input_scale
    }

    /// What logits are divided by before the softmax.
    pub fn temperature(&self) -> f32 {
        self.temperature
    }

    /// Dense layers, the first one first.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The same network with another temperature.
    ///
    /// # Errors
    /// When it is not above 0, in words.
    pub fn with_temperature(mut self, temperature: f32) -> Result<Self, String> {
        if !(temperature.is_finite() && temperature > 0.0) {
            return Err(format!("temperature must be above 0, not {temperature}"));
        }
        self.temperature = temperature;
        Ok(self)
    }

    /// Inputs normalised and clamped to -1..=1. A missing or surplus value is left out.
    pub fn normalised(&self, inputs: &[f32]) -> Vec<f32> {
        let norm = self.input_offset.iter().zip(&self.input_scale);
        inputs
            .iter()
            .zip(norm)
            .map(|(x, (offset, scale))| ((x - offset) * scale).clamp(-1.0, 1.0))
            .collect()
    }

    /// What flows into each layer, and the logits last: element `i` is the input vector of layer `i`. `inputs` as the
    /// features come, not normalised.
    pub fn activations(&self, inputs: &[f32]) -> Vec<Vec<f32>> {
        let mut x = self.normalised(inputs);
        let mut aside = Vec::new();
        if matches!(self.kind, Kind::Paper { .. }) {
            aside = x.split_off(PAPER_INPUTS_PER_PATH.min(x.len()));
        }
        let mut flow = Vec::with_capacity(self.layers.len() + 1);
        for (index, layer) in self.layers.iter().enumerate() {
            let mut y = layer.apply(&x);
            if index + 1 < self.layers.len() {
                y.iter_mut().for_each(|y| *y = y.max(0.0));
            }
            y.append(&mut aside);
            flow.push(std::mem::replace(&mut x, y));
        }
        flow.push(x);
        flow
    }

    /// Logits of inputs as the features come.
    pub fn logits(&self, inputs: &[f32]) -> [f32; STATES] {
        let last = self.activations(inputs).pop().unwrap_or_default();
        std::array::from_fn(|i| last.get(i).copied().unwrap_or(0.0))
    }

    /// Calibrated probabilities of inputs as the features come.
    pub fn probabilities(&self, inputs: &[f32]) -> [f32; STATES] {
        softmax(self.logits(inputs), self.temperature)
    }
}

/// `softmax(logits / temperature)`, by `libm` so that it is the same on every machine.
pub fn softmax(logits: [f32; STATES], temperature: f32) -> [f32; STATES] {
    let most = logits[0].max(logits[1]).max(logits[2]);
    let powers = logits.map(|l| libm::expf((l - most) / temperature));
    let sum = powers[0] + powers[1] + powers[2];
    powers.map(|p| p / sum)
}

/// Models for tests: small, every value different.
#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub(in crate::link_state) fn layer(inputs: usize, outputs: usize, seed: u32) -> Layer {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 8) as f32 / 16_777_216.0 - 0.5
        };
        Layer {
            inputs,
            weight: (0..inputs * outputs).map(|_| next()).collect(),
            bias: (0..outputs).map(|_| next()).collect(),
        }
    }

    pub(in crate::link_state) fn paper(k: usize) -> FloatModel {
        let n = 3 * k;
        FloatModel::new(
            Kind::Paper { k },
            (0..n).map(|i| format!("x{i}")).collect(),
            (0..n).map(|i| i as f32).collect(),
            vec![0.25; n],
            1.5,
            vec![layer(3, 4, 1), layer(4 + n - 3, 5, 2), layer(5, 3, 3)],
        )
        .expect("fits")
    }

    pub(in crate::link_state) fn geometric() -> FloatModel {
        let names = vec!["excess".into(), "angle".into()];
        let layers = vec![layer(2, 4, 7), layer(4, 3, 8)];
        FloatModel::new(Kind::Geometric, names, vec![0.0; 2], vec![1.0; 2], 0.8, layers).expect("fits")
    }

    #[test]
    fn the_first_path_goes_through_f1_and_the_others_around_it() {
        let model = paper(2);
        let inputs = [0.3, 1.2, 1.9, 3.1, 3.7, 5.2];
        let x: Vec<f32> = inputs
            .iter()
            .enumerate()
            .map(|(i, x)| (x - i as f32) * 0.25)
            .collect();
        let mut first: Vec<f32> = model.layers()[0]
            .apply(&x[..3])
            .iter()
            .map(|y| y.max(0.0))
            .collect();
        first.extend_from_slice(&x[3..]);
        let hidden: Vec<f32> = model.layers()[1]
            .apply(&first)
            .iter()
            .map(|y| y.max(0.0))
            .collect();
        assert_eq!(model.logits(&inputs).to_vec(), model.layers()[2].apply(&hidden));
        assert_eq!(model.activations(&inputs)[1], first);
    }

    #[test]
    fn inputs_beyond_their_range_are_clamped() {
        let model = geometric();
        assert_eq!(model.logits(&[9.0, -1e30]), model.logits(&[1.0, -1.0]));
    }

    #[test]
    fn a_dense_layer_is_a_matrix_product() {
        let layer = Layer {
            inputs: 2,
            weight: vec![1.0, 2.0, 3.0, 4.0, -5.0, 6.0],
            bias: vec![0.5, 0.0, 1.0],
        };
        assert_eq!(layer.apply(&[10.0, 100.0]), [210.5, 430.0, 551.0]);
    }

    #[test]
    fn softmax_is_a_distribution_that_temperature_flattens() {
        let p = softmax([1000.0, 999.0, -1000.0], 1.0);
        assert!((p[0] - 0.731_058_6).abs() < 1e-6 && p[2] == 0.0);
        let q = softmax([2.0, 1.0, 0.0], 1e6);
        assert!(q.iter().all(|q| (q - 1.0 / 3.0).abs() < 1e-5));
    }

    #[test]
    fn shapes_that_do_not_fit_are_named() {
        let with = |layers| {
            FloatModel::new(
                Kind::Geometric,
                vec!["a".into(), "b".into()],
                vec![0.0; 2],
                vec![1.0; 2],
                1.0,
                layers,
            )
        };
        let message = with(vec![layer(2, 4, 1), layer(5, 3, 1)]).expect_err("4 into 5");
        assert!(message.contains("f2.weight: expected 3 x 4"), "{message}");
        let message = with(vec![layer(2, 4, 1)]).expect_err("four outputs");
        assert!(message.contains("3 outputs"), "{message}");
        assert!(with(vec![]).is_err());
        let mut bad = layer(2, 3, 1);
        bad.bias[1] = f32::NAN;
        assert!(with(vec![bad]).expect_err("NaN").contains("not finite"));
    }
}
