//! Forward and backward pass over a few samples at a time, in plain f32 loops.
//!
//! Every sum runs in one fixed order and no operation is fused, so a gradient has the same bits on every machine. Inner
//! loops run along a row and vectorise without reordering anything.

use crate::link_state::float_model::{FloatModel, Kind, Layer, PAPER_INPUTS_PER_PATH, STATES};

/// Samples of a gradient that is computed in one go.
pub(super) const SUB_BATCH: usize = 125;

/// Shape of one dense layer and where its parameters lie.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Dense {
    inputs: usize,
    outputs: usize,
    /// Inputs that come from the layer before, the others from aside.
    from_before: usize,
    /// Weights row by row, then biases.
    begin: usize,
}

impl Dense {
    fn weights(&self) -> std::ops::Range<usize> {
        self.begin..self.begin + self.inputs * self.outputs
    }

    fn biases(&self) -> std::ops::Range<usize> {
        let end = self.weights().end;
        end..end + self.outputs
    }
}

/// A network whose parameters are one vector.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Network {
    inputs: usize,
    /// Inputs that the first layer sees.
    head: usize,
    layers: Vec<Dense>,
    pub(super) parameters: Vec<f32>,
}

/// What a pass needs to remember.
#[derive(Clone, Debug)]
pub(super) struct Workspace {
    /// Inputs of each layer, sample by sample, and the logits last.
    flow: Vec<Vec<f32>>,
    delta: Vec<f32>,
    delta_before: Vec<f32>,
    pub(super) gradient: Vec<f32>,
    /// Sum of weighted losses.
    pub(super) loss: f64,
    /// Sum of weights.
    pub(super) weight: f32,
    pub(super) right: usize,
}

impl Network {
    /// A network with all parameters 0: `hidden` widths, and [`STATES`] outputs.
    pub(super) fn new(kind: Kind, inputs: usize, hidden: &[usize]) -> Self {
        let head = match kind {
            Kind::Paper { .. } => PAPER_INPUTS_PER_PATH,
            Kind::Geometric => inputs,
        };
        let mut layers = Vec::new();
        let (mut from_before, mut width, mut begin) = (head, head, 0);
        for (index, &outputs) in hidden.iter().chain(&[STATES]).enumerate() {
            let layer = Dense {
                inputs: width,
                outputs,
                from_before,
                begin,
            };
            begin = layer.biases().end;
            from_before = outputs;
            width = outputs + if index == 0 { inputs - head } else { 0 };
            layers.push(layer);
        }
        Self {
            inputs,
            head,
            layers,
            parameters: vec![0.0; begin],
        }
    }

    /// The network of a float model. Its inputs are the model's, normalised.
    pub(crate) fn of(model: &FloatModel) -> Self {
        let widths: Vec<usize> = model.layers().iter().map(Layer::outputs).collect();
        let hidden = &widths[..widths.len() - 1];
        let mut network = Self::new(model.kind(), model.inputs().len(), hidden);
        let layers = network.layers.clone();
        for (dense, layer) in layers.iter().zip(model.layers()) {
            network.parameters[dense.weights()].copy_from_slice(&layer.weight);
            network.parameters[dense.biases()].copy_from_slice(&layer.bias);
        }
        network
    }

    /// Layers as a float model has them.
    pub(super) fn layers(&self) -> Vec<Layer> {
        let layer = |dense: &Dense| Layer {
            inputs: dense.inputs,
            weight: self.parameters[dense.weights()].to_vec(),
            bias: self.parameters[dense.biases()].to_vec(),
        };
        self.layers.iter().map(layer).collect()
    }

    /// Draws weights from a uniform distribution of variance 2 / inputs (He et al.); biases are 0.
    pub(super) fn initialise(&mut self, mut uniform: impl FnMut() -> f64) {
        for layer in self.layers.clone() {
            let bound = (6.0 / layer.inputs as f64).sqrt();
            for weight in &mut self.parameters[layer.weights()] {
                *weight = (bound * (2.0 * uniform() - 1.0)) as f32;
            }
        }
    }

    /// Weights column by column, layer by layer: what the forward pass runs along.
    pub(super) fn transposed(&self) -> Vec<Vec<f32>> {
        let transpose = |layer: &Dense| {
            let weights = &self.parameters[layer.weights()];
            let mut columns = vec![0.0; weights.len()];
            for (o, row) in weights.chunks_exact(layer.inputs).enumerate() {
                for (i, w) in row.iter().enumerate() {
                    columns[i * layer.outputs + o] = *w;
                }
            }
            columns
        };
        self.layers.iter().map(transpose).collect()
    }

