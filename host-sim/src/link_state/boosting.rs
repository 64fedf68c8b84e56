//! Trainer of the trees: gradient boosting with a softmax over the classes, on inputs that are rounded as the receiver rounds them.
//!
//! Each round adds a tree for each class. With the probabilities `p` so far and `y` 1 where a sample is of the class, a leaf of samples with
//! `G = sum (y - p)` and `H = sum p (1 - p)` holds `rate G / (H + ridge)`, and a node is split where `G^2 / (H + ridge)` of both sides gains most
//! (Friedman 2001; Chen and Guestrin 2016, section 2). Inputs have 255 values, so a split is looked for in a histogram. Sums run in the
//! order of the samples: the same trees on every machine and for any number of threads.

use cslam_core::link_state::{
    CLASSES, InputScale, LEAVES, MAX_ROUNDS, NODES, TREE_INPUTS, Tree, Trees, TreesDescription, tree_names,
};
use rayon::prelude::*;

use super::flight_samples::FlightSamples;
use crate::evaluation::{PathClass, PathStateFigures, PathStates};
use crate::input::InputError;

/// How the trees are trained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Trees of each class.
    pub rounds: usize,
    /// Share of a step that a tree makes.
    pub rate: f64,
    /// Added to `H`.
    pub ridge: f64,
    /// Least `H` on either side of a split.
    pub least_weight: f64,
    /// Share of the samples at either end of an input's range that may lie beyond what an int8 holds.
    pub beyond: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rounds: 40,
            rate: 0.3,
            ridge: 1.0,
            least_weight: 5.0,
            beyond: 0.001,
        }
    }
}

/// Values that an input may have: -127 to 127, and one place more.
const VALUES: usize = 256;

/// Inputs of a sample, rounded: 0 stands for -128.
type Row = [u8; TREE_INPUTS];

/// Trained trees.
#[derive(Clone, Debug, PartialEq)]
pub struct Boosted {
    scales: Vec<InputScale>,
    /// Class by class in each round.
    trees: Vec<FloatTree>,
    /// Logits are multiplied by this.
    sharpness: f64,
}

/// A tree before its leaves are rounded.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct FloatTree {
    inputs: [u8; NODES],
    thresholds: [i8; NODES],
    leaves: [f64; LEAVES],
}

impl FloatTree {
    fn leaf(&self, row: &Row) -> f64 {
        let mut node = 0;
        while node < NODES {
            let value = row[usize::from(self.inputs[node])];
            node = 2 * node + 1 + usize::from(value > place(self.thresholds[node]));
        }
        self.leaves[node - NODES]
    }
}

/// Place of an int8 in a histogram.
fn place(value: i8) -> u8 {
    value.cast_unsigned() ^ 0x80
}

/// Sums over samples: `G` and `H`.
#[derive(Clone, Copy, Debug, Default)]
struct Sums {
    gradient: f64,
    weight: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.gradient += other.gradient;
        self.weight += other.weight;
    }

    fn without(&self, other: &Self) -> Self {
        Self {
            gradient: self.gradient - other.gradient,
            weight: self.weight - other.weight,
        }
    }

    fn score(&self, settings: &Settings) -> f64 {
        self.gradient * self.gradient / (self.weight + settings.ridge)
    }
}

