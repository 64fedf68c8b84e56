//! A three-axis magnetometer: the earth's field in body axes, with hard and soft iron left over from calibration and
//! the disturbance of a city.
//!
//! code = round((I + S) R^T (B + disturbance + iron in walls) + hard iron + motors + noise). At the defaults the heading it gives is off by
//! about 5 deg, most of it constant or slow (docs/localization.md, "The model" takes it as a bias): a weak aid.

use core::f64::consts::PI;

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Field of one magnetometer code, uT: 16 384 codes a gauss, 18 bits for 800 uT.
pub const FIELD_PER_CODE_UT: f64 = 100.0 / 16_384.0;
/// Largest code.
pub const FIELD_CODE_MAX: i32 = (1 << 17) - 1;
/// Thrust over mass at full throttle: twice the weight.
const FULL_THRUST_M_PER_S2: f64 = 2.0 * STANDARD_GRAVITY_M_PER_S2;

/// The earth's field, known to the receiver, and the errors of the magnetometer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MagnetometerConfig {
    /// Samples per second, Hz; divides 1 000 000.
    pub rate_hz: u32,
    /// Strength of the earth's field, uT.
    pub field_ut: f64,
    /// Angle of the field below the horizon, deg.
    pub inclination_deg: f64,
    /// Angle of magnetic north east of true north, deg.
    pub declination_deg: f64,
    /// White noise, uT rms per axis and sample.
    pub noise_ut: f64,
    /// Standard deviation of the hard iron left after calibration, uT per axis, constant in body axes.
    pub hard_iron_ut: f64,
    /// Standard deviation of each element of the soft-iron matrix.
    pub soft_iron: f64,
    /// Standard deviation of the disturbance by the surroundings, uT per axis in the world frame.
    pub disturbance_ut: f64,
    /// Correlation time of the disturbance, s.
    pub disturbance_time_s: f64,
    /// Field of the motors' currents at full thrust, uT, in one direction of the body: calibration on the ground does not see it.
    pub motor_ut: f64,
    /// Field of a dipole of iron in the walls of a building at 1 m along its axis, uT; none under the sky ([`super::WallIron`]).
    pub wall_dipole_ut: f64,
}

impl Default for MagnetometerConfig {
    fn default() -> Self {
        Self {
            rate_hz: 50,
            field_ut: 48.0,
            inclination_deg: 65.0,
            declination_deg: 3.0,
            noise_ut: 0.04,
            hard_iron_ut: 1.2,
            soft_iron: 0.01,
            disturbance_ut: 1.2,
            disturbance_time_s: 10.0,
            motor_ut: 0.0,
            wall_dipole_ut: 0.0,
        }
    }
}

impl MagnetometerConfig {
    /// The same field without errors.
    pub fn ideal() -> Self {
        Self {
            noise_ut: 0.0,
            hard_iron_ut: 0.0,
            soft_iron: 0.0,
            disturbance_ut: 0.0,
            ..Self::default()
        }
    }

    /// The default, beside motors that make a tenth of the earth's field at full thrust, and iron in the walls of buildings.
    pub fn real() -> Self {
        Self {
            motor_ut: 4.8,
            wall_dipole_ut: 20.0,
            ..Self::default()
        }
    }

    /// Earth's field in the world frame (east, north, up), uT.
    pub fn earth_field_ut(&self) -> Vector3<f64> {
        let (sin_i, cos_i) = libm::sincos(self.inclination_deg * PI / 180.0);
        let (sin_d, cos_d) = libm::sincos(self.declination_deg * PI / 180.0);
        Vector3::new(cos_i * sin_d, cos_i * cos_d, -sin_i) * self.field_ut
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        super::divides_a_second("magnetometer.rate_hz", self.rate_hz)?;
        super::not_negative(&[
            ("magnetometer.field_ut", self.field_ut),
            ("magnetometer.noise_ut", self.noise_ut),
            ("magnetometer.hard_iron_ut", self.hard_iron_ut),
            ("magnetometer.soft_iron", self.soft_iron),
            ("magnetometer.disturbance_ut", self.disturbance_ut),
            ("magnetometer.disturbance_time_s", self.disturbance_time_s),
            ("magnetometer.motor_ut", self.motor_ut),
            ("magnetometer.wall_dipole_ut", self.wall_dipole_ut),
        ])?;
        for (key, angle) in [
            ("magnetometer.inclination_deg", self.inclination_deg),
            ("magnetometer.declination_deg", self.declination_deg),
        ] {
            if !(-180.0..=180.0).contains(&angle) {
                return Err(InputError::at_key(
                    key,
                    format!("is {angle}, expected -180 to 180"),
                ));
            }
        }
        Ok(())
    }
}

