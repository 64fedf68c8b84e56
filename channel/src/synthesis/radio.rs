//! The radio of a simulated world: what the GMT sends, and with which arrays the two ends send and hear.

use cslam_core::array::{
    CodebookConfig, GmtArrayConfig, SquintConfig, SquintScheme, UavArrayConfig, UavLayout,
};
use cslam_core::radio::RadioConfig;
use cslam_core::signal::Waveform;

use crate::input::InputError;

/// Streams of random numbers have room for so many slots of a sweep: beams and squint symbols.
const MOST_SLOTS: usize = 1 << 12;

/// Arrays of the GMT.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GmtCounts {
    /// Faces, at equal steps of azimuth.
    pub faces: usize,
    /// Columns of elements of a face.
    pub columns: usize,
    /// Rows of elements of a face.
    pub rows: usize,
}

impl Default for GmtCounts {
    /// Three faces of 8 x 8 elements.
    fn default() -> Self {
        Self {
            faces: 3,
            columns: 8,
            rows: 8,
        }
    }
}

impl GmtCounts {
    /// Elements of a face.
    #[must_use]
    pub fn elements(&self) -> usize {
        self.columns * self.rows
    }
}

/// A radio, from the same description as a receiver's; antennas, beams and symbols are made of it by code of their own. How many arrays
/// and elements the UAV has, the type of a [`Simulator`](super::Simulator) says.
/// ```
/// use cslam_core::profile::quad_4x16_gmt_48 as second;
/// use cslam_channel::synthesis::{ChannelConfig, GmtCounts, Radio, Simulator};
///
/// let radio = Radio::new(&second::radio(), GmtCounts::default())?;
/// assert_eq!(radio.beams(), second::BEAMS);
/// let simulator = Simulator::<4, 16, 64>::with_radio(radio, ChannelConfig::ideal(), 1);
/// assert_eq!(simulator.beams(), second::BEAMS);
/// # Ok::<(), cslam_channel::input::InputError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Radio {
    pub(super) waveform: Waveform,
    pub(super) uav_arrays: UavArrayConfig,
    pub(super) gmt_arrays: GmtArrayConfig,
    pub(super) gmt: GmtCounts,
    pub(super) codebook: BeamGrid,
    pub(super) squint_scheme: SquintScheme,
    pub(super) squint: SquintSweeps,
}

/// Beams of a face: azimuths of equal steps in sine over a sector, each at every elevation.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct BeamGrid {
    pub(super) azimuths: usize,
    pub(super) sector_rad: f64,
    pub(super) elevations_rad: Vec<f64>,
}

/// Sweeps of the squint symbols of a face, in direction cosines along row and column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SquintSweeps {
    /// Azimuth sweeps run over +- this cosine, at these elevations.
    pub(super) half_width: f64,
    pub(super) elevations: Vec<f64>,
    /// So many elevation sweeps, over the azimuths of a sector (its sine), rise from the first of these to the second.
    pub(super) elevation_sweeps: usize,
    pub(super) sector: f64,
    pub(super) rise: [f64; 2],
    /// A raster symbol passes over the azimuths this often while its elevation rises.
    pub(super) passes: usize,
    pub(super) raster_rise: [f64; 2],
}

impl<const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>
    From<&SquintConfig<AZIMUTH_SWEEPS, ELEVATION_SWEEPS>> for SquintSweeps
{
    fn from(config: &SquintConfig<AZIMUTH_SWEEPS, ELEVATION_SWEEPS>) -> Self {
        Self {
            half_width: config.half_width,
            elevations: config.elevations.to_vec(),
            elevation_sweeps: ELEVATION_SWEEPS,
            sector: config.sector,
            rise: config.rise,
            passes: config.passes,
            raster_rise: config.raster_rise,
        }
    }
}

impl Default for Radio {
    /// docs/signal-model.md, "Default configuration".
    fn default() -> Self {
        Self::unchecked(&RadioConfig::default(), GmtCounts::default())
    }
}

impl Radio {
    /// The radio of a description and of the counts that it does not say.
    ///
    /// # Errors
    /// [`InputError`] naming the field that cannot work ([`RadioConfig::check`]), or counts that there is no room for.
    pub fn new<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>(
        config: &RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
        gmt: GmtCounts,
    ) -> Result<Self, InputError> {
        let refused =
            |field: &str, expected: String| InputError::at_key(field, format!("expected {expected}"));
        config
            .check()
            .map_err(|error| refused(error.field(), error.expected().to_owned()))?;
        if gmt.faces == 0 || gmt.elements() == 0 {
            return Err(refused(
                "gmt_arrays",
                "at least one face with an element".to_owned(),
            ));
        }
        let radio = Self::unchecked(config, gmt);
        if radio.beams() + radio.squint.of_face(SquintScheme::Sequential) * gmt.faces > MOST_SLOTS {
            let expected = format!("at most {MOST_SLOTS} beams and squint symbols");
            return Err(refused("codebook", expected));
        }
        Ok(radio)
    }

