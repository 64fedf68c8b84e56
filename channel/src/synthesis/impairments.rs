//! Errors of the arrays, the clocks, the hardware and the air, and the sizes that they have in each world.

use serde::{Deserialize, Serialize};

use super::effects::amplifier::Amplifier;
use super::effects::interference::Interference;
use super::hardware::{AirframeEffects, GmtArrayErrors, Oscillators, ReceiverErrors, UavArrayErrors};
use crate::input::{InputError, within};

/// Errors of the arrays, clocks and the air.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Impairments {
    /// UAV: phase error of an element, deg rms. Drawn once for a device.
    pub uav_element_phase_rms_deg: f64,
    /// UAV: error of an array axis, deg rms in each of its two components. Drawn once.
    pub uav_axis_rms_deg: f64,
    /// UAV: delay error of an array, ps rms. Of the baseband: its carrier phase is part of the array's free phase. Once.
    pub uav_array_delay_rms_ps: f64,
    /// UAV: each array has a free oscillator phase, new in every beam.
    pub free_array_phase: bool,
    /// GMT: phase error of an element, deg rms. Drawn once.
    pub gmt_element_phase_rms_deg: f64,
    /// GMT: delay error of an element, ps rms, of the baseband (its carrier phase is in the phase error). Drawn once.
    pub gmt_element_delay_rms_ps: f64,
    /// Clock offset, s; added to every delay.
    pub clock_offset_s: f64,
    /// Rate of the clock offset, s/s: it grows from the first beam of a sweep on.
    pub clock_drift: f64,
    /// Carrier frequency offset, Hz.
    pub cfo_hz: f64,
    /// Chance of a beam's block to be lost, 0..=1.
    pub dropped_beam_probability: f64,
    /// Beams whose blocks are always lost.
    pub dropped_beams: Vec<u16>,
    /// Channels that deliver zeros.
    pub dead_channels: Vec<u8>,
    /// Further errors of the UAV's arrays.
    pub uav_arrays: UavArrayErrors,
    /// Further errors of the GMT's faces.
    pub gmt_arrays: GmtArrayErrors,
    /// The UAV's body before its arrays.
    pub airframe: AirframeEffects,
    /// The GMT's transmit amplifier; a linear one without.
    pub amplifier: Option<Amplifier>,
    /// Oscillators of both ends.
    pub oscillators: Oscillators,
    /// Mixers and converters of the UAV.
    pub receiver: ReceiverErrors,
    /// Bursts of a neighbour in the band.
    pub interference: Option<Interference>,
    /// A jammer in the band.
    pub jammer: Option<Jammer>,
}

/// What a jammer sends.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum JammerKind {
    /// A tone.
    #[default]
    Tone,
    /// White noise over the sampled band.
    Noise,
    /// The same in pulses.
    Pulsed,
    /// The GMT's symbol with a delay of the jammer's choice, alike in every beam.
    Replay,
}

/// A jammer, in one direction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Jammer {
    /// What it sends.
    #[serde(default)]
    pub kind: JammerKind,
    /// Power an isotropic antenna at the UAV receives while it sends, dBm.
    pub power_dbm: f64,
    /// Frequency off the carrier, Hz; of a tone or a replay.
    #[serde(default)]
    pub offset_hz: f64,
    /// Time from pulse to pulse, s.
    #[serde(default = "ten_microseconds")]
    pub pulse_interval_s: f64,
    /// Part of it that a pulse lasts, 0..=1.
    #[serde(default = "a_third")]
    pub duty: f64,
    /// Delay of a replay by the GMT's clock, s.
    #[serde(default)]
    pub delay_s: f64,
    /// Zenith angle it arrives from, world frame, deg.
    pub zenith_deg: f64,
    /// Azimuth it arrives from, world frame, deg.
    pub azimuth_deg: f64,
}

fn ten_microseconds() -> f64 {
    1e-5
}

fn a_third() -> f64 {
    1.0 / 3.0
}

impl Jammer {
    fn check(&self) -> Result<(), InputError> {
        within(&[
            ("power_dbm", self.power_dbm, -200.0, 60.0),
            ("offset_hz", self.offset_hz, -122.88e6, 122.88e6),
            ("pulse_interval_s", self.pulse_interval_s, 1e-8, 1.0),
            ("duty", self.duty, 0.0, 1.0),
            ("delay_s", self.delay_s, 0.0, 1e-3),
            ("zenith_deg", self.zenith_deg, 0.0, 180.0),
            ("azimuth_deg", self.azimuth_deg, -360.0, 360.0),
        ])
    }

