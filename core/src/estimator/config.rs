//! Figures of the filter: what it believes about the sensors, the radio and the calibration before it has seen any.
//!
//! Defaults are the "Error budget" of docs/signal-model.md in the form of docs/localization.md, "The model". Immutable while
//! flying.

use super::beacon::BeaconLimits;
use super::row::BELIEVED_OF_THREE;
use super::window::WINDOW;
use crate::constants::{SPEED_OF_LIGHT_M_PER_S, STANDARD_GRAVITY_M_PER_S2};

/// Given: a unit.
const NS_M: f64 = SPEED_OF_LIGHT_M_PER_S * 1e-9;
/// Given: a unit.
const DEG_RAD: f64 = core::f64::consts::PI / 180.0;

/// Noise that drives the state between measurements. All figures are densities: standard deviation per root second.
/// Given: the error budget (docs/signal-model.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProcessNoise {
    /// White noise of the accelerometer, m/s per root s: three times the sensor's own, for its time stamps scatter and the frame shakes.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub accel_m_per_s: f64,
    /// Scale and misalignment of the accelerometer: this share of what it feels beside hovering acts as white noise with a
    /// time of 1 s.
    pub accel_scale: f64,
    /// White noise of the gyroscope, rad per root s.
    pub gyro_rad: f64,
    /// Random walk of the gyroscope bias, rad/s per root s: the sensor's own is a third of it, the rest follows its temperature.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub gyro_bias_rad_per_s: f64,
    /// Random walk of the accelerometer bias, m/s^2 per root s: mostly what warmth does to it.
    /// Derived: 50 ug/K of bias, and 100 ppm/K of scale along the one axis of three that feels gravity, are 76 ug/K; a sensor warms by 10 K in 120 s.
    pub accel_bias_m_per_s2: f64,
    /// White frequency noise of the clock, m per root s.
    pub clock_offset_m: f64,
    /// Random walk of the clock frequency, m/s per root s.
    pub clock_drift_m_per_s: f64,
    /// Walk of the clock's ramp, m/s^2 per root s: temperatures turn.
    pub clock_ramp_m_per_s2: f64,
    /// Walk of the beacon's position error, m per root s.
    pub beacon_m: f64,
    /// Walk of the face biases, per root s: they are constant over a face up to a smooth rest of 0.3 mrad, which a flight
    /// crosses in some ten seconds.
    pub face_bias: f64,
    /// Acceleration that is possible without inertial data, m/s per root s.
    /// Given: what a quadrotor can do.
    pub gap_accel_m_per_s: f64,
    /// Turn that is possible without inertial data, rad per root s.
    /// Given: what a quadrotor can do.
    pub gap_gyro_rad: f64,
}

/// A TCXO (docs/localization.md, "The model", has other clocks): white frequency noise, m per root s; random walk, m/s per root s; thermal ramp, m/s^2.
/// Given: a data sheet.
const TCXO: [f64; 3] = [0.1 * NS_M, 0.3 * NS_M, 0.5 * NS_M];

impl Default for ProcessNoise {
    fn default() -> Self {
        let [clock_offset_m, clock_drift_m_per_s, ramp_m_per_s2] = TCXO;
        Self {
            accel_m_per_s: 3.1e-3,
            accel_scale: 0.003,
            gyro_rad: 1.5 * 2.8e-3 * DEG_RAD,
            gyro_bias_rad_per_s: 3.4e-3 * DEG_RAD,
            accel_bias_m_per_s2: 0.07e-3 * STANDARD_GRAVITY_M_PER_S2,
            clock_offset_m,
            clock_drift_m_per_s,
            // It reverses about once a minute: (2 ramp)^2 / 60 s.
            clock_ramp_m_per_s2: ramp_m_per_s2 * 2.0 / 7.75,
            // 20 mm that wander over a minute: sqrt(2 / 60 s).
            beacon_m: 3.7e-3,
            face_bias: 1.2e-4,
            gap_accel_m_per_s: 3.0,
            gap_gyro_rad: 0.5,
        }
    }
}

/// Errors of the measurements that their own covariance does not hold: multipath, the rest of the calibration. Added in
/// squares to what a measurement claims.
/// Given: the error budget (docs/signal-model.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioNoise {
    /// Angle of arrival, rad per axis.
    pub aoa_rad: f64,
    /// Delay, m.
    pub delay_m: f64,
    /// Direction cosine of departure.
    pub departure: f64,
    /// What of its error one sweep has in common with the next.
    /// Measured: 0.75 mrad, lost within 3.5 s, of 4297 departures of lines of sight in 28 flights of `real` (tuning seeds), without the face's constant.
    pub departure_lasting: f64,
    /// Two-way timing, m.
    pub two_way_m: f64,
    /// Magnetic heading beside [`crate::inertial::MagneticField::disturbance_ut`], rad.
    /// Measured: 4449 headings of right poses in 19 flights of `real` and 50 of `budget` (tuning seeds) miss by 5 to 7 deg, 4.8 of it by that field.
    pub heading_rad: f64,
    /// Up to this standard deviation, m per axis, the beacon's error is one that stays from sweep to sweep. It moves the whole
    /// solution, and shows in no measurement.
    pub beacon_m: f64,
}

