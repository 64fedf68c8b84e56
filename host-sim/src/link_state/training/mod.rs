//! The trainer: Adam on the cross entropy, small, and the same bits on every machine.
//!
//! A batch of 1000 is eight sub-batches of 125 whose gradients are computed on any threads and added in a fixed order. All
//! functions are `libm`'s, all random numbers ChaCha8's, so the weights depend on the samples, the settings and the seed
//! only. Training stops when the validation loss has not fallen for some epochs; the weights of the best epoch are kept.

mod network;

pub(crate) use network::Network;

use network::{SUB_BATCH, Workspace};
use rayon::prelude::*;
use serde::Serialize;

use super::float_model::{FloatModel, STATES};
use super::samples::{Samples, Task};
use crate::random::Stream;

/// Samples of a batch.
pub const BATCH: usize = 1000;

/// Hidden layers of the paper's network; the first one sees the strongest path alone.
pub const PAPER_HIDDEN: [usize; 3] = [10, 50, 100];

/// Hidden layers of the geometric networks: nine paths within the receiver's budget.
pub const GEOMETRIC_HIDDEN: [usize; 2] = [48, 32];

/// How much more the strongest path of a link counts than another one, in the geometric networks. It decides the state of the
/// link, but there are four others for each, most of them more easily mistaken, and a network of this size learns what it is
/// asked most. A weight that depends on an input, the rank, leaves the probabilities that training aims at as they are.
pub const STRONGEST_WEIGHT: f32 = 4.0;

/// Share of training samples that may lie beyond the range of an input of the geometric networks, at either end: a few
/// outliers would spread the steps of int8, and the network's attention, over lengths that hardly occur.
pub const BEYOND_RANGE: f64 = 1e-3;

/// How to train.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Widths of the hidden layers.
    pub hidden: Vec<usize>,
    /// Most epochs.
    pub epochs: usize,
    /// Epochs without a lower validation loss before training ends.
    pub patience: usize,
    /// Adam's step size at the start.
    pub learning_rate: f32,
    /// Whether the step size falls to 0 along half a cosine over the epochs; constant otherwise.
    pub cosine: bool,
    /// Weight of the samples that stand for their links; the others have 1.
    pub strongest_weight: f32,
    /// Share of samples beyond the range of an input at either end; they are taken to its end.
    pub beyond_range: f64,
    /// Seed of initial weights and of the order of samples.
    pub seed: u64,
}

impl Settings {
    /// The paper's for its network, ours for the geometric ones.
    pub fn of(task: Task) -> Self {
        let paper = matches!(task, Task::Paper { .. });
        Self {
            hidden: if paper {
                PAPER_HIDDEN.to_vec()
            } else {
                GEOMETRIC_HIDDEN.to_vec()
            },
            epochs: if paper { 20 } else { 32 },
            patience: 4,
            learning_rate: 1e-3,
            cosine: !paper,
            strongest_weight: if paper { 1.0 } else { STRONGEST_WEIGHT },
            beyond_range: if paper { 0.0 } else { BEYOND_RANGE },
            seed: 1,
        }
    }
}

/// An epoch as the curves show it. Accuracies are over all samples.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Epoch {
    /// Number, from 1.
    pub epoch: usize,
    /// Weighted mean cross entropy of the training samples as they went by, nat.
    pub training_loss: f64,
    /// Share of training samples that were classified rightly as they went by.
    pub training_accuracy: f64,
    /// Weighted mean cross entropy on the validation samples after the epoch, nat.
    pub validation_loss: f64,
    /// Accuracy on the validation samples after the epoch.
    pub validation_accuracy: f64,
}

/// A trained model and how it came to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Trained {
    /// The model of the best epoch, temperature 1.
    pub model: FloatModel,
    /// All epochs.
    pub curve: Vec<Epoch>,
}

const BETA_1: f32 = 0.9;
const BETA_2: f32 = 0.999;
const EPSILON: f32 = 1e-8;

/// Adam's moments.
struct Adam {
    first: Vec<f32>,
    second: Vec<f32>,
    powers: [f32; 2],
}

impl Adam {
    fn new(parameters: usize) -> Self {
        Self {
            first: vec![0.0; parameters],
            second: vec![0.0; parameters],
            powers: [1.0; 2],
        }
    }