/// Trains trees; `round_done` is told of every round.
///
/// # Errors
/// [`InputError`] when there are no samples, or settings out of range.
pub fn train(
    samples: &FlightSamples,
    settings: &Settings,
    mut round_done: impl FnMut(usize),
) -> Result<Boosted, InputError> {
    if samples.is_empty() {
        return Err(InputError::new("no samples to train on"));
    }
    if settings.rounds == 0 || settings.rounds > MAX_ROUNDS {
        return Err(InputError::new(format!("rounds: expected 1 to {MAX_ROUNDS}")));
    }
    let scales = scales(samples, settings.beyond);
    let rows = rounded(samples, &scales);
    let mut logits = vec![[0.0; CLASSES]; rows.len()];
    let mut trees = Vec::with_capacity(settings.rounds * CLASSES);
    for round in 0..settings.rounds {
        let probabilities: Vec<[f64; CLASSES]> = logits.iter().map(softmax).collect();
        let grown: Vec<FloatTree> = (0..CLASSES)
            .into_par_iter()
            .map(|class| {
                let of = |index: usize| {
                    let p = probabilities[index][class];
                    let y = f64::from(u8::from(samples.classes[index] as usize == class));
                    Sums {
                        gradient: y - p,
                        weight: p * (1.0 - p),
                    }
                };
                grow(&rows, &(0..rows.len()).map(of).collect::<Vec<_>>(), settings)
            })
            .collect();
        for (logits, row) in logits.iter_mut().zip(&rows) {
            add(&grown, row, logits);
        }
        trees.extend(grown);
        round_done(round);
    }
    Ok(Boosted {
        scales,
        trees,
        sharpness: 1.0,
    })
}

/// Grows a tree level by level.
fn grow(rows: &[Row], sums: &[Sums], settings: &Settings) -> FloatTree {
    let mut tree = FloatTree::default();
    // The node that each sample is in.
    let mut nodes = vec![0_u8; rows.len()];
    let (mut first, mut count) = (0, 1);
    while first < NODES {
        let mut histograms = vec![[[Sums::default(); VALUES]; TREE_INPUTS]; count];
        for ((row, sums), node) in rows.iter().zip(sums).zip(&nodes) {
            let histogram = &mut histograms[usize::from(*node) - first];
            for (values, value) in histogram.iter_mut().zip(row) {
                values[usize::from(*value)].add(sums);
            }
        }
        for (node, histogram) in histograms.iter().enumerate() {
            // A node that is not worth a split sends everybody to the left: no input is above 127.
            let (input, threshold) = split(histogram, settings).unwrap_or((0, i8::MAX));
            (tree.inputs[first + node], tree.thresholds[first + node]) = (input, threshold);
        }
        for (row, node) in rows.iter().zip(&mut nodes) {
            let at = usize::from(*node);
            let above = row[usize::from(tree.inputs[at])] > place(tree.thresholds[at]);
            *node = (2 * at + 1 + usize::from(above)) as u8;
        }
        first += count;
        count *= 2;
    }
    let mut leaves = [Sums::default(); LEAVES];
    for (sums, node) in sums.iter().zip(&nodes) {
        leaves[usize::from(*node) - NODES].add(sums);
    }
    tree.leaves = leaves.map(|leaf| settings.rate * leaf.gradient / (leaf.weight + settings.ridge));
    tree
}

/// The split that gains most: input, and the greatest value on the left. `None` when none gains.
fn split(histogram: &[[Sums; VALUES]; TREE_INPUTS], settings: &Settings) -> Option<(u8, i8)> {
    let mut best: Option<(f64, u8, i8)> = None;
    for (input, values) in histogram.iter().enumerate() {
        let mut all = Sums::default();
        values.iter().for_each(|value| all.add(value));
        let mut left = Sums::default();
        for (value, sums) in values.iter().enumerate().take(VALUES - 1) {
            left.add(sums);
            let right = all.without(&left);
            if left.weight < settings.least_weight || right.weight < settings.least_weight {
                continue;
            }
            let gain = left.score(settings) + right.score(settings) - all.score(settings);
            if gain > best.map_or(1e-9, |(gain, ..)| gain) {
                best = Some((gain, input as u8, (value as u8 ^ 0x80).cast_signed()));
            }
        }
    }
    best.map(|(_, input, threshold)| (input, threshold))
}

/// Scales that put all but a share of the samples at either end of each input between -127 and 127.
fn scales(samples: &FlightSamples, beyond: f64) -> Vec<InputScale> {
    let last = samples.len() - 1;
    let cut = (beyond * last as f64) as usize;
    (0..TREE_INPUTS)
        .map(|input| {
            let mut values: Vec<f32> = samples.inputs.iter().map(|row| row[input]).collect();
            values.sort_by(f32::total_cmp);
            let (low, high) = (values[cut], values[last - cut]);
            let half = (0.5 * (high - low)).max(1e-3);
            InputScale {
                offset: low + half,
                steps: 127.0 / half,
            }
        })
        .collect()
}

