//! What rest has shown of the tilt: by a biased accelerometer that is turned in the body.

use nalgebra::{Matrix3, Vector3};

use super::super::nominal::rotation;
use super::super::*;
use super::flight::{STEP_NS, SWEEP_NS, fly_from, increment, truth};
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::inertial::{Alignment, ImuIncrement, ImuStep, Motion};

/// What a body of this attitude that stands still finds, of an accelerometer with this bias, m/s^2, turned in it by this, rad.
fn alignment(attitude: &Matrix3<f64>, bias: Vector3<f64>, turned: Vector3<f64>) -> Alignment {
    let up = attitude.tr_mul(&Vector3::z()) * STANDARD_GRAVITY_M_PER_S2;
    // What the sensor feels is turned the other way.
    let felt = (rotation(&-turned) * up + bias).map(|c| c as f32);
    Alignment {
        gyro_bias_rad_per_s: Vector3::zeros(),
        gyro_bias_sigma_rad_per_s: Vector3::repeat(1e-5),
        up: felt.normalize(),
        accel_bias_up_m_per_s2: felt.norm() - STANDARD_GRAVITY_M_PER_S2 as f32,
        accel_bias_up_sigma_m_per_s2: 0.03,
        time_ns: 0,
    }
}

fn rested(rest: &Alignment) -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    filter.aligned(rest);
    filter
}

#[test]
fn rest_tells_the_vertical_part_of_the_bias_and_a_pose_that_was_wrong_does_not_take_it() {
    let bias = Vector3::new(0.14, -0.1, 0.02);
    let mut filter = rested(&alignment(&Matrix3::identity(), bias, Vector3::zeros()));
    let knows = |filter: &Filter49| {
        let found = filter.nominal().imu.accel_bias_m_per_s2;
        let sigma = |axis| libm::sqrt(filter.variance(ACCEL_BIAS + axis));
        assert!(
            (f64::from(found.z) - bias.z).abs() < 5e-3 && found.xy().norm() < 1e-3,
            "{found}"
        );
        assert!((sigma(2) - 0.03).abs() < 2e-3, "{}", sigma(2));
        assert!((sigma(0) - 0.196).abs() < 2e-3 && (sigma(1) - 0.196).abs() < 2e-3);
    };
    knows(&filter);
    filter.restart();
    knows(&filter);
}

/// With an attitude that is known, what rest has the tilt off by is the bias, or the mounting, whichever is not known; whatever the body has done since.
#[test]
fn of_a_known_attitude_the_tilt_at_rest_tells_bias_and_mounting() {
    let at_rest = rotation(&Vector3::new(0.0, 0.0, 2.1)) * rotation(&Vector3::new(0.2, -0.1, 0.0));
    let since = rotation(&Vector3::new(0.3, 0.25, -0.6));
    for (bias, turned) in [
        (Vector3::new(0.12, -0.08, 0.0), Vector3::zeros()),
        (Vector3::zeros(), Vector3::new(-6e-3, 9e-3, 0.0)),
    ] {
        let (bias, turned) = (rotation(&Vector3::new(0.2, -0.1, 0.0)).tr_mul(&bias), turned);
        let mut filter = rested(&alignment(&at_rest, bias, turned));
        // The gyroscope is turned with the accelerometer: what it feels is the body's turn in its own axes.
        let carried = filter.nominal.attitude * rotation(&-turned) * since * rotation(&turned);
        filter.nominal.attitude = at_rest * since;
        for i in 0..3 {
            filter.covariance.reset(ATTITUDE + i, 1e-8);
            let known = if turned == Vector3::zeros() {
                MOUNTING
            } else {
                ACCEL_BIAS
            };
            filter.covariance.reset(known + i, 0.0);
        }
        assert!(filter.take_rest_tilt(&carried));
        let imu = filter.nominal.imu;
        let level = |attitude: &Matrix3<f64>, v: &Vector3<f64>| (attitude * v).xy();
        let (found, expected, least) = if turned == Vector3::zeros() {
            let found = level(&at_rest, &imu.accel_bias_m_per_s2.map(f64::from));
            (found, level(&at_rest, &bias), 0.9)
        } else {
            let now = at_rest * since;
            (
                level(&now, &imu.mounting_rad.map(f64::from)),
                level(&now, &turned),
                0.65,
            )
        };
        // As much of it as the gyroscope's errors leave.
        let share = found.dot(&expected) / expected.norm_squared();
        assert!((least..1.0).contains(&share), "{share}");
        assert!(
            (found - expected * share).norm() < 0.05 * expected.norm(),
            "{found} {expected}"
        );
    }
}

/// A start from a window knows its attitude to a degree about the sight; the tilt of rest takes part.
#[test]
fn a_start_soon_after_rest_knows_its_tilt_better() {
    let started = |rest: Option<Alignment>| {
        let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
        if let Some(rest) = rest {
            filter.aligned(&rest);
        }
        fly_from(&mut filter, 0, 8 * SWEEP_NS, 0, |_, filter, sweep| {
            if filter.is_running() {
                sweep.line_of_sight = None;
            }
        });
        filter
    };
    let rest = || alignment(&truth(0).attitude, Vector3::zeros(), Vector3::zeros());
    let [without, with] = [None, Some(rest())].map(started);
    assert!(without.is_running() && with.is_running());
    let unsure = [&without, &with].map(|filter| filter.sigma(ATTITUDE));
    assert!(unsure[1] < 0.9 * unsure[0], "{unsure:?}");

    // One that leans otherwise than rest allows is no start, until rest is long ago.
    let mut leaning = rest();
    leaning.up = rotation(&Vector3::new(0.3, 0.0, 0.0)).map(|c| c as f32) * leaning.up;
    let filter = started(Some(leaning));
    assert!(!filter.is_running() && filter.counters().starts_refused > 0);
    let mut filter = filter;
    fly_from(&mut filter, 8 * SWEEP_NS, 24 * SWEEP_NS, 0, |_, _, _| ());
    assert!(filter.is_running());
}

#[test]
fn the_tilt_is_forgotten_with_the_inertial_data() {
    let mut filter = rested(&alignment(&truth(0).attitude, Vector3::zeros(), Vector3::zeros()));
    assert!(filter.rest_tilt.is_some());
    filter.step(&ImuStep {
        increment: ImuIncrement {
            end_ns: STEP_NS,
            ..increment(0)
        },
        motion: Motion::Coasting,
        angle_variance_rad2: 0.0,
        velocity_variance_m2_per_s2: 0.0,
    });
    filter.advance(STEP_NS);
    assert!(filter.rest_tilt.is_none());
}
