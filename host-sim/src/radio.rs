//! The radio: what may be another at run time. How many arrays, elements, faces, rows, columns, beams and subcarriers there are, the type of
//! the receiver says.

use cslam_core::array::{
    CodebookConfig, GmtArrayConfig, GmtElement, SquintConfig, SquintScheme, UavArrayConfig, UavElement,
    UavLayout,
};
use cslam_core::radio::RadioConfig;
use cslam_core::signal::Waveform;
use cslam_firmware::storage::RadioSettings;
use serde::{Deserialize, Serialize};

use crate::channel::{GmtCounts, Radio};
use crate::input::InputError;

/// Highest carrier and largest radius that a board's settings have room for.
const CARRIER_OF_BOARD_HZ: f64 = 1e12;
const RADIUS_OF_BOARD_M: f64 = 6.5;

/// Table `[radio]`, and `radio` of a recording.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RadioFigures {
    /// What is sent.
    pub waveform: WaveformFigures,
    /// Receive arrays.
    pub uav_arrays: UavArrayFigures,
    /// Transmit arrays.
    pub gmt_arrays: GmtArrayFigures,
    /// Transmit beams.
    pub codebook: CodebookFigures,
    /// Beam squint symbols.
    pub squint: SquintFigures,
}

/// Table `[radio.waveform]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct WaveformFigures {
    /// Carrier, Hz.
    pub carrier_hz: f64,
    /// Complex sample rate, Hz.
    pub sample_rate_hz: f64,
    /// Length of the Zadoff-Chu sequence.
    pub sequence_length: u32,
    /// Its root.
    pub root: u32,
}

/// Table `[radio.uav_arrays]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct UavArrayFigures {
    /// Distance of an array's centre from the body's origin, m.
    pub radius_m: f64,
    /// Tilt of the arrays out of the horizontal, deg.
    pub tilt_deg: f64,
    /// Element spacing, wavelengths of the carrier.
    pub spacing_wavelengths: f64,
    /// Attenuation of an element at 90 degrees off its face, dB.
    pub side_attenuation_db: f64,
    /// Further attenuation from there to its rear, dB.
    pub rear_attenuation_db: f64,
    /// Power gain of its face in front, dB.
    pub front_gain_db: f64,
}

/// Table `[radio.gmt_arrays]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct GmtArrayFigures {
    /// Element spacing in both directions, wavelengths of the carrier.
    pub spacing_wavelengths: f64,
    /// Least cosine of the angle off the face that an element's pattern follows.
    pub least_cosine: f64,
    /// Amplitude of an element behind its face.
    pub rear_amplitude: f64,
}

/// Table `[radio.codebook]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CodebookFigures {
    /// Half the sector of a face, deg.
    pub sector_deg: f64,
    /// Elevations of the beams, deg.
    pub elevations_deg: [f64; 3],
}

/// Table `[radio.squint]`, all direction cosines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SquintFigures {
    /// Azimuth sweeps run over +- this cosine.
    pub half_width: f64,
    /// Elevations at which they are sent.
    pub elevations: [f64; 3],
    /// First and last elevation of an elevation sweep.
    pub rise: [f64; 2],
    /// Edge of the sector over whose azimuths the elevation sweeps are spread.
    pub sector: f64,
}

/// An angle in degrees; that of the default, which has no round number of them, to its last bit.
fn radians(deg: f64, default_rad: f64) -> f64 {
    let rad = deg.to_radians();
    if (rad - default_rad).abs() < 1e-12 {
        default_rad
    } else {
        rad
    }
}

impl RadioFigures {
    /// For the receiver.
    pub fn config(&self) -> RadioConfig {
        let default = RadioConfig::default();
        let Self {
            waveform,
            uav_arrays,
            gmt_arrays,
            codebook,
            squint,
        } = self;
        let mut elevations_rad = default.codebook.elevations_rad;
        for (rad, deg) in elevations_rad.iter_mut().zip(codebook.elevations_deg) {
            *rad = radians(deg, *rad);
        }
        RadioConfig {
            waveform: Waveform {
                carrier_hz: waveform.carrier_hz,
                sample_rate_hz: waveform.sample_rate_hz,
                sequence_length: waveform.sequence_length,
                root: waveform.root,
                ..default.waveform
            },
            uav_arrays: UavArrayConfig {
                layout: UavLayout::Around,
                radius_m: uav_arrays.radius_m,
                tilt_rad: radians(uav_arrays.tilt_deg, default.uav_arrays.tilt_rad),
                spacing_wavelengths: uav_arrays.spacing_wavelengths,
                element: UavElement {
                    side_attenuation_db: uav_arrays.side_attenuation_db,
                    rear_attenuation_db: uav_arrays.rear_attenuation_db,
                    front_gain_db: uav_arrays.front_gain_db,
                },
            },
            gmt_arrays: GmtArrayConfig {
                spacing_wavelengths: gmt_arrays.spacing_wavelengths,
                element: GmtElement {
                    least_cosine: gmt_arrays.least_cosine,
                    rear_amplitude: gmt_arrays.rear_amplitude,
                },
            },
            codebook: CodebookConfig {
                sector_rad: radians(codebook.sector_deg, default.codebook.sector_rad),
                elevations_rad,
                ..default.codebook
            },
            squint_scheme: SquintScheme::Sequential,
            squint: SquintConfig {
                half_width: squint.half_width,
                elevations: squint.elevations,
                rise: squint.rise,
                sector: squint.sector,
                ..default.squint
            },
        }
    }

