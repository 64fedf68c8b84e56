//! What the channel and the front end are set to, as a TOML file gives it.
//!
//! Every impairment has its parameter, a zero setting ([`Impairments::none`]) and a default at the "Error
//! budget" of docs/signal-model.md; the three worlds are [`ChannelConfig::ideal`], `ChannelConfig::default()` (`budget`) and [`ChannelConfig::real`].

use cslam_core::profile::quad_4x8_gmt_72::{BEAMS, CHANNELS};
use serde::{Deserialize, Serialize};

use super::impairments::Impairments;
use crate::input::{InputError, within};

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

    /// Checks the range of every value, for the default radio.
    ///
    /// # Errors
    /// [`InputError`] naming the key that is out of range, and the range.
    pub fn check(&self) -> Result<(), InputError> {
        self.check_with(CHANNELS, BEAMS)
    }

    /// The same for a radio of so many channels and beams.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn check_with(&self, channels: usize, beams: usize) -> Result<(), InputError> {
        self.front_end.check().map_err(|error| error.under("front_end"))?;
        self.impairments
            .check(channels, beams)
            .map_err(|error| error.under("impairments"))?;
        self.motion.check().map_err(|error| error.under("motion"))
    }
}

impl FrontEndConfig {
    fn check(&self) -> Result<(), InputError> {
        if !(8..=16).contains(&self.adc_bits) {
            let message = format!("is {}, expected 8 to 16", self.adc_bits);
            return Err(InputError::at_key("adc_bits", message));
        }
        // What lies beyond is no receiver and no link: 100 dB either way turn the weakest path into the strongest.
        within(&[
            ("transmit_power_dbm", self.transmit_power_dbm, -100.0, 100.0),
            ("implementation_loss_db", self.implementation_loss_db, 0.0, 100.0),
            ("noise_figure_db", self.noise_figure_db, 0.0, 100.0),
            ("snr_offset_db", self.snr_offset_db, -100.0, 100.0),
            ("agc_rms_dbfs", self.agc_rms_dbfs, -60.0, 0.0),
        ])
    }
}

impl MotionConfig {
    fn check(&self) -> Result<(), InputError> {
        within(&[("gmt_heading_deg", self.gmt_heading_deg, -360.0, 360.0)])?;
        for (key, velocity) in [
            ("uav_velocity_m_per_s", self.uav_velocity_m_per_s),
            ("gmt_velocity_m_per_s", self.gmt_velocity_m_per_s),
        ] {
            if let Some(value) = velocity.iter().find(|v| !(-300.0..=300.0).contains(*v)) {
                let message = format!("holds {value}, expected -300 to 300");
                return Err(InputError::at_key(key, message));
            }
        }
        let norm: f64 = self.uav_quaternion_wb.iter().map(|c| c * c).sum();
        if !(norm.is_finite() && norm > 1e-12) {
            let message = "is no rotation, expected [w, x, y, z]";
            return Err(InputError::at_key("uav_quaternion_wb", message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthesis::{
        AirframeEffects, GmtArrayErrors, Jammer, JammerKind, Oscillators, ReceiverErrors, UavArrayErrors,
    };

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
