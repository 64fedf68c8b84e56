//! What four rotors shake the inertial sensor with.
//!
//! Each rotor turns at a rate of its own and shakes at 1, 2 and 4 times that: once a turn by its unbalance, twice by its two blades, and
//! the next harmonic of these. The rotation has 90 deg between its x and y axes, in the same sense for all rotors, which is the worst
//! case: the sensor cones, and a receiver that adds up rates would see it turn about z by A_x A_y / (2 omega).
//!
//! The shaking moves the sensor about a mean place and attitude, which are those of the body: it never adds up to a motion.

use core::f64::consts::{SQRT_2, TAU};

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::DPS_RAD_PER_S;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Rotors of the UAV.
const ROTORS: usize = 4;
/// Multiples of a rotor's rate at which it shakes.
const HARMONICS: [f64; 3] = [1.0, 2.0, 4.0];
/// Rate of a rotor in hover, Hz. Thrust goes with its square: 90 to 130 Hz within the limits of a flight.
const HOVER_HZ: f64 = 105.0;
/// Rates of the rotors differ by up to this share either way: they carry different shares of the thrust.
const SPREAD: f64 = 0.03;

/// Strength of the vibration behind its mount, at full thrust share; zeros for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VibrationConfig {
    /// Acceleration at 1, 2 and 4 times the rotors' rate, all rotors together, m/s^2 rms per axis. A soft mount leaves a third to three
    /// times 3, 2, 1; autopilots warn at 30.
    pub acceleration_m_per_s2: [f64; 3],
    /// Angular rate at the same multiples, deg/s rms per axis.
    pub rate_dps: [f64; 3],
}

impl VibrationConfig {
    /// A small quadrotor with a soft mount.
    pub fn real() -> Self {
        Self {
            acceleration_m_per_s2: [3.0, 2.0, 1.0],
            rate_dps: [0.3, 0.2, 0.1],
        }
    }

    /// Whether there is none.
    pub(super) fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        for k in 0..HARMONICS.len() {
            super::not_negative(&[
                (
                    "imu.vibration.acceleration_m_per_s2",
                    self.acceleration_m_per_s2[k],
                ),
                ("imu.vibration.rate_dps", self.rate_dps[k]),
            ])?;
        }
        Ok(())
    }
}

/// How the sensor moves against the body at one instant, in body axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shake {
    /// Rotation vector from the body's attitude to the sensor's, rad; far below a milliradian.
    pub(super) angle_rad: Vector3<f64>,
    /// Angular rate of the sensor against the body, rad/s.
    pub(super) rate_rad_per_s: Vector3<f64>,
    /// Acceleration of the sensor against the body, m/s^2.
    pub(super) acceleration_m_per_s2: Vector3<f64>,
}

/// One rotor: where it is in its turn, and the phases of what it shakes with, all in turns.
#[derive(Clone, Copy, Debug)]
struct Rotor {
    /// Its rate over that of a rotor with the mean thrust.
    ratio: f64,
    turn: f64,
    linear: [Vector3<f64>; 3],
    /// Of the cone, and of the rotation about z.
    angular: [[f64; 2]; 3],
}

/// The rotors of one flight: state of the simulation.
#[derive(Clone, Debug)]
pub(super) struct Vibration {
    /// Amplitude of one rotor at each harmonic, m/s^2 and rad/s.
    amplitude: [[f64; 2]; 3],
    rotors: [Rotor; ROTORS],
}

impl Vibration {
    /// The rotors of the world of `seed`.
    pub(super) fn new(config: &VibrationConfig, seed: u64) -> Self {
        let mut random = Seeded::new(seed, Source::Vibration);
        // Rotors are not in step: their powers add up, so that each has the root of a fourth of it.
        let each = SQRT_2 / (ROTORS as f64).sqrt();
        Self {
            amplitude: core::array::from_fn(|k| {
                [
                    config.acceleration_m_per_s2[k] * each,
                    config.rate_dps[k] * DPS_RAD_PER_S * each,
                ]
            }),
            rotors: core::array::from_fn(|_| Rotor {
                ratio: random.between(1.0 - SPREAD, 1.0 + SPREAD),
                turn: random.uniform(),
                linear: core::array::from_fn(|_| {
                    let (x, y, z) = (random.uniform(), random.uniform(), random.uniform());
                    Vector3::new(x, y, z)
                }),
                angular: core::array::from_fn(|_| [random.uniform(), random.uniform()]),
            }),
        }
    }

