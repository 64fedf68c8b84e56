//! The inertial measurement unit, after the data sheet of the ICM-42688-P.
//!
//! code = round(saturate((I + M) x + turn-on bias + drift + warmth + white noise)), with x what the sample holds of the
//! signal (its true mean over the interval, unless [`SamplingConfig`] and the effects before it say otherwise), and M a full
//! 3 x 3 matrix of scale (diagonal) and misalignment errors (docs/localization.md, "The model").

use core::f64::consts::PI;

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use cslam_firmware::icm42688::packet::{
    ACCELERATION_CODE_MAX, ACCELERATION_PER_CODE_M_PER_S2, RATE_CODE_MAX, RATE_PER_CODE_RAD_PER_S, RawSample,
};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::drift::BiasDrift;
use super::g_sensitivity::GSensitivityConfig;
use super::imu_chip::stamp;
use super::mounting::MountingConfig;
use super::sampling::SamplingConfig;
use super::temperature::{Temperature, TemperatureConfig};
use super::vibration::VibrationConfig;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Errors of the IMU, in the units of data sheets. Every figure is zero or positive.
///
/// White noise is given by its Allan deviation at tau = 1 s, the usual reading of a data sheet's noise density: a
/// sample at rate f has the standard deviation density x sqrt f.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ImuConfig {
    /// Output data rate, Hz; divides 1 000 000.
    pub rate_hz: u32,
    /// Standard deviation of its own clock's rate against the UAV's, 1e-6, 0 to 1000: it samples by the one, and is stamped by the
    /// other.
    pub clock_rms_ppm: f64,
    /// White noise of the gyroscope, mdps/sqrt(Hz). Data sheet: 2.8.
    pub gyro_noise_mdps_per_sqrt_hz: f64,
    /// Flicker floor of the gyroscope's Allan deviation, deg/h. The data sheet gives none: 3 is typical of
    /// the class, and in flight the walk below exceeds it after three seconds.
    pub gyro_bias_instability_deg_per_h: f64,
    /// Random walk of the gyroscope's bias, mdps/sqrt(s): temperature drift in flight (docs/localization.md, "The model").
    pub gyro_bias_walk_mdps_per_sqrt_s: f64,
    /// Standard deviation of the gyroscope's turn-on bias, deg/s per axis. Data sheet and budget: 0.5.
    pub gyro_turn_on_bias_dps: f64,
    /// Standard deviation of each element of the gyroscope's scale and misalignment matrix.
    pub gyro_scale_misalignment: f64,
    /// White noise of the accelerometer, ug/sqrt(Hz). Data sheet: 70 (z; x and y are at 65).
    pub accel_noise_ug_per_sqrt_hz: f64,
    /// Flicker floor of the accelerometer's Allan deviation, ug. The data sheet gives none: 20 is typical of the
    /// class, and in flight the walk below exceeds it after three seconds.
    pub accel_bias_instability_ug: f64,
    /// Random walk of the accelerometer's bias, ug/sqrt(s): temperature drift in flight (docs/localization.md, "The model").
    pub accel_bias_walk_ug_per_sqrt_s: f64,
    /// Standard deviation of the accelerometer's turn-on bias, mg per axis. Data sheet and budget: 20.
    pub accel_turn_on_bias_mg: f64,
    /// Standard deviation of each element of the accelerometer's scale and misalignment matrix.
    pub accel_scale_misalignment: f64,
    /// What warmth does; nothing by default.
    pub temperature: TemperatureConfig,
    /// What acceleration does besides being measured; nothing by default.
    pub g_sensitivity: GSensitivityConfig,
    /// What the rotors shake it with; nothing by default.
    pub vibration: VibrationConfig,
    /// Where it is against what the receiver believes; there by default.
    pub mounting: MountingConfig,
    /// Filter, latency and stamps; exact means by default.
    pub sampling: SamplingConfig,
}

impl Default for ImuConfig {
    fn default() -> Self {
        Self {
            rate_hz: 1000,
            clock_rms_ppm: 0.0,
            gyro_noise_mdps_per_sqrt_hz: 2.8,
            gyro_bias_instability_deg_per_h: 3.0,
            gyro_bias_walk_mdps_per_sqrt_s: 1.0,
            gyro_turn_on_bias_dps: 0.5,
            gyro_scale_misalignment: 0.003,
            accel_noise_ug_per_sqrt_hz: 70.0,
            accel_bias_instability_ug: 20.0,
            accel_bias_walk_ug_per_sqrt_s: 20.0,
            accel_turn_on_bias_mg: 20.0,
            accel_scale_misalignment: 0.003,
            temperature: TemperatureConfig::default(),
            g_sensitivity: GSensitivityConfig::default(),
            vibration: VibrationConfig::default(),
            mounting: MountingConfig::default(),
            sampling: SamplingConfig::default(),
        }
    }
}

