//! The GMT's beacon: where it says it is, and when it will sound.
//!
//! A beacon follows every sweep. It tells the position of the GMT by its own navigation, off by a slowly wandering
//! error, and the attitude of its mast, which is meant to be level and of the heading that it tells but is off by a constant that
//! nobody knows: that error turns the whole solution about the GMT (docs/localization.md, "The model").

use core::f64::consts::PI;

use nalgebra::{Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::flight::Schedule;
use crate::input::InputError;
use crate::scene::turn;
use crate::seeded::{Seeded, Source};

/// Errors of what the GMT says about itself. Defaults are the budget of design section 6.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BeaconConfig {
    /// Standard deviation of the reported position, m per axis.
    pub position_error_m: f64,
    /// Correlation time of that error, s; zero for a fresh one in every beacon.
    pub position_error_time_s: f64,
    /// Standard deviation of the true heading of the mast about the reported one, deg; constant over a flight.
    pub heading_error_deg: f64,
    /// Standard deviation of the true tilt of the mast about each horizontal axis, deg; constant over a flight.
    pub tilt_error_deg: f64,
    /// Time from the start of a sweep to the end of the beacon that follows it, s.
    pub latency_s: f64,
    /// Share of beacons that are lost, 0..=1.
    pub loss: f64,
    /// Whether beacons go through the channel, and are lost with its paths ([`super::OverAir`]).
    pub over_air: bool,
}

impl Default for BeaconConfig {
    fn default() -> Self {
        Self {
            position_error_m: 0.02,
            position_error_time_s: 60.0,
            heading_error_deg: 0.05,
            tilt_error_deg: 0.05,
            latency_s: 1e-3,
            loss: 0.0,
            over_air: false,
        }
    }
}

impl BeaconConfig {
    /// Beacons that go through the channel.
    pub fn real() -> Self {
        Self {
            over_air: true,
            ..Self::default()
        }
    }

    /// A GMT that knows itself exactly.
    pub fn ideal() -> Self {
        Self {
            position_error_m: 0.0,
            heading_error_deg: 0.0,
            tilt_error_deg: 0.0,
            ..Self::default()
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::not_negative(&[
            ("beacon.position_error_m", self.position_error_m),
            ("beacon.position_error_time_s", self.position_error_time_s),
            ("beacon.heading_error_deg", self.heading_error_deg),
            ("beacon.tilt_error_deg", self.tilt_error_deg),
            ("beacon.latency_s", self.latency_s),
            ("beacon.loss", self.loss),
        ])?;
        super::at_most_one("beacon.loss", self.loss)
    }
}

/// What a beacon says.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Beacon {
    /// Number of the sweep it follows, from 0.
    pub sweep: u32,
    /// Start of that sweep by the GMT clock, s.
    pub gmt_time_s: f64,
    /// Position of the GMT antenna during that sweep, m, world frame.
    pub position_m: [f64; 3],
    /// Heading, pitch and roll of the mast, rad (rotation about z, then y, then x).
    pub heading_pitch_roll_rad: [f64; 3],
    /// Standard deviation the GMT claims for its position, m per axis.
    pub position_sigma_m: f64,
    /// Time from sweep to sweep, s.
    pub sweep_period_s: f64,
    /// The GMT moves once every this many sweeps (T_c).
    pub sweeps_per_stop: u32,
}

/// The GMT's idea of itself over one flight: state of the simulation.
#[derive(Clone, Debug)]
pub struct Beacons {
    schedule: Schedule,
    heading_rad: f64,
    position_error_m: Vector3<f64>,
    sigma_m: f64,
    kept: f64,
    loss: f64,
    position: Seeded,
    lost: Seeded,
}

impl Beacons {
    /// The beacons of the world of `seed`, of a mast of that heading, rad from east: the errors of its position turn with it.
    pub fn new(config: &BeaconConfig, schedule: Schedule, heading_rad: f64, seed: u64) -> Self {
        let mut position = Seeded::new(seed, Source::GmtPosition);
        let kept = if config.position_error_time_s > 0.0 {
            libm::exp(-schedule.sweep_period_s / config.position_error_time_s)
        } else {
            0.0
        };
        Self {
            schedule,
            heading_rad,
            position_error_m: position.normal_vector() * config.position_error_m,
            sigma_m: config.position_error_m,
            kept,
            loss: config.loss,
            position,
            lost: Seeded::new(seed, Source::BeaconLoss),
        }
    }