    /// The shaking `step_s` later, at a thrust of `thrust_m_per_s2` over mass, of which the rotors carry `share`: 0 stands still.
    pub(super) fn advance(&mut self, step_s: f64, thrust_m_per_s2: f64, share: f64) -> Shake {
        let mean_hz = HOVER_HZ * (thrust_m_per_s2 / STANDARD_GRAVITY_M_PER_S2).sqrt();
        let mut shake = Shake {
            angle_rad: Vector3::zeros(),
            rate_rad_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
        };
        for rotor in &mut self.rotors {
            let hz = mean_hz * rotor.ratio;
            rotor.turn += hz * step_s;
            rotor.turn -= libm::floor(rotor.turn);
            for (k, harmonic) in HARMONICS.into_iter().enumerate() {
                let phase = |offset: f64| libm::sincos(TAU * (harmonic * rotor.turn + offset));
                let [linear, angular] = self.amplitude[k].map(|amplitude| amplitude * share);
                shake.acceleration_m_per_s2 += rotor.linear[k].map(|offset| phase(offset).1) * linear;
                let [cone, roll] = rotor.angular[k].map(phase);
                shake.rate_rad_per_s += Vector3::new(cone.1, cone.0, roll.1) * angular;
                // The integral of that rate.
                let angle = angular / (TAU * harmonic * hz);
                shake.angle_rad += Vector3::new(cone.0, -cone.1, roll.0) * angle;
            }
        }
        // The angular rate of an attitude exp(angle), in its own axes, to second order: what a coning sensor feels about z, so that
        // it does not turn.
        shake.rate_rad_per_s -= shake.angle_rad.cross(&shake.rate_rad_per_s) * 0.5;
        shake
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::UnitQuaternion;

    use super::*;

    const STEP_S: f64 = 1.0 / 8000.0;

    fn second(vibration: &mut Vibration, thrust_m_per_s2: f64, share: f64) -> Vec<Shake> {
        (0..8000)
            .map(|_| vibration.advance(STEP_S, thrust_m_per_s2, share))
            .collect()
    }

    /// Root mean square over ten seconds and the axes.
    fn rms(config: &VibrationConfig, of: impl Fn(&Shake) -> Vector3<f64>) -> f64 {
        let mut sum = 0.0;
        for seed in 0..10 {
            let mut vibration = Vibration::new(config, seed);
            let shakes = second(&mut vibration, STANDARD_GRAVITY_M_PER_S2, 1.0);
            sum += shakes.iter().map(|s| of(s).norm_squared() / 3.0).sum::<f64>() / 80_000.0;
        }
        sum.sqrt()
    }

    #[test]
    fn it_is_as_strong_as_it_says_on_every_axis() {
        let config = VibrationConfig::real();
        let acceleration = rms(&config, |s| s.acceleration_m_per_s2);
        assert!(
            (acceleration / 14.0_f64.sqrt() - 1.0).abs() < 0.03,
            "{acceleration}"
        );
        let rate = rms(&config, |s| s.rate_rad_per_s) / DPS_RAD_PER_S;
        assert!((rate / 0.14_f64.sqrt() - 1.0).abs() < 0.03, "{rate}");
        let none = second(&mut Vibration::new(&config, 1), STANDARD_GRAVITY_M_PER_S2, 0.0);
        assert!(none.iter().all(|s| s.rate_rad_per_s.norm() == 0.0));
        assert!(none.iter().all(|s| s.acceleration_m_per_s2.norm() == 0.0));
    }

    /// Power of the acceleration along x between two frequencies, by the sums of a discrete Fourier transform.
    fn power_between(shakes: &[Shake], low_hz: u32, high_hz: u32) -> f64 {
        (low_hz..=high_hz)
            .map(|hz| {
                let (mut re, mut im) = (0.0, 0.0);
                for (k, shake) in shakes.iter().enumerate() {
                    let (sin, cos) = libm::sincos(TAU * f64::from(hz) * k as f64 * STEP_S);
                    re += shake.acceleration_m_per_s2.x * cos;
                    im += shake.acceleration_m_per_s2.x * sin;
                }
                let count = shakes.len() as f64;
                2.0 * (re * re + im * im) / (count * count)
            })
            .sum()
    }

    #[test]
    fn the_harmonics_lie_where_the_thrust_puts_them() {
        for (thrust_g, hover_share) in [(1.0, 1.0), (1.44, 1.2)] {
            let mut vibration = Vibration::new(&VibrationConfig::real(), 3);
            let shakes = second(&mut vibration, thrust_g * STANDARD_GRAVITY_M_PER_S2, 1.0);
            for (harmonic, acceleration) in HARMONICS.into_iter().zip([3.0, 2.0, 1.0]) {
                let middle = HOVER_HZ * hover_share * harmonic;
                let (low, high) = (middle * (1.0 - SPREAD), middle * (1.0 + SPREAD));
                let power = power_between(&shakes, low as u32 - 1, high as u32 + 2);
                // Two rotors that are near each other may still be in or out of step over a second.
                let ratio = power / (acceleration * acceleration);
                assert!((0.6..1.5).contains(&ratio), "{ratio} at {middle} Hz");
            }
        }
    }

    #[test]
    fn it_never_adds_up_to_a_motion_but_plain_sums_would_cone() {
        let config = VibrationConfig {
            rate_dps: [3.0, 0.0, 0.0],
            ..VibrationConfig::default()
        };
        let mut vibration = Vibration::new(&config, 5);
        let (mut attitude, mut sum) = (UnitQuaternion::identity(), Vector3::zeros());
        let start = vibration.clone().advance(0.0, STANDARD_GRAVITY_M_PER_S2, 1.0);
        // Steps so short that the rate in their middle says all.
        let step_s = STEP_S / 2.0;
        vibration.advance(-0.5 * step_s, STANDARD_GRAVITY_M_PER_S2, 1.0);
        let mut velocity = Vector3::zeros();
        for _ in 0..960_000 {
            let shake = vibration.advance(step_s, STANDARD_GRAVITY_M_PER_S2, 1.0);
            attitude *= UnitQuaternion::from_scaled_axis(shake.rate_rad_per_s * step_s);
            sum += shake.rate_rad_per_s * step_s;
            velocity += shake.acceleration_m_per_s2 * step_s;
        }
        let expected_rad_per_s: f64 = vibration
            .rotors
            .iter()
            .map(|rotor| {
                let amplitude = 3.0 * DPS_RAD_PER_S * SQRT_2 / 2.0;
                0.5 * amplitude * amplitude / (TAU * HOVER_HZ * rotor.ratio)
            })
            .sum();
        // The sensor stays where it was but for the shaking itself; the sum of its rates runs away by the coning.
        let end = vibration.advance(0.5 * step_s, STANDARD_GRAVITY_M_PER_S2, 1.0);
        let turned = attitude.scaled_axis() - (end.angle_rad - start.angle_rad);
        assert!(turned.norm() < 0.03 * expected_rad_per_s * 60.0, "{turned}");
        let drift = (sum.z - (end.angle_rad.z - start.angle_rad.z)) / 60.0;
        assert!(
            (drift / -expected_rad_per_s - 1.0).abs() < 0.05,
            "{drift} for {expected_rad_per_s}"
        );
        assert_eq!(velocity, Vector3::zeros());
    }

    #[test]
    fn speeds_of_the_shaking_stay_bounded() {
        let mut vibration = Vibration::new(&VibrationConfig::real(), 2);
        let (mut velocity, mut largest) = (Vector3::zeros(), 0.0f64);
        for k in 0..80_000 {
            let share = (f64::from(k) / 8000.0).min(1.0);
            let shake = vibration.advance(STEP_S, STANDARD_GRAVITY_M_PER_S2, share);
            velocity += shake.acceleration_m_per_s2 * STEP_S;
            largest = largest.max(velocity.norm());
        }
        // 3 m/s^2 rms per axis at 105 Hz: 4.5 mm/s rms, four rotors in step at most 16 on an axis.
        assert!(largest < 0.04, "{largest}");
    }
}
