//! Which true path is behind a measured one.
//!
//! Both are compared as the receiver's antennas see them: a true path's delay with the true clock offset on it, its
//! angle of arrival turned into the true body axes. So the errors of pose and clock play no part, and what is left is
//! the error of path estimation. Pairs farther apart than the gates in delay or in angle are not made; within the gates
//! as many pairs as possible, at the least sum of squared distances in units of the gates. Pieces of diffusely scattered waves come
//! into question for those measured paths alone that no other true path is behind.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::assignment::assign;
use crate::flight_log::{FlightLog, MeasuredPath, PoseTruth, SweepRecord};
use crate::paths::{Link, LinkPath};

/// How far a measured path may be from the true one behind it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchGates {
    /// In length, m. Two thirds of the resolution c / 200 MHz.
    pub delay_m: f64,
    /// In angle of arrival, deg: a quarter of a four-array beam.
    pub angle_deg: f64,
}

impl Default for MatchGates {
    fn default() -> Self {
        Self {
            delay_m: 1.0,
            angle_deg: 3.0,
        }
    }
}

/// Fills in the true path behind every measured one, in every sweep whose truth is known and that has no matches yet.
pub fn match_paths(log: &mut FlightLog, gates: &MatchGates) {
    let cycle_m = log.header.delay_cycle_m;
    for sweep in &mut log.sweeps {
        if sweep.truth.matches.is_empty() {
            sweep.truth.matches = match_sweep(sweep, gates, cycle_m);
        }
    }
}

/// Index of the true path behind every measured one of a sweep; empty when the truth is not known.
fn match_sweep(sweep: &SweepRecord, gates: &MatchGates, cycle_m: Option<f64>) -> Vec<Option<usize>> {
    match (&sweep.truth.link, &sweep.truth.pose) {
        (Some(link), Some(pose)) => matches(&sweep.estimate.paths, link, pose, gates, cycle_m),
        _ => Vec::new(),
    }
}

/// Index of the true path of a link behind each measured path; delays are cyclic over `cycle_m`, if they are.
pub fn matches(
    measured: &[MeasuredPath],
    link: &Link,
    pose: &PoseTruth,
    gates: &MatchGates,
    cycle_m: Option<f64>,
) -> Vec<Option<usize>> {
    let [w, x, y, z] = pose.quaternion_wb;
    let to_body = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)).inverse();
    let clock_m = pose.clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
    let seen: Vec<(f64, Vector3<f64>)> = link
        .paths
        .iter()
        .map(|path| apparent(path, &to_body, clock_m))
        .collect();
    let cost = |row: usize, column: usize| {
        let path: &MeasuredPath = &measured[row];
        let (c_tau_m, direction) = &seen[column];
        let apart_m = wrapped(path.c_tau_m - c_tau_m, cycle_m).abs() / gates.delay_m;
        let angle = unit(path.aoa_zenith_rad, path.aoa_azimuth_rad)
            .angle(direction)
            .to_degrees()
            / gates.angle_deg;
        (apart_m <= 1.0 && angle <= 1.0).then_some(apart_m * apart_m + angle * angle)
    };
    // The pieces of scattered waves lie everywhere, also beside the path that was measured: what is left may be one of them.
    let (pieces, waves): (Vec<usize>, Vec<usize>) =
        (0..seen.len()).partition(|&column| link.paths[column].is_scattered());
    let among = |rows: &[usize], columns: &[usize]| {
        let chosen = assign(rows.len(), columns.len(), 2.0, |row, column| {
            cost(rows[row], columns[column])
        });
        let found = chosen
            .into_iter()
            .map(|column| column.map(|column| columns[column]));
        found.collect::<Vec<_>>()
    };
    let rows: Vec<usize> = (0..measured.len()).collect();
    let mut matches = among(&rows, &waves);
    let left: Vec<usize> = rows.into_iter().filter(|&row| matches[row].is_none()).collect();
    for (row, column) in left.iter().zip(among(&left, &pieces)) {
        matches[*row] = column;
    }
    matches
}

/// Length and body-frame direction of a true path as the antennas see it.
fn apparent(path: &LinkPath, to_body: &UnitQuaternion<f64>, clock_m: f64) -> (f64, Vector3<f64>) {
    let direction = to_body * unit(path.aoa_zenith_rad, path.aoa_azimuth_rad);
    (path.delay_s * SPEED_OF_LIGHT_M_PER_S + clock_m, direction)
}

/// Unit vector of zenith angle and azimuth.
pub(crate) fn unit(zenith_rad: f64, azimuth_rad: f64) -> Vector3<f64> {
    let (st, ct) = libm::sincos(zenith_rad);
    let (sp, cp) = libm::sincos(azimuth_rad);
    Vector3::new(st * cp, st * sp, ct)
}