    pub(super) fn workspace(&self) -> Workspace {
        let mut flow: Vec<Vec<f32>> = self
            .layers
            .iter()
            .map(|l| vec![0.0; SUB_BATCH * l.inputs])
            .collect();
        flow.push(vec![0.0; SUB_BATCH * STATES]);
        let widest = self
            .layers
            .iter()
            .map(|l| l.inputs.max(l.outputs))
            .max()
            .unwrap_or(0);
        Workspace {
            flow,
            delta: vec![0.0; SUB_BATCH * widest],
            delta_before: vec![0.0; SUB_BATCH * widest],
            gradient: vec![0.0; self.parameters.len()],
            loss: 0.0,
            weight: 0.0,
            right: 0,
        }
    }

    /// Logits of up to [`SUB_BATCH`] samples, sample by sample. `rows` are normalised inputs.
    pub(super) fn forward<'w>(
        &self,
        transposed: &[Vec<f32>],
        rows: &[f32],
        workspace: &'w mut Workspace,
    ) -> &'w [f32] {
        let samples = rows.len() / self.inputs;
        let (head, aside) = (self.head, self.inputs - self.head);
        for (sample, row) in rows.chunks_exact(self.inputs).enumerate() {
            workspace.flow[0][sample * head..][..head].copy_from_slice(&row[..head]);
            if aside > 0 {
                let layer = &self.layers[1];
                let place = sample * layer.inputs + layer.from_before;
                workspace.flow[1][place..][..aside].copy_from_slice(&row[head..]);
            }
        }
        for (index, layer) in self.layers.iter().enumerate() {
            let (before, after) = workspace.flow.split_at_mut(index + 1);
            let next = self.layers.get(index + 1);
            let stride = next.map_or(STATES, |next| next.inputs);
            let bias = &self.parameters[layer.biases()];
            let columns = &transposed[index];
            for sample in 0..samples {
                let x = &before[index][sample * layer.inputs..][..layer.inputs];
                let y = &mut after[0][sample * stride..][..layer.outputs];
                y.copy_from_slice(bias);
                for (x, column) in x.iter().zip(columns.chunks_exact(layer.outputs)) {
                    add_scaled(y, column, *x);
                }
                if next.is_some() {
                    y.iter_mut().for_each(|y| *y = if *y > 0.0 { *y } else { 0.0 });
                }
            }
        }
        &workspace.flow[self.layers.len()][..samples * STATES]
    }

    /// Weighted sum over the samples of the cross entropy's gradient, into the workspace, with the losses, the weights and
    /// the right answers.
    pub(super) fn backward(
        &self,
        transposed: &[Vec<f32>],
        rows: &[f32],
        states: &[u8],
        weights: &[f32],
        workspace: &mut Workspace,
    ) {
        self.forward(transposed, rows, workspace);
        let Workspace {
            flow,
            delta,
            delta_before,
            gradient,
            loss,
            weight,
            right,
        } = workspace;
        gradient.fill(0.0);
        (*loss, *weight, *right) = (0.0, 0.0, 0);
        let logits = &flow[self.layers.len()];
        for (sample, (&state, &counts)) in states.iter().zip(weights).enumerate() {
            let logits = &logits[sample * STATES..][..STATES];
            let most = logits.iter().fold(f32::NEG_INFINITY, |m, l| m.max(*l));
            let powers: [f32; STATES] = std::array::from_fn(|i| libm::expf(logits[i] - most));
            let sum = powers[0] + powers[1] + powers[2];
            let state = usize::from(state);
            for (i, power) in powers.iter().enumerate() {
                let target = if i == state { 1.0 } else { 0.0 };
                delta[sample * STATES + i] = counts * (power / sum - target);
            }
            *loss += f64::from(counts) * f64::from(libm::logf(sum) - (logits[state] - most));
            *weight += counts;
            *right += usize::from(logits[state] >= most);
        }
        for (index, layer) in self.layers.iter().enumerate().rev() {
            let (of_weights, rest) = gradient[layer.begin..].split_at_mut(layer.inputs * layer.outputs);
            let of_biases = &mut rest[..layer.outputs];
            let weights = &self.parameters[layer.weights()];
            let wanted = layer.from_before;
            for sample in 0..states.len() {
                let x = &flow[index][sample * layer.inputs..][..layer.inputs];
                let d = &delta[sample * layer.outputs..][..layer.outputs];
                let before = &mut delta_before[sample * wanted..][..wanted];
                before.fill(0.0);
                for (o, d) in d.iter().enumerate().filter(|(_, d)| **d != 0.0) {
                    of_biases[o] += d;
                    add_scaled(&mut of_weights[o * layer.inputs..][..layer.inputs], x, *d);
                    if index > 0 {
                        add_scaled(before, &weights[o * layer.inputs..][..wanted], *d);
                    }
                }
                // Where the rectifier cut, nothing comes through.
                for (before, x) in before.iter_mut().zip(x) {
                    if *x <= 0.0 {
                        *before = 0.0;
                    }
                }
            }
            std::mem::swap(delta, delta_before);
        }
    }
}

