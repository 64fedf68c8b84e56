//! Alignment at rest: accuracy against what the sensor's noise allows, and refusal of motion.

use std::println;

use super::*;

extern crate std;

const MS: u64 = 1_000_000;

/// Normal numbers by the sum of twelve uniform ones.
struct Noise(u32);

impl Noise {
    fn next(&mut self) -> f32 {
        let mut sum = -6.0;
        for _ in 0..12 {
            self.0 = self.0.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            sum += (self.0 >> 8) as f32 / 16_777_216.0;
        }
        sum
    }

    fn vector(&mut self, sigma: f32) -> Vector3<f32> {
        let (x, y, z) = (self.next(), self.next(), self.next());
        Vector3::new(x, y, z) * sigma
    }
}

/// Noise of a sample at 1 kHz: 2.8 mdps and 70 ug by the root of 1000 Hz.
const RATE_SIGMA: f32 = 2.8e-3 * DPS * 31.62;
const FORCE_SIGMA: f32 = 70e-6 * G * 31.62;

fn sample(ms: u64, rate: Vector3<f32>, force: Vector3<f32>, noise: &mut Noise) -> ImuSample {
    ImuSample {
        time_ns: ms * MS,
        rate_rad_per_s: rate + noise.vector(RATE_SIGMA),
        specific_force_m_per_s2: force + noise.vector(FORCE_SIGMA),
    }
}

/// Aligns at rest under a motion that is added; the result and the number of refusals over 3.5 s.
fn align(seed: u32, added: impl Fn(f32) -> (Vector3<f32>, Vector3<f32>)) -> (Option<Alignment>, u32) {
    let mut noise = Noise(seed);
    let mut alignment = RestAlignment::new(RestConfig::default());
    let mut found = None;
    for ms in 0..3500 {
        let (rate, force) = added(ms as f32 * 1e-3);
        if let RestStatus::Aligned(result) = alignment.push(&sample(ms, rate, force, &mut noise)) {
            found = found.or(Some(result));
        }
    }
    (found, alignment.moved())
}

fn up() -> Vector3<f32> {
    Vector3::new(0.0, 0.0, G)
}

#[test]
fn bias_comes_out_within_its_sigma_and_the_sigma_is_a_hundredth_of_a_degree_per_second() {
    let (mut squares, mut worst) = (0.0f32, 0.0f32);
    for seed in 1..=40 {
        let bias = Noise(seed * 77).vector(0.5 * DPS);
        let (result, moved) = align(seed, |_| (bias, up()));
        let result = result.expect("at rest");
        assert_eq!((moved, result.time_ns), (0, 2999 * MS));
        let (off, sigma) = (
            result.gyro_bias_rad_per_s - bias,
            result.gyro_bias_sigma_rad_per_s,
        );
        squares += off.component_div(&sigma).norm_squared() / 120.0;
        worst = worst.max(sigma.max());
    }
    println!("error over sigma {}, sigma {} dps", squares.sqrt(), worst / DPS);
    assert!(worst < 0.01 * DPS);
    // Part of the sigma is wander, which this sensor does not have.
    assert!((0.4..1.1).contains(&squares.sqrt()), "{}", squares.sqrt());
}

#[test]
fn tilt_comes_out_at_any_attitude() {
    for (roll, pitch) in [(0.0f32, 0.0f32), (0.1, -0.2), (-0.5, 0.3), (1.2, -0.9)] {
        let truth =
            crate::geometry::Rotation::<crate::geometry::Body, crate::geometry::World>::from_yaw_pitch_roll(
                0.7, pitch, roll,
            )
            .expect("finite");
        let force = truth.inverse().apply_vector(&up());
        let (result, _) = align(5, |_| (Vector3::zeros(), force));
        let result = result.expect("at rest");
        let (r, p) = result.roll_pitch_rad();
        assert!((r - roll).abs() < 2e-4 && (p - pitch).abs() < 2e-4, "{r} {p}");
        let attitude = result.attitude(0.7).matrix().map(|m| m as f32);
        assert!((attitude - truth.matrix()).norm() < 5e-4);
    }
}

#[test]
fn motion_is_refused() {
    let rest = (Vector3::zeros(), up());
    let turning = |t: f32| (Vector3::new(0.02 * libm::sinf(3.0 * t), 0.0, 0.0), up());
    let shaken = |t: f32| {
        (
            Vector3::zeros(),
            up() + Vector3::new(0.3 * libm::sinf(60.0 * t), 0.0, 0.0),
        )
    };
    let swaying = |t: f32| {
        (
            Vector3::zeros(),
            up() + Vector3::new(0.0, 0.05 * libm::sinf(1.0 * t), 0.0),
        )
    };
    let spinning = |_: f32| (Vector3::new(0.0, 0.0, 0.1), up());
    let falling = |_: f32| (Vector3::zeros(), up() * 0.5);
    let not_a_number = |_: f32| (Vector3::new(f32::NAN, 0.0, 0.0), up());
    assert!(align(2, |_| rest).0.is_some());
    for (name, motion) in [
        ("turning", &turning as &dyn Fn(f32) -> _),
        ("shaken", &shaken),
        ("swaying", &swaying),
        ("spinning", &spinning),
        ("falling", &falling),
        ("not a number", &not_a_number),
    ] {
        let (result, moved) = align(2, motion);
        assert!(result.is_none() && moved > 0, "{name}: {result:?}, {moved}");
    }
}

#[test]
fn a_jolt_begins_the_alignment_anew() {
    let mut noise = Noise(9);
    let mut alignment = RestAlignment::new(RestConfig::default());
    let mut end_ms = None;
    for ms in 0..6000 {
        let jolt = if (1600..1650).contains(&ms) { 0.05 } else { 0.0 };
        let rate = Vector3::new(0.0, jolt, 0.0);
        match alignment.push(&sample(ms, rate, up(), &mut noise)) {
            RestStatus::Moving => assert_eq!(ms, 1749),
            RestStatus::Aligned(_) => end_ms = end_ms.or(Some(ms)),
            RestStatus::Gathering { .. } => {}
        }
    }
    assert_eq!((end_ms, alignment.moved()), (Some(4749), 1));
}

#[test]
fn what_is_shown_beyond_gravity_is_the_bias_along_the_vertical() {
    for (tilt, bias) in [(0.0, 0.25), (0.3, -0.2)] {
        let (sin, cos) = (libm::sinf(tilt), libm::cosf(tilt));
        let (vertical, level) = (Vector3::new(sin, 0.0, cos), Vector3::new(cos, 0.0, -sin));
        let force = vertical * (G + bias) + level * 0.1;
        let result = align(4, |_| (Vector3::zeros(), force)).0.expect("at rest");
        // 0.1 across adds 0.5 mm/s^2 to the length.
        let off = result.accel_bias_up_m_per_s2 - bias;
        assert!(off.abs() < 2e-3, "{off} m/s^2 off");
        assert!((result.accel_bias_up_sigma_m_per_s2 - 0.003 * G).abs() < 1e-3);
    }
}
