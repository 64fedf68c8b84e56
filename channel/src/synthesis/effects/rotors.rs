//! The rotors around the arrays: their tips scatter the strongest wave with a phase that turns with the tip, and a blade
//! that crosses the way to an array takes one decibel.
//!
//! A tip at R from its hub and at the angle theta brings the phase `2 pi/lambda u.R (cos theta, sin theta, 0)`: up to +-v/
//! lambda of frequency. Its way on to the array is taken as constant, and so is its phase over a block of two microseconds.

use std::f64::consts::{PI, TAU};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use super::Draw;
use crate::synthesis::antenna::{phasor, phasor_of_turns};
use crate::synthesis::{C64, Ray};

/// Rotors, at azimuth 45 + 90 k deg.
const ROTORS: usize = 4;
/// Hubs: distance from the body's axis and height over the arrays, m.
const ARM_M: f64 = 0.25;
const HEIGHT_M: f64 = 0.05;
/// Blades, two a rotor: length and chord, m.
const BLADE_M: f64 = 0.127;
const CHORD_M: f64 = 0.02;
/// Revolutions per second, drawn for each rotor.
const RATE_HZ: [f64; 2] = [90.0, 130.0];
/// What a tip scatters, dB, and the detour of it, m.
const TIP_DB: f64 = -30.0;
const DETOUR_M: f64 = 0.3;
/// What a blade in the way takes, dB.
const SHADOW_DB: f64 = 1.0;

/// The rotors of a flight.
#[derive(Clone, Debug)]
pub(crate) struct Rotors([Rotor; ROTORS]);

#[derive(Clone, Copy, Debug)]
struct Rotor {
    /// Revolutions per second; neighbours turn against each other.
    rate_hz: f64,
    /// Angle at switch-on, turns.
    first_turns: f64,
}

/// Where the way of a wave to an array goes through the disc of a rotor.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Crossing {
    rotor: usize,
    /// From the hub, m, body frame.
    at_m: [f64; 2],
}

fn hub(rotor: usize) -> Vector3<f64> {
    let along = phasor(PI * (0.25 + 0.5 * rotor as f64)) * ARM_M;
    Vector3::new(along.re, along.im, HEIGHT_M)
}

impl Rotors {
    /// Draws the rotors of a flight.
    pub(crate) fn draw(seed: u64) -> Self {
        let mut stream = Draw::Rotors.stream(seed);
        Self(std::array::from_fn(|k| {
            let sense = if k % 2 == 0 { 1.0 } else { -1.0 };
            Rotor {
                rate_hz: sense * (RATE_HZ[0] + (RATE_HZ[1] - RATE_HZ[0]) * stream.uniform()),
                first_turns: stream.uniform(),
            }
        }))
    }

    /// Direction of the first blade of each rotor at a time.
    fn blades(&self, time_s: f64) -> [C64; ROTORS] {
        self.0
            .map(|rotor| phasor_of_turns(rotor.first_turns + rotor.rate_hz * time_s))
    }

    /// The rays that the rotors scatter of a ray: one each, from its hub.
    pub(crate) fn scattered(ray: &Ray) -> Vec<Ray> {
        let of_rotor = |k| {
            Some(Ray {
                amplitude: ray.amplitude * libm::exp10(TIP_DB / 20.0),
                delay_s: ray.delay_s + DETOUR_M / SPEED_OF_LIGHT_M_PER_S,
                arrival: Direction::<Body, f64>::from_vector(hub(k)).ok()?,
                ..*ray
            })
        };
        (0..ROTORS).filter_map(of_rotor).collect()
    }

    /// What the tips of each rotor multiply the ray scattered of a wave from `u` by: the sum over both blades.
    pub(crate) fn tips(&self, u: &Vector3<f64>, carrier_hz: f64, time_s: f64) -> [C64; ROTORS] {
        self.blades(time_s).map(|blade| {
            let turns = carrier_hz / SPEED_OF_LIGHT_M_PER_S * BLADE_M * (u.x * blade.re + u.y * blade.im);
            // The other blade is opposite.
            C64::new(2.0 * libm::cos(TAU * turns), 0.0)
        })
    }