impl ImuConfig {
    /// An IMU without errors: what is left is the rounding to codes.
    pub fn ideal() -> Self {
        Self {
            rate_hz: 1000,
            clock_rms_ppm: 0.0,
            gyro_noise_mdps_per_sqrt_hz: 0.0,
            gyro_bias_instability_deg_per_h: 0.0,
            gyro_bias_walk_mdps_per_sqrt_s: 0.0,
            gyro_turn_on_bias_dps: 0.0,
            gyro_scale_misalignment: 0.0,
            accel_noise_ug_per_sqrt_hz: 0.0,
            accel_bias_instability_ug: 0.0,
            accel_bias_walk_ug_per_sqrt_s: 0.0,
            accel_turn_on_bias_mg: 0.0,
            accel_scale_misalignment: 0.0,
            temperature: TemperatureConfig::default(),
            g_sensitivity: GSensitivityConfig::default(),
            vibration: VibrationConfig::default(),
            mounting: MountingConfig::default(),
            sampling: SamplingConfig::default(),
        }
    }

    /// An IMU that the filter has no model of: biases that follow a warm-up instead of a walk, vibration and what it rectifies to, a
    /// filter, latency, a clock of its own, and a mounting that was measured with a ruler.
    pub fn real() -> Self {
        Self {
            clock_rms_ppm: 50.0,
            gyro_bias_walk_mdps_per_sqrt_s: 0.0,
            accel_bias_walk_ug_per_sqrt_s: 0.0,
            temperature: TemperatureConfig::real(),
            g_sensitivity: GSensitivityConfig::real(),
            vibration: VibrationConfig::real(),
            mounting: MountingConfig::real(),
            sampling: SamplingConfig::real(),
            ..Self::default()
        }
    }

