//! From a float network to the integers that fly.
//!
//! Weights are int8 with a scale for each output, activations int8 with a scale for each of them, sums i32. The scale of
//! an activation is folded into the weights that it meets, so that a row's weights are rounded where they matter: as
//! contributions to the sum. With `a` the value of one step of an activation, `s` that of one step of an output,
//! `t = max |W a| / 127` the value of one step of a row's sum:
//!
//! ```text
//! weight = round(W a / t), bias = round(b / t), multiplier = round(t / s 2^32), logit scale = t
//! ```
//! `a` of an input is 1/127 of its normalised range; of a hidden unit, 1/127 of its largest value over the calibration
//! samples. All roundings are half up. What the flight code does with the result is said in `cslam_core::link_state` and
//! docs/link-state.md.

mod integer;
mod report;

use cslam_core::link_state::format::MAX_BIAS;
use cslam_core::link_state::{self, Description, InputScale, Outputs, Rows, Shape};

use super::float_model::{FloatModel, Kind};
use super::model_file::ModelFile;

pub use report::{LayerNoise, Report, report};

/// Largest magnitude of an int8 weight, input or activation.
const LARGEST: f64 = 127.0;

/// A unit that hardly fires over the calibration samples keeps this share of the layer's largest range, in case it does.
const LEAST_RANGE: f64 = 1.0 / 16.0;

/// A network in integers.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantised {
    shape: Shape,
    names: String,
    temperature: f32,
    inputs: Vec<InputScale>,
    layers: Vec<Layer>,
}

/// A dense layer in integers.
#[derive(Clone, Debug, PartialEq)]
struct Layer {
    columns: usize,
    weights: Vec<i8>,
    biases: Vec<i32>,
    /// Of a hidden layer.
    multipliers: Vec<i32>,
    /// Value of one step of each row's sum.
    sum_steps: Vec<f64>,
    /// Value of one step of each output of a hidden layer.
    output_steps: Vec<f64>,
}

impl Quantised {
    /// Quantises a network, given the largest value of every hidden unit: see [`largest_activations`].
    ///
    /// # Errors
    /// What the flight code cannot take, in words.
    pub fn new(model: &FloatModel, largest: &[Vec<f32>]) -> Result<Self, String> {
        let outputs: Vec<usize> = model.layers().iter().map(|layer| layer.outputs()).collect();
        let kind = match model.kind() {
            Kind::Paper { .. } => link_state::Kind::Paper,
            Kind::Geometric => link_state::Kind::Geometric,
        };
        let inputs = model.inputs().len();
        let shape = Shape::new(kind, inputs, &outputs).ok_or_else(|| {
            format!("layers of {outputs:?} outputs over {inputs} inputs are more than the flight code takes")
        })?;
        let input_step = 1.0 / LARGEST;
        let mut steps = vec![input_step; shape.head()];
        let mut layers = Vec::new();
        for (index, float) in model.layers().iter().enumerate() {
            let ranges = largest.get(index).map(Vec::as_slice);
            let ranges = if index + 1 < outputs.len() {
                ranges.filter(|r| r.len() == float.outputs())
            } else {
                Some([].as_slice())
            };
            let ranges = ranges.ok_or_else(|| format!("no ranges for the outputs of layer {}", index + 1))?;
            let layer = Layer::new(float, &steps, ranges)
                .map_err(|message| format!("f{}.weight: {message}", index + 1))?;
            steps = layer.output_steps.clone();
            if index == 0 {
                steps.extend(std::iter::repeat_n(input_step, inputs - shape.head()));
            }
            layers.push(layer);
        }
        Ok(Self {
            shape,
            names: model.inputs().join(","),
            temperature: model.temperature(),
            inputs: model
                .input_offset()
                .iter()
                .zip(model.input_scale())
                .map(|(&offset, scale)| InputScale {
                    offset,
                    steps: scale * LARGEST as f32,
                })
                .collect(),
            layers,
        })
    }