/// One magnetometer sample as integer codes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MagnetometerSample {
    /// Codes x, y, z in body axes; [`FIELD_PER_CODE_UT`] each.
    pub field: [i32; 3],
}

impl MagnetometerSample {
    /// Magnetic field in body axes, uT.
    pub fn field_ut(&self) -> Vector3<f64> {
        Vector3::from(self.field).map(|code| f64::from(code) * FIELD_PER_CODE_UT)
    }
}

/// The magnetometer of one flight: state of the simulation.
#[derive(Clone, Debug)]
pub struct Magnetometer {
    earth_ut: Vector3<f64>,
    soft_iron: Matrix3<f64>,
    hard_iron_ut: Vector3<f64>,
    noise_ut: f64,
    noise: Seeded,
    disturbance_ut: Vector3<f64>,
    kept: f64,
    added_ut: f64,
    surroundings: Seeded,
    /// Field of the motors at full thrust, body axes.
    motor_ut: Vector3<f64>,
}

/// Share of the motors' full current at a thrust of `thrust_m_per_s2` over mass: power, and with it the current, goes with thrust^1.5.
pub(super) fn current_share(thrust_m_per_s2: f64) -> f64 {
    let share = (thrust_m_per_s2 / FULL_THRUST_M_PER_S2).max(0.0);
    share * share.sqrt()
}

impl Magnetometer {
    /// The magnetometer of the world of `seed`.
    pub fn new(config: &MagnetometerConfig, seed: u64) -> Self {
        let mut build = Seeded::new(seed, Source::MagnetometerBuild);
        let mut surroundings = Seeded::new(seed, Source::MagneticDisturbance);
        let kept = if config.disturbance_time_s > 0.0 {
            libm::exp(-1.0 / (f64::from(config.rate_hz) * config.disturbance_time_s))
        } else {
            0.0
        };
        Self {
            earth_ut: config.earth_field_ut(),
            soft_iron: Matrix3::from_fn(|_, _| config.soft_iron * build.normal()) + Matrix3::identity(),
            hard_iron_ut: build.normal_vector() * config.hard_iron_ut,
            noise_ut: config.noise_ut,
            noise: Seeded::new(seed, Source::MagnetometerNoise),
            disturbance_ut: surroundings.normal_vector() * config.disturbance_ut,
            kept,
            added_ut: config.disturbance_ut * (1.0 - kept * kept).sqrt(),
            surroundings,
            motor_ut: direction(&mut Seeded::new(seed, Source::MotorField)) * config.motor_ut,
        }
    }

    /// The next sample at attitude R_wb, with the motors at a share of their full current and a field of iron nearby, uT, world frame.
    pub fn measure(
        &mut self,
        attitude: &Rotation3<f64>,
        current_share: f64,
        iron_ut: &Vector3<f64>,
    ) -> MagnetometerSample {
        self.disturbance_ut =
            self.disturbance_ut * self.kept + self.surroundings.normal_vector() * self.added_ut;
        let body = attitude.inverse() * (self.earth_ut + self.disturbance_ut + iron_ut);
        let field = self.soft_iron * body
            + self.hard_iron_ut
            + self.motor_ut * current_share
            + self.noise.normal_vector() * self.noise_ut;
        let limit = f64::from(FIELD_CODE_MAX);
        let code = |value: f64| libm::floor(value / FIELD_PER_CODE_UT + 0.5).clamp(-limit, limit) as i32;
        MagnetometerSample {
            field: [code(field.x), code(field.y), code(field.z)],
        }
    }
}

