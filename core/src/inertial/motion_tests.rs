//! The mechanisation against motions that are known in closed form, and what `f32` costs it.

use core::f64::consts::PI;
use std::println;
use std::vec::Vec;

use nalgebra::Vector3;

use super::{Imu, ImuConfig, ImuStep, Integrator, Motion, Strapdown, Turn};
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::Real;
use crate::inertial::{ImuIncrement, ImuSample};

extern crate std;

const H_S: f64 = 1e-3;

/// Angle of a pure coning motion over an interval: the integral of its body rate. Half angle `theta`, rate `omega`.
fn coning_angle(theta: f64, omega: f64, start_s: f64) -> Vector3<f64> {
    let (a, b) = (omega * start_s, omega * (start_s + H_S));
    let s = libm::sin(theta / 2.0);
    Vector3::new(
        libm::sin(theta) * (libm::cos(b) - libm::cos(a)),
        libm::sin(theta) * (libm::sin(b) - libm::sin(a)),
        -2.0 * s * s * omega * H_S,
    )
}

/// Attitude of that motion: the body's z axis goes round a cone, and no axis turns on average.
fn coning_attitude(theta: f64, omega: f64, time_s: f64) -> Turn<f64> {
    let (s, c) = (libm::sin(theta / 2.0), libm::cos(theta / 2.0));
    let at = omega * time_s;
    Turn::from_quaternion([c, s * libm::cos(at), s * libm::sin(at), 0.0]).expect("unit")
}

/// Drift of the attitude about z under coning, rad/s, by the integrator in `T`, and by samples simply turned one after the
/// other.
fn coning_drift<T: Real>(theta: f64, hz: f64, duration_s: f64) -> (f64, f64) {
    let omega = 2.0 * PI * hz;
    let samples = (duration_s / H_S + 0.5) as u32;
    let mut sum = Integrator::<T>::default();
    let mut attitude = coning_attitude(theta, omega, 0.0);
    let mut uncompensated = attitude;
    for k in 0..samples {
        let angle = coning_angle(theta, omega, f64::from(k) * H_S);
        let rate = (angle / H_S).map(T::of);
        sum.add(&rate, &Vector3::zeros(), T::of(H_S));
        uncompensated = uncompensated
            .then(&Turn::from_rotation_vector(&angle))
            .renormalised();
        if k % 10 == 9 {
            let step = sum.angle_rad().map(|a| a.to_f64());
            attitude = attitude.then(&Turn::from_rotation_vector(&step)).renormalised();
            sum.restart();
        }
    }
    let truth = coning_attitude(theta, omega, f64::from(samples) * H_S).inverse();
    let off = |a: Turn<f64>| truth.then(&a).rotation_vector().z / duration_s;
    (off(attitude), off(uncompensated))
}

#[test]
fn coning_drifts_as_the_theory_says_with_and_without_compensation() {
    let theta = 0.1 * PI / 180.0;
    for hz in [20.0, 50.0, 100.0, 200.0] {
        let x = 2.0 * PI * hz * H_S;
        let half = 4.0 * libm::sin(x / 2.0) * libm::sin(x / 2.0);
        let square = libm::sin(theta) * libm::sin(theta) / H_S;
        let none = square * 0.5 * (x - libm::sin(x));
        let left = none - square * half * (7.0 * libm::sin(x) - libm::sin(2.0 * x)) / 60.0;
        // A whole number of cycles at every frequency; the first two samples have no course yet.
        let (drift, plain) = coning_drift::<f64>(theta, hz, 20.0);
        println!(
            "{hz} Hz: {plain:.3e} rad/s plain (theory {none:.3e}), {drift:.3e} compensated ({left:.3e})"
        );
        assert!(
            (plain.abs() / none - 1.0).abs() < 1e-3,
            "{hz} Hz: {plain} of {none}"
        );
        let start_up = square * 2.0 * H_S * x * x * x / 12.0 / 20.0;
        assert!(
            (drift.abs() - left).abs() < 0.02 * left + start_up,
            "{hz} Hz: {drift} of {left}"
        );
        assert_eq!(plain < 0.0, drift < 0.0);
    }
}

