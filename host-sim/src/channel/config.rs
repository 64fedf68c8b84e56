//! What the channel and the front end are set to, as a TOML file gives it.
//!
//! Every impairment has its parameter, a zero setting ([`Impairments::none`]) and a default at the "Error
//! budget" of docs/signal-model.md.

use serde::{Deserialize, Serialize};

use super::effects::amplifier::Amplifier;
use super::effects::interference::Interference;
use super::hardware::{AirframeEffects, GmtArrayErrors, Oscillators, ReceiverErrors, UavArrayErrors};
use crate::input::InputError;
use crate::sigmf::Codebook;

/// Beams of a sweep.
const BEAMS: usize = Codebook::Beams.len();

/// The whole configuration of a channel simulation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct ChannelConfig {
    /// Transmit power, noise, gain control, converter.
    pub front_end: FrontEndConfig,
    /// Errors of both ends.
    pub impairments: Impairments,
    /// Motion and attitude of both ends, where the paths file says nothing of it.
    pub motion: MotionConfig,
}

/// Link budget, gain control and converter.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FrontEndConfig {
    /// Transmit power of a face, dBm.
    pub transmit_power_dbm: f64,
    /// Implementation loss, dB; weakens the signal, not the noise.
    pub implementation_loss_db: f64,
    /// Noise figure, dB over thermal noise at 290 K.
    pub noise_figure_db: f64,
    /// Whether thermal noise is added.
    pub noise: bool,
    /// Converter width, bits, 8..=16; samples are left-aligned in 16 bits.
    pub adc_bits: u8,
    /// Level the gain control holds, dB of full scale: complex rms of the block's strongest channel, relative to 32 768.
    /// Gains are powers of two (the block's exponent), so a block lies at most 6.02 dB under this level, never over it.
    pub agc_rms_dbfs: f64,
    /// Raises (or lowers) the signal against the noise, dB.
    pub snr_offset_db: f64,
}

impl Default for FrontEndConfig {
    fn default() -> Self {
        Self {
            transmit_power_dbm: 30.0,
            implementation_loss_db: 3.0,
            noise_figure_db: 7.0,
            noise: true,
            adc_bits: 12,
            agc_rms_dbfs: -12.0,
            snr_offset_db: 0.0,
        }
    }
}

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
    /// Channels 0..32 that deliver zeros.
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

/// Attitude and velocity of both ends, world frame (east-north-up).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct MotionConfig {
    /// Attitude of the UAV: quaternion [w, x, y, z] that turns body into world.
    pub uav_quaternion_wb: [f64; 4],
    /// Velocity of the UAV, m/s.
    pub uav_velocity_m_per_s: [f64; 3],
    /// Heading of the GMT, deg: azimuth its first face looks at.
    pub gmt_heading_deg: f64,
    /// Velocity of the GMT, m/s.
    pub gmt_velocity_m_per_s: [f64; 3],
}

impl Default for MotionConfig {
    fn default() -> Self {
        Self {
            uav_quaternion_wb: [1.0, 0.0, 0.0, 0.0],
            uav_velocity_m_per_s: [0.0; 3],
            gmt_heading_deg: 0.0,
            gmt_velocity_m_per_s: [0.0; 3],
        }
    }
}

impl ChannelConfig {
    /// Every error at zero, thermal noise on: the paper's world.
    pub fn ideal() -> Self {
        Self {
            impairments: Impairments::none(),
            ..Self::default()
        }
    }

    /// The error budget with every effect of real hardware (docs/signal-model.md, "Hardware of the simulation").
    pub fn real() -> Self {
        Self {
            impairments: Impairments::real(),
            ..Self::default()
        }
    }