/// A unit vector, uniform over the sphere.
fn direction(random: &mut Seeded) -> Vector3<f64> {
    let v = random.normal_vector();
    v / v.norm().max(f64::MIN_POSITIVE)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Heading of a level body from its field, rad, declination taken out.
    fn heading(sample: &MagnetometerSample, config: &MagnetometerConfig) -> f64 {
        let (body, earth) = (sample.field_ut(), config.earth_field_ut());
        libm::atan2(earth.y, earth.x) - libm::atan2(body.y, body.x)
    }

    #[test]
    fn an_ideal_one_points_north() {
        let config = MagnetometerConfig::ideal();
        assert!((config.earth_field_ut().norm() - 48.0).abs() < 1e-12 && config.earth_field_ut().z < 0.0);
        let mut magnetometer = Magnetometer::new(&config, 1);
        for yaw in [-2.0, 0.0, 0.7, 3.0] {
            let sample = magnetometer.measure(
                &Rotation3::from_euler_angles(0.0, 0.0, yaw),
                1.0,
                &Vector3::zeros(),
            );
            let error = heading(&sample, &config) - yaw;
            assert!(libm::sin(error).abs() < 4e-4 && libm::cos(error) > 0.0, "{error}");
        }
    }

    #[test]
    fn the_budget_is_five_degrees_of_slow_heading_error() {
        let config = MagnetometerConfig::default();
        let (mut squares, mut jumps) = (0.0, 0.0);
        for seed in 0..400 {
            let mut magnetometer = Magnetometer::new(&config, seed);
            let [first, second] = [(); 2].map(|()| {
                heading(
                    &magnetometer.measure(&Rotation3::identity(), 1.0, &Vector3::zeros()),
                    &config,
                )
            });
            squares += first * first;
            jumps += (second - first) * (second - first);
        }
        let rms_deg = |sum: f64| (sum / 400.0).sqrt() * 180.0 / PI;
        assert!((rms_deg(squares) - 5.0).abs() < 0.6, "{} deg", rms_deg(squares));
        assert!(
            rms_deg(jumps) < 0.5,
            "{} deg from sample to sample",
            rms_deg(jumps)
        );
    }

    #[test]
    fn motors_add_a_field_of_one_direction_by_their_current() {
        let config = MagnetometerConfig {
            motor_ut: 4.8,
            ..MagnetometerConfig::ideal()
        };
        let mut mean = Vector3::zeros();
        for seed in 0..200 {
            let mut magnetometer = Magnetometer::new(&config, seed);
            let turned = Rotation3::from_euler_angles(0.3, -0.2, 2.0);
            let mut field = |attitude: &Rotation3<f64>, share| {
                let earth = attitude.inverse() * config.earth_field_ut();
                magnetometer
                    .measure(attitude, share, &Vector3::zeros())
                    .field_ut()
                    - earth
            };
            let rounding = 0.6 * FIELD_PER_CODE_UT;
            assert!(field(&turned, 0.0).amax() < rounding);
            let full = field(&Rotation3::identity(), 1.0);
            assert!((full.norm() - 4.8).abs() < 2.0 * rounding, "{full}");
            assert!((field(&turned, 0.5) - full * 0.5).amax() < 2.0 * rounding);
            mean += full / (4.8 * 200.0);
        }
        // Any direction: 1/sqrt 200 is left of their mean.
        assert!(mean.norm() < 0.2, "{mean}");
        // A third of it in hover.
        let hover = current_share(STANDARD_GRAVITY_M_PER_S2);
        assert!((hover - 0.353_553).abs() < 1e-6 && current_share(0.0) == 0.0);
        assert!((current_share(2.0 * STANDARD_GRAVITY_M_PER_S2) - 1.0).abs() < 1e-15);
    }
}
