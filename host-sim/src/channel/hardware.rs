//! What the hardware of both ends is set to beyond the error budget: everything here is off by default.

use serde::{Deserialize, Serialize};

use crate::input::InputError;

/// A key with its value and the least and greatest one that it may have.
pub(super) type Range<'k> = (&'k str, f64, f64, f64);

/// Checks values against their ranges.
pub(super) fn within(ranges: &[Range<'_>]) -> Result<(), InputError> {
    match ranges
        .iter()
        .find(|(_, value, low, high)| !(low..=high).contains(&value))
    {
        None => Ok(()),
        Some((key, value, low, high)) => {
            let message = format!("is {value}, expected {low} to {high}");
            Err(InputError::at_key(*key, message))
        }
    }
}

/// Errors of the UAV's arrays beside phase, axis and delay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UavArrayErrors {
    /// Gain error of a channel, dB rms, 0..=6. Drawn once for a device.
    pub gain_rms_db: f64,
    /// Error of an array's centre in each component, mm rms, 0..=100. Drawn once.
    pub centre_rms_mm: f64,
    /// Relative error with which calibration knows the coupling of the elements, rms, 0..=0.5: what is left of it grows
    /// with it. Drawn once.
    pub coupling_unknown_share: f64,
    /// Ripple of the element patterns over the angle: amplitude, dB rms, 0..=6. Drawn once.
    pub ripple_rms_db: f64,
    /// The same: phase, deg rms, 0..=45. Drawn once.
    pub ripple_rms_deg: f64,
    /// Phase of an element over temperature, deg/K rms, 0..=10. Drawn once; temperature follows the time since switch-on.
    pub phase_drift_rms_deg_per_k: f64,
    /// Delay of an array over temperature, ps/K rms, 0..=100. Drawn once.
    pub delay_drift_rms_ps_per_k: f64,
    /// Whether the phase of an element follows the frequency over the band, not only the carrier.
    pub squint: bool,
}

impl UavArrayErrors {
    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("gain_rms_db", self.gain_rms_db, 0.0, 6.0),
            ("centre_rms_mm", self.centre_rms_mm, 0.0, 100.0),
            ("coupling_unknown_share", self.coupling_unknown_share, 0.0, 0.5),
            ("ripple_rms_db", self.ripple_rms_db, 0.0, 6.0),
            ("ripple_rms_deg", self.ripple_rms_deg, 0.0, 45.0),
            (
                "phase_drift_rms_deg_per_k",
                self.phase_drift_rms_deg_per_k,
                0.0,
                10.0,
            ),
            (
                "delay_drift_rms_ps_per_k",
                self.delay_drift_rms_ps_per_k,
                0.0,
                100.0,
            ),
        ])
    }
}

/// Errors of the GMT's faces beside phase and delay.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GmtArrayErrors {
    /// Gain error of an element, dB rms, 0..=6. Drawn once for a device.
    pub gain_rms_db: f64,
}

impl GmtArrayErrors {
    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[("gain_rms_db", self.gain_rms_db, 0.0, 6.0)])
    }
}

/// What the UAV's body does to waves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AirframeEffects {
    /// Whether arms and legs shade what comes from below, and scatter a copy of every wave.
    pub shadow: bool,
}