    /// The same IMU on a bench at constant temperature, where data sheets and Allan plots are made: no bias walk, no warming.
    pub fn at_constant_temperature(&self) -> Self {
        Self {
            gyro_bias_walk_mdps_per_sqrt_s: 0.0,
            accel_bias_walk_ug_per_sqrt_s: 0.0,
            temperature: TemperatureConfig::default(),
            ..self.clone()
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::divides_a_second("imu.rate_hz", self.rate_hz)?;
        if !(0.0..=1000.0).contains(&self.clock_rms_ppm) {
            let message = format!("is {}, expected 0 to 1000", self.clock_rms_ppm);
            return Err(InputError::at_key("imu.clock_rms_ppm", message));
        }
        super::not_negative(&[
            (
                "imu.gyro_noise_mdps_per_sqrt_hz",
                self.gyro_noise_mdps_per_sqrt_hz,
            ),
            (
                "imu.gyro_bias_instability_deg_per_h",
                self.gyro_bias_instability_deg_per_h,
            ),
            (
                "imu.gyro_bias_walk_mdps_per_sqrt_s",
                self.gyro_bias_walk_mdps_per_sqrt_s,
            ),
            ("imu.gyro_turn_on_bias_dps", self.gyro_turn_on_bias_dps),
            ("imu.gyro_scale_misalignment", self.gyro_scale_misalignment),
            ("imu.accel_noise_ug_per_sqrt_hz", self.accel_noise_ug_per_sqrt_hz),
            ("imu.accel_bias_instability_ug", self.accel_bias_instability_ug),
            (
                "imu.accel_bias_walk_ug_per_sqrt_s",
                self.accel_bias_walk_ug_per_sqrt_s,
            ),
            ("imu.accel_turn_on_bias_mg", self.accel_turn_on_bias_mg),
            ("imu.accel_scale_misalignment", self.accel_scale_misalignment),
        ])?;
        self.temperature.check()?;
        self.g_sensitivity.check()?;
        self.vibration.check()?;
        self.mounting.check()?;
        self.sampling.check(self.rate_hz)
    }
}

/// Degrees per second in rad/s.
pub const DPS_RAD_PER_S: f64 = PI / 180.0;
/// A micro-g in m/s^2.
pub const MICRO_G_M_PER_S2: f64 = STANDARD_GRAVITY_M_PER_S2 * 1e-6;

/// Three like axes: the error model shared by gyroscope and accelerometer, in SI units.
#[derive(Clone, Debug)]
struct Triad {
    matrix: Matrix3<f64>,
    turn_on: Vector3<f64>,
    noise_sigma: f64,
    noise: Seeded,
    drift: BiasDrift,
    bias: Vector3<f64>,
}

impl Triad {
    fn measure(&mut self, truth: &Vector3<f64>, advance_drift: bool) -> Vector3<f64> {
        if advance_drift {
            self.bias = self.turn_on + self.drift.advance();
        }
        self.matrix * truth + self.bias + self.noise.normal_vector() * self.noise_sigma
    }
}

/// Build errors, turn-on bias and drift of one IMU: state of the simulation, hidden from the receiver.
#[derive(Clone, Debug)]
pub struct Imu {
    gyroscope: Triad,
    accelerometer: Triad,
    temperature: Temperature,
    interval_s: f64,
    drift_every: u32,
    count: u32,
}

/// The drift is advanced at this rate: above it white noise hides a flicker by three orders of magnitude.
const DRIFT_RATE_HZ: u32 = 100;

impl Imu {
    /// The IMU of the world of `seed`. `config` has been checked by [`super::SensorsConfig::check`].
    pub fn new(config: &ImuConfig, seed: u64) -> Self {
        let drift_every = (config.rate_hz / DRIFT_RATE_HZ).max(1);
        let drift_step_s = f64::from(drift_every) / f64::from(config.rate_hz);
        let root_rate = f64::from(config.rate_hz).sqrt();
        let triad = |build, noise, drift, matrix: f64, turn_on: f64, density: f64, floor, walk| {
            let mut build = Seeded::new(seed, build);
            Triad {
                matrix: Matrix3::from_fn(|_, _| matrix * build.normal()) + Matrix3::identity(),
                turn_on: build.normal_vector() * turn_on,
                noise_sigma: density * root_rate,
                noise: Seeded::new(seed, noise),
                drift: BiasDrift::new(floor, walk, drift_step_s, Seeded::new(seed, drift)),
                bias: Vector3::zeros(),
            }
        };
        Self {
            gyroscope: triad(
                Source::GyroscopeBuild,
                Source::GyroscopeNoise,
                Source::GyroscopeDrift,
                config.gyro_scale_misalignment,
                config.gyro_turn_on_bias_dps * DPS_RAD_PER_S,
                config.gyro_noise_mdps_per_sqrt_hz * 1e-3 * DPS_RAD_PER_S,
                config.gyro_bias_instability_deg_per_h / 3600.0 * DPS_RAD_PER_S,
                config.gyro_bias_walk_mdps_per_sqrt_s * 1e-3 * DPS_RAD_PER_S,
            ),
            accelerometer: triad(
                Source::AccelerometerBuild,
                Source::AccelerometerNoise,
                Source::AccelerometerDrift,
                config.accel_scale_misalignment,
                config.accel_turn_on_bias_mg * 1e3 * MICRO_G_M_PER_S2,
                config.accel_noise_ug_per_sqrt_hz * MICRO_G_M_PER_S2,
                config.accel_bias_instability_ug * MICRO_G_M_PER_S2,
                config.accel_bias_walk_ug_per_sqrt_s * MICRO_G_M_PER_S2,
            ),
            temperature: Temperature::new(&config.temperature, seed),
            interval_s: 1.0 / f64::from(config.rate_hz),
            drift_every,
            count: 0,
        }
    }

    /// The next sample, from what it holds of the signals: angular rate in rad/s and specific force in m/s^2, both in the
    /// sensor's axes.
    pub fn measure(&mut self, rate_rad_per_s: &Vector3<f64>, force_m_per_s2: &Vector3<f64>) -> RawSample {
        let advance = self.count.is_multiple_of(self.drift_every);
        self.count = self.count.wrapping_add(1);
        let time_s = f64::from(self.count) * self.interval_s;
        let (rate_error, force_error) = self.temperature.errors(rate_rad_per_s, force_m_per_s2, time_s);
        let rate = self.gyroscope.measure(rate_rad_per_s, advance) + rate_error;
        let force = self.accelerometer.measure(force_m_per_s2, advance) + force_error;
        RawSample {
            acceleration: quantise(&force, ACCELERATION_PER_CODE_M_PER_S2, ACCELERATION_CODE_MAX),
            rate: quantise(&rate, RATE_PER_CODE_RAD_PER_S, RATE_CODE_MAX),
            temperature: 0,
            // A chip whose clock is the UAV's: the errors of both clocks are in the times of the events.
            time_ticks: stamp(time_s),
        }
    }

