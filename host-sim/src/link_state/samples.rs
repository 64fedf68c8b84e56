//! From measured links to what a network trains on: the flight code's own features, and the true class beside them.

use cslam_core::link_state::{
    GEOMETRIC_INPUTS, GEOMETRIC_NAMES, GEOMETRIC_WITH_DEPARTURE_INPUTS, LinkGeometry, PAPER_INPUTS_PER_PATH,
    PAPER_NAMES, paper_inputs,
};
use cslam_core::signal::Waveform;
use rayon::prelude::*;

use super::errors::{Errors, Measured};
use super::float_model::Kind;
use super::links::{Link, Links};
use crate::random::Stream;

/// Paths of a link that the receiver keeps (docs/signal-model.md, "Default configuration": K = 9).
pub const RECEIVED_PATHS: usize = 9;

/// What a network is to tell from what.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// The state of a link from delay and direction of its K strongest paths.
    Paper {
        /// Number of paths.
        k: usize,
    },
    /// The class of a path from its geometric features.
    Geometric {
        /// Whether angles of departure are measured.
        departure: bool,
    },
}

impl Task {
    /// Number of inputs.
    pub fn inputs(self) -> usize {
        match self {
            Self::Paper { k } => PAPER_INPUTS_PER_PATH * k,
            Self::Geometric { departure: false } => GEOMETRIC_INPUTS,
            Self::Geometric { departure: true } => GEOMETRIC_WITH_DEPARTURE_INPUTS,
        }
    }

    /// Names of the inputs.
    pub fn names(self) -> Vec<String> {
        match self {
            Self::Paper { k } => (1..=k)
                .flat_map(|path| PAPER_NAMES.map(|name| format!("{name}_{path}")))
                .collect(),
            Self::Geometric { .. } => {
                let names = GEOMETRIC_NAMES.iter().take(self.inputs());
                names.map(ToString::to_string).collect()
            }
        }
    }

    /// Kind of the model.
    pub fn kind(self) -> Kind {
        match self {
            Self::Paper { k } => Kind::Paper { k },
            Self::Geometric { .. } => Kind::Geometric,
        }
    }

    /// Whether measurements have angles of departure.
    pub fn departures(self) -> bool {
        self == Self::Geometric { departure: true }
    }
}

/// Samples, row by row.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Samples {
    /// Inputs of a sample.
    pub width: usize,
    /// Inputs, one sample after the other, as the features come.
    pub inputs: Vec<f32>,
    /// True class: 0 line of sight, 1 first order, 2 higher order.
    pub states: Vec<u8>,
    /// Whether the sample stands for its link: its strongest path, or the link itself.
    pub strongest: Vec<bool>,
    /// Paths that gave no features: no receiver would have reported them.
    pub refused: usize,
}

impl Samples {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.states.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.states.is_empty()
    }

    /// Inputs of a sample.
    pub fn row(&self, sample: usize) -> &[f32] {
        &self.inputs[sample * self.width..][..self.width]
    }

    /// Adds samples of the same width behind these.
    pub fn append(&mut self, mut other: Self) {
        self.inputs.append(&mut other.inputs);
        self.states.append(&mut other.states);
        self.strongest.append(&mut other.strongest);
        self.refused += other.refused;
    }

    /// Measures links and computes their samples. Every link has a stream of its own, so the result does not depend on
    /// the number of threads; `draws` measures every link so many times, each with errors of its own.
    pub fn of(sets: &[Links], task: Task, errors: &Errors, seed: u64, draws: usize) -> Self {
        const LINKS: usize = 2048;
        let mut all = Self {
            width: task.inputs(),
            ..Self::default()
        };
        for draw in 0..draws {
            for (number, links) in sets.iter().enumerate() {
                // Sets may come from different scenes with the same link numbers.
                let seed = seed
                    .wrapping_add((number as u64) << 32)
                    .wrapping_add((draw as u64) << 48);
                let parts: Vec<Self> = (0..links.len().div_ceil(LINKS))
                    .into_par_iter()
                    .map(|part| {
                        let mut samples = Self::default();
                        let range = part * LINKS..((part + 1) * LINKS).min(links.len());
                        for link in range.filter_map(|i| links.link(i)) {
                            let mut stream = Stream::new(seed, link.index);
                            match errors.measure(&link, task.departures(), &mut stream) {
                                Ok(measured) => samples.add(&link, &measured, task),
                                Err(_) => samples.refused += link.paths().count(),
                            }
                        }
                        samples
                    })
                    .collect();
                parts.into_iter().for_each(|part| all.append(part));
            }
        }
        all
    }

    fn add(&mut self, link: &Link<'_>, measured: &Measured, task: Task) {
        let paths = measured.paths.get(..RECEIVED_PATHS).unwrap_or(&measured.paths);
        match task {
            Task::Paper { k } => {
                if let Some(strongest) = link.paths().next() {
                    let mut inputs = vec![0.0; PAPER_INPUTS_PER_PATH * k];
                    paper_inputs(&measured.paths, &mut inputs);
                    self.inputs.append(&mut inputs);
                    self.states.push(strongest.class());
                    self.strongest.push(true);
                }
            }
            Task::Geometric { departure } => {
                let Ok(geometry) = LinkGeometry::new(&measured.ends, paths, &Waveform::default()) else {
                    self.refused += paths.len();
                    return;
                };
                for (place, (path, truth)) in paths.iter().zip(link.paths()).enumerate() {
                    let Ok(features) = geometry.features(path) else {
                        self.refused += 1;
                        continue;
                    };
                    match features.with_departure() {
                        Some(inputs) if departure => self.inputs.extend_from_slice(inputs),
                        _ => self.inputs.extend_from_slice(features.without_departure()),
                    }
                    self.states.push(truth.class());
                    self.strongest.push(place == 0);
                }
            }
        }
    }

    /// Offset and scale that take the range of each input to -1..=1. A share `beyond` of the samples may lie beyond the range
    /// at either end; 0 is the whole range. An input that never changes goes to 0.
    pub fn range(&self, beyond: f64) -> (Vec<f32>, Vec<f32>) {
        let ends: Vec<(f32, f32)> = (0..self.width)
            .into_par_iter()
            .map(|input| {
                let mut column: Vec<f32> = self
                    .inputs
                    .iter()
                    .skip(input)
                    .step_by(self.width)
                    .copied()
                    .collect();
                let whole = ends(&mut column, 0.0);
                // An input that is nearly always the same keeps the range of the exceptions.
                match ends(&mut column, beyond) {
                    (low, high) if low < high => (low, high),
                    _ => whole,
                }
            })
            .collect();
        let scaled = ends.into_iter().map(|(low, high)| {
            let span = high - low;
            if span > 0.0 {
                (0.5 * (low + high), 2.0 / span)
            } else {
                (low.min(high), 1.0)
            }
        });
        scaled.unzip()
    }
}