    fn step(&mut self, parameters: &mut [f32], gradient: &[f32], rate: f32) {
        self.powers[0] *= BETA_1;
        self.powers[1] *= BETA_2;
        let (c1, c2) = (1.0 - self.powers[0], 1.0 - self.powers[1]);
        let moments = self.first.iter_mut().zip(&mut self.second);
        for ((p, g), (m, v)) in parameters.iter_mut().zip(gradient).zip(moments) {
            *m = BETA_1 * *m + (1.0 - BETA_1) * g;
            *v = BETA_2 * *v + (1.0 - BETA_2) * g * g;
            *p -= rate * (*m / c1) / ((*v / c2).sqrt() + EPSILON);
        }
    }
}

/// Samples whose inputs have been normalised.
struct Ready<'a> {
    rows: Vec<f32>,
    samples: &'a Samples,
}

impl<'a> Ready<'a> {
    fn new(samples: &'a Samples, offset: &[f32], scale: &[f32]) -> Self {
        let mut rows = samples.inputs.clone();
        rows.par_chunks_mut(samples.width).for_each(|row| {
            for (x, (offset, scale)) in row.iter_mut().zip(offset.iter().zip(scale)) {
                *x = ((*x - offset) * scale).clamp(-1.0, 1.0);
            }
        });
        Self { rows, samples }
    }

    fn row(&self, sample: usize) -> &[f32] {
        &self.rows[sample * self.samples.width..][..self.samples.width]
    }
}

/// Trains a network. `progress` hears of every epoch and says whether to go on.
///
/// # Errors
/// In words, when there are no samples or the network comes out with a number that is none.
pub fn train(
    task: Task,
    training: &Samples,
    validation: &Samples,
    settings: &Settings,
    mut progress: impl FnMut(&Epoch, f64) -> bool,
) -> Result<Trained, String> {
    if training.is_empty() || validation.is_empty() {
        return Err("expected training and validation links with paths, found none".into());
    }
    let (offset, scale) = training.range(settings.beyond_range);
    let mut network = Network::new(task.kind(), task.inputs(), &settings.hidden);
    let mut stream = Stream::new(settings.seed, 0);
    network.initialise(|| stream.uniform());
    let of = |network: &Network| {
        FloatModel::new(
            task.kind(),
            task.names(),
            offset.clone(),
            scale.clone(),
            1.0,
            network.layers(),
        )
    };
    let ready = Ready::new(training, &offset, &scale);
    let mut adam = Adam::new(network.parameters.len());
    let mut workspaces: Vec<Sub> = (0..BATCH / SUB_BATCH).map(|_| Sub::new(&network)).collect();
    let mut order: Vec<u32> = (0..training.len() as u32).collect();
    let (mut best, mut best_loss, mut since) = (network.clone(), f64::INFINITY, 0);
    let mut curve = Vec::new();
    for epoch in 1..=settings.epochs {
        shuffle(&mut order, &mut Stream::new(settings.seed, epoch as u64));
        let rate = settings.rate(epoch - 1);
        let (mut loss, mut weight, mut right) = (0.0, 0.0, 0);
        for batch in order.chunks(BATCH) {
            let sum = step(
                &mut network,
                &mut adam,
                &ready,
                batch,
                &mut workspaces,
                settings,
                rate,
            );
            loss += sum.loss;
            weight += f64::from(sum.weight);
            right += sum.right;
        }
        let logits = logits_of(&of(&network)?, validation);
        let (validation_loss, validation_accuracy) = loss_and_accuracy(&logits, validation, settings);
        curve.push(Epoch {
            epoch,
            training_loss: loss / weight,
            training_accuracy: right as f64 / training.len() as f64,
            validation_loss,
            validation_accuracy,
        });
        since += 1;
        if validation_loss < best_loss {
            (best, best_loss, since) = (network.clone(), validation_loss, 0);
        }
        let go_on = curve.last().is_none_or(|epoch| progress(epoch, best_loss));
        if since >= settings.patience || !go_on {
            break;
        }
    }
    Ok(Trained {
        model: of(&best)?,
        curve,
    })
}

impl Settings {
    fn weight(&self, samples: &Samples, sample: usize) -> f32 {
        if samples.strongest[sample] {
            self.strongest_weight
        } else {
            1.0
        }
    }