#[test]
fn single_precision_keeps_the_compensation() {
    let theta = PI / 180.0;
    for hz in [20.0, 50.0, 100.0] {
        let (narrow, plain) = coning_drift::<f32>(theta, hz, 10.0);
        let (wide, _) = coning_drift::<f64>(theta, hz, 10.0);
        println!("{hz} Hz: {narrow:.3e} in f32, {wide:.3e} in f64, {plain:.3e} rad/s plain");
        // A fiftieth of the gyroscope's walk in a second.
        assert!((narrow - wide).abs() < 3e-7, "{hz} Hz: {narrow} against {wide}");
    }
}

/// Rolling and swaying in step push the UAV up without an accelerometer that would say so: the mean is half the
/// product of the amplitudes. What each way of integrating loses of it has the form of coning's loss.
#[test]
fn sculling_pushes_as_the_theory_says() {
    let (roll, sway) = (1e-3, 20.0);
    for hz in [20.0, 50.0, 100.0] {
        let omega = 2.0 * PI * hz;
        let (mut sum, mut plain) = (Integrator::<f64>::default(), Vector3::zeros());
        let mut attitude = Turn::<f64>::identity();
        for k in 0..20_000u32 {
            let (a, b) = (omega * f64::from(k) * H_S, omega * f64::from(k + 1) * H_S);
            let angle = Vector3::new(roll * (libm::sin(b) - libm::sin(a)), 0.0, 0.0);
            let push = Vector3::new(0.0, sway / omega * (libm::cos(a) - libm::cos(b)), 0.0);
            sum.add(&(angle / H_S), &(push / H_S), H_S);
            plain += attitude.apply(&(push + angle.cross(&push) * 0.5));
            attitude = attitude.then(&Turn::from_rotation_vector(&angle));
        }
        let (truth, x) = (0.5 * roll * sway, omega * H_S);
        let pair = 4.0 * libm::sin(x / 2.0) * libm::sin(x / 2.0) / x;
        let lost = truth * (1.0 - libm::sin(x) / x);
        let left = lost - 2.0 * truth * pair * (7.0 * libm::sin(x) - libm::sin(2.0 * x)) / 60.0;
        let (with, without) = (truth - sum.velocity_m_per_s().z / 20.0, truth - plain.z / 20.0);
        println!(
            "{hz} Hz: lost {without:.3e} m/s^2 (theory {lost:.3e}), with compensation {with:.3e} ({left:.3e})"
        );
        assert!(
            (without / lost - 1.0).abs() < 0.01,
            "{hz} Hz: {without} of {lost}"
        );
        assert!(
            (with - left).abs() < 0.05 * left + 1e-3 * lost,
            "{hz} Hz: {with} of {left}"
        );
    }
}

/// Position, velocity, acceleration and Euler angles with their rates, all sums of sinusoids.
struct Flight;

impl Flight {
    fn wave(t: f64, parts: &[(f64, f64, f64)]) -> [f64; 3] {
        parts.iter().fold([0.0; 3], |[p, v, a], &(size, rate, phase)| {
            let (sin, cos) = libm::sincos(rate * t + phase);
            [
                p + size * sin,
                v + size * rate * cos,
                a - size * rate * rate * sin,
            ]
        })
    }