/// A difference of lengths on a circle of `cycle_m`.
fn wrapped(difference_m: f64, cycle_m: Option<f64>) -> f64 {
    match cycle_m {
        Some(cycle) if cycle > 0.0 => difference_m - cycle * libm::floor(difference_m / cycle + 0.5),
        _ => difference_m,
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2};

    use super::*;
    use crate::paths::{Interaction, Kind};
    use crate::test_flight::{measured, sweep, true_path};

    /// A UAV that looks north (yaw of 90 degrees) with its clock 100 ns ahead hears three paths.
    fn heard(paths: Vec<MeasuredPath>) -> SweepRecord {
        let mut record = sweep(0, [0.0; 3]);
        let pose = record.truth.pose.as_mut().expect("made with one");
        pose.quaternion_wb = [FRAC_1_SQRT_2, 0.0, 0.0, FRAC_1_SQRT_2];
        pose.clock_offset_s = 100e-9;
        let link = record.truth.link.as_mut().expect("made with one");
        link.paths = vec![
            true_path(0, 50.0, [FRAC_PI_2, FRAC_PI_2]),
            true_path(1, 60.0, [FRAC_PI_2, 0.0]),
            true_path(2, 60.5, [FRAC_PI_2, 0.02]),
        ];
        record.estimate.paths = paths;
        record
    }

    const CLOCK_M: f64 = 100e-9 * SPEED_OF_LIGHT_M_PER_S;

    #[test]
    fn paths_are_found_through_attitude_and_clock() {
        // Seen ahead what comes from the north; from the right (-90 degrees) what comes from the east.
        let ahead = measured(50.1 + CLOCK_M, [FRAC_PI_2, 0.001]);
        let right = measured(60.4 + CLOCK_M, [FRAC_PI_2, 0.015 - FRAC_PI_2]);
        let record = heard(vec![ahead, right]);
        assert_eq!(
            match_sweep(&record, &MatchGates::default(), None),
            [Some(0), Some(2)]
        );
    }

    #[test]
    fn beyond_either_gate_there_is_no_truth() {
        let late = measured(51.1 + CLOCK_M, [FRAC_PI_2, 0.0]);
        let aside = measured(50.0 + CLOCK_M, [FRAC_PI_2, 3.1_f64.to_radians()]);
        let no_clock = measured(50.0, [FRAC_PI_2, 0.0]);
        let record = heard(vec![late, aside, no_clock]);
        assert_eq!(match_sweep(&record, &MatchGates::default(), None), [None; 3]);
    }

    #[test]
    fn two_measured_paths_do_not_share_a_true_one() {
        // Both are nearest to the first-order path; one of them has another choice.
        let best = measured(60.02 + CLOCK_M, [FRAC_PI_2, -FRAC_PI_2]);
        let other = measured(60.15 + CLOCK_M, [FRAC_PI_2, 0.005 - FRAC_PI_2]);
        let record = heard(vec![best, other]);
        assert_eq!(
            match_sweep(&record, &MatchGates::default(), None),
            [Some(1), Some(2)]
        );
    }

    #[test]
    fn delays_wrap_when_they_are_cyclic() {
        let cycle_m = 70.0;
        let record = heard(vec![measured(50.0 + CLOCK_M - cycle_m, [FRAC_PI_2, 0.0])]);
        assert_eq!(match_sweep(&record, &MatchGates::default(), None), [None]);
        assert_eq!(
            match_sweep(&record, &MatchGates::default(), Some(cycle_m)),
            [Some(0)]
        );
    }

    #[test]
    fn a_piece_of_a_scattered_wave_is_behind_what_nothing_else_is_behind() {
        let near = [
            measured(50.3 + CLOCK_M, [FRAC_PI_2, 0.0]),
            measured(80.1 + CLOCK_M, [FRAC_PI_2, 0.0]),
        ];
        let mut record = heard(near.to_vec());
        let link = record.truth.link.as_mut().expect("made with one");
        let piece = |length_m| LinkPath {
            kind: Kind::of(&[Interaction::Scattering]),
            ..true_path(1, length_m, [FRAC_PI_2, FRAC_PI_2])
        };
        // Nearer to the first measured path than line of sight is.
        link.paths.extend([piece(50.3), piece(80.0)]);
        assert_eq!(
            match_sweep(&record, &MatchGates::default(), None),
            [Some(0), Some(4)]
        );
        let path = &record.truth.link.as_ref().expect("made with one").paths[4];
        assert!(path.order == Some(1) && !path.is_first_order());
    }
}
