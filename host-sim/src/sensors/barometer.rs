//! A barometer: the pressure of the standard atmosphere at the sensor's height, with what makes the height that follows from it wrong.
//!
//! Height read = z of the sensor + weather + white noise - c_p v^2 / (2 g) - cushion, turned into a pressure and rounded to a code. The
//! weather is a Gauss-Markov process; v is the speed through the air, whose dynamic pressure the case takes for depth; the cushion is
//! the air that the rotors press against the ground. No receiver of this repository has an input for it: it is recorded
//! (docs/formats.md), for those of others.

use cslam_core::constants::STANDARD_GRAVITY_M_PER_S2;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

use crate::flight::Motion;
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Pressure of one code, Pa, as the compensation of a BMP390 gives it.
pub const PRESSURE_PER_CODE_PA: f64 = 0.01;
/// International standard atmosphere at sea level: pressure, Pa; temperature over its lapse, m; exponent (ISO 2533).
const SEA_LEVEL_PA: f64 = 101_325.0;
const LAPSE_LENGTH_M: f64 = 288.15 / 0.0065;
const LAPSE_EXPONENT: f64 = 5.255_88;
/// Where the cushion ends, m above ground.
const CUSHION_M: f64 = 2.0;

/// The errors of the barometer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct BarometerConfig {
    /// Samples per second, Hz; divides 1 000 000. 0 for no barometer.
    pub rate_hz: u32,
    /// White noise, m rms of height a sample.
    pub noise_m: f64,
    /// Standard deviation of what the weather adds to the height, m.
    pub weather_m: f64,
    /// Correlation time of the weather, s; 0 for another one in every sample.
    pub weather_time_s: f64,
    /// Share of the dynamic pressure that the case adds to the static one, -1 to 1.
    pub wind_coefficient: f64,
    /// By how much the height is read too low by a UAV that hovers on the ground, m; less with the square of the way up to 2 m.
    pub ground_effect_m: f64,
    /// Place of the sensor from the centre of the arrays, m, body frame.
    pub place_m: [f64; 3],
}

impl Default for BarometerConfig {
    /// None.
    fn default() -> Self {
        Self {
            rate_hz: 0,
            ..Self::ideal()
        }
    }
}

impl BarometerConfig {
    /// One without errors, at the centre of the arrays.
    pub fn ideal() -> Self {
        Self {
            rate_hz: 25,
            noise_m: 0.0,
            weather_m: 0.0,
            weather_time_s: 300.0,
            wind_coefficient: 0.0,
            ground_effect_m: 0.0,
            place_m: [0.0; 3],
        }
    }

    /// A sensor of an autopilot in its case: half a metre low at 10 m/s, and half a metre low over the ground.
    pub fn real() -> Self {
        Self {
            noise_m: 0.08,
            weather_m: 0.4,
            wind_coefficient: 0.1,
            ground_effect_m: 0.5,
            place_m: [-0.06, 0.02, 0.03],
            ..Self::ideal()
        }
    }

    /// Checks the figures; the error names the key.
    pub(super) fn check(&self) -> Result<(), InputError> {
        if self.rate_hz != 0 {
            super::divides_a_second("barometer.rate_hz", self.rate_hz)?;
        }
        super::not_negative(&[
            ("barometer.noise_m", self.noise_m),
            ("barometer.weather_m", self.weather_m),
            ("barometer.weather_time_s", self.weather_time_s),
            ("barometer.ground_effect_m", self.ground_effect_m),
        ])?;
        let within = |key: &str, value: f64| {
            if (-1.0..=1.0).contains(&value) {
                return Ok(());
            }
            Err(InputError::at_key(key, format!("is {value}, expected -1 to 1")))
        };
        within("barometer.wind_coefficient", self.wind_coefficient)?;
        self.place_m
            .iter()
            .try_for_each(|value| within("barometer.place_m", *value))
    }
}

/// One sample of the barometer as an integer code.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BarometerSample {
    /// Pressure, [`PRESSURE_PER_CODE_PA`] each.
    pub pressure: u32,
}

impl BarometerSample {
    /// Pressure, Pa.
    pub fn pressure_pa(&self) -> f64 {
        f64::from(self.pressure) * PRESSURE_PER_CODE_PA
    }

    /// Height over sea level in the standard atmosphere, m.
    pub fn height_m(&self) -> f64 {
        let share = self.pressure_pa() / SEA_LEVEL_PA;
        LAPSE_LENGTH_M * (1.0 - libm::pow(share, 1.0 / LAPSE_EXPONENT))
    }