    /// For a simulated world.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn of_channel(&self) -> Result<Radio, InputError> {
        self.check()?;
        Radio::new(&self.config(), GmtCounts::default())
    }

    /// For the settings of a board, in whole numbers; `None` where it is the default's.
    ///
    /// # Errors
    /// [`InputError`] naming a figure that has no place there, or that is beyond what it has room for.
    pub fn for_board(&self) -> Result<Option<RadioSettings>, InputError> {
        let Some(told) = self.unless_default() else {
            return Ok(None);
        };
        told.check()?;
        let default = Self::default();
        let only_default = [
            (
                "waveform.sample_rate_hz",
                told.waveform.sample_rate_hz == default.waveform.sample_rate_hz,
            ),
            ("uav_arrays", told.uav_arrays.has_element_of(&default.uav_arrays)),
            ("gmt_arrays", told.gmt_arrays.has_element_of(&default.gmt_arrays)),
            ("squint", told.squint == default.squint),
        ];
        if let Some((key, _)) = only_default.into_iter().find(|(_, is_default)| !is_default) {
            let message =
                "a board's settings have no place for it: expected the default's elements, rate and symbols";
            return Err(InputError::at_key(key, message));
        }
        let (waveform, uav, gmt, codebook) = (told.waveform, told.uav_arrays, told.gmt_arrays, told.codebook);
        // In range: checked, but for these.
        let beyond =
            |key: &str, expected: &str| InputError::at_key(key, format!("expected {expected} for a board"));
        let sequence = [waveform.sequence_length, waveform.root].map(u16::try_from);
        let [Ok(length), Ok(root)] = sequence else {
            return Err(beyond("waveform.sequence_length", "a sequence of up to 65535"));
        };
        if waveform.carrier_hz > CARRIER_OF_BOARD_HZ {
            return Err(beyond("waveform.carrier_hz", "up to 1 THz"));
        }
        if uav.radius_m > RADIUS_OF_BOARD_M {
            return Err(beyond("uav_arrays.radius_m", "up to 6.5 m"));
        }
        let millionths = |deg: f64| (deg * 1e6).round() as i32;
        let hundred_thousandths = |wavelengths: f64| (wavelengths * 1e5).round() as u16;
        Ok(RadioSettings {
            carrier_khz: (waveform.carrier_hz / 1e3).round() as u32,
            sequence: [length, root],
            radius_tenth_mm: (uav.radius_m * 1e4).round() as u16,
            tilt_udeg: millionths(uav.tilt_deg),
            spacing: [uav.spacing_wavelengths, gmt.spacing_wavelengths].map(hundred_thousandths),
            sector_cdeg: (codebook.sector_deg * 1e2).round() as u16,
            elevations_udeg: codebook.elevations_deg.map(millionths),
        }
        .checked())
    }

    /// Whether a receiver can be made for it.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.config().check().map_err(|error| {
            let key = match error.field() {
                "uav_arrays.tilt_rad" => "uav_arrays.tilt_deg",
                "uav_arrays.element" => "uav_arrays",
                "gmt_arrays.element" => "gmt_arrays",
                "codebook.sector_rad" => "codebook.sector_deg",
                "codebook.elevations_rad" => "codebook.elevations_deg",
                same => same,
            };
            InputError::at_key(key, format!("expected {}", error.expected()))
        })
    }

    /// These, where they are not the default's: what a recording says of its radio.
    #[must_use]
    pub fn unless_default(self) -> Option<Self> {
        Some(self).filter(|radio| *radio != Self::default())
    }
}

impl WaveformFigures {
    /// Its name in recordings: the sequence's length and root, [`Waveform::NAME`] by default.
    pub(crate) fn name(&self) -> String {
        format!("zc{}-{}", self.sequence_length, self.root)
    }
}

impl UavArrayFigures {
    fn has_element_of(&self, other: &Self) -> bool {
        let element = |it: &Self| [it.side_attenuation_db, it.rear_attenuation_db, it.front_gain_db];
        element(self) == element(other)
    }
}

impl GmtArrayFigures {
    fn has_element_of(&self, other: &Self) -> bool {
        let element = |it: &Self| [it.least_cosine, it.rear_amplitude];
        element(self) == element(other)
    }
}

impl Default for WaveformFigures {
    fn default() -> Self {
        let Waveform {
            carrier_hz,
            sample_rate_hz,
            sequence_length,
            root,
            ..
        } = Waveform::default();
        Self {
            carrier_hz,
            sample_rate_hz,
            sequence_length,
            root,
        }
    }
}

impl Default for UavArrayFigures {
    fn default() -> Self {
        let arrays = UavArrayConfig::default();
        Self {
            radius_m: arrays.radius_m,
            tilt_deg: arrays.tilt_rad.to_degrees(),
            spacing_wavelengths: arrays.spacing_wavelengths,
            side_attenuation_db: arrays.element.side_attenuation_db,
            rear_attenuation_db: arrays.element.rear_attenuation_db,
            front_gain_db: arrays.element.front_gain_db,
        }
    }
}

impl Default for GmtArrayFigures {
    fn default() -> Self {
        let arrays = GmtArrayConfig::default();
        Self {
            spacing_wavelengths: arrays.spacing_wavelengths,
            least_cosine: arrays.element.least_cosine,
            rear_amplitude: arrays.element.rear_amplitude,
        }
    }
}

impl Default for CodebookFigures {
    fn default() -> Self {
        let codebook = CodebookConfig::default();
        // Whole degrees, but for the last bit.
        let degrees = |rad: f64| (rad.to_degrees() * 1e6).round() * 1e-6;
        Self {
            sector_deg: degrees(codebook.sector_rad),
            elevations_deg: codebook.elevations_rad.map(degrees),
        }
    }
}

impl Default for SquintFigures {
    fn default() -> Self {
        let squint = SquintConfig::default();
        Self {
            half_width: squint.half_width,
            elevations: squint.elevations,
            rise: squint.rise,
            sector: squint.sector,
        }
    }
}

#[cfg(test)]
mod tests;