    fn unchecked<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>(
        config: &RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
        gmt: GmtCounts,
    ) -> Self {
        Self {
            waveform: config.waveform,
            uav_arrays: config.uav_arrays,
            gmt_arrays: config.gmt_arrays,
            gmt,
            codebook: BeamGrid {
                azimuths: config.codebook.azimuths,
                sector_rad: config.codebook.sector_rad,
                elevations_rad: config.codebook.elevations_rad.to_vec(),
            },
            squint_scheme: config.squint_scheme,
            squint: SquintSweeps::from(&config.squint),
        }
    }

    /// Its description for a receiver of so many elevations, azimuth and elevation sweeps; `None` where it has others.
    #[must_use]
    pub fn description<
        const ELEVATIONS: usize,
        const AZIMUTH_SWEEPS: usize,
        const ELEVATION_SWEEPS: usize,
    >(
        &self,
    ) -> Option<RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>> {
        let Self { codebook, squint, .. } = self;
        if squint.elevation_sweeps != ELEVATION_SWEEPS {
            return None;
        }
        Some(RadioConfig {
            waveform: self.waveform,
            uav_arrays: self.uav_arrays,
            gmt_arrays: self.gmt_arrays,
            codebook: CodebookConfig {
                azimuths: codebook.azimuths,
                sector_rad: codebook.sector_rad,
                elevations_rad: codebook.elevations_rad.as_slice().try_into().ok()?,
            },
            squint_scheme: self.squint_scheme,
            squint: SquintConfig {
                half_width: squint.half_width,
                elevations: squint.elevations.as_slice().try_into().ok()?,
                rise: squint.rise,
                sector: squint.sector,
                passes: squint.passes,
                raster_rise: squint.raster_rise,
            },
        })
    }

    /// Whether the UAV's arrays are the rows of one stiff board, with one oscillator and one line to the converter.
    pub(super) fn is_one_board(&self) -> bool {
        self.uav_arrays.layout != UavLayout::Around
    }

    /// One with a planar array on the UAV.
    #[cfg(test)]
    pub(super) fn planar() -> Self {
        let planar = cslam_core::profile::planar_8x8_gmt_72::radio();
        Self::new(&planar, GmtCounts::default()).expect("sound")
    }

    /// Beams of a sweep.
    #[must_use]
    pub fn beams(&self) -> usize {
        self.gmt.faces * self.codebook.of_face()
    }

    /// Which squint symbols follow a sweep.
    #[must_use]
    pub fn squint_scheme(&self) -> SquintScheme {
        self.squint_scheme
    }

    /// Waveform of beams and squint symbols.
    #[must_use]
    pub fn waveform(&self) -> &Waveform {
        &self.waveform
    }
}

impl BeamGrid {
    /// Beams of a face.
    pub(super) fn of_face(&self) -> usize {
        self.azimuths * self.elevations_rad.len()
    }
}

impl SquintSweeps {
    /// Symbols of a face.
    pub(super) fn of_face(&self, scheme: SquintScheme) -> usize {
        match scheme {
            SquintScheme::Sequential => self.elevations.len() + self.elevation_sweeps,
            SquintScheme::Raster => 1,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_has_the_counts_of_the_documents() {
        let radio = Radio::default();
        assert_eq!(radio.beams(), 72);
        assert_eq!(radio.squint.of_face(SquintScheme::Sequential), 11);
        let checked = Radio::new(&RadioConfig::default(), GmtCounts::default());
        assert_eq!(radio.description(), Some(RadioConfig::default()));
        assert_eq!(radio.description::<2, 3, 8>(), None);
        assert_eq!(radio.description::<3, 3, 7>(), None);
        assert_eq!(checked, Ok(radio));
    }

    #[test]
    fn what_cannot_work_is_refused_by_its_field() {
        let refused = |change: fn(&mut RadioConfig), gmt: GmtCounts| {
            let mut config = RadioConfig::default();
            change(&mut config);
            Radio::new(&config, gmt).expect_err("must be refused").to_string()
        };
        let default = GmtCounts::default();
        assert_eq!(
            refused(|r| r.uav_arrays.spacing_wavelengths = 0.7, default),
            "uav_arrays.spacing_wavelengths expected above 0 and at most 0.5"
        );
        assert_eq!(
            refused(|_| (), GmtCounts { rows: 0, ..default }),
            "gmt_arrays expected at least one face with an element"
        );
        assert_eq!(
            refused(|r| r.codebook.azimuths = 500, default),
            "codebook expected at most 4096 beams and squint symbols"
        );
    }
}
