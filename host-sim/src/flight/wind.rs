//! Wind along a flight: the air that moves, and by how much the UAV is blown off its planned curve.
//!
//! Rotor drag pushes with the air: a gust w accelerates the UAV by d w, and its position loop e'' + 2 zeta omega e' + omega^2 e = d w brings it
//! back. The mean wind is what the loop's integrator holds: the UAV leans into it and stays on its curve. Air and excursion are splines with
//! knots at 20 Hz, so that all that follows from them has its derivatives, and attitude, rates and forces come out of the same formulas as
//! without wind.
//!
//! The planner keeps the curve at its clearance from walls; the excursion is bent so that it never reaches half of that.

use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use super::Spline;
use super::dryden::{Air, Gusts};
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Knot interval of air and excursion, s.
const KNOT_S: f64 = 0.05;
/// A control point reaches this far to both sides, s.
const REACH_S: f64 = 3.0 * KNOT_S;
/// The excursion stays below this share of the clearance.
pub(super) const CLEARANCE_SHARE: f64 = 0.5;

/// The wind, and how the UAV holds against it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WindConfig {
    /// Speed of the mean wind at 20 ft, kn, 0 to 30: gusts follow from it (MIL-F-8785C). Zero for calm; under a roof it is always calm.
    pub w20_kn: f64,
    /// Natural frequency of the position loop, rad/s, above 0 to 10.
    pub loop_rad_per_s: f64,
    /// Damping of the position loop, above 0 to 2.
    pub loop_damping: f64,
}

impl Default for WindConfig {
    fn default() -> Self {
        Self {
            w20_kn: 0.0,
            loop_rad_per_s: 1.5,
            loop_damping: 0.8,
        }
    }
}

impl WindConfig {
    /// The light turbulence of the standard: 15 kn at 20 ft.
    pub fn real() -> Self {
        Self {
            w20_kn: 15.0,
            ..Self::default()
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        let refuse = |key: &str, value: f64, expected: &str| {
            Err(InputError::at_key(
                key,
                format!("is {value}, expected {expected}"),
            ))
        };
        if !(0.0..=30.0).contains(&self.w20_kn) {
            return refuse("flight.wind.w20_kn", self.w20_kn, "0 to 30");
        }
        for (key, value, most) in [
            ("flight.wind.loop_rad_per_s", self.loop_rad_per_s, 10.0),
            ("flight.wind.loop_damping", self.loop_damping, 2.0),
        ] {
            if !(value > 0.0 && value <= most) {
                return refuse(key, value, &format!("above 0, up to {most}"));
            }
        }
        Ok(())
    }
}

/// What the wind of a flight depends on besides its configuration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Exposure {
    /// Mean height above ground, m.
    pub(super) height_m: f64,
    /// Linear rotor drag, 1/s.
    pub(super) drag_per_s: f64,
    /// Distance to walls that the planned curve keeps, m.
    pub(super) clearance_m: f64,
    /// Length of the flight, s.
    pub(super) duration_s: f64,
}

/// The wind of one flight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Wind {
    /// Velocity of the air around the UAV, m/s, world frame.
    pub(super) air_m_per_s: Spline<3>,
    /// From the planned place to the true one, m, world frame.
    pub(super) excursion_m: Spline<3>,
}

impl Wind {
    /// The wind of `seed`; `None` when it is calm. `carried` is the share of its weight that the UAV's rotors carry at a time: what
    /// stands on the ground is not blown about.
    pub(super) fn new(
        config: &WindConfig,
        exposure: Exposure,
        carried: impl Fn(f64) -> f64,
        seed: u64,
    ) -> Option<Self> {
        if config.w20_kn == 0.0 {
            return None;
        }
        let mut random = Seeded::new(seed, Source::Wind);
        let (sin, cos) = libm::sincos(random.between(0.0, core::f64::consts::TAU));
        let (along, left) = (Vector3::new(cos, sin, 0.0), Vector3::new(-sin, cos, 0.0));
        let weather = Air::new(config.w20_kn, exposure.height_m);
        let mut gusts = Gusts::new(&weather, KNOT_S, random);
        let mut position_loop = PositionLoop::new(config);
        let (mut air, mut excursion) = (Vec::new(), Vec::new());
        for k in 0..(exposure.duration_s / KNOT_S) as usize + 8 {
            // Where this control point weighs most, less its reach: at rest nothing moves.
            let share = carried((k as f64 - 2.0) * KNOT_S - REACH_S);
            let gust = gusts.next();
            let gust = (along * gust.x + left * gust.y + Vector3::z() * gust.z) * share;
            air.push(gust + along * (weather.mean_m_per_s * share));
            let place = position_loop.advance(&(gust * exposure.drag_per_s));
            excursion.push(bent(&place, CLEARANCE_SHARE * exposure.clearance_m));
        }
        Some(Self {
            air_m_per_s: Spline::new(air, KNOT_S)?,
            excursion_m: Spline::new(excursion, KNOT_S)?,
        })
    }