    /// The sample of a height over sea level, m; that of 30 km above and of 10 km below.
    fn at_height(height_m: f64) -> Self {
        let share = 1.0 - height_m.clamp(-10e3, 30e3) / LAPSE_LENGTH_M;
        let pressure_pa = SEA_LEVEL_PA * libm::pow(share, LAPSE_EXPONENT);
        Self {
            pressure: libm::floor(pressure_pa / PRESSURE_PER_CODE_PA + 0.5) as u32,
        }
    }
}

/// The barometer of one flight: state of the simulation.
#[derive(Clone, Debug)]
pub struct Barometer {
    config: BarometerConfig,
    weather: Seeded,
    weather_m: f64,
    /// What is left of the weather after a sample, and the deviation of what is added, m.
    kept: f64,
    added_m: f64,
    noise: Seeded,
}

impl Barometer {
    /// The barometer of the world of `seed`. `config` has been checked by [`super::SensorsConfig::check`].
    pub fn new(config: &BarometerConfig, seed: u64) -> Self {
        let mut weather = Seeded::new(seed, Source::BarometerWeather);
        let kept = if config.weather_time_s > 0.0 && config.rate_hz > 0 {
            libm::exp(-1.0 / (f64::from(config.rate_hz) * config.weather_time_s))
        } else {
            0.0
        };
        Self {
            weather_m: weather.normal() * config.weather_m,
            weather,
            kept,
            added_m: config.weather_m * (1.0 - kept * kept).sqrt(),
            noise: Seeded::new(seed, Source::BarometerNoise),
            config: config.clone(),
        }
    }

    /// The next sample of a UAV in motion at a velocity through the air, m/s, over ground at a height, m, whose rotors carry a share of
    /// its weight. The world's origin lies at sea level.
    pub fn measure(
        &mut self,
        uav: &Motion,
        airspeed_m_per_s: &Vector3<f64>,
        ground_z_m: f64,
        carried_share: f64,
    ) -> BarometerSample {
        self.weather_m = self.weather_m * self.kept + self.weather.normal() * self.added_m;
        let config = &self.config;
        let z_m = (uav.position_m + uav.attitude * Vector3::from(config.place_m)).z;
        let wind_m =
            config.wind_coefficient * airspeed_m_per_s.norm_squared() / (2.0 * STANDARD_GRAVITY_M_PER_S2);
        let up = ((z_m - ground_z_m) / CUSHION_M).clamp(0.0, 1.0);
        let cushion_m = config.ground_effect_m * carried_share * (1.0 - up) * (1.0 - up);
        let noise_m = self.noise.normal() * config.noise_m;
        BarometerSample::at_height(z_m + self.weather_m + noise_m - wind_m - cushion_m)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector1};

    use super::*;
    use crate::flight::{Spline, Trajectory};

    /// What a code of 0.01 Pa leaves, m.
    const ROUNDING_M: f64 = 5e-4;

    fn at(z_m: f64) -> Motion {
        Trajectory::at_rest(Vector3::new(3.0, 4.0, z_m), 10.0).at(5.0)
    }

    fn read_m(config: &BarometerConfig, uav: &Motion, airspeed_m_per_s: f64, carried_share: f64) -> f64 {
        let airspeed = Vector3::new(0.6, -0.8, 0.0) * airspeed_m_per_s;
        Barometer::new(config, 3)
            .measure(uav, &airspeed, 1.0, carried_share)
            .height_m()
    }

    fn only(change: impl Fn(&mut BarometerConfig)) -> BarometerConfig {
        let mut config = BarometerConfig::ideal();
        change(&mut config);
        config
    }

    #[test]
    fn without_errors_it_is_the_height_in_the_standard_atmosphere() {
        for z_m in [-5.0, 0.0, 12.3, 400.0] {
            let read = read_m(&BarometerConfig::ideal(), &at(z_m), 10.0, 1.0);
            assert!((read - z_m).abs() < ROUNDING_M, "{read} for {z_m}");
        }
        // ISO 2533, geopotential heights.
        for (z_m, pressure_pa) in [(0.0, 101_325.0), (500.0, 95_460.8), (1000.0, 89_874.6)] {
            let found = BarometerSample::at_height(z_m).pressure_pa();
            assert!((found - pressure_pa).abs() < 0.1, "{found} for {pressure_pa}");
        }
    }

