//! How the warmth of an inertial sensor moves its biases and scales.
//!
//! A sensor is switched on cold and warms by an exponential. Bias and scale follow the temperature by coefficients of their own, so that
//! the bias of a flight is a curve of one shape, not a random walk.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use super::{DPS_RAD_PER_S, MICRO_G_M_PER_S2};
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Warming and what it does; zeros for none.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TemperatureConfig {
    /// How much warmer it gets from the start of the flight on, K.
    pub warm_up_k: f64,
    /// Time constant of the warming, s.
    pub warm_up_s: f64,
    /// Standard deviation of the gyroscope's bias by temperature, mdps/K per axis.
    pub gyro_bias_mdps_per_k: f64,
    /// Standard deviation of the accelerometer's bias by temperature, ug/K per axis.
    pub accel_bias_ug_per_k: f64,
    /// Standard deviation of the scale of each axis of both by temperature, 1e-6/K.
    pub scale_ppm_per_k: f64,
}

impl Default for TemperatureConfig {
    fn default() -> Self {
        Self {
            warm_up_k: 0.0,
            warm_up_s: 180.0,
            gyro_bias_mdps_per_k: 0.0,
            accel_bias_ug_per_k: 0.0,
            scale_ppm_per_k: 0.0,
        }
    }
}

impl TemperatureConfig {
    /// 20 K, over which the biases move by 0.15 deg/s and 1 mg.
    pub fn real() -> Self {
        Self {
            warm_up_k: 20.0,
            warm_up_s: 180.0,
            gyro_bias_mdps_per_k: 7.5,
            accel_bias_ug_per_k: 50.0,
            scale_ppm_per_k: 100.0,
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::not_negative(&[
            ("imu.temperature.warm_up_k", self.warm_up_k),
            ("imu.temperature.gyro_bias_mdps_per_k", self.gyro_bias_mdps_per_k),
            ("imu.temperature.accel_bias_ug_per_k", self.accel_bias_ug_per_k),
            ("imu.temperature.scale_ppm_per_k", self.scale_ppm_per_k),
        ])?;
        if !(self.warm_up_s.is_finite() && self.warm_up_s > 0.0) {
            return Err(InputError::at_key(
                "imu.temperature.warm_up_s",
                format!("is {}, expected a number above 0", self.warm_up_s),
            ));
        }
        Ok(())
    }
}

/// Change of one sensor's three axes per kelvin.
#[derive(Clone, Debug)]
struct Coefficients {
    bias: Vector3<f64>,
    scale: Vector3<f64>,
}

impl Coefficients {
    fn change(&self, value: &Vector3<f64>, warmer_k: f64) -> Vector3<f64> {
        (self.bias + self.scale.component_mul(value)) * warmer_k
    }
}

/// The temperature of one sensor and what it does: state of the simulation.
#[derive(Clone, Debug)]
pub(super) struct Temperature {
    warm_up_k: f64,
    warm_up_s: f64,
    gyroscope: Coefficients,
    accelerometer: Coefficients,
}

impl Temperature {
    /// The sensor of the world of `seed`.
    pub(super) fn new(config: &TemperatureConfig, seed: u64) -> Self {
        let mut random = Seeded::new(seed, Source::ImuTemperature);
        let mut coefficients = |bias: f64| Coefficients {
            bias: random.normal_vector() * bias,
            scale: random.normal_vector() * (config.scale_ppm_per_k * 1e-6),
        };
        Self {
            warm_up_k: config.warm_up_k,
            warm_up_s: config.warm_up_s,
            gyroscope: coefficients(config.gyro_bias_mdps_per_k * 1e-3 * DPS_RAD_PER_S),
            accelerometer: coefficients(config.accel_bias_ug_per_k * MICRO_G_M_PER_S2),
        }
    }

    /// What the warmth `time_s` after the start adds to a rate (rad/s) and a force (m/s^2).
    pub(super) fn errors(
        &self,
        rate_rad_per_s: &Vector3<f64>,
        force_m_per_s2: &Vector3<f64>,
        time_s: f64,
    ) -> (Vector3<f64>, Vector3<f64>) {
        let warmer_k = self.warm_up_k * (1.0 - libm::exp(-time_s / self.warm_up_s));
        (
            self.gyroscope.change(rate_rad_per_s, warmer_k),
            self.accelerometer.change(force_m_per_s2, warmer_k),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn biases_follow_the_warmth_and_end_at_their_figures() {
        let zero = Vector3::zeros();
        let (mut gyro, mut accel) = (0.0, 0.0);
        for seed in 0..400 {
            let sensor = Temperature::new(&TemperatureConfig::real(), seed);
            let at = |time_s| sensor.errors(&zero, &zero, time_s);
            let (rate, force) = at(1e5);
            gyro += rate.norm_squared() / 1200.0;
            accel += force.norm_squared() / 1200.0;
            assert_eq!(at(0.0), (zero, zero));
            // After one time constant 63 % of the way.
            assert!((at(180.0).0 - rate * 0.632_120_558_8).norm() < 1e-9 * rate.norm());
        }
        let gyro = gyro.sqrt() / DPS_RAD_PER_S;
        assert!((gyro / 0.15 - 1.0).abs() < 0.06, "{gyro}");
        let accel = accel.sqrt() / (1e3 * MICRO_G_M_PER_S2);
        assert!((accel / 1.0 - 1.0).abs() < 0.06, "{accel}");
    }

    #[test]
    fn scales_follow_the_warmth_axis_by_axis() {
        let config = TemperatureConfig {
            warm_up_k: 20.0,
            scale_ppm_per_k: 100.0,
            ..TemperatureConfig::default()
        };
        let mut square = 0.0;
        for seed in 0..400 {
            let sensor = Temperature::new(&config, seed);
            let (rate, force) = sensor.errors(&(Vector3::x() * 2.0), &(Vector3::z() * 10.0), 1e5);
            assert!(rate.y == 0.0 && rate.z == 0.0 && force.x == 0.0 && force.y == 0.0);
            square += (rate.x / 2.0) * (rate.x / 2.0) / 800.0 + (force.z / 10.0) * (force.z / 10.0) / 800.0;
        }
        assert!((square.sqrt() / 2e-3 - 1.0).abs() < 0.06, "{}", square.sqrt());
        let none = Temperature::new(&TemperatureConfig::default(), 1);
        let (rate, force) = none.errors(&Vector3::x(), &Vector3::x(), 60.0);
        assert_eq!((rate, force), (Vector3::zeros(), Vector3::zeros()));
    }
}
