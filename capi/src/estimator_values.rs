//! Values of path estimation.

use core::ffi::CStr;

use cslam_core::geometry::{Gmt, Rotation, World};
use cslam_core::paths::{ElementErrors, EstimatedPath, EstimatorConfigError, WorkLimit};
use cslam_core::profile::FlightConfig;
use cslam_core::profile::quad_4x8_gmt_72::BEAMS;
use cslam_core::signal::WaveformError;

use crate::pointer::Sized32;
use crate::values::flag;

/// What the estimator may be told. `cslam_estimator_config_default` fills it in.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamEstimatorConfig {
    /// `sizeof(cslam_estimator_config)`.
    pub size: u32,
    /// 1: beams and candidates are passed over that hold no path but known ones. 0: everything is looked at.
    pub screening: u8,
    /// 1: what one sweep shows of the noise helps the next, for sweeps that follow each other. 0: sweeps of no one flight.
    pub gating: u8,
    /// 1: errors of the receive elements are learned from sweep to sweep, beginning with `element_errors`. 0: they are known.
    pub element_errors_learned: u8,
    /// 0.
    pub reserved: u8,
    /// Attitude of the transmitter: quaternion w, x, y, z from its axes to the world's. 1, 0, 0, 0: first face to the east.
    pub gmt_attitude_wxyz: [f32; 4],
    /// False alarms a sweep on noise alone, above 0 and at most 1.
    pub false_alarms_per_sweep: f32,
    /// Paths weaker than the strongest one by more than this are not reported, dB, 0 to 120.
    pub dynamic_range_db: f32,
    /// Standard deviation of the error of a receive element's response, relative to what it should be, 0 to 1.
    pub element_errors: f32,
    /// Standard deviation of a transmit beam's gain, dB, 0 to 20.
    pub beam_gain_sigma_db: f32,
    /// Thousands of instructions of a Cortex-M7 that the search of a sweep may take; UINT32_MAX for no limit.
    pub work_limit_thousands: u32,
}

/// What one beam gave.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamBeamReport {
    /// `sizeof(cslam_beam_report)`.
    pub size: u32,
    /// Paths found in it.
    pub paths: u32,
    /// Mean power of a sample, all channels added, amplitude units squared.
    pub power: f32,
    /// Values that clipped in the transform: paths may be too weak where this is not 0.
    pub clips: u32,
    /// 1 when the beam was not searched, for it holds no path worth reporting.
    pub weak: u8,
    /// 1 when the beam was not searched because the sweep's work was spent.
    pub left_out: u8,
    /// 0.
    pub reserved: [u8; 2],
}