    fn rate(&self, epoch: usize) -> f32 {
        if self.cosine {
            let turn = core::f32::consts::PI * epoch as f32 / self.epochs.max(1) as f32;
            self.learning_rate * 0.5 * (1.0 + libm::cosf(turn))
        } else {
            self.learning_rate
        }
    }
}

/// A sub-batch on its way.
struct Sub {
    rows: Vec<f32>,
    states: Vec<u8>,
    weights: Vec<f32>,
    pass: Workspace,
}

impl Sub {
    fn new(network: &Network) -> Self {
        Self {
            rows: Vec::new(),
            states: Vec::new(),
            weights: Vec::new(),
            pass: network.workspace(),
        }
    }
}

/// What a batch adds up to.
struct Sum {
    loss: f64,
    weight: f32,
    right: usize,
}

/// One step of Adam along the weighted mean of a batch's gradients.
fn step(
    network: &mut Network,
    adam: &mut Adam,
    ready: &Ready<'_>,
    batch: &[u32],
    subs: &mut [Sub],
    settings: &Settings,
    rate: f32,
) -> Sum {
    let transposed = network.transposed();
    let shared: &Network = network;
    let used = batch.len().div_ceil(SUB_BATCH);
    subs[..used]
        .par_iter_mut()
        .zip(batch.par_chunks(SUB_BATCH))
        .for_each(|(sub, chosen)| {
            sub.rows.clear();
            sub.states.clear();
            sub.weights.clear();
            for sample in chosen.iter().map(|&sample| sample as usize) {
                sub.rows.extend_from_slice(ready.row(sample));
                sub.states.push(ready.samples.states[sample]);
                sub.weights.push(settings.weight(ready.samples, sample));
            }
            shared.backward(&transposed, &sub.rows, &sub.states, &sub.weights, &mut sub.pass);
        });
    let (first, others) = subs[..used].split_at_mut(1);
    let sum = &mut first[0].pass;
    for sub in others {
        sum.gradient
            .iter_mut()
            .zip(&sub.pass.gradient)
            .for_each(|(sum, g)| *sum += g);
        sum.loss += sub.pass.loss;
        sum.weight += sub.pass.weight;
        sum.right += sub.pass.right;
    }
    let mean = 1.0 / sum.weight;
    sum.gradient.iter_mut().for_each(|g| *g *= mean);
    adam.step(&mut network.parameters, &sum.gradient, rate);
    Sum {
        loss: sum.loss,
        weight: sum.weight,
        right: sum.right,
    }
}

/// Fisher and Yates.
fn shuffle(order: &mut [u32], stream: &mut Stream) {
    for last in (1..order.len()).rev() {
        let other = (stream.uniform() * (last + 1) as f64) as usize;
        order.swap(last, other.min(last));
    }
}

/// Logits of a float model for all samples, in order.
pub fn logits_of(model: &FloatModel, samples: &Samples) -> Vec<[f32; STATES]> {
    let network = Network::of(model);
    let transposed = network.transposed();
    let ready = Ready::new(samples, model.input_offset(), model.input_scale());
    let parts: Vec<Vec<[f32; STATES]>> = ready
        .rows
        .par_chunks(SUB_BATCH * samples.width)
        .map_init(
            || network.workspace(),
            |workspace, rows| {
                let logits = network.forward(&transposed, rows, workspace);
                logits.chunks_exact(STATES).map(|l| [l[0], l[1], l[2]]).collect()
            },
        )
        .collect();
    parts.concat()
}

/// Weighted mean of the cross entropy (nat), and accuracy, at temperature 1.
fn loss_and_accuracy(logits: &[[f32; STATES]], samples: &Samples, settings: &Settings) -> (f64, f64) {
    let (mut loss, mut weights, mut right) = (0.0, 0.0, 0_usize);
    for (sample, (logits, state)) in logits.iter().zip(&samples.states).enumerate() {
        let weight = f64::from(settings.weight(samples, sample));
        loss += weight * super::calibration::cross_entropy(logits, *state, 1.0);
        weights += weight;
        right += usize::from(super::calibration::most_likely(logits) == *state);
    }
    let n = samples.len().max(1) as f64;
    (loss / weights.max(f64::MIN_POSITIVE), right as f64 / n)
}

#[cfg(test)]
mod tests;