    /// The model file.
    ///
    /// # Errors
    /// What the flight code's reader would refuse, in words.
    pub fn to_file(&self) -> Result<ModelFile, String> {
        let scales: Vec<Vec<f32>> = self
            .layers
            .iter()
            .map(|layer| layer.sum_steps.iter().map(|&t| t as f32).collect())
            .collect();
        let last = self.layers.len() - 1;
        let rows: Vec<Rows<'_>> = self
            .layers
            .iter()
            .zip(&scales)
            .enumerate()
            .map(|(index, (layer, scales))| Rows {
                weights: &layer.weights,
                biases: &layer.biases,
                outputs: if index == last {
                    Outputs::Logits(scales)
                } else {
                    Outputs::Requantised(&layer.multipliers)
                },
            })
            .collect();
        let description = Description {
            shape: self.shape,
            temperature: self.temperature,
            names: &self.names,
            inputs: &self.inputs,
            layers: &rows,
        };
        ModelFile::of(&description).map_err(|error| error.to_string())
    }
}

impl Layer {
    /// Quantises a layer whose inputs have these steps and whose outputs reach these ranges (none for the last layer).
    fn new(float: &super::float_model::Layer, steps: &[f64], ranges: &[f32]) -> Result<Self, String> {
        let widest = ranges.iter().fold(0.0_f64, |m, &r| m.max(f64::from(r)));
        let mut layer = Self {
            columns: float.inputs,
            weights: Vec::with_capacity(float.weight.len()),
            biases: Vec::new(),
            multipliers: Vec::new(),
            sum_steps: Vec::new(),
            output_steps: Vec::new(),
        };
        for (row, &bias) in float.weight.chunks_exact(float.inputs).zip(&float.bias) {
            let folded: Vec<f64> = row.iter().zip(steps).map(|(&w, a)| f64::from(w) * a).collect();
            let most = folded.iter().fold(0.0_f64, |m, w| m.max(w.abs()));
            // A row of zeros, or under a bias that would not fit: its steps may be as coarse as the bias asks for.
            let least = f64::from(bias).abs() / f64::from(MAX_BIAS);
            let step = (most / LARGEST).max(2.0 * least).max(f64::MIN_POSITIVE * 1e20);
            layer
                .weights
                .extend(folded.iter().map(|w| rounded(w / step) as i8));
            layer.biases.push(rounded(f64::from(bias) / step) as i32);
            layer.sum_steps.push(step);
        }
        for (&range, step) in ranges.iter().zip(&layer.sum_steps) {
            let range = f64::from(range).max(LEAST_RANGE * widest);
            // Outputs are not finer than two steps of the sum: multipliers stay under 2^31.
            let output = (range / LARGEST).max(2.0 * step * (1.0 + 1e-9));
            layer.output_steps.push(output);
            let multiplier = rounded(step / output * 4_294_967_296.0);
            layer.multipliers.push(multiplier.min(f64::from(i32::MAX)) as i32);
        }
        let sound = layer.sum_steps.iter().all(|t| (*t as f32).is_finite());
        sound
            .then_some(layer)
            .ok_or_else(|| "the weights are too large".into())
    }
}

/// Rounded half up.
fn rounded(x: f64) -> f64 {
    (x + 0.5).floor()
}

/// Largest value of each unit of each hidden layer over rows of inputs as the features come.
pub fn largest_activations<'a>(
    model: &FloatModel,
    rows: impl IntoIterator<Item = &'a [f32]>,
) -> Vec<Vec<f32>> {
    let hidden = model.layers().len() - 1;
    let mut largest: Vec<Vec<f32>> = model.layers()[..hidden]
        .iter()
        .map(|layer| vec![0.0; layer.outputs()])
        .collect();
    for row in rows {
        // Element i + 1 begins with the outputs of layer i.
        for (most, values) in largest.iter_mut().zip(model.activations(row).iter().skip(1)) {
            for (most, value) in most.iter_mut().zip(values) {
                *most = most.max(*value);
            }
        }
    }
    largest
}

#[cfg(test)]
mod tests;