/// The values that a share `beyond` of all lie below, and above. Changes the order.
fn ends(values: &mut [f32], beyond: f64) -> (f32, f32) {
    let Some(last) = values.len().checked_sub(1) else {
        return (0.0, 0.0);
    };
    let outside = ((values.len() as f64 * beyond) as usize).min(last / 2);
    let (_, low, _) = values.select_nth_unstable_by(outside, f32::total_cmp);
    let low = *low;
    let (_, high, _) = values.select_nth_unstable_by(last - outside, f32::total_cmp);
    (low, *high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::link_state::links::tests::one_link;

    #[test]
    fn every_path_is_a_sample_and_the_first_stands_for_the_link() {
        let links = [one_link()];
        let paths = usize::from(links[0].paths[0]).min(RECEIVED_PATHS);
        for (departure, width) in [(true, GEOMETRIC_WITH_DEPARTURE_INPUTS), (false, GEOMETRIC_INPUTS)] {
            let samples = Samples::of(&links, Task::Geometric { departure }, &Errors::default(), 1, 2);
            assert_eq!(
                (samples.len(), samples.width, samples.refused),
                (2 * paths, width, 0)
            );
            assert_eq!(samples.inputs.len(), samples.len() * width);
            assert_eq!(samples.strongest.iter().filter(|s| **s).count(), 2);
            assert_eq!(samples.states[0], 0, "line of sight");
            assert_ne!(samples.row(0), samples.row(paths), "another draw");
        }
        let samples = Samples::of(&links, Task::Paper { k: 15 }, &Errors::default(), 1, 1);
        assert_eq!((samples.len(), samples.width), (1, 45));
        assert_eq!(
            samples.row(0)[3 * usize::from(links[0].paths[0])..],
            [0.0; 45][3 * usize::from(links[0].paths[0])..]
        );
    }

    #[test]
    fn names_and_inputs_go_together() {
        for task in [
            Task::Paper { k: 9 },
            Task::Geometric { departure: true },
            Task::Geometric { departure: false },
        ] {
            assert_eq!(task.names().len(), task.inputs());
        }
        assert_eq!(Task::Paper { k: 2 }.names()[3], "c_tau_m_2");
    }

    #[test]
    fn the_range_goes_to_one() {
        let samples = Samples {
            width: 2,
            inputs: vec![1.0, 7.0, 5.0, 7.0, 3.0, 7.0],
            ..Samples::default()
        };
        assert_eq!(samples.range(0.0), (vec![3.0, 7.0], vec![0.5, 1.0]));
    }

    #[test]
    fn outliers_lie_beyond_the_range_and_exceptions_within() {
        // 0 to 99 with an outlier at either end; nearly always 0; twice as many outliers as may be left out.
        let mut inputs: Vec<f32> = Vec::new();
        for i in 0..100 {
            let edge = if i < 4 { 50.0 } else { i as f32 / 100.0 };
            inputs.extend([i as f32, if i == 7 { 3.0 } else { 0.0 }, edge]);
        }
        inputs.extend([-1e6, 0.0, 0.5, 1e6, 0.0, 0.5]);
        let samples = Samples {
            width: 3,
            inputs,
            ..Samples::default()
        };
        let (offset, scale) = samples.range(0.01);
        assert_eq!((offset[0], scale[0]), (49.5, 2.0 / 99.0));
        assert_eq!((offset[1], scale[1]), (1.5, 2.0 / 3.0));
        assert!((offset[2] - 25.0).abs() < 0.1, "{offset:?}");
    }
}
