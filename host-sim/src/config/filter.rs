//! Figures of the receiver's localization, as a TOML file has them: those of the flight code, key by key.
//!
//! The structures below only tell the names. Were one of the flight code's fields missing here, this would not compile.

use cslam_core::estimator::{
    BeaconLimits, FilterConfig, Gates, Priors, ProcessNoise, RadioNoise, Setup, baseline,
};
use cslam_core::receiver::{BaselineConfig, Residuals};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU32;

use crate::input::InputError;

/// Table `[receiver.filter]`: what the filter believes about sensors, radio and calibration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FilterFigures {
    /// Between measurements.
    #[serde(with = "ProcessNoiseKeys")]
    pub process: ProcessNoise,
    /// Of measurements.
    #[serde(with = "RadioNoiseKeys")]
    pub radio: RadioNoise,
    /// Before the first.
    #[serde(with = "PriorsKeys")]
    pub priors: Priors,
    /// Believing them.
    #[serde(with = "GatesKeys")]
    pub gates: Gates,
    /// Believing the beacon. Where the GMT was set up is `[receiver.gmt_setup]`.
    #[serde(with = "BeaconLimitsKeys")]
    pub beacon: BeaconLimits,
}

impl FilterFigures {
    /// For the flight code, of a GMT that was set up there, if anybody says where.
    pub fn config(&self, setup: Option<Setup>) -> FilterConfig {
        FilterConfig {
            process: self.process,
            radio: self.radio,
            priors: self.priors,
            gates: self.gates,
            beacon: BeaconLimits { setup, ..self.beacon },
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        Ok(self.config(None).check()?)
    }
}

/// Table `[receiver.baseline]`: figures of the paper's localization.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct BaselineFigures(#[serde(with = "BaselineConfigKeys")] BaselineConfig);

impl BaselineFigures {
    /// For the flight code, in a mode.
    pub fn config(&self, mode: baseline::Mode) -> BaselineConfig {
        BaselineConfig { mode, ..self.0 }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        Ok(self.0.check()?)
    }
}

/// Table `[receiver.residuals]`: what calibration leaves in a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct ResidualFigures(#[serde(with = "ResidualsKeys")] Residuals);

impl ResidualFigures {
    /// For the flight code.
    pub fn config(&self) -> Residuals {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        Ok(self.0.check()?)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "ProcessNoise",
    default = "ProcessNoise::default",
    deny_unknown_fields
)]
struct ProcessNoiseKeys {
    accel_m_per_s: f64,
    accel_scale: f64,
    gyro_rad: f64,
    gyro_bias_rad_per_s: f64,
    accel_bias_m_per_s2: f64,
    clock_offset_m: f64,
    clock_drift_m_per_s: f64,
    clock_ramp_m_per_s2: f64,
    beacon_m: f64,
    face_bias: f64,
    gap_accel_m_per_s: f64,
    gap_gyro_rad: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "RadioNoise", default = "RadioNoise::default", deny_unknown_fields)]
struct RadioNoiseKeys {
    aoa_rad: f64,
    delay_m: f64,
    departure: f64,
    departure_lasting: f64,
    two_way_m: f64,
    heading_rad: f64,
    beacon_m: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Priors", default = "Priors::default", deny_unknown_fields)]
struct PriorsKeys {
    gyro_bias_rad_per_s: f64,
    accel_bias_m_per_s2: f64,
    gyro_matrix: f64,
    mounting_rad: f64,
    clock_drift_m_per_s: f64,
    clock_ramp_m_per_s2: f64,
    two_way_bias_m: f64,
    face_bias: [f64; 2],
    mast_rad: f64,
    array_slope: f64,
    array_axis_rad: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Gates", default = "Gates::default", deny_unknown_fields)]
struct GatesKeys {
    five: f64,
    three: f64,
    one: f64,
    trusted_m: f64,
    lost_m: f64,
    attitude_lost_rad: f64,
    refix_after: u32,
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "BeaconLimits",
    default = "BeaconLimits::default",
    deny_unknown_fields
)]
struct BeaconLimitsKeys {
    speed_m_per_s: f64,
    slack_m: f64,
    walk_m: f64,
    white_m: f64,
    memory: f64,
    #[serde(skip)]
    setup: Option<Setup>,
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "BaselineConfig",
    default = "BaselineConfig::default",
    deny_unknown_fields
)]
struct BaselineConfigKeys {
    // The choice of a localization says it.
    #[serde(skip)]
    mode: baseline::Mode,
    interval_sweeps: NonZeroU32,
    position_sigma_m: f32,
    attitude_sigma_rad: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Residuals", default = "Residuals::default", deny_unknown_fields)]
struct ResidualsKeys {
    delay_m: f32,
    angle_rad: f32,
    departure_rad: f32,
}