    /// Checks the range of every value.
    ///
    /// # Errors
    /// [`InputError`] naming the key that is out of range, and the range.
    pub fn check(&self) -> Result<(), InputError> {
        let (f, i, m) = (&self.front_end, &self.impairments, &self.motion);
        let wrong = |key: &str, message: String| Err(InputError::at_key(key, message));
        if !(8..=16).contains(&f.adc_bits) {
            return wrong(
                "front_end.adc_bits",
                format!("is {}, expected 8 to 16", f.adc_bits),
            );
        }
        // What lies beyond is no receiver and no link: 100 dB either way turn the weakest path into the strongest.
        let ranges = [
            (
                "front_end.transmit_power_dbm",
                f.transmit_power_dbm,
                -100.0,
                100.0,
            ),
            (
                "front_end.implementation_loss_db",
                f.implementation_loss_db,
                0.0,
                100.0,
            ),
            ("front_end.noise_figure_db", f.noise_figure_db, 0.0, 100.0),
            ("front_end.snr_offset_db", f.snr_offset_db, -100.0, 100.0),
            ("front_end.agc_rms_dbfs", f.agc_rms_dbfs, -60.0, 0.0),
            ("impairments.clock_offset_s", i.clock_offset_s, -1.0, 1.0),
            ("motion.gmt_heading_deg", m.gmt_heading_deg, -360.0, 360.0),
            (
                "impairments.uav_element_phase_rms_deg",
                i.uav_element_phase_rms_deg,
                0.0,
                180.0,
            ),
            ("impairments.uav_axis_rms_deg", i.uav_axis_rms_deg, 0.0, 45.0),
            (
                "impairments.uav_array_delay_rms_ps",
                i.uav_array_delay_rms_ps,
                0.0,
                1e5,
            ),
            (
                "impairments.gmt_element_phase_rms_deg",
                i.gmt_element_phase_rms_deg,
                0.0,
                180.0,
            ),
            (
                "impairments.gmt_element_delay_rms_ps",
                i.gmt_element_delay_rms_ps,
                0.0,
                200.0,
            ),
            ("impairments.clock_drift", i.clock_drift, -1e-4, 1e-4),
            ("impairments.cfo_hz", i.cfo_hz, -1e8, 1e8),
            (
                "impairments.dropped_beam_probability",
                i.dropped_beam_probability,
                0.0,
                1.0,
            ),
        ];
        for (key, value, low, high) in ranges {
            if !(low..=high).contains(&value) {
                return wrong(key, format!("is {value}, expected {low} to {high}"));
            }
        }
        if let Some(channel) = i.dead_channels.iter().find(|c| **c >= 32) {
            return wrong(
                "impairments.dead_channels",
                format!("holds {channel}, expected 0 to 31"),
            );
        }
        if let Some(beam) = i.dropped_beams.iter().find(|m| usize::from(**m) >= BEAMS) {
            return wrong(
                "impairments.dropped_beams",
                format!("holds {beam}, expected 0 to {}", BEAMS - 1),
            );
        }
        let under =
            |table: &'static str| move |error: InputError| error.under(&format!("impairments.{table}"));
        i.uav_arrays.check().map_err(under("uav_arrays"))?;
        i.gmt_arrays.check().map_err(under("gmt_arrays"))?;
        i.oscillators.check().map_err(under("oscillators"))?;
        i.receiver.check().map_err(under("receiver"))?;
        if let Some(amplifier) = &i.amplifier {
            amplifier.check().map_err(under("amplifier"))?;
        }
        if let Some(interference) = &i.interference {
            interference.check().map_err(under("interference"))?;
        }
        if let Some(j) = &i.jammer {
            let ranges = [
                ("power_dbm", j.power_dbm, -200.0, 60.0),
                ("offset_hz", j.offset_hz, -122.88e6, 122.88e6),
                ("pulse_interval_s", j.pulse_interval_s, 1e-8, 1.0),
                ("duty", j.duty, 0.0, 1.0),
                ("delay_s", j.delay_s, 0.0, 1e-3),
                ("zenith_deg", j.zenith_deg, 0.0, 180.0),
                ("azimuth_deg", j.azimuth_deg, -360.0, 360.0),
            ];
            for (key, value, low, high) in ranges {
                if !(low..=high).contains(&value) {
                    return wrong(
                        &format!("impairments.jammer.{key}"),
                        format!("is {value}, expected {low} to {high}"),
                    );
                }
            }
        }
        for (key, velocity) in [
            ("motion.uav_velocity_m_per_s", m.uav_velocity_m_per_s),
            ("motion.gmt_velocity_m_per_s", m.gmt_velocity_m_per_s),
        ] {
            if let Some(value) = velocity.iter().find(|v| !(-300.0..=300.0).contains(*v)) {
                return wrong(key, format!("holds {value}, expected -300 to 300"));
            }
        }
        let norm: f64 = m.uav_quaternion_wb.iter().map(|c| c * c).sum();
        if !(norm.is_finite() && norm > 1e-12) {
            return wrong(
                "motion.uav_quaternion_wb",
                "is no rotation, expected [w, x, y, z]".to_owned(),
            );
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<ChannelConfig, String> {
        let config: ChannelConfig = toml::from_str(text).map_err(|e| e.message().to_owned())?;
        config.check().map_err(|e| e.to_string())?;
        Ok(config)
    }

    #[test]
    fn an_empty_file_is_the_budget_and_any_setting_survives_the_round_trip() {
        assert_eq!(read("").expect("defaults"), ChannelConfig::default());
        let mut config = ChannelConfig {
            impairments: Impairments::none(),
            ..ChannelConfig::default()
        };
        config.impairments.dropped_beams = vec![3, 71];
        config.impairments.jammer = Some(Jammer {
            kind: JammerKind::Pulsed,
            offset_hz: 2e6,
            zenith_deg: 80.0,
            azimuth_deg: 10.0,
            ..Jammer::tone(-70.0)
        });
        let text = toml::to_string(&config).expect("TOML");
        assert_eq!(read(&text).expect("same"), config);
    }

    #[test]
    fn the_worlds_are_sound_and_differ_in_their_impairments_only() {
        let worlds = [
            ChannelConfig::ideal(),
            ChannelConfig::default(),
            ChannelConfig::real(),
        ];
        for world in &worlds {
            world.check().expect("in range");
            assert_eq!(world.front_end, FrontEndConfig::default());
            assert_eq!(
                read(&toml::to_string(world).expect("TOML")).expect("same"),
                *world
            );
        }
        let impairments = worlds.map(|world| world.impairments);
        assert_eq!(impairments[..2], [Impairments::none(), Impairments::budget()]);
        let budget = Impairments {
            uav_arrays: UavArrayErrors::default(),
            gmt_arrays: GmtArrayErrors::default(),
            airframe: AirframeEffects::default(),
            amplifier: None,
            oscillators: Oscillators::default(),
            receiver: ReceiverErrors::default(),
            interference: None,
            ..impairments[2].clone()
        };
        assert_eq!(budget, Impairments::budget());
        let real = &impairments[2];
        assert!(real.uav_arrays.ripple_rms_db > 0.0 && real.oscillators.phase_noise);
    }

    #[test]
    fn what_is_wrong_is_named() {
        for (text, expected) in [
            ("[front_end]\nadc_bits = 7", "adc_bits is 7, expected 8 to 16"),
            ("[front_end]\n\nadc_bit = 12", "unknown field `adc_bit`"),
            ("[impairments]\ncfo_hz = nan", "cfo_hz is NaN"),
            ("[impairments]\ndead_channels = [32]", "dead_channels holds 32"),
            (
                "[impairments]\ndropped_beams = [3, 72]",
                "dropped_beams holds 72, expected 0 to 71",
            ),
            (
                "[front_end]\nsnr_offset_db = 400",
                "front_end.snr_offset_db is 400, expected -100 to 100",
            ),
            (
                "[front_end]\nimplementation_loss_db = -3",
                "implementation_loss_db is -3, expected 0 to 100",
            ),
            (
                "[impairments]\nclock_offset_s = 2",
                "clock_offset_s is 2, expected -1 to 1",
            ),
            ("[front_end]\nnoise_figure_db = inf", "noise_figure_db is inf"),
            (
                "[motion]\nuav_quaternion_wb = [0,0,0,0]",
                "uav_quaternion_wb is no rotation",
            ),
        ] {
            let message = read(text).expect_err(text);
            assert!(message.contains(expected), "{message}");
        }
    }
}