    fn at(t: f64) -> (Strapdown<f64>, Vector3<f64>, Vector3<f64>) {
        let axes = [
            Self::wave(t, &[(40.0, 0.11, 0.2), (3.0, 0.9, 1.0), (2e-4, 340.0, 0.0)]),
            Self::wave(t, &[(30.0, 0.13, 1.3), (2.0, 1.1, 0.4), (1e-4, 410.0, 0.5)]),
            Self::wave(t, &[(6.0, 0.21, 2.0), (0.5, 1.7, 0.1), (2e-4, 377.0, 1.0)]),
        ];
        let pick = |order: usize| Vector3::new(axes[0][order], axes[1][order], axes[2][order]);
        let [yaw, yaw_rate, _] = Self::wave(t, &[(2.0, 0.3, 0.0), (2e-3, 300.0, 0.3)]);
        let [pitch, pitch_rate, _] = Self::wave(t, &[(0.2, 1.3, 0.5), (3e-3, 314.0, 0.0)]);
        let [roll, roll_rate, _] = Self::wave(t, &[(0.25, 1.1, 1.5), (3e-3, 314.0, 1.57)]);
        let about = |x, y, z| Turn::from_rotation_vector(&Vector3::new(x, y, z));
        let attitude = about(0.0, 0.0, yaw)
            .then(&about(0.0, pitch, 0.0))
            .then(&about(roll, 0.0, 0.0));
        let ((sp, cp), (sr, cr)) = (libm::sincos(pitch), libm::sincos(roll));
        let rate = Vector3::new(
            roll_rate - yaw_rate * sp,
            pitch_rate * cr + yaw_rate * cp * sr,
            -pitch_rate * sr + yaw_rate * cp * cr,
        );
        let up = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_PER_S2);
        let force = attitude.inverse().apply(&(pick(2) + up));
        let state = Strapdown {
            position_m: pick(0) + Vector3::new(120.0, 80.0, 20.0),
            velocity_m_per_s: pick(1),
            attitude,
        };
        (state, rate, force)
    }

    /// Mean rate and force over a millisecond by three-point Gauss quadrature.
    fn means(start_s: f64) -> (Vector3<f64>, Vector3<f64>) {
        let node = 0.5 * H_S * libm::sqrt(0.6);
        let middle = start_s + 0.5 * H_S;
        let [a, b, c] = [-node, 0.0, node].map(|d| Self::at(middle + d));
        let mean =
            |x: &Vector3<f64>, y: &Vector3<f64>, z: &Vector3<f64>| (x * 5.0 + y * 8.0 + z * 5.0) / 18.0;
        (mean(&a.1, &b.1, &c.1), mean(&a.2, &b.2, &c.2))
    }
}

/// A brisk turn in a circle: constant body rate and force.
struct Circle;

impl Circle {
    const SPEED: f64 = 8.0;
    const RATE: f64 = 1.0;

    fn at(t: f64) -> Strapdown<f64> {
        let (sin, cos) = libm::sincos(Self::RATE * t);
        let radius = Self::SPEED / Self::RATE;
        Strapdown {
            position_m: Vector3::new(120.0 + radius * sin, 80.0 - radius * cos, 20.0),
            velocity_m_per_s: Vector3::new(cos, sin, 0.0) * Self::SPEED,
            attitude: Turn::from_rotation_vector(&Vector3::new(0.0, 0.0, Self::RATE * t)),
        }
    }

    fn means(_: f64) -> (Vector3<f64>, Vector3<f64>) {
        let force = Vector3::new(0.0, Self::SPEED * Self::RATE, STANDARD_GRAVITY_M_PER_S2);
        (Vector3::new(0.0, 0.0, Self::RATE), force)
    }
}

/// Largest error of position (m) and attitude (rad) over a motion, with the nominal state in `T`: increments by the
/// flying `f32` code from `f32` samples.
fn flown<T: Real>(
    seconds: u32,
    start: &Strapdown<f64>,
    means: impl Fn(f64) -> (Vector3<f64>, Vector3<f64>),
    truth: impl Fn(f64) -> Strapdown<f64>,
) -> (f64, f64) {
    let mut imu = Imu::new(ImuConfig::default().without_noise());
    let mut state = Strapdown::<T> {
        position_m: start.position_m.map(T::of),
        velocity_m_per_s: start.velocity_m_per_s.map(T::of),
        attitude: Turn::from_quaternion(start.attitude.to_quaternion().map(T::of)).expect("unit"),
    };
    let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
    // The first sample only says when integration begins.
    for k in 0..=u64::from(seconds) * 1000 {
        let (rate, force) = means((k as f64 - 1.0) * H_S);
        let sample = ImuSample {
            time_ns: k * 1_000_000,
            rate_rad_per_s: rate.map(|r| r as f32),
            specific_force_m_per_s2: force.map(|f| f as f32),
        };
        let Some(step) = imu.push(&sample) else { continue };
        assert_eq!((step.motion, step.angle_variance_rad2), (Motion::Measured, 0.0));
        state.advance(&step.increment);
        let here = truth(step.increment.end_ns as f64 * 1e-9);
        let off = here.position_m - state.position_m.map(|p| p.to_f64());
        let turned = state.attitude.to_quaternion().map(|q| q.to_f64());
        let turned = Turn::from_quaternion(turned).expect("finite");
        worst_m = worst_m.max(off.norm());
        worst_rad = worst_rad.max(here.attitude.inverse().then(&turned).rotation_vector().norm());
    }
    assert_eq!(imu.counters().spikes, 0, "the vibration is not taken for spikes");
    (worst_m, worst_rad)
}

