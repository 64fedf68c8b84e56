//! How well links and paths are classified, and what a map made of the accepted ones would be worth.

use cslam_core::geometry::Position;
use cslam_core::link_state::{AcceptGate, Classifier, LinkGeometry};
use cslam_core::reflection::{Form, Verdict, solve};
use cslam_core::signal::Waveform;
use rayon::prelude::*;

use super::calibration::{CalibrationError, most_likely};
use super::errors::Errors;
use super::float_model::{FloatModel, STATES};
use super::links::{Link, Links};
use super::samples::RECEIVED_PATHS;
use crate::random::Stream;

/// Right answers of some.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Share {
    /// Right ones.
    pub right: usize,
    /// All.
    pub all: usize,
}

impl Share {
    fn add(&mut self, right: bool) {
        self.right += usize::from(right);
        self.all += 1;
    }

    /// Right ones of all; 0 of nothing.
    pub fn value(&self) -> f64 {
        self.right as f64 / self.all.max(1) as f64
    }
}

/// Points that would enter the map.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MapScore {
    /// Accepted paths that are truly first-order, of all accepted ones.
    pub precision: Share,
    /// Accepted ones of all first-order paths.
    pub recall: Share,
    /// Distances of true accepted points from where the wave was reflected, m.
    pub errors_m: Vec<f64>,
}

/// Figures of one classifier over some links.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scores {
    /// Link state by the integer network.
    pub links: Share,
    /// Link state by the float network.
    pub links_float: Share,
    /// Class of every path by the integer network.
    pub paths: Share,
    /// Class of every path by the float network.
    pub paths_float: Share,
    /// Calibration of link states, integer network.
    pub links_calibration: CalibrationError,
    /// Calibration of all paths, integer network.
    pub paths_calibration: CalibrationError,
    /// A map of strongest paths alone.
    pub strongest_map: MapScore,
    /// A map of all paths.
    pub map: MapScore,
}

/// What is scored.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The integer networks.
    pub classifier: &'a Classifier<'a>,
    /// The float network.
    pub float: &'a FloatModel,
    /// Whether angles of departure are measured.
    pub departure: bool,
    /// The gate into the map.
    pub gate: &'a AcceptGate,
    /// Errors of measurement.
    pub errors: &'a Errors,
}

impl Subject<'_> {
    /// Scores links, each measured once with a stream of the seed.
    pub fn score(&self, links: &Links, seed: u64) -> Scores {
        const LINKS: usize = 512;
        let parts: Vec<Scores> = (0..links.len().div_ceil(LINKS))
            .into_par_iter()
            .map(|part| {
                let mut scores = Scores::default();
                let range = part * LINKS..((part + 1) * LINKS).min(links.len());
                for link in range.filter_map(|i| links.link(i)) {
                    self.add(&link, &mut Stream::new(seed, link.index), &mut scores);
                }
                scores
            })
            .collect();
        let mut all = Scores::default();
        parts.iter().for_each(|part| all.append(part));
        all
    }

    fn add(&self, link: &Link<'_>, stream: &mut Stream, scores: &mut Scores) {
        let Ok(mut measured) = self.errors.measure(link, self.departure, stream) else {
            return;
        };
        measured.paths.truncate(RECEIVED_PATHS);
        let Ok(geometry) = LinkGeometry::new(&measured.ends, &measured.paths, &Waveform::default()) else {
            return;
        };
        for (place, (received, truth)) in measured.paths.iter().zip(link.paths()).enumerate() {
            let (class, strongest) = (truth.class(), place == 0);
            let Ok(probabilities) = self.classifier.path(&geometry, received) else {
                continue;
            };
            let integer = probabilities.to_array();
            let float = self.float_probabilities(&geometry, received);
            let right = most_likely(&integer) == class;
            let float_right = float.is_some_and(|p| most_likely(&p) == class);
            scores.paths.add(right);
            scores.paths_float.add(float_right);
            scores.paths_calibration.add(&integer, class);
            if strongest {
                scores.links.add(right);
                scores.links_float.add(float_right);
                scores.links_calibration.add(&integer, class);
            }
            let verdict = solve(&measured.ends, &received.path, Form::Vector, &self.gate.point);
            let error_m = match verdict {
                Ok(Verdict::Accepted(point)) if probabilities.is_first_order(self.gate.min_probability) => {
                    let [x, y, z] = truth.last_vertex_m;
                    let exact = Position::new(x, y, z);
                    exact
                        .ok()
                        .map(|exact| f64::from(point.position.distance_m(&exact)))
                }
                _ => None,
            };
            scores.map.add(class, error_m);
            if strongest {
                scores.strongest_map.add(class, error_m);
            }
        }
    }

    fn float_probabilities(
        &self,
        geometry: &LinkGeometry<'_>,
        received: &cslam_core::link_state::Received,
    ) -> Option<[f32; STATES]> {
        let features = geometry.features(received).ok()?;
        Some(match features.with_departure() {
            Some(inputs) => self.float.probabilities(inputs),
            None => self.float.probabilities(features.without_departure()),
        })
    }
}

impl MapScore {
    /// A path of a class; the error of its point when it was accepted.
    fn add(&mut self, class: u8, error_m: Option<f64>) {
        if let Some(error_m) = error_m {
            self.precision.add(class == 1);
            if class == 1 {
                self.errors_m.push(error_m);
            }
        }
        if class == 1 {
            self.recall.add(error_m.is_some());
        }
    }

    fn append(&mut self, other: &Self) {
        self.precision.append(other.precision);
        self.recall.append(other.recall);
        self.errors_m.extend_from_slice(&other.errors_m);
    }
}

impl Share {
    fn append(&mut self, other: Self) {
        self.right += other.right;
        self.all += other.all;
    }
}

impl Scores {
    /// Adds the counts of other links.
    pub fn append(&mut self, other: &Self) {
        self.links.append(other.links);
        self.links_float.append(other.links_float);
        self.paths.append(other.paths);
        self.paths_float.append(other.paths_float);
        self.links_calibration.append(&other.links_calibration);
        self.paths_calibration.append(&other.paths_calibration);
        self.strongest_map.append(&other.strongest_map);
        self.map.append(&other.map);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn precision_and_recall_count_what_they_say() {
        let mut map = MapScore::default();
        map.add(1, Some(0.5));
        map.add(1, None);
        map.add(2, Some(3.0));
        map.add(0, None);
        assert_eq!(
            (map.precision, map.recall),
            (Share { right: 1, all: 2 }, Share { right: 1, all: 2 })
        );
        assert_eq!(map.errors_m, [0.5]);
        assert_eq!(map.precision.value(), 0.5);
    }
}