/// An estimated path.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamPath {
    /// `sizeof(cslam_path)`.
    pub size: u32,
    /// Transmit beam in which the path was strongest.
    pub beam: u16,
    /// 1 when the beams showed the direction of departure, else 0 and zeros there.
    pub has_departure: u8,
    /// 0.
    pub reserved: u8,
    /// Speed of light times the delay, clock offset included, m, cyclic with 625 m.
    pub c_tau_m: f32,
    /// Unit vector from the UAV towards where the wave came from, body axes: forward, left, up.
    pub aoa_body: [f32; 3],
    /// Unit vector from the transmitter towards where the wave went, world axes.
    pub aod_world: [f32; 3],
    /// Standard deviation of that along any tangent, rad.
    pub aod_sigma_rad: f32,
    /// SNR per element and active subcarrier in that beam, mean over the elements, dB.
    pub snr_db: f32,
    /// Power per active subcarrier in that beam, summed over the elements, amplitude units squared.
    pub energy: f32,
    /// Covariance by noise of (c tau, angles along the tangents e1, e2 of the arrival), m^2, m rad, rad^2, row by row.
    pub covariance: [f32; 9],
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamEstimatorConfig {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamBeamReport {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamPath {}

const _: () = assert!(size_of::<CslamEstimatorConfig>() == 44 && size_of::<CslamBeamReport>() == 20);
const _: () = assert!(size_of::<CslamPath>() == 84 && core::mem::offset_of!(CslamPath, covariance) == 48);

impl From<&FlightConfig> for CslamEstimatorConfig {
    fn from(config: &FlightConfig) -> Self {
        Self {
            size: size_of::<Self>() as u32,
            screening: config.screening.into(),
            gating: config.gating.into(),
            element_errors_learned: matches!(config.element_errors, ElementErrors::Learned(_)).into(),
            reserved: 0,
            gmt_attitude_wxyz: [1.0, 0.0, 0.0, 0.0],
            false_alarms_per_sweep: config.false_alarms_per_sweep as f32,
            dynamic_range_db: config.dynamic_range_db,
            element_errors: config.element_errors.sigma(),
            beam_gain_sigma_db: config.beam_gain_sigma_db,
            work_limit_thousands: config.work_limit.0,
        }
    }
}

impl CslamEstimatorConfig {
    /// The configuration and how the GMT stands, or the name of the field that is wrong.
    pub(crate) fn checked(&self) -> Result<(FlightConfig, Rotation<Gmt, World>), &'static CStr> {
        let default = FlightConfig::default();
        // The default is a decimal that single precision does not hold; left as it was, it shall be the default's.
        let false_alarms_per_sweep = if self.false_alarms_per_sweep == default.false_alarms_per_sweep as f32 {
            default.false_alarms_per_sweep
        } else {
            f64::from(self.false_alarms_per_sweep)
        };
        let [w, x, y, z] = self.gmt_attitude_wxyz;
        // The identity stays exactly that.
        let gmt_attitude = if [x, y, z] == [0.0; 3] && w > 0.0 && w.is_finite() {
            Rotation::identity()
        } else {
            Rotation::<Gmt, World>::from_quaternion([w, x, y, z]).map_err(|_| c"gmt_attitude_wxyz")?
        };
        let config = FlightConfig {
            false_alarms_per_sweep,
            dynamic_range_db: self.dynamic_range_db,
            screening: flag(self.screening).map_err(|_| c"screening")?,
            gating: flag(self.gating).map_err(|_| c"gating")?,
            element_errors: if flag(self.element_errors_learned).map_err(|_| c"element_errors_learned")? {
                ElementErrors::Learned(self.element_errors)
            } else {
                ElementErrors::Known(self.element_errors)
            },
            beam_gain_sigma_db: self.beam_gain_sigma_db,
            work_limit: WorkLimit(self.work_limit_thousands),
            ..default
        };
        match config.check(BEAMS) {
            Ok(()) => Ok((config, gmt_attitude)),
            Err(error) => Err(name(error)),
        }
    }
}

/// The name of a field with a closing zero.
fn name(error: EstimatorConfigError) -> &'static CStr {
    use EstimatorConfigError as Error;
    match error {
        Error::FalseAlarms => c"false_alarms_per_sweep",
        Error::DynamicRange => c"dynamic_range_db",
        Error::ElementErrors => c"element_errors",
        Error::BeamGain => c"beam_gain_sigma_db",
        Error::Waveform(WaveformError::Active) => c"waveform.active",
        Error::Waveform(_) => c"waveform",
        Error::Arrays | Error::Aliasing => c"arrays",
        _ => c"codebook",
    }
}

impl From<&EstimatedPath<World>> for CslamPath {
    fn from(found: &EstimatedPath<World>) -> Self {
        let c = &found.path.covariance;
        let aod = found.path.aod;
        Self {
            size: size_of::<Self>() as u32,
            beam: found.beam,
            has_departure: aod.is_some().into(),
            reserved: 0,
            c_tau_m: found.path.c_tau_m,
            aoa_body: (*found.path.aoa.vector()).into(),
            aod_world: aod.map_or([0.0; 3], |aod| (*aod.direction.vector()).into()),
            aod_sigma_rad: aod.map_or(0.0, |aod| aod.sigma_rad),
            snr_db: found.snr_db,
            energy: found.energy,
            covariance: [c.m11, c.m12, c.m13, c.m21, c.m22, c.m23, c.m31, c.m32, c.m33],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_is_that_of_the_core() {
        let told = CslamEstimatorConfig::from(&FlightConfig::default());
        let (config, _) = told.checked().expect("sound");
        assert_eq!(
            config.false_alarms_per_sweep.to_bits(),
            FlightConfig::default().false_alarms_per_sweep.to_bits()
        );
    }
}
