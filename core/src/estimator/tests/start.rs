//! The covariance of a start in flight, against starts whose errors are drawn: noise of the fixes and what they share, biases of the
//! inertial sensor, its mounting, the clock.

use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

use super::super::nominal::rotation;
use super::super::start_covariance::LASTING_S;
use super::super::window::SIGHT_SCATTER_RAD;
use super::super::*;
use super::window::{G, attitude, increment, position, velocity};
use crate::geometry::{Gmt, World};
use crate::inertial::ImuIncrement;

type Double = Filter<f64, { states(0) }>;
type Joint = SMatrix<f64, 9, 9>;

const TRIALS: usize = 400;
/// Noise of a fix per axis: what the window adds to a claim of none, m.
const FIX_M: f64 = 0.06;
const ARRIVAL_RAD: f64 = 2.5e-3;
const CLOCK_M: f64 = 0.05;
const DRIFT_M_PER_S: f64 = 0.2;

/// Deviates of the normal distribution, near enough: sums of twelve.
struct Draw(u64);

impl Draw {
    fn one(&mut self) -> f64 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            sum += (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        }
        sum
    }

    fn vector(&mut self, sigma: f64) -> Vector3<f64> {
        Vector3::new(self.one(), self.one(), self.one()) * sigma
    }
}

/// A start at the end of five fixes, and how it errs: true less estimated.
fn start(draw: &mut Draw) -> Option<(Double, SVector<f64, 9>)> {
    let radio = RadioModel::default();
    let mut filter = Double::new(&radio, FilterConfig::default(), 0);
    let priors = filter.config.priors;
    filter.covariance.reset(CLOCK_OFFSET, CLOCK_M * CLOCK_M);
    filter
        .covariance
        .reset(CLOCK_DRIFT, DRIFT_M_PER_S * DRIFT_M_PER_S);
    let gyro = draw.vector(priors.gyro_bias_rad_per_s);
    let accel = draw.vector(priors.accel_bias_m_per_s2);
    let mounting = draw.vector(priors.mounting_rad);
    let arrival = draw.vector(ARRIVAL_RAD);
    let (clock_m, drift_m_per_s) = (CLOCK_M * draw.one(), DRIFT_M_PER_S * draw.one());
    // What the sensor has in its own axes; the estimate takes it for that of the body.
    let misread = rotation(&mounting).transpose();
    let mut lasting = Vector3::zeros();
    let mut window = Window::new();
    for k in 0..=200_u32 {
        let t = f64::from(k) * 0.01;
        if k.is_multiple_of(50) {
            let way = G - position(t);
            let (towards, range_m) = (way.normalize(), way.norm());
            let kept = if k == 0 {
                0.0
            } else {
                LASTING_S / (LASTING_S + 0.5)
            };
            lasting = lasting * kept + draw.vector(SIGHT_SCATTER_RAD * libm::sqrt(1.0 - kept * kept));
            let across = lasting - towards * lasting.dot(&towards);
            let late_m = clock_m + drift_m_per_s * (t - 2.0);
            let off = draw.vector(FIX_M) + across * range_m + towards * -late_m;
            let fix = position(t) + off;
            let seen = attitude(t).tr_mul(&towards);
            let seen = rotation(&arrival) * seen;
            window.push(
                &filter.nominal,
                fix,
                &[Vector3::zeros(); 2],
                (G - fix).normalize(),
                seen,
            );
        }
        if k < 200 {
            let exact = increment(t);
            let turn = exact.delta_angle_rad.map(f64::from) + gyro * 0.01;
            let gained = exact.delta_velocity_m_per_s.map(f64::from) + accel * 0.01;
            let moved = exact.delta_position_m.map(f64::from) + accel * 0.5e-4;
            window.advance(&ImuIncrement {
                delta_angle_rad: (misread * turn).map(|c| c as f32),
                delta_velocity_m_per_s: (misread * gained).map(|c| c as f32),
                delta_position_m: (misread * moved).map(|c| c as f32),
                ..exact
            });
        }
    }
    let solution = window.solve(5, None)?;
    let gmt = Transmitter {
        position_m: G,
        sigma_m: 0.0,
        attitude: Rotation::<Gmt, World, f64>::identity(),
        reach: crate::array::BeamReach::default(),
    };
    filter.set_pose(&gmt, &solution);
    let turn = attitude(2.0) * solution.attitude.transpose();
    let angle = Vector3::new(turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12) * 0.5;
    let mut error = SVector::<f64, 9>::zeros();
    let parts = [
        position(2.0) - solution.position_m,
        velocity(2.0) - solution.velocity_m_per_s,
        angle,
    ];
    for (value, part) in error.iter_mut().zip(parts.iter().flat_map(|part| part.iter())) {
        *value = *part;
    }
    Some((filter, error))
}

