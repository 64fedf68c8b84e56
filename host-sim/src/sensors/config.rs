//! The errors of all sensors in one description, as a TOML file gives it.

use serde::{Deserialize, Serialize};

use super::{
    BarometerConfig, BeaconConfig, ClockConfig, FaultsConfig, ImuConfig, MagnetometerConfig, TimingConfig,
};
use crate::input::InputError;

/// Errors of all sensors. The default is the budget of design section 6.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SensorsConfig {
    /// Inertial measurement unit.
    pub imu: ImuConfig,
    /// Magnetometer.
    pub magnetometer: MagnetometerConfig,
    /// Barometer; none by default.
    pub barometer: BarometerConfig,
    /// What the GMT says about itself.
    pub beacon: BeaconConfig,
    /// Two-way timing.
    pub timing: TimingConfig,
    /// UAV clock.
    pub clock: ClockConfig,
    /// What fails; nothing by default.
    pub faults: FaultsConfig,
}

impl SensorsConfig {
    /// No errors at all; rates as in the default.
    pub fn ideal() -> Self {
        Self {
            imu: ImuConfig::ideal(),
            magnetometer: MagnetometerConfig::ideal(),
            barometer: BarometerConfig::ideal(),
            beacon: BeaconConfig::ideal(),
            timing: TimingConfig::ideal(),
            clock: ClockConfig::ideal(),
            faults: FaultsConfig::default(),
        }
    }

    /// Sensors that are not those of the receiver's model: inertial sensor and magnetometer as they are built in and shaken, a
    /// barometer, beacons and two-way timing through the channel. The clock is that of the default.
    pub fn real() -> Self {
        Self {
            imu: ImuConfig::real(),
            magnetometer: MagnetometerConfig::real(),
            barometer: BarometerConfig::real(),
            beacon: BeaconConfig::real(),
            timing: TimingConfig::real(),
            ..Self::default()
        }
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.imu
            .check()
            .and_then(|()| self.magnetometer.check())
            .and_then(|()| self.barometer.check())
            .and_then(|()| self.beacon.check())
            .and_then(|()| self.timing.check())
            .and_then(|()| self.clock.check())
            .and_then(|()| self.faults.check())
    }
}

/// A rate whose period is a whole number of microseconds.
pub(super) fn divides_a_second(key: &str, rate_hz: u32) -> Result<(), InputError> {
    if rate_hz == 0 || 1_000_000 % rate_hz != 0 {
        let message = format!("is {rate_hz}, expected a rate that divides 1 000 000");
        return Err(InputError::at_key(key, message));
    }
    Ok(())
}

/// Finite and not negative.
pub(super) fn not_negative(figures: &[(&str, f64)]) -> Result<(), InputError> {
    match figures
        .iter()
        .find(|(_, value)| !(value.is_finite() && *value >= 0.0))
    {
        Some((key, value)) => Err(InputError::at_key(
            *key,
            format!("is {value}, expected a number of at least 0"),
        )),
        None => Ok(()),
    }
}

/// A share.
pub(super) fn at_most_one(key: &str, share: f64) -> Result<(), InputError> {
    if share > 1.0 {
        return Err(InputError::at_key(
            key,
            format!("is {share}, expected a share of 0 to 1"),
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partial_toml_keeps_the_other_defaults() {
        let config: SensorsConfig =
            toml::from_str("[imu]\ngyro_noise_mdps_per_sqrt_hz = 14.0\n").expect("valid");
        assert_eq!(config.imu.gyro_noise_mdps_per_sqrt_hz, 14.0);
        assert_eq!(config.imu.accel_noise_ug_per_sqrt_hz, 70.0);
        assert_eq!(config.clock, ClockConfig::default());
        let text = toml::to_string(&config).expect("serialisable");
        assert_eq!(
            toml::from_str::<SensorsConfig>(&text).expect("own output"),
            config
        );
        assert!(toml::from_str::<SensorsConfig>("[imu]\ngyro_noise = 1.0\n").is_err());
    }

    #[test]
    fn bad_figures_are_named() {
        let message = |change: fn(&mut SensorsConfig)| {
            let mut config = SensorsConfig::default();
            change(&mut config);
            config.check().expect_err("must be refused").to_string()
        };
        assert!(SensorsConfig::default().check().is_ok() && SensorsConfig::ideal().check().is_ok());
        assert!(SensorsConfig::real().check().is_ok());
        assert!(message(|c| c.imu.vibration.rate_dps[2] = -1.0).contains("imu.vibration.rate_dps"));
        assert!(message(|c| c.imu.sampling.filter_hz = 2001.0).contains("imu.sampling.filter_hz"));
        assert!(message(|c| c.imu.temperature.warm_up_s = 0.0).contains("imu.temperature.warm_up_s"));
        assert!(message(|c| c.magnetometer.motor_ut = -1.0).contains("magnetometer.motor_ut"));
        assert!(message(|c| c.magnetometer.wall_dipole_ut = -1.0).contains("magnetometer.wall_dipole_ut"));
        assert!(message(|c| c.imu.clock_rms_ppm = 1001.0).contains("imu.clock_rms_ppm"));
        assert!(message(|c| c.barometer.rate_hz = 7).contains("barometer.rate_hz"));
        assert!(message(|c| c.barometer.weather_m = -0.1).contains("barometer.weather_m"));
        assert!(message(|c| c.barometer.wind_coefficient = 2.0).contains("barometer.wind_coefficient"));
        assert!(message(|c| c.barometer.place_m[1] = f64::NAN).contains("barometer.place_m"));
        assert!(message(|c| c.imu.rate_hz = 0).contains("imu.rate_hz"));
        assert!(message(|c| c.imu.rate_hz = 999).contains("imu.rate_hz"));
        assert!(message(|c| c.imu.accel_turn_on_bias_mg = -1.0).contains("imu.accel_turn_on_bias_mg"));
        assert!(
            message(|c| c.magnetometer.inclination_deg = f64::NAN).contains("magnetometer.inclination_deg")
        );
        assert!(message(|c| c.beacon.loss = 1.5).contains("beacon.loss"));
        assert!(message(|c| c.timing.availability = f64::INFINITY).contains("timing.availability"));
        assert!(message(|c| c.clock.initial_drift_ppm = 1e4).contains("clock.initial_drift_ppm"));
    }
}