    #[test]
    fn the_air_that_passes_reads_as_depth_by_the_square_of_its_speed() {
        let config = only(|c| c.wind_coefficient = 0.1);
        let low_m = |speed| 20.0 - read_m(&config, &at(20.0), speed, 1.0);
        // 0.1 x 100 / (2 x 9.80665).
        assert!((low_m(10.0) - 0.5099).abs() < ROUNDING_M && (low_m(20.0) - 2.0394).abs() < ROUNDING_M);
        assert!(low_m(0.0).abs() < ROUNDING_M);
    }

    #[test]
    fn a_cushion_of_air_lies_under_turning_rotors_up_to_two_metres() {
        let config = only(|c| c.ground_effect_m = 0.5);
        // The ground is at 1 m.
        let low_m = |up_m: f64, carried| 1.0 + up_m - read_m(&config, &at(1.0 + up_m), 0.0, carried);
        assert!((low_m(0.0, 1.0) - 0.5).abs() < ROUNDING_M);
        assert!((low_m(1.0, 1.0) - 0.125).abs() < ROUNDING_M);
        assert!((low_m(0.0, 0.4) - 0.2).abs() < ROUNDING_M);
        for (up_m, carried) in [(0.0, 0.0), (2.0, 1.0), (30.0, 1.0)] {
            assert!(low_m(up_m, carried).abs() < ROUNDING_M);
        }
    }

    #[test]
    fn it_sits_where_it_sits_in_the_body() {
        let config = only(|c| c.place_m = [0.2, 0.0, 0.1]);
        let mut uav = at(20.0);
        uav.attitude = Rotation3::from_euler_angles(0.0, -0.5, 1.0);
        let expected_m = 20.0 + 0.2 * libm::sin(0.5) + 0.1 * libm::cos(0.5);
        assert!((read_m(&config, &uav, 0.0, 1.0) - expected_m).abs() < ROUNDING_M);
    }

    #[test]
    fn weather_drifts_slowly_and_noise_is_white() {
        let heights = |config: &BarometerConfig, seed| -> Vec<f64> {
            let mut barometer = Barometer::new(config, seed);
            let uav = at(20.0);
            let mut next = || barometer.measure(&uav, &Vector3::zeros(), 0.0, 1.0).height_m() - 20.0;
            (0..7500).map(|_| next()).collect()
        };
        // Two flights of samples apart by 300 s: correlation 1/e.
        let config = only(|c| c.weather_m = 0.4);
        let (mut square, mut product, mut step) = (0.0, 0.0, 0.0);
        for seed in 0..800 {
            let found = heights(&config, seed);
            let (first, last) = (found[0], found[7499]);
            square += (first * first + last * last) / 1600.0;
            product += first * last / 800.0;
            step += (found[1] - first) * (found[1] - first) / 800.0;
        }
        assert!((square.sqrt() / 0.4 - 1.0).abs() < 0.05, "{square}");
        assert!(
            (product / square - libm::exp(-1.0)).abs() < 0.12,
            "{product} of {square}"
        );
        // sigma sqrt(2 x 0.04 s / 300 s).
        assert!((step.sqrt() / 6.53e-3 - 1.0).abs() < 0.1, "{}", step.sqrt());
        let noise = heights(&only(|c| c.noise_m = 0.08), 1);
        let mean = |of: &dyn Fn(usize) -> f64| (0..7499).map(of).sum::<f64>() / 7499.0;
        assert!((mean(&|k| noise[k] * noise[k]).sqrt() / 0.08 - 1.0).abs() < 0.04);
        assert!(mean(&|k| noise[k] * noise[k + 1]).abs() < 0.05 * 0.08 * 0.08);
        // The one moves no draw of the other.
        let both = heights(
            &only(|c| {
                c.weather_m = 0.4;
                c.noise_m = 0.08;
            }),
            1,
        );
        let drift = heights(&config, 1);
        let off = |k: usize| (both[k] - drift[k] - noise[k]).abs();
        assert!((0..7500).all(|k| off(k) < 3.0 * ROUNDING_M));
    }

    #[test]
    fn a_climb_is_followed() {
        let climb = (0..40).map(|k| Vector3::z() * (2.0 * f64::from(k)));
        let make = "more than six control points";
        let uav = Trajectory::new(
            Spline::new(climb.collect(), 1.0).expect(make),
            Spline::new(vec![Vector1::zeros(); 40], 1.0).expect(make),
            0.0,
        );
        let mut barometer = Barometer::new(&BarometerConfig::ideal(), 1);
        for time_s in [4.0, 9.0, 21.0] {
            let motion = uav.at(time_s);
            let read = barometer
                .measure(&motion, &motion.velocity_m_per_s, 0.0, 1.0)
                .height_m();
            assert!((read - motion.position_m.z).abs() < ROUNDING_M);
        }
    }
}