fn rounded(samples: &FlightSamples, scales: &[InputScale]) -> Vec<Row> {
    let row =
        |inputs: &[f32; TREE_INPUTS]| std::array::from_fn(|input| place(scales[input].int8(inputs[input])));
    samples.inputs.iter().map(row).collect()
}

fn softmax(logits: &[f64; CLASSES]) -> [f64; CLASSES] {
    let most = logits.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let all = logits.map(|logit| libm::exp(logit - most));
    let sum: f64 = all.iter().sum();
    all.map(|e| e / sum)
}

/// Adds to the logits what trees say of a sample, class by class in each round.
fn add(trees: &[FloatTree], row: &Row, logits: &mut [f64; CLASSES]) {
    for round in trees.chunks_exact(CLASSES) {
        for (logit, tree) in logits.iter_mut().zip(round) {
            *logit += tree.leaf(row);
        }
    }
}

impl Boosted {
    /// Logits of a sample before the calibration.
    fn logits(&self, row: &Row) -> [f64; CLASSES] {
        let mut logits = [0.0; CLASSES];
        add(&self.trees, row, &mut logits);
        logits
    }

    /// Makes its probabilities those of least cross entropy on samples that it was not trained on, with one factor on all logits; gives
    /// the factor.
    pub fn calibrate(&mut self, samples: &FlightSamples) -> f64 {
        let rows = rounded(samples, &self.scales);
        let logits: Vec<[f64; CLASSES]> = rows.iter().map(|row| self.logits(row)).collect();
        let loss = |sharpness: f64| -> f64 {
            let of = |(logits, class): (&[f64; CLASSES], &PathClass)| {
                let p = softmax(&logits.map(|logit| sharpness * logit))[*class as usize];
                -libm::log(p.max(1e-12))
            };
            logits.iter().zip(&samples.classes).map(of).sum()
        };
        // From 1/4 to 4 in steps of 2 %.
        let candidates = (-70..=70).map(|step| libm::pow(1.02, f64::from(step)));
        let best = candidates
            .map(|sharpness| (loss(sharpness), sharpness))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        self.sharpness = best.map_or(1.0, |(_, sharpness)| sharpness);
        self.sharpness
    }

    /// The model file.
    ///
    /// # Errors
    /// [`InputError`] when the reader would refuse it.
    pub fn to_file(&self) -> Result<Vec<u8>, InputError> {
        let largest = (self.trees.iter())
            .flat_map(|tree| tree.leaves)
            .fold(1e-6, |most: f64, leaf| most.max(leaf.abs()));
        let unit = largest / f64::from(i16::MAX);
        let trees: Vec<Tree> = (self.trees.iter())
            .map(|tree| Tree {
                inputs: tree.inputs,
                thresholds: tree.thresholds,
                leaves: tree.leaves.map(|leaf| libm::round(leaf / unit) as i16),
            })
            .collect();
        let names = tree_names().collect::<Vec<_>>().join(",");
        let description = TreesDescription {
            unit: (unit * self.sharpness) as f32,
            names: &names,
            inputs: &self.scales,
            trees: &trees,
        };
        let mut file = vec![0; description.length()];
        description
            .write(&mut file)
            .map_err(|error| InputError::new(error.to_string()))?;
        Ok(file)
    }
}

/// Judges trees.
///
/// # Errors
/// [`InputError`] for inputs that are no numbers.
pub fn judge(trees: &Trees<'_>, samples: &FlightSamples) -> Result<PathStateFigures, InputError> {
    let mut states = PathStates::default();
    for ((inputs, class), strongest) in samples
        .inputs
        .iter()
        .zip(&samples.classes)
        .zip(&samples.strongest)
    {
        let probabilities = trees
            .classify(inputs)
            .map_err(|error| InputError::new(error.to_string()))?;
        states.add(probabilities.to_array().map(f64::from), *class, *strongest);
    }
    Ok(states.figures())
}

#[cfg(test)]
mod tests;
