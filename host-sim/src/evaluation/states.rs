//! What a classifier says of measured paths, against what they truly were.

use serde::Serialize;

use crate::flight_log::SweepTruth;
use crate::paths::LinkPath;

/// What a measured path truly was. Numbers as in files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum PathClass {
    /// Line of sight.
    LineOfSight = 0,
    /// One reflection or diffraction.
    FirstOrder = 1,
    /// Several.
    HigherOrder = 2,
    /// No path of its own: nothing, a piece of a scattered wave, or what a mover reflects.
    Artefact = 3,
}

impl PathClass {
    /// Of its number.
    #[must_use]
    pub fn from_number(number: u8) -> Option<Self> {
        let all = [
            Self::LineOfSight,
            Self::FirstOrder,
            Self::HigherOrder,
            Self::Artefact,
        ];
        all.get(usize::from(number)).copied()
    }

    /// Of each measured path of a sweep whose paths have been matched; nothing when the truth is not known.
    pub fn of_sweep(truth: &SweepTruth) -> impl Iterator<Item = Option<Self>> {
        truth.link.iter().flat_map(|link| {
            let behind = |matched: &Option<usize>| matched.and_then(|path| link.paths.get(path));
            truth.matches.iter().map(move |matched| Self::of(behind(matched)))
        })
    }

    /// Of the true path behind a measured one; `None` when the truth does not say its order.
    fn of(truth: Option<&LinkPath>) -> Option<Self> {
        let Some(path) = truth else {
            return Some(Self::Artefact);
        };
        Some(match path.order? {
            0 => Self::LineOfSight,
            1 if path.is_first_order() => Self::FirstOrder,
            1 => Self::Artefact,
            _ => Self::HigherOrder,
        })
    }
}

/// A probability of first order from which on a path is taken for one of first order.
const SURE: f64 = 0.8;
/// Bins of the calibration error.
const BINS: usize = 10;

/// Figures of a classifier, path by path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PathStateFigures {
    /// Measured paths of known truth that were classified.
    pub paths: usize,
    /// Share of them whose most probable class is the true one. A classifier that knows no artefacts is wrong about each.
    pub right: Option<f64>,
    /// The same of the path that was measured as the strongest of its sweep.
    pub strongest_right: Option<f64>,
    /// Of the paths whose probability of first order is at least .8: the share that is.
    pub sure_precision: Option<f64>,
    /// Share of the paths of first order that have it.
    pub sure_recall: Option<f64>,
    /// Gap between probability and share of first order, mean over ten bins of the probability by how many paths fall into each.
    pub calibration_error: Option<f64>,
}

/// Counts what figures are made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PathStates {
    paths: usize,
    right: usize,
    strongest: usize,
    strongest_right: usize,
    sure: usize,
    sure_right: usize,
    first_order: usize,
    /// Paths, sum of their probabilities of first order, and how many are of first order.
    bins: [(usize, f64, usize); BINS],
}

impl PathStates {
    /// Takes a path: probabilities of line of sight, first and higher order (the rest is an artefact's), what it was, and whether it was
    /// measured as the strongest of its sweep.
    pub fn add(&mut self, [los, one, several]: [f64; 3], truth: PathClass, strongest: bool) {
        let all = [los, one, several, 1.0 - los - one - several];
        let most = (0..all.len()).fold(0, |most, class| if all[class] > all[most] { class } else { most });
        let (is_right, is_first) = (most == truth as usize, truth == PathClass::FirstOrder);
        self.paths += 1;
        self.right += usize::from(is_right);
        self.strongest += usize::from(strongest);
        self.strongest_right += usize::from(strongest && is_right);
        self.sure += usize::from(one >= SURE);
        self.sure_right += usize::from(one >= SURE && is_first);
        self.first_order += usize::from(is_first);
        let (paths, sum, first) = &mut self.bins[((one * BINS as f64) as usize).min(BINS - 1)];
        *paths += 1;
        *sum += one;
        *first += usize::from(is_first);
    }

    /// The figures.
    #[must_use]
    pub fn figures(&self) -> PathStateFigures {
        let share = super::figures::share;
        let gaps = self
            .bins
            .iter()
            .map(|(_, sum, first)| (sum - *first as f64).abs());
        PathStateFigures {
            paths: self.paths,
            right: share(self.right, self.paths),
            strongest_right: share(self.strongest_right, self.strongest),
            sure_precision: share(self.sure_right, self.sure),
            sure_recall: share(self.sure_right, self.first_order),
            calibration_error: (self.paths > 0).then(|| gaps.sum::<f64>() / self.paths as f64),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_counted_by_what_was_said_and_what_they_were() {
        let mut states = PathStates::default();
        states.add([0.9, 0.1, 0.0], PathClass::LineOfSight, true);
        states.add([0.0, 0.85, 0.1], PathClass::FirstOrder, false);
        states.add([0.0, 0.85, 0.1], PathClass::HigherOrder, true);
        states.add([0.1, 0.1, 0.2], PathClass::Artefact, false);
        states.add([0.0, 0.5, 0.4], PathClass::FirstOrder, false);
        let found = states.figures();
        assert_eq!(
            (found.paths, found.right, found.strongest_right),
            (5, Some(0.8), Some(0.5))
        );
        assert_eq!((found.sure_precision, found.sure_recall), (Some(0.5), Some(0.5)));
        // Bins: two of .1 without any, one of .5 that is, two of .85 with one.
        let expected = (0.2 + 0.5 + (1.7_f64 - 1.0).abs()) / 5.0;
        assert!((found.calibration_error.expect("paths") - expected).abs() < 1e-12);
        assert_eq!(PathStates::default().figures(), PathStateFigures::default());
    }
}