/// The sight at the end, and the axes across it: horizontal, and the third.
fn axes() -> [Vector3<f64>; 3] {
    let sight = (G - position(2.0)).normalize();
    let level = sight.cross(&Vector3::z()).normalize();
    [sight, level, sight.cross(&level)]
}

#[test]
fn a_start_errs_as_its_covariance_says() {
    let mut draw = Draw(7);
    let (mut claimed, mut found, mut nees, mut number) = (Joint::zeros(), Joint::zeros(), 0.0, 0.0);
    for _ in 0..TRIALS {
        let Some((filter, error)) = start(&mut draw) else {
            continue;
        };
        let joint = Joint::from_fn(|i, j| filter.covariance.at(i, j));
        let inverse = joint.cholesky().expect("positive definite").inverse();
        nees += error.dot(&(inverse * error));
        claimed += joint;
        found += error * error.transpose();
        number += 1.0;
    }
    // The others bend too much for a force that is as long inside as outside.
    assert!(number > 0.8 * TRIALS as f64, "{number}");
    let (claimed, found) = (claimed / number, found / number);
    assert!((6.5..11.5).contains(&(nees / number)), "{}", nees / number);
    let of = |joint: &Joint, i: usize, a: &Vector3<f64>, j: usize, b: &Vector3<f64>| {
        let block: Matrix3<f64> = joint.fixed_view::<3, 3>(i, j).into();
        a.dot(&(block * b))
    };
    for axis in axes() {
        for first in [POSITION, VELOCITY, ATTITUDE] {
            let ratio =
                libm::sqrt(of(&found, first, &axis, first, &axis) / of(&claimed, first, &axis, first, &axis));
            assert!((0.7..1.3).contains(&ratio), "{first}, {axis}: {ratio}");
        }
    }
    // About the sight the force is all that tells.
    let [sight, level, _] = axes();
    let about = of(&claimed, ATTITUDE, &sight, ATTITUDE, &sight);
    assert!(about > 4.0 * of(&claimed, ATTITUDE, &level, ATTITUDE, &level));
    // A body that is thought to be turned about the sight is thought to fly aside.
    let correlation = |joint: &Joint| {
        let both =
            of(joint, VELOCITY, &level, VELOCITY, &level) * of(joint, ATTITUDE, &sight, ATTITUDE, &sight);
        of(joint, VELOCITY, &level, ATTITUDE, &sight) / libm::sqrt(both)
    };
    let (said, is) = (correlation(&claimed), correlation(&found));
    assert!(is.abs() > 0.15 && (said - is).abs() < 0.15, "{said} {is}");
}

#[test]
fn the_bias_of_the_accelerometer_hides_in_the_attitude_of_a_start() {
    let (filter, _) = start(&mut Draw(3)).expect("consistent");
    let [sight, ..] = axes();
    let force = Vector3::z();
    let lever = sight.cross(&force);
    let attitude_wb = filter.nominal.attitude;
    // A force that is felt too far to one side turns the body to the other.
    let with = attitude_wb * filter.covariance.block(ATTITUDE, ACCEL_BIAS).transpose() * sight;
    let bias = filter.variance(ACCEL_BIAS);
    let expected = bias / (lever.norm() * crate::constants::STANDARD_GRAVITY_M_PER_S2);
    let shared = with.dot(&lever.normalize());
    assert!((0.8..1.2).contains(&(shared / expected)), "{shared} {expected}");
}
