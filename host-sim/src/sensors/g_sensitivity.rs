//! What acceleration does to the readings of an inertial sensor besides being measured.
//!
//! rate += G f + c |f|^2 and force_i += k_i f_i^2, with f the specific force on the sensor. The squares rectify: vibration that averages out
//! leaves a bias of its mean square.

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::{DPS_RAD_PER_S, MICRO_G_M_PER_S2};
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Standard deviations of the coefficients over sensors; zeros for none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GSensitivityConfig {
    /// Each element of the matrix G, deg/s per g.
    pub gyro_dps_per_g: f64,
    /// Each axis of c, deg/s per g^2.
    pub gyro_dps_per_g2: f64,
    /// Each axis of k, ug per g^2.
    pub accel_ug_per_g2: f64,
}

impl GSensitivityConfig {
    /// Typical of the class.
    pub fn real() -> Self {
        Self {
            gyro_dps_per_g: 0.05,
            gyro_dps_per_g2: 0.001,
            accel_ug_per_g2: 50.0,
        }
    }

    /// Whether there is none.
    pub(super) fn is_off(&self) -> bool {
        *self == Self::default()
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::not_negative(&[
            ("imu.g_sensitivity.gyro_dps_per_g", self.gyro_dps_per_g),
            ("imu.g_sensitivity.gyro_dps_per_g2", self.gyro_dps_per_g2),
            ("imu.g_sensitivity.accel_ug_per_g2", self.accel_ug_per_g2),
        ])
    }
}

/// The coefficients of one sensor in SI units, per m/s^2.
#[derive(Clone, Debug)]
pub(super) struct GSensitivity {
    gyro: Matrix3<f64>,
    gyro_square: Vector3<f64>,
    accel_square: Vector3<f64>,
}

impl GSensitivity {
    /// The sensor of the world of `seed`.
    pub(super) fn new(config: &GSensitivityConfig, seed: u64) -> Self {
        let g = STANDARD_GRAVITY_M_PER_S2;
        let mut random = Seeded::new(seed, Source::GSensitivity);
        let gyro = Matrix3::from_fn(|_, _| random.normal());
        Self {
            gyro: gyro * (config.gyro_dps_per_g * DPS_RAD_PER_S / g),
            gyro_square: random.normal_vector() * (config.gyro_dps_per_g2 * DPS_RAD_PER_S / (g * g)),
            accel_square: random.normal_vector() * (config.accel_ug_per_g2 * MICRO_G_M_PER_S2 / (g * g)),
        }
    }

    /// What a specific force (m/s^2, at an instant) adds to rate (rad/s) and force (m/s^2).
    pub(super) fn errors(&self, force_m_per_s2: &Vector3<f64>) -> (Vector3<f64>, Vector3<f64>) {
        let square = force_m_per_s2.component_mul(force_m_per_s2);
        (
            self.gyro * force_m_per_s2 + self.gyro_square * square.sum(),
            self.accel_square.component_mul(&square),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const G: f64 = STANDARD_GRAVITY_M_PER_S2;

    #[test]
    fn each_coefficient_has_its_size() {
        let (mut linear, mut gyro, mut accel) = (0.0, 0.0, 0.0);
        for seed in 0..400 {
            let sensor = GSensitivity::new(&GSensitivityConfig::real(), seed);
            let force = Vector3::x() * (3.0 * G);
            let [(up, force_up), (down, force_down)] = [force, -force].map(|f| sensor.errors(&f));
            linear += ((up - down) / 6.0).norm_squared() / 1200.0;
            gyro += ((up + down) / 18.0).norm_squared() / 1200.0;
            accel += (force_up.x / 9.0) * (force_up.x / 9.0) / 400.0;
            assert_eq!(force_up, force_down);
            assert!(force_up.y == 0.0 && force_up.z == 0.0);
        }
        let off = |sum: f64, expected: f64| (sum.sqrt() / expected - 1.0).abs();
        assert!(off(linear, 0.05 * DPS_RAD_PER_S) < 0.06, "{}", linear.sqrt());
        assert!(off(gyro, 0.001 * DPS_RAD_PER_S) < 0.06, "{}", gyro.sqrt());
        assert!(off(accel, 50.0 * MICRO_G_M_PER_S2) < 0.1, "{}", accel.sqrt());
    }

    #[test]
    fn vibration_leaves_a_bias_of_its_mean_square() {
        let config = GSensitivityConfig {
            accel_ug_per_g2: 50.0,
            ..GSensitivityConfig::default()
        };
        let sensor = GSensitivity::new(&config, 1);
        let mean = |amplitude: f64| {
            let at =
                |k: u32| Vector3::repeat(amplitude * libm::sin(0.01 * core::f64::consts::TAU * f64::from(k)));
            (0..100).map(|k| sensor.errors(&at(k)).1).sum::<Vector3<f64>>() / 100.0
        };
        let expected = sensor.accel_square * (0.5 * 9.0);
        assert!((mean(3.0) - expected).norm() < 1e-12 * expected.norm().max(1.0));
        assert_eq!(sensor.errors(&Vector3::repeat(20.0)).0, Vector3::zeros());
    }
}