    /// The beacon after sweep `sweep`, sent from `position_m`; `None` when it is lost.
    pub fn next(&mut self, sweep: u32, position_m: &Vector3<f64>) -> Option<Beacon> {
        let added = self.sigma_m * (1.0 - self.kept * self.kept).sqrt();
        self.position_error_m = self.position_error_m * self.kept + self.position.normal_vector() * added;
        let lost = self.lost.uniform() < self.loss;
        (!lost).then(|| Beacon {
            sweep,
            gmt_time_s: self.schedule.sweep_time_s(sweep),
            position_m: (position_m + turn(self.heading_rad) * self.position_error_m).into(),
            heading_pitch_roll_rad: [self.heading_rad, 0.0, 0.0],
            position_sigma_m: self.sigma_m,
            sweep_period_s: self.schedule.sweep_period_s,
            sweeps_per_stop: self.schedule.sweeps_per_stop,
        })
    }
}

/// True attitude of the GMT's mast over a flight: turns vectors of the GMT's array frame into world vectors. The
/// beacons report the heading alone, rad from east.
pub fn true_gmt_attitude(config: &BeaconConfig, heading_rad: f64, seed: u64) -> Rotation3<f64> {
    let mut random = Seeded::new(seed, Source::GmtAttitude);
    let degree = PI / 180.0;
    let tilt = config.tilt_error_deg * degree;
    let (roll, pitch) = (random.normal() * tilt, random.normal() * tilt);
    let yaw = random.normal() * config.heading_error_deg * degree;
    // nalgebra's own sine and cosine come from the platform; small rotations are built from libm's instead.
    let about = |axis: Vector3<f64>, angle: f64| {
        let (sin, cos) = libm::sincos(0.5 * angle);
        nalgebra::UnitQuaternion::from_quaternion(nalgebra::Quaternion::from_parts(cos, axis * sin))
    };
    let off = about(Vector3::z(), yaw) * about(Vector3::y(), pitch) * about(Vector3::x(), roll);
    turn(heading_rad) * off.to_rotation_matrix()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn schedule() -> Schedule {
        Schedule::default()
    }

    #[test]
    fn the_position_error_is_two_centimetres_and_wanders() {
        let here = Vector3::new(3.0, -4.0, 1.5);
        let (mut now, mut step, mut minute) = (0.0, 0.0, 0.0);
        for seed in 0..300 {
            let mut beacons = Beacons::new(&BeaconConfig::default(), schedule(), 0.0, seed);
            let errors: Vec<_> = (0..=120)
                .filter_map(|sweep| beacons.next(sweep, &here))
                .map(|beacon| Vector3::from(beacon.position_m) - here)
                .collect();
            assert_eq!(errors.len(), 121);
            now += errors[0].norm_squared() / 900.0;
            step += (errors[1] - errors[0]).norm_squared() / 900.0;
            minute += (errors[120] - errors[0]).norm_squared() / 900.0;
        }
        assert!((now.sqrt() / 0.02 - 1.0).abs() < 0.08, "{}", now.sqrt());
        assert!(step.sqrt() < 0.004, "{}", step.sqrt());
        // Correlation exp(-1) after a minute: sqrt(2 (1 - exp(-1))) = 1.124 sigma.
        assert!((minute.sqrt() / 0.02 - 1.124).abs() < 0.1, "{}", minute.sqrt());
    }

    #[test]
    fn the_mast_is_off_by_the_budget_and_the_beacon_does_not_say_so() {
        let (mut heading, mut tilt) = (0.0, 0.0);
        for seed in 0..400 {
            let r = true_gmt_attitude(&BeaconConfig::default(), 0.0, seed).into_inner();
            heading += r.m21 * r.m21 / 400.0;
            tilt += (r.m13 * r.m13 + r.m23 * r.m23) / 800.0;
        }
        let deg = |square: f64| square.sqrt() * 180.0 / PI;
        assert!((deg(heading) / 0.05 - 1.0).abs() < 0.1 && (deg(tilt) / 0.05 - 1.0).abs() < 0.1);
        assert_eq!(
            true_gmt_attitude(&BeaconConfig::ideal(), 0.0, 4),
            Rotation3::identity()
        );
        let beacon = Beacons::new(&BeaconConfig::default(), schedule(), 0.0, 1).next(0, &Vector3::zeros());
        assert_eq!(beacon.map(|b| b.heading_pitch_roll_rad), Some([0.0; 3]));
    }

    #[test]
    fn losses_do_not_disturb_the_errors() {
        let lossy = BeaconConfig {
            loss: 0.4,
            ..BeaconConfig::default()
        };
        let (mut all, mut some) = (
            Beacons::new(&BeaconConfig::default(), schedule(), 0.0, 9),
            Beacons::new(&lossy, schedule(), 0.0, 9),
        );
        let mut lost = 0;
        for sweep in 0..1000 {
            let full = all.next(sweep, &Vector3::zeros());
            match some.next(sweep, &Vector3::zeros()) {
                Some(beacon) => assert_eq!(Some(beacon), full),
                None => lost += 1,
            }
        }
        assert!((340..460).contains(&lost), "{lost}");
    }
}
