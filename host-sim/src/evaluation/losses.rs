//! Where the points went: what became of every true path of one reflection.
//!
//! Each is counted once. Those that no measured path belongs to are told apart by the truth: too weak beside the strongest
//! path, not to be resolved from one at least half as strong in amplitude, left out of a full list, or none of these.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::paths::EstimatorConfig;
use cslam_core::receiver::PATHS;
use serde::Serialize;

use super::matching::unit;
use crate::flight_log::{FlightLog, MeasuredPath, SweepRecord};
use crate::paths::LinkPath;

/// Paths closer than this in length, m (c / 200 MHz), and in angle of arrival, deg (a beam of the four arrays), are one peak.
const RESOLUTION: (f64, f64) = (1.5, 12.0);
/// A path down to this much weaker hides another one from being resolved, dB.
const HIDES_DB: f64 = -6.0;

/// What became of the true paths of one reflection.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct FirstOrderPaths {
    /// All of them.
    pub paths: usize,
    /// Points of the map.
    pub accepted: usize,
    /// Not measured: weaker than the strongest path by more than the estimator's dynamic range.
    pub too_weak: usize,
    /// Not measured: within a resolution cell of a path that is hardly weaker, or stronger.
    pub unresolved: usize,
    /// Not measured in a sweep whose list of paths was full.
    pub list_full: usize,
    /// Not measured for another reason.
    pub not_found: usize,
    /// Measured without a pose.
    pub no_pose: usize,
    /// Judged not to be one reflection, whether or not as several they gave points.
    pub improbable: usize,
    /// Off surfaces that were not confirmed.
    pub not_confirmed: usize,
    /// With several explanations.
    pub ambiguous: usize,
    /// Explained by no surface that is known.
    pub unexplained: usize,
    /// Explained, but without a point that is known well enough, or withdrawn with their surface.
    pub without_point: usize,
    /// Refused by another gate, taken for the line of sight, not used in this mode.
    pub refused: usize,
}

