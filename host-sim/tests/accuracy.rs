//! Path estimation at the Cramer-Rao bound: the flying estimator on int16 samples of a 12-bit converter, seeded.
//!
//! `cslam accuracy` prints the same cases with more trials; docs/path-estimation.md holds its table.

use cslam_host_sim::accuracy::{Mode, bounce, departures, false_alarms, pairs, scenes, single};

const SEED: u64 = 1;

#[test]
fn one_path_is_estimated_at_the_bound() {
    for snr_db in [-15.0, 0.0, 20.0, 40.0] {
        let figures = single(Mode::Best, snr_db, 200, SEED);
        assert!(figures.ratio.iter().all(|ratio| *ratio <= 1.10), "{figures:?}");
        assert!(
            figures.detected >= 0.98 && figures.outliers <= 0.01,
            "{figures:?}"
        );
        // Its own covariance says how wrong it is.
        assert!((0.8..1.25).contains(&figures.nees), "{figures:?}");
    }
}

#[test]
fn noise_is_rarely_a_path() {
    let figures = false_alarms(Mode::Best, 200, SEED);
    assert!(figures.sweeps_with_paths <= 5, "{figures:?}");
}

#[test]
fn nine_paths_over_thirty_decibels_are_found() {
    let figures = scenes(Mode::Best, 20.0, 10, SEED);
    let [near, middle, far] = figures.detected;
    assert!(near >= 1.0 && middle >= 0.99 && far >= 0.94, "{figures:?}");
    assert!(figures.false_alarms <= 0.05, "{figures:?}");
}

#[test]
fn a_ground_bounce_does_not_bias_the_line_of_sight() {
    for (distance_m, limit_m) in [(20.0, 2e-3), (50.0, 2e-3), (100.0, 4e-3)] {
        let figures = bounce(Mode::Best, distance_m, 100, SEED);
        assert!(
            figures.range_m[0] <= limit_m && figures.angle_deg[0] <= 0.03,
            "{figures:?}"
        );
    }
}

#[test]
fn close_pairs_are_told_apart() {
    // Separation in m and deg, second path in dB, share found by a joint fit in signal.md section 3.3.
    for (apart_m, apart_deg, second_db, expected) in [
        (0.75, 0.0, 0.0, 0.92),
        (0.0, 10.0, 0.0, 0.60),
        (0.0, 25.0, -10.0, 0.88),
        (0.6, 10.0, 0.0, 0.96),
    ] {
        let figures = pairs(Mode::Best, apart_m, apart_deg, second_db, 60, SEED);
        assert!(figures.both >= expected, "{figures:?}");
    }
}

#[test]
fn the_angle_of_departure_comes_from_the_beams() {
    let figures = departures(Mode::Best, 10.0, 60, SEED);
    assert!(figures.rms_deg <= 0.5, "{figures:?}");
}