    /// A tone on the carrier from the horizon ahead of the world's x axis.
    pub fn tone(power_dbm: f64) -> Self {
        Self {
            kind: JammerKind::Tone,
            power_dbm,
            offset_hz: 0.0,
            pulse_interval_s: ten_microseconds(),
            duty: a_third(),
            delay_s: 0.0,
            zenith_deg: 90.0,
            azimuth_deg: 0.0,
        }
    }
}

impl Impairments {
    /// Checks the range of every value, for a radio of so many channels and beams.
    pub(super) fn check(&self, channels: usize, beams: usize) -> Result<(), InputError> {
        let rms = |key, value, most| (key, value, 0.0, most);
        within(&[
            ("clock_offset_s", self.clock_offset_s, -1.0, 1.0),
            rms("uav_element_phase_rms_deg", self.uav_element_phase_rms_deg, 180.0),
            rms("uav_axis_rms_deg", self.uav_axis_rms_deg, 45.0),
            rms("uav_array_delay_rms_ps", self.uav_array_delay_rms_ps, 1e5),
            rms("gmt_element_phase_rms_deg", self.gmt_element_phase_rms_deg, 180.0),
            rms("gmt_element_delay_rms_ps", self.gmt_element_delay_rms_ps, 200.0),
            ("clock_drift", self.clock_drift, -1e-4, 1e-4),
            ("cfo_hz", self.cfo_hz, -1e8, 1e8),
            (
                "dropped_beam_probability",
                self.dropped_beam_probability,
                0.0,
                1.0,
            ),
        ])?;
        if let Some(channel) = self.dead_channels.iter().find(|c| usize::from(**c) >= channels) {
            let message = format!("holds {channel}, expected 0 to {}", channels - 1);
            return Err(InputError::at_key("dead_channels", message));
        }
        if let Some(beam) = self.dropped_beams.iter().find(|m| usize::from(**m) >= beams) {
            let message = format!("holds {beam}, expected 0 to {}", beams - 1);
            return Err(InputError::at_key("dropped_beams", message));
        }
        let under = |table: &'static str| move |error: InputError| error.under(table);
        self.uav_arrays.check().map_err(under("uav_arrays"))?;
        self.gmt_arrays.check().map_err(under("gmt_arrays"))?;
        self.oscillators.check().map_err(under("oscillators"))?;
        self.receiver.check().map_err(under("receiver"))?;
        if let Some(amplifier) = &self.amplifier {
            amplifier.check().map_err(under("amplifier"))?;
        }
        if let Some(interference) = &self.interference {
            interference.check().map_err(under("interference"))?;
        }
        if let Some(jammer) = &self.jammer {
            jammer.check().map_err(under("jammer"))?;
        }
        Ok(())
    }

    /// No error at all.
    pub fn none() -> Self {
        Self {
            uav_element_phase_rms_deg: 0.0,
            uav_axis_rms_deg: 0.0,
            uav_array_delay_rms_ps: 0.0,
            free_array_phase: false,
            gmt_element_phase_rms_deg: 0.0,
            gmt_element_delay_rms_ps: 0.0,
            clock_offset_s: 0.0,
            clock_drift: 0.0,
            cfo_hz: 0.0,
            dropped_beam_probability: 0.0,
            dropped_beams: Vec::new(),
            dead_channels: Vec::new(),
            uav_arrays: UavArrayErrors::default(),
            gmt_arrays: GmtArrayErrors::default(),
            airframe: AirframeEffects::default(),
            amplifier: None,
            oscillators: Oscillators::default(),
            receiver: ReceiverErrors::default(),
            interference: None,
            jammer: None,
        }
    }

    /// The "Error budget" of docs/signal-model.md. Clock, loss and jamming belong to a scenario and are off.
    pub fn budget() -> Self {
        Self {
            uav_element_phase_rms_deg: 2.0,
            uav_axis_rms_deg: 0.1,
            uav_array_delay_rms_ps: 50.0,
            free_array_phase: true,
            gmt_element_phase_rms_deg: 5.0,
            gmt_element_delay_rms_ps: 20.0,
            ..Self::none()
        }
    }

    /// The budget and what measured hardware has beyond it.
    pub fn real() -> Self {
        Self {
            uav_arrays: UavArrayErrors::real(),
            gmt_arrays: GmtArrayErrors::real(),
            airframe: AirframeEffects {
                shadow: true,
                rotors: true,
            },
            amplifier: Some(Amplifier::default()),
            oscillators: Oscillators::real(),
            receiver: ReceiverErrors::real(),
            interference: Some(Interference::default()),
            ..Self::budget()
        }
    }
}

impl Default for Impairments {
    fn default() -> Self {
        Self::budget()
    }
}