    /// Where a wave from `u` crosses a rotor on its way to `centre_m`.
    pub(crate) fn crossing(u: &Vector3<f64>, centre_m: &Vector3<f64>) -> Option<Crossing> {
        let climb_m = HEIGHT_M - centre_m.z;
        if u.z * BLADE_M <= 1e-3 * climb_m {
            return None;
        }
        let through = centre_m + u * (climb_m / u.z);
        (0..ROTORS).find_map(|rotor| {
            let at = through - hub(rotor);
            (at.x * at.x + at.y * at.y < BLADE_M * BLADE_M).then_some(Crossing {
                rotor,
                at_m: [at.x, at.y],
            })
        })
    }

    /// Amplitude that the blades leave at a crossing.
    pub(crate) fn shade(&self, crossing: &Crossing, time_s: f64) -> f64 {
        let blade = self.blades(time_s)[crossing.rotor];
        // Distance from the line of both blades.
        let off_m = crossing.at_m[0] * blade.im - crossing.at_m[1] * blade.re;
        if off_m.abs() < 0.5 * CHORD_M {
            libm::exp10(-SHADOW_DB / 20.0)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spectrum_of_the_tips_ends_at_v_over_lambda() {
        let (rotors, carrier_hz, rate_hz, count) = (Rotors::draw(2), 30e9, 40e3, 4096);
        let elevation: f64 = 0.3;
        let u = Vector3::new(libm::cos(elevation), 0.0, libm::sin(elevation));
        let x: Vec<C64> = (0..count)
            .map(|n| rotors.tips(&u, carrier_hz, f64::from(n) / rate_hz)[0])
            .collect();
        let speed = TAU * rotors.0[0].rate_hz.abs() * BLADE_M;
        assert!((60.0..110.0).contains(&speed), "{speed}");
        let edge_hz = speed * carrier_hz / SPEED_OF_LIGHT_M_PER_S * libm::cos(elevation);
        let power = |f_hz: f64| {
            let hann = |n: usize| 1.0 - libm::cos(TAU * (n as f64 + 0.5) / f64::from(count));
            let turned = |(n, x): (usize, &C64)| x * phasor_of_turns(-f_hz * n as f64 / rate_hz) * hann(n);
            x.iter().enumerate().map(turned).sum::<C64>().norm_sqr()
        };
        let band = |low: f64, high: f64| -> f64 {
            let at = |i| power(edge_hz * (low + (high - low) * f64::from(i) / 40.0));
            (0..40).map(at).sum()
        };
        let (inside, edge, outside) = (band(0.3, 0.8), band(0.85, 1.0), band(1.1, 1.6));
        assert!(
            edge > inside && outside < 1e-3 * edge,
            "{inside} {edge} {outside}"
        );
    }

    #[test]
    fn a_blade_takes_its_decibel_for_its_share_of_a_turn() {
        let rotors = Rotors::draw(5);
        // From the array on the nose through a point 6 cm from the hub of the first rotor.
        let centre_m = Vector3::new(0.2, 0.0, 0.0);
        let u = (hub(0) + Vector3::new(0.06, 0.0, 0.0) - centre_m).normalize();
        let crossing = Rotors::crossing(&u, &centre_m).expect("through the disc");
        assert_eq!(crossing.rotor, 0);
        assert!((crossing.at_m[0] - 0.06).abs() < 1e-12 && crossing.at_m[1].abs() < 1e-12);
        let steps = 20_000;
        let turn_s = 1.0 / rotors.0[0].rate_hz;
        let levels = (0..steps).map(|n| rotors.shade(&crossing, turn_s * f64::from(n) / f64::from(steps)));
        let shaded = levels.clone().filter(|level| *level < 1.0).count();
        let expected = 2.0 * libm::asin(0.01 / 0.06) / PI;
        assert!(
            (shaded as f64 / f64::from(steps) - expected).abs() < 1e-3,
            "{shaded}"
        );
        let least = levels.fold(1.0, f64::min);
        assert!((20.0 * libm::log10(least) + 1.0).abs() < 1e-12);
        // From below, level, and past the rotors nothing is crossed.
        for u in [
            Vector3::new(0.5, 0.5, -0.7),
            Vector3::new(1.0, 0.0, 0.0),
            Vector3::new(0.0, 0.0, 1.0),
        ] {
            assert!(Rotors::crossing(&u, &centre_m).is_none(), "{u}");
        }
    }
}