impl FirstOrderPaths {
    /// Numbers with what they count, in words.
    pub fn rows(&self) -> [(&'static str, usize); 12] {
        [
            ("accepted", self.accepted),
            ("too weak beside the strongest path", self.too_weak),
            ("not resolved from another path", self.unresolved),
            ("left out of a full list of paths", self.list_full),
            ("not found", self.not_found),
            ("no pose", self.no_pose),
            ("judged not to be one reflection", self.improbable),
            ("off a surface that was not confirmed", self.not_confirmed),
            ("ambiguous", self.ambiguous),
            ("unexplained", self.unexplained),
            ("without a point, or withdrawn", self.without_point),
            ("another gate", self.refused),
        ]
    }

    /// The number that a path which was measured belongs to.
    fn of_verdict(&mut self, verdict: &str) -> &mut usize {
        match verdict {
            MeasuredPath::OK => &mut self.accepted,
            MeasuredPath::NO_POSE => &mut self.no_pose,
            MeasuredPath::NOT_FIRST_ORDER | MeasuredPath::OK_HIGHER_ORDER => &mut self.improbable,
            MeasuredPath::NOT_CONFIRMED => &mut self.not_confirmed,
            MeasuredPath::AMBIGUOUS => &mut self.ambiguous,
            MeasuredPath::UNEXPLAINED => &mut self.unexplained,
            MeasuredPath::WITHOUT_POINT | MeasuredPath::WITHDRAWN => &mut self.without_point,
            _ => &mut self.refused,
        }
    }

    /// The number that a path which was not measured belongs to.
    fn of_unheard(&mut self, paths: &[LinkPath], index: usize, measured: usize) -> Option<&mut usize> {
        let path = paths.get(index)?;
        // Finite: two paths without any power differ by nothing.
        let level = |path: &LinkPath| path.gain_db().map_or(0.0, |db| db.max(f64::MIN));
        let strongest = paths.iter().map(level).fold(f64::NEG_INFINITY, f64::max);
        let hides = |(other, by): (usize, &LinkPath)| {
            other != index && level(by) - level(path) > HIDES_DB && within_resolution(path, by)
        };
        Some(
            if strongest - level(path) > f64::from(EstimatorConfig::default().dynamic_range_db) {
                &mut self.too_weak
            } else if paths.iter().enumerate().any(hides) {
                &mut self.unresolved
            } else if measured >= PATHS {
                &mut self.list_full
            } else {
                &mut self.not_found
            },
        )
    }

    fn enter(&mut self, sweep: &SweepRecord) {
        let Some(link) = &sweep.truth.link else {
            return;
        };
        let measured = &sweep.estimate.paths;
        for (index, _) in link.paths.iter().enumerate().filter(|(_, p)| p.is_first_order()) {
            self.paths += 1;
            let heard = sweep.truth.matches.iter().position(|m| *m == Some(index));
            let number = match heard.and_then(|path| measured.get(path)) {
                Some(path) => Some(self.of_verdict(&path.verdict)),
                None => self.of_unheard(&link.paths, index, measured.len()),
            };
            if let Some(number) = number {
                *number += 1;
            }
        }
    }
}

/// Counts the true first-order paths of all sweeps. The log's paths must have been matched.
pub(super) fn first_order_paths(log: &FlightLog) -> FirstOrderPaths {
    let mut all = FirstOrderPaths::default();
    log.sweeps.iter().for_each(|sweep| all.enter(sweep));
    all
}

fn within_resolution(a: &LinkPath, b: &LinkPath) -> bool {
    let apart_m = (a.delay_s - b.delay_s).abs() * SPEED_OF_LIGHT_M_PER_S;
    let [a, b] = [a, b].map(|path| unit(path.aoa_zenith_rad, path.aoa_azimuth_rad));
    apart_m < RESOLUTION.0 && a.angle(&b).to_degrees() < RESOLUTION.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_flight::{log_of, measured, sweep, true_path};

    /// What becomes of the first of these paths, of a length, azimuth and level each, when `heard` measured paths belong to
    /// others.
    fn unheard(paths: &[(f64, f64, f64)], heard: usize) -> FirstOrderPaths {
        let mut record = sweep(0, [0.0; 3]);
        let made = paths.iter().map(|(length_m, azimuth_deg, level_db)| {
            let mut path = true_path(2, *length_m, [1.5, azimuth_deg.to_radians()]);
            path.gain = Some([libm::exp10(level_db / 20.0), 0.0]);
            path
        });
        let link = record.truth.link.as_mut().expect("known");
        link.paths = made.collect();
        link.paths[0].order = Some(1);
        record.estimate.paths = vec![measured(10.0, [1.0, 1.0]); heard];
        record.truth.matches = vec![None; heard];
        first_order_paths(&log_of(vec![record]))
    }

    #[test]
    fn a_path_that_was_measured_counts_under_its_verdict() {
        let verdicts = [
            "ok",
            "no pose yet",
            "not one reflection",
            MeasuredPath::NOT_CONFIRMED,
            MeasuredPath::AMBIGUOUS,
            "line of sight",
            MeasuredPath::OK_HIGHER_ORDER,
        ];
        let mut record = sweep(0, [0.0; 3]);
        record.truth.link.as_mut().expect("known").paths = (0..8)
            .map(|k| true_path(u8::from(k < 7), 10.0 + f64::from(k), [1.0, 1.0]))
            .collect();
        record.estimate.paths = vec![measured(10.0, [1.0, 1.0]); 8];
        for (path, verdict) in record.estimate.paths.iter_mut().zip(verdicts) {
            path.verdict = verdict.into();
        }
        record.truth.matches = (0..8).map(Some).collect();
        let expected = FirstOrderPaths {
            paths: 7,
            accepted: 1,
            no_pose: 1,
            improbable: 2,
            not_confirmed: 1,
            ambiguous: 1,
            refused: 1,
            ..FirstOrderPaths::default()
        };
        assert_eq!(first_order_paths(&log_of(vec![record])), expected);
    }

    #[test]
    fn a_path_that_was_not_measured_counts_by_what_hides_it() {
        let one = FirstOrderPaths {
            paths: 1,
            ..FirstOrderPaths::default()
        };
        let alone = (30.0, 0.0, -80.0);
        let not_found = FirstOrderPaths { not_found: 1, ..one };
        assert_eq!(unheard(&[alone], 1), not_found);
        assert_eq!(unheard(&[alone], PATHS), FirstOrderPaths { list_full: 1, ..one });
        let unresolved = FirstOrderPaths { unresolved: 1, ..one };
        assert_eq!(unheard(&[alone, (31.0, 8.0, -85.0)], 1), unresolved);
        for beside in [(31.0, 8.0, -87.0), (32.0, 8.0, -60.0), (31.0, 14.0, -60.0)] {
            assert_eq!(unheard(&[alone, beside], 1), not_found, "{beside:?}");
        }
        let too_weak = FirstOrderPaths { too_weak: 1, ..one };
        assert_eq!(unheard(&[alone, (80.0, 90.0, -45.0)], 1), too_weak);
    }

    #[test]
    fn the_rows_are_all_of_it() {
        let all = unheard(&[(30.0, 0.0, -80.0)], 1);
        assert_eq!(
            all.rows().iter().map(|(_, number)| number).sum::<usize>(),
            all.paths
        );
    }
}