#[inline]
fn add_scaled(sum: &mut [f32], x: &[f32], factor: f32) {
    for (sum, x) in sum.iter_mut().zip(x) {
        *sum += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Stream;

    fn problem(kind: Kind, inputs: usize, hidden: &[usize]) -> (Network, Vec<f32>, Vec<u8>) {
        let mut stream = Stream::new(11, 0);
        let mut network = Network::new(kind, inputs, hidden);
        network.initialise(|| stream.uniform());
        // Biases away from 0, so that their part shows.
        network
            .parameters
            .iter_mut()
            .for_each(|p| *p += 0.05 * stream.normal() as f32);
        let rows = (0..20 * inputs)
            .map(|_| (2.0 * stream.uniform() - 1.0) as f32)
            .collect();
        let states = (0..20).map(|i| (i % 3) as u8).collect();
        (network, rows, states)
    }

    /// The sum of losses in f64, straight from the definition: fine enough for steps within which no rectifier switches.
    fn loss(network: &Network, parameters: &[f64], rows: &[f32], states: &[u8], weights: &[f32]) -> f64 {
        let one = |(row, (state, weight)): (&[f32], (&u8, &f32))| {
            let row: Vec<f64> = row.iter().map(|x| f64::from(*x)).collect();
            let (head, aside) = row.split_at(network.head);
            let mut x = head.to_vec();
            for (index, layer) in network.layers.iter().enumerate() {
                let output = |o: usize| {
                    let weights = &parameters[layer.begin + o * layer.inputs..][..layer.inputs];
                    let bias = parameters[layer.biases().start + o];
                    weights.iter().zip(&x).map(|(w, x)| w * x).sum::<f64>() + bias
                };
                let mut y: Vec<f64> = (0..layer.outputs).map(output).collect();
                if index + 1 < network.layers.len() {
                    y.iter_mut().for_each(|y| *y = y.max(0.0));
                }
                if index == 0 {
                    y.extend_from_slice(aside);
                }
                x = y;
            }
            f64::from(*weight) * (x.iter().map(|l| l.exp()).sum::<f64>().ln() - x[usize::from(*state)])
        };
        let samples = states.iter().zip(weights);
        rows.chunks_exact(network.inputs).zip(samples).map(one).sum()
    }

    #[test]
    fn gradients_are_finite_differences() {
        for (kind, inputs, hidden) in [
            (Kind::Geometric, 7, vec![6, 5]),
            (Kind::Paper { k: 3 }, 9, vec![4, 6, 5]),
            (Kind::Paper { k: 1 }, 3, vec![4, 6]),
        ] {
            let (network, rows, states) = problem(kind, inputs, &hidden);
            let mut workspace = network.workspace();
            let weights: Vec<f32> = (0..states.len()).map(|i| [1.0, 8.0][i % 2]).collect();
            network.backward(&network.transposed(), &rows, &states, &weights, &mut workspace);
            assert_eq!(workspace.weight, weights.iter().sum::<f32>());
            let parameters: Vec<f64> = network.parameters.iter().map(|p| f64::from(*p)).collect();
            let at_rest = loss(&network, &parameters, &rows, &states, &weights);
            assert!((workspace.loss - at_rest).abs() < 1e-4 * at_rest);
            let step = 1e-6;
            for (place, gradient) in workspace.gradient.iter().enumerate() {
                let at = |shift: f64| {
                    let mut moved = parameters.clone();
                    moved[place] += shift;
                    loss(&network, &moved, &rows, &states, &weights)
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                assert!(
                    (difference - f64::from(*gradient)).abs() < 1e-4 * (1.0 + difference.abs()),
                    "{kind:?}, parameter {place}: {difference} against {gradient}"
                );
            }
        }
    }

    #[test]
    fn the_forward_pass_is_the_float_models() {
        let (network, rows, _) = problem(Kind::Paper { k: 3 }, 9, &[4, 6, 5]);
        let names = (0..9).map(|i| format!("x{i}")).collect();
        let model = FloatModel::new(
            Kind::Paper { k: 3 },
            names,
            vec![0.0; 9],
            vec![1.0; 9],
            1.0,
            network.layers(),
        )
        .expect("fits");
        assert_eq!(Network::of(&model), network);
        let mut workspace = network.workspace();
        let logits = network.forward(&network.transposed(), &rows, &mut workspace);
        for (row, logits) in rows.chunks_exact(9).zip(logits.chunks_exact(3)) {
            let expected = model.logits(row);
            assert!(
                logits.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-5),
                "{logits:?} {expected:?}"
            );
        }
    }
}