    /// The same wind out of another direction.
    #[must_use]
    pub(super) fn turned(self, rotation: &Rotation3<f64>) -> Self {
        Self {
            air_m_per_s: self.air_m_per_s.with_control(|v| rotation * v),
            excursion_m: self.excursion_m.with_control(|v| rotation * v),
        }
    }
}

/// A vector bent to less than `most` in length; what is far below stays as it is. A curve of control points in a ball lies in it too.
fn bent(v: &Vector3<f64>, most: f64) -> Vector3<f64> {
    let square = v.norm_squared() / (most * most);
    v / (1.0 + square * square).sqrt().sqrt()
}

/// The excursion and its derivative under a push.
#[derive(Clone, Debug)]
struct PositionLoop {
    natural_rad_per_s: f64,
    damping: f64,
    place_m: Vector3<f64>,
    speed_m_per_s: Vector3<f64>,
}

impl PositionLoop {
    fn new(config: &WindConfig) -> Self {
        Self {
            natural_rad_per_s: config.loop_rad_per_s,
            damping: config.loop_damping,
            place_m: Vector3::zeros(),
            speed_m_per_s: Vector3::zeros(),
        }
    }

    /// The excursion a knot later, m, under an acceleration in m/s^2: the trapezoidal rule.
    fn advance(&mut self, push: &Vector3<f64>) -> Vector3<f64> {
        let half = 0.5 * KNOT_S;
        let spring = self.natural_rad_per_s * self.natural_rad_per_s;
        let brake = 2.0 * self.damping * self.natural_rad_per_s;
        let (e, v) = (self.place_m, self.speed_m_per_s);
        let rest = v + (push * 2.0 - v * brake - e * (2.0 * spring) - v * (half * spring)) * half;
        self.speed_m_per_s = rest / (1.0 + half * brake + half * half * spring);
        self.place_m = e + (v + self.speed_m_per_s) * half;
        self.place_m
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const EXPOSURE: Exposure = Exposure {
        height_m: 9.0,
        drag_per_s: 0.15,
        clearance_m: 1.5,
        duration_s: 120.0,
    };

    fn wind(seed: u64, exposure: Exposure) -> Wind {
        let carried = |time_s: f64| ((time_s - 3.0) / 2.0).clamp(0.0, 1.0);
        Wind::new(&WindConfig::real(), exposure, carried, seed).expect("not calm")
    }

    #[test]
    fn the_position_loop_answers_a_step_in_closed_form() {
        let config = WindConfig::real();
        let mut position_loop = PositionLoop::new(&config);
        let (omega, zeta) = (1.5, 0.8_f64);
        let damped = omega * (1.0 - zeta * zeta).sqrt();
        for k in 1..400 {
            let place = position_loop.advance(&Vector3::x()).x;
            let t = f64::from(k) * KNOT_S;
            let (sin, cos) = libm::sincos(damped * t);
            let decay = libm::exp(-zeta * omega * t);
            let expected = (1.0 - decay * (cos + zeta * omega / damped * sin)) / (omega * omega);
            assert!((place - expected).abs() < 2e-4, "{place} for {expected} at {t}");
        }
    }

    #[test]
    fn it_blows_by_decimetres_and_never_beyond_half_the_clearance() {
        let mut square = 0.0;
        for seed in 0..20 {
            let wind = wind(seed, EXPOSURE);
            for k in 100..1200 {
                let e = wind.excursion_m.at(f64::from(k) * 0.1)[0];
                square += e.norm_squared() / 22_000.0;
                assert!(e.norm() < 0.75);
            }
            assert!(
                wind.excursion_m
                    .derivative_bounds(3)
                    .iter()
                    .all(|jerk| *jerk < 5.0)
            );
            // A narrow place, as of a corridor.
            let narrow = Exposure {
                clearance_m: 0.1,
                ..EXPOSURE
            };
            let wind = self::wind(seed, narrow);
            let largest = (0..1200)
                .map(|k| wind.excursion_m.at(f64::from(k) * 0.1)[0].norm())
                .fold(0.0, f64::max);
            assert!(largest < 0.05 && largest > 0.03, "{largest}");
        }
        let rms = square.sqrt();
        // Quasi-static: 0.15/s x 1.4 m/s / (1.5 rad/s)^2 = 0.09 m in each horizontal direction.
        assert!((0.08..0.25).contains(&rms), "{rms} m");
    }

    #[test]
    fn at_rest_nothing_moves_and_calm_is_none() {
        let wind = wind(4, EXPOSURE);
        for k in 0..=30 {
            let time_s = f64::from(k) * 0.1;
            assert!(wind.excursion_m.at(time_s).iter().all(|d| d.norm() == 0.0));
            assert!(wind.air_m_per_s.at(time_s).iter().all(|d| d.norm() == 0.0));
        }
        assert!(wind.air_m_per_s.at(10.0)[0].norm() > 3.0);
        assert_eq!(Wind::new(&WindConfig::default(), EXPOSURE, |_| 1.0, 4), None);
    }
}