impl Default for RadioNoise {
    /// The white part of each error: 0.05 and 0.02 deg, 20 mm, 0.9 mrad; two-way timing 0.3 ns. Constant parts are states.
    fn default() -> Self {
        Self {
            aoa_rad: 0.054 * DEG_RAD,
            delay_m: 0.02,
            departure: 0.9e-3,
            departure_lasting: 0.75e-3,
            two_way_m: 0.3 * NS_M,
            heading_rad: 4.0 * DEG_RAD,
            beacon_m: 0.03,
        }
    }
}

/// Standard deviations before any measurement.
/// Given: the error budget (docs/signal-model.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Priors {
    /// Gyroscope bias, rad/s.
    pub gyro_bias_rad_per_s: f64,
    /// Accelerometer bias, m/s^2.
    pub accel_bias_m_per_s2: f64,
    /// Scale and misalignment of the gyroscope, each element.
    pub gyro_matrix: f64,
    /// Rotation of the inertial sensor against the arrays that nobody compensates, rad about each axis.
    pub mounting_rad: f64,
    /// Clock drift, m/s: 300 is one part per million.
    pub clock_drift_m_per_s: f64,
    /// Clock ramp, m/s^2.
    pub clock_ramp_m_per_s2: f64,
    /// Constant error of two-way timing, m.
    pub two_way_bias_m: f64,
    /// Bias of a GMT face's direction cosine along its row, and along its column: 5 deg and 20 ps an element.
    pub face_bias: [f64; 2],
    /// Heading and tilt of the GMT's mast against what the beacon says, rad per axis.
    pub mast_rad: f64,
    /// Phase slope of a UAV array: 2 deg rms an element are 1.7 mrad, the rest is the mean of its pattern's ripple over a flight's directions.
    /// Measured: most likely for the constants of 112 arrays that the errors of 4637 lines of sight show, in 28 flights of `real` (tuning seeds).
    pub array_slope: f64,
    /// Axis tilt of a UAV array, rad: 0.1 deg of its mounting, the rest as of the slope.
    /// Measured: as the slope; 2.4 and 2.8 mrad for its two components.
    pub array_axis_rad: f64,
}

impl Default for Priors {
    fn default() -> Self {
        Self {
            gyro_bias_rad_per_s: 0.5 * DEG_RAD,
            accel_bias_m_per_s2: 20e-3 * STANDARD_GRAVITY_M_PER_S2,
            gyro_matrix: 0.003,
            mounting_rad: 0.5 * DEG_RAD,
            clock_drift_m_per_s: 300.0,
            clock_ramp_m_per_s2: TCXO[2],
            two_way_bias_m: 0.1 * NS_M,
            face_bias: [1.5e-3; 2],
            mast_rad: 0.05 * DEG_RAD,
            array_slope: 2.2e-3,
            array_axis_rad: 0.15 * DEG_RAD,
        }
    }
}

/// When a measurement is believed (docs/localization.md, "What it believes").
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates {
    /// Joint chi-square of a path with angle of departure: 5 degrees of freedom.
    /// Derived: one honest path in 17 500 is beyond.
    pub five: f64,
    /// The same without: 3 degrees of freedom.
    pub three: f64,
    /// Chi-square of a scalar.
    /// Derived: one honest scalar in 15 800 is beyond: four standard deviations.
    pub one: f64,
    /// Position sigma (norm, m) up to which a sweep without a consistent neighbour is believed.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub trusted_m: f64,
    /// Position sigma (norm, m) above which the filter counts as lost.
    /// Given: what is asked for. Who is not known to three metres does not find an entrance.
    pub lost_m: f64,
    /// Attitude sigma (norm, rad) above which the attitude counts as lost and is found anew.
    /// Derived: where the sine of an angle is a fiftieth off it a linear correction ends.
    pub attitude_lost_rad: f64,
    /// Contested sweeps in a row before the pose is fixed anew: more than any run of equal outliers that is to be
    /// ridden out.
    /// Derived: as many as a window holds fixes.
    pub refix_after: u32,
}

impl Default for Gates {
    fn default() -> Self {
        Self {
            five: 27.0,
            three: BELIEVED_OF_THREE,
            one: 16.0,
            trusted_m: 0.4,
            lost_m: 3.0,
            attitude_lost_rad: 0.35,
            refix_after: WINDOW as u32,
        }
    }
}

/// All figures of the filter.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilterConfig {
    /// Between measurements.
    pub process: ProcessNoise,
    /// Of measurements.
    pub radio: RadioNoise,
    /// Before the first.
    pub priors: Priors,
    /// Believing them.
    pub gates: Gates,
    /// Believing the beacon.
    pub beacon: BeaconLimits,
}