    /// Bias of gyroscope (rad/s) and accelerometer (m/s^2) in the last sample: truth, for evaluation only.
    pub fn bias(&self) -> (Vector3<f64>, Vector3<f64>) {
        (self.gyroscope.bias, self.accelerometer.bias)
    }
}

/// Round half up to the nearest code, then saturate.
fn quantise(value: &Vector3<f64>, per_code: f64, max: i32) -> [i32; 3] {
    let limit = f64::from(max);
    core::array::from_fn(|axis| libm::floor(value[axis] / per_code + 0.5).clamp(-limit, limit) as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn only(change: impl Fn(&mut ImuConfig)) -> ImuConfig {
        let mut config = ImuConfig::ideal();
        change(&mut config);
        config
    }

    /// Errors of gyroscope (rad/s) and accelerometer (m/s^2) of the first sample.
    fn errors(config: &ImuConfig, seed: u64, rate: Vector3<f64>, force: Vector3<f64>) -> [Vector3<f64>; 2] {
        let sample = Imu::new(config, seed).measure(&rate, &force);
        [
            sample.rate_rad_per_s() - rate,
            sample.specific_force_m_per_s2() - force,
        ]
    }

    fn rms(values: impl Iterator<Item = Vector3<f64>>) -> f64 {
        let (sum, count) = values.fold((0.0, 0.0), |(s, n), v| (s + v.norm_squared(), n + 3.0));
        f64::sqrt(sum / count)
    }

    #[test]
    fn without_errors_only_the_rounding_is_left() {
        for k in 0..100 {
            let truth = Vector3::new(0.013, -0.7, 0.31) * f64::from(k) * 0.1;
            let [rate, force] = errors(&ImuConfig::ideal(), 1, truth, truth * 4.0);
            assert!(rate.amax() <= 0.5001 * RATE_PER_CODE_RAD_PER_S);
            assert!(force.amax() <= 0.5001 * ACCELERATION_PER_CODE_M_PER_S2);
        }
    }

    #[test]
    fn each_error_has_its_size_and_touches_its_sensor_only() {
        let zero = Vector3::zeros();
        let turn_on = |config: &ImuConfig| {
            [0, 1].map(|i| rms((0..500).map(|seed| errors(config, seed, zero, zero)[i])))
        };
        let [rate, force] = turn_on(&only(|c| c.gyro_turn_on_bias_dps = 0.5));
        assert!((rate / (0.5 * DPS_RAD_PER_S) - 1.0).abs() < 0.06 && force == 0.0);
        let [rate, force] = turn_on(&only(|c| c.accel_turn_on_bias_mg = 20.0));
        assert!((force / (20e3 * MICRO_G_M_PER_S2) - 1.0).abs() < 0.06 && rate == 0.0);
        // Scale and misalignment: every element of the matrix alike, whichever axis turns.
        let config = only(|c| c.gyro_scale_misalignment = 0.003);
        for axis in [Vector3::x(), Vector3::z()] {
            let error = rms((0..500).map(|seed| errors(&config, seed, axis * 10.0, zero)[0]));
            assert!((error / 0.03 - 1.0).abs() < 0.06, "{error}");
        }
        let config = only(|c| c.accel_scale_misalignment = 0.003);
        let error = rms((0..500).map(|seed| errors(&config, seed, zero, Vector3::z() * 100.0)[1]));
        assert!((error / 0.3 - 1.0).abs() < 0.06, "{error}");
    }

    #[test]
    fn beyond_the_range_the_codes_stand_at_their_ends() {
        let mut imu = Imu::new(&ImuConfig::default(), 3);
        let sample = imu.measure(&Vector3::new(40.0, -40.0, 0.0), &Vector3::new(-400.0, 0.0, 400.0));
        assert_eq!((sample.rate[0], sample.rate[1]), (RATE_CODE_MAX, -RATE_CODE_MAX));
        assert_eq!(sample.acceleration[0], -ACCELERATION_CODE_MAX);
        assert_eq!(sample.acceleration[2], ACCELERATION_CODE_MAX);
        assert!(sample.is_saturated());
        assert!(!imu.measure(&Vector3::zeros(), &Vector3::zeros()).is_saturated());
    }

    #[test]
    fn the_chip_counts_ticks_of_its_own() {
        let mut imu = Imu::new(&ImuConfig::default(), 3);
        let stamps: Vec<u16> = (0..70)
            .map(|_| imu.measure(&Vector3::zeros(), &Vector3::zeros()).time_ticks)
            .collect();
        // 937.5 a millisecond, and 65 536 make a turn.
        assert_eq!(
            (stamps[0], stamps[1], stamps[68], stamps[69]),
            (937, 1875, 64_687, 89)
        );
    }
}
