//! A start without departures: a UAV at rest whose accelerometer is biased, hence whose level is not quite level.

use nalgebra::{Matrix3, Vector3};

use super::super::*;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::{Gmt, World};
use crate::inertial::{Alignment, ImuIncrement, ImuStep, Motion};

const STEP_NS: u64 = 10_000_000;
const SWEEP_NS: u64 = 500_000_000;
const YAW_RAD: f64 = 0.4;
/// Of the accelerometer, m/s^2: 0.14 and -0.1 of tilt, 1 deg.
const BIAS: [f32; 3] = [0.14, -0.1, 0.02];
/// Of the yaw that the start is given, rad.
const YAW_ERROR_RAD: f64 = 0.015;

fn gmt() -> Transmitter {
    Transmitter {
        position_m: Vector3::new(1.0, -2.0, 1.5),
        sigma_m: 0.02,
        attitude: Rotation::<Gmt, World, f64>::identity(),
        reach: crate::array::BeamReach::default(),
    }
}

fn place() -> Vector3<f64> {
    Vector3::new(9.0, 5.0, 12.0)
}

fn attitude_wb() -> Matrix3<f64> {
    rotation(&Vector3::new(0.0, 0.0, YAW_RAD))
}

fn path(with_departure: bool) -> PathMeasurement {
    let way = gmt().position_m - place();
    let leaving = -way.normalize();
    PathMeasurement {
        c_tau_m: way.norm(),
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_vector(attitude_wb().tr_mul(&way)).expect("apart"),
        aoa_sigma_rad: 1e-4,
        aoa_rise_sigma_rad: 0.0,
        range_rate: None,
        departure: with_departure.then_some(FaceDirection {
            face: 0,
            cosines: [leaving.y, leaving.z],
            sigma: [1e-3; 2],
        }),
    }
}

fn sweep(time_ns: u64, with_departure: bool, yaw: bool) -> SweepMeasurement<'static> {
    SweepMeasurement {
        time_ns,
        gmt: gmt(),
        stop: 0,
        line_of_sight: Some(path(with_departure)),
        self_consistent: false,
        contrary: None,
        level_yaw: yaw.then_some(LevelYaw {
            yaw_rad: YAW_RAD + YAW_ERROR_RAD,
            sigma_rad: YAW_ERROR_RAD,
        }),
        reflections: &[],
        paths: &[],
        delta_ranges: true,
    }
}

/// Moves on to a time, at rest; two-way timing comes on the way.
fn rest(filter: &mut Filter49, from_ns: u64, until_ns: u64) {
    let force = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_PER_S2 as f32) + Vector3::from(BIAS);
    for start_ns in (from_ns..until_ns).step_by(STEP_NS as usize) {
        filter.increment(&ImuIncrement {
            start_ns,
            end_ns: start_ns + STEP_NS,
            delta_angle_rad: Vector3::zeros(),
            delta_velocity_m_per_s: force * 0.01,
            delta_position_m: force * 0.5e-4,
            removed: ImuErrors::default(),
        });
        if start_ns % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(start_ns, 0.0);
        }
    }
}

/// A filter that has rested for three seconds and may start at the fourth.
fn rested() -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    rest(&mut filter, 0, 3_000_000_000);
    let up = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_PER_S2 as f32) + Vector3::from(BIAS);
    filter.aligned(&Alignment {
        gyro_bias_rad_per_s: Vector3::zeros(),
        gyro_bias_sigma_rad_per_s: Vector3::repeat(1e-5),
        up: up.normalize(),
        tilt_sigma_rad: 0.02,
        accel_bias_up_m_per_s2: up.norm() - STANDARD_GRAVITY_M_PER_S2 as f32,
        accel_bias_up_sigma_m_per_s2: 0.03,
        time_ns: 3_000_000_000,
    });
    rest(&mut filter, 3_000_000_000, 4_000_000_000);
    filter
}

#[test]
fn rest_tells_the_vertical_part_of_the_bias_and_a_pose_that_was_wrong_does_not_take_it() {
    let mut filter = rested();
    let knows = |filter: &Filter49| {
        let bias = filter.nominal().imu.accel_bias_m_per_s2;
        let sigma = |axis| libm::sqrt(filter.variance(ACCEL_BIAS + axis));
        assert!(
            (bias.z - BIAS[2]).abs() < 5e-3 && bias.xy().norm() < 1e-3,
            "{bias}"
        );
        assert!((sigma(2) - 0.03).abs() < 2e-3, "{}", sigma(2));
        assert!((sigma(0) - 0.196).abs() < 2e-3 && (sigma(1) - 0.196).abs() < 2e-3);
    };
    knows(&filter);
    filter.restart();
    knows(&filter);
}

/// The tilt's error is the bias at rest, however the body leans at the start.
#[test]
fn a_body_that_leans_since_rest_starts_with_a_sound_covariance() {
    let mut filter = rested();
    let lean = rotation(&Vector3::new(0.0, 0.35, 0.0));
    filter.increment(&ImuIncrement {
        start_ns: 4_000_000_000,
        end_ns: 4_000_000_000 + STEP_NS,
        delta_angle_rad: Vector3::new(0.0, 0.35, 0.0),
        delta_velocity_m_per_s: Vector3::new(0.0, 0.0, 0.098),
        delta_position_m: Vector3::zeros(),
        removed: ImuErrors::default(),
    });
    let mut sweep = sweep(4_000_000_000 + STEP_NS, false, true);
    let seen = (attitude_wb() * lean).tr_mul(&(gmt().position_m - place()));
    if let Some(path) = &mut sweep.line_of_sight {
        path.aoa = Direction::from_vector(seen).expect("apart");
    }
    assert_eq!(filter.sweep(&sweep), SweepVerdict::Started);
    // What is left of the tilt once the horizontal bias is known: mounting and what the gyroscope adds. No direction may have less than nothing.
    let states: [usize; 6] = core::array::from_fn(|i| if i < 3 { ATTITUDE + i } else { ACCEL_BIAS + i - 3 });
    let joint = nalgebra::Matrix6::from_fn(|i, j| f64::from(filter.covariance.at(states[i], states[j])));
    let least = joint.symmetric_eigenvalues().min();
    assert!(least > 0.0, "{least}");
}