/// The same motion with every number in `f64`.
fn reference(seconds: u32) -> (f64, f64) {
    let (mut state, _, _) = Flight::at(0.0);
    let mut sum = Integrator::<f64>::default();
    let up = Vector3::new(0.0, 0.0, -STANDARD_GRAVITY_M_PER_S2);
    let (mut worst_m, mut worst_rad) = (0.0f64, 0.0f64);
    for k in 0..seconds * 1000 {
        let (rate, force) = Flight::means(f64::from(k) * H_S);
        sum.add(&rate, &force, H_S);
        if k % 10 == 9 {
            let dt = 0.01;
            state.position_m +=
                state.velocity_m_per_s * dt + state.attitude.apply(&sum.position_m()) + up * (dt * dt / 2.0);
            state.velocity_m_per_s += state.attitude.apply(&sum.velocity_m_per_s()) + up * dt;
            state.attitude = state.attitude.then(&Turn::from_rotation_vector(&sum.angle_rad()));
            sum.restart();
            let (here, _, _) = Flight::at(f64::from(k + 1) * H_S);
            worst_m = worst_m.max((here.position_m - state.position_m).norm());
            let off = here.attitude.inverse().then(&state.attitude).rotation_vector();
            worst_rad = worst_rad.max(off.norm());
        }
    }
    (worst_m, worst_rad)
}

/// Two minutes of a flight with vibration and coning, integrated freely. What decides the type of each part: measured
/// 0.9 mm with every number in `f64`, 5.5 mm with increments in `f32`, 51 mm with the nominal state in `f32` too.
#[test]
fn increments_hold_in_single_precision_and_the_nominal_state_needs_double() {
    let truth = |t: f64| Flight::at(t).0;
    let exact = reference(120);
    let mixed = flown::<f64>(120, &truth(0.0), Flight::means, truth);
    let narrow = flown::<f32>(120, &truth(0.0), Flight::means, truth);
    println!("flight, 120 s: m, rad: all f64 {exact:?}, f32 increments {mixed:?}, all f32 {narrow:?}");
    assert!(exact.0 < 1e-3 && exact.1 < 2e-6, "{exact:?}");
    assert!(mixed.0 < 1e-2 && mixed.1 < 2e-6, "{mixed:?}");
    assert!(
        narrow.0 > 5.0 * mixed.0,
        "the nominal state may be f32: {narrow:?} against {mixed:?}"
    );
}

#[test]
fn a_constant_turn_comes_back_to_where_it_began() {
    let mixed = flown::<f64>(60, &Circle::at(0.0), Circle::means, Circle::at);
    println!("circle, 60 s: {mixed:?}");
    assert!(mixed.0 < 5e-3 && mixed.1 < 5e-6, "{mixed:?}");
}

/// An increment of the unit is that of a finer integration, whatever the length of the step.
#[test]
fn long_steps_lose_nothing() {
    for step_ms in [5, 20, 50] {
        let mut imu = Imu::new(ImuConfig {
            step_ns: step_ms * 1_000_000,
            ..ImuConfig::default().without_noise()
        });
        let mut state = Flight::at(0.0).0;
        let mut increments: Vec<ImuIncrement> = Vec::new();
        for k in 0..=10_000u64 {
            let (rate, force) = Flight::means((k as f64 - 1.0) * H_S);
            let step: Option<ImuStep> = imu.push(&ImuSample {
                time_ns: k * 1_000_000,
                rate_rad_per_s: rate.map(|r| r as f32),
                specific_force_m_per_s2: force.map(|f| f as f32),
            });
            increments.extend(step.map(|s| s.increment));
        }
        assert_eq!(increments.len() as u32, 10_000 / step_ms);
        for increment in &increments {
            assert_eq!(
                increment.end_ns - increment.start_ns,
                u64::from(step_ms) * 1_000_000
            );
            state.advance(increment);
        }
        let (end, _, _) = Flight::at(10.0);
        let off = (end.position_m - state.position_m).norm();
        assert!(off < 5e-4, "{step_ms} ms: {off}");
    }
}
