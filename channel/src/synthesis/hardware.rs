//! What the hardware of both ends is set to beyond the error budget: everything here is off by default.

use serde::{Deserialize, Serialize};

use crate::input::{InputError, within};

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
    /// Cross-polar discrimination of the elements, dB, 0..=60: what they take of a horizontal field; nothing without. Drawn once.
    pub cross_polarisation_db: Option<f64>,
}

impl UavArrayErrors {
    /// Of beamformer circuits and patches at 28 GHz.
    pub(super) fn real() -> Self {
        Self {
            gain_rms_db: 0.5,
            centre_rms_mm: 1.0,
            coupling_unknown_share: 0.2,
            ripple_rms_db: 1.0,
            ripple_rms_deg: 5.0,
            phase_drift_rms_deg_per_k: 0.05,
            delay_drift_rms_ps_per_k: 1.0,
            squint: true,
            cross_polarisation_db: Some(18.0),
        }
    }

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
            (
                "cross_polarisation_db",
                self.cross_polarisation_db.unwrap_or(60.0),
                0.0,
                60.0,
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
    /// Turn of a face, and so of its beams, about each axis, deg rms, 0..=45. Drawn once.
    pub axis_rms_deg: f64,
    /// Error of a face's centre in each component, mm rms, 0..=100. Drawn once.
    pub centre_rms_mm: f64,
}

impl GmtArrayErrors {
    /// As at the UAV.
    pub(super) fn real() -> Self {
        Self {
            gain_rms_db: 0.5,
            axis_rms_deg: 0.1,
            centre_rms_mm: 1.0,
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("gain_rms_db", self.gain_rms_db, 0.0, 6.0),
            ("axis_rms_deg", self.axis_rms_deg, 0.0, 45.0),
            ("centre_rms_mm", self.centre_rms_mm, 0.0, 100.0),
        ])
    }
}

/// What the UAV's body does to waves.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct AirframeEffects {
    /// Whether arms and legs shade what comes from below, and scatter a copy of every wave.
    pub shadow: bool,
    /// Whether the rotors' tips scatter the strongest wave, and their blades shade what passes between them.
    pub rotors: bool,
}

/// Oscillators of both ends.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Oscillators {
    /// Whether the oscillators of the GMT and of every array have the phase noise of 3GPP TR 38.803 at 29.55 GHz.
    pub phase_noise: bool,
    /// Carrier frequency offset, Hz rms, 0..=1e6. Drawn once for a flight, with the sampling clock tied to it.
    pub offset_rms_hz: f64,
    /// Rate of its wander, Hz/s rms, 0..=1e4.
    pub wander_rms_hz_per_s: f64,
    /// Walk of the carrier's phase between pilots, rad in a root second, 0..=100: white frequency noise of the crystals.
    pub phase_walk_rad_per_root_s: f64,
}

impl Oscillators {
    /// Crystals that a beacon has tracked to 0.3 ppm.
    pub(super) fn real() -> Self {
        Self {
            phase_noise: true,
            offset_rms_hz: 9e3,
            wander_rms_hz_per_s: 50.0,
            phase_walk_rad_per_root_s: 1.5,
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("offset_rms_hz", self.offset_rms_hz, 0.0, 1e6),
            ("wander_rms_hz_per_s", self.wander_rms_hz_per_s, 0.0, 1e4),
            (
                "phase_walk_rad_per_root_s",
                self.phase_walk_rad_per_root_s,
                0.0,
                100.0,
            ),
        ])
    }
}

/// Errors of the receiver's mixers and converters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ReceiverErrors {
    /// Imbalance of the quadrature mixers: gain, dB rms, 0..=6. Drawn once for a device.
    pub iq_gain_rms_db: f64,
    /// The same: phase, deg rms, 0..=45. Drawn once.
    pub iq_phase_rms_deg: f64,
    /// Leakage of the oscillator, a constant in every channel, dB of full scale, -100..=0; none without.
    pub leakage_dbfs: Option<f64>,
    /// Effective number of bits of the converter, 4..=16, where it is below its width; the width without.
    pub effective_bits: Option<f64>,
    /// Jitter of the sampling instants, ps rms, 0..=100.
    pub aperture_jitter_ps: f64,
}

impl ReceiverErrors {
    /// An image at -32 dB, leakage and bits of a direct-conversion receiver.
    pub(super) fn real() -> Self {
        Self {
            iq_gain_rms_db: 0.3,
            iq_phase_rms_deg: 2.0,
            leakage_dbfs: Some(-35.0),
            effective_bits: Some(9.5),
            aperture_jitter_ps: 0.5,
        }
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        within(&[
            ("iq_gain_rms_db", self.iq_gain_rms_db, 0.0, 6.0),
            ("iq_phase_rms_deg", self.iq_phase_rms_deg, 0.0, 45.0),
            ("leakage_dbfs", self.leakage_dbfs.unwrap_or(0.0), -100.0, 0.0),
            ("effective_bits", self.effective_bits.unwrap_or(16.0), 4.0, 16.0),
            ("aperture_jitter_ps", self.aperture_jitter_ps, 0.0, 100.0),
        ])
    }
}