fn error_m(filter: &Filter49) -> Vector3<f64> {
    filter.nominal().position_m - place()
}

/// Rotation vector from the true attitude to the estimated one, small, world axes, rad.
fn turn_rad(filter: &Filter49) -> Vector3<f64> {
    let off = filter.nominal().attitude * attitude_wb().transpose();
    Vector3::new(off.m32 - off.m23, off.m13 - off.m31, off.m21 - off.m12) * 0.5
}

#[test]
fn one_sweep_and_a_yaw_start_a_filter_that_knows_its_error() {
    let mut filter = rested();
    assert!(filter.level().is_some());
    assert_eq!(
        filter.sweep(&sweep(4_000_000_000, false, false)),
        SweepVerdict::Waiting
    );
    rest(&mut filter, 4_000_000_000, 4_500_000_000);
    assert_eq!(
        filter.sweep(&sweep(4_500_000_000, false, true)),
        SweepVerdict::Started
    );
    assert!(filter.level().is_none() && filter.pose().is_some());
    // Tilt of 1 deg and yaw of 0.9 deg at 16 m: some decimetres, of which the covariance explains all three numbers.
    let error = error_m(&filter);
    assert!((0.1..0.6).contains(&error.norm()), "{error}");
    let covariance = filter.covariance().block(POSITION, POSITION).map(f64::from);
    let explained = error.dot(&(covariance.try_inverse().expect("regular") * error));
    assert!(explained < 6.0, "{explained}");
    assert!(covariance.trace() < 0.5, "{covariance}");
    // A yaw turns the place about the GMT: dp = rho l x dth.
    let way = gmt().position_m - place();
    let (p, th) = (
        filter.covariance().block(POSITION, ATTITUDE),
        YAW_ERROR_RAD * YAW_ERROR_RAD,
    );
    let expected = way.cross(&Vector3::z()) * th;
    let shared = p.column(2).map(f64::from);
    assert!(
        (shared - expected).norm() < 0.1 * expected.norm(),
        "{shared} {expected}"
    );
}

#[test]
fn a_departure_takes_out_the_error_of_place_and_attitude_together() {
    let mut filter = rested();
    rest(&mut filter, 4_000_000_000, 4_500_000_000);
    let _ = filter.sweep(&sweep(4_500_000_000, false, true));
    let (error, turn) = (error_m(&filter).norm(), turn_rad(&filter));
    assert!(turn.z > 0.014 && turn.norm() > 0.02, "{turn}");
    for k in 10..14 {
        rest(&mut filter, k * SWEEP_NS - SWEEP_NS, k * SWEEP_NS);
        assert_eq!(
            filter.sweep(&sweep(k * SWEEP_NS, true, false)),
            SweepVerdict::Accepted
        );
    }
    assert!(
        error_m(&filter).norm() < 0.04 && error > 0.1,
        "{}",
        error_m(&filter)
    );
    assert!(turn_rad(&filter).z.abs() < 0.4 * turn.z, "{}", turn_rad(&filter));
}

#[test]
fn tilt_and_bias_are_one_error() {
    let mut filter = rested();
    rest(&mut filter, 4_000_000_000, 4_500_000_000);
    let _ = filter.sweep(&sweep(4_500_000_000, false, true));
    let before = filter.sigma(VELOCITY);
    // Dead reckoning at rest: a tilt without the bias that made it would gather 0.2 m/s each second.
    rest(&mut filter, 4_500_000_000, 7_500_000_000);
    let mut silent = sweep(7_500_000_000, false, false);
    silent.line_of_sight = None;
    let _ = filter.sweep(&silent);
    let level = filter.nominal().velocity_m_per_s.xy().norm();
    assert!(level < 0.02, "{level}");
    let grown = [VELOCITY, VELOCITY + 1].map(|i| libm::sqrt(filter.variance(i)));
    assert!(grown.iter().all(|sigma| *sigma < 0.25), "{before} {grown:?}");
}

#[test]
fn level_is_forgotten_with_time_and_with_the_inertial_data() {
    let mut filter = rested();
    rest(&mut filter, 4_000_000_000, 13_000_000_000);
    assert!(filter.level().is_none(), "ten seconds");
    let start = sweep(13_000_000_000, false, true);
    assert_eq!(filter.sweep(&start), SweepVerdict::Waiting);

    let mut filter = rested();
    filter.step(&ImuStep {
        increment: ImuIncrement {
            start_ns: 4_000_000_000,
            end_ns: 4_500_000_000,
            delta_angle_rad: Vector3::zeros(),
            delta_velocity_m_per_s: Vector3::zeros(),
            delta_position_m: Vector3::zeros(),
            removed: ImuErrors::default(),
        },
        motion: Motion::Coasting,
        angle_variance_rad2: 0.0,
        velocity_variance_m2_per_s2: 0.0,
    });
    assert_eq!(
        filter.sweep(&sweep(4_500_000_000, false, true)),
        SweepVerdict::Waiting
    );
}
