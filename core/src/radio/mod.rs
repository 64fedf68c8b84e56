//! The radio that a receiver is made for: waveform, arrays and transmit beams as one description that can be checked.
//!
//! How many arrays, elements, faces and beams there are, types say ([`crate::profile`]); everything else of a radio is a value here.
//! Estimator, beam squint, filter and receiver are made from the same one:
//! ```
//! use cslam_core::array::UavArrayConfig;
//! use cslam_core::radio::RadioConfig;
//! use cslam_core::signal::Waveform;
//!
//! let mut radio = RadioConfig {
//!     waveform: Waveform { carrier_hz: 28e9, root: 5, ..Waveform::default() },
//!     ..RadioConfig::default()
//! };
//! assert_eq!(radio.check(), Ok(()));
//! // Elements this far apart hear two directions alike.
//! radio.uav_arrays.spacing_wavelengths = 0.7;
//! assert_eq!(radio.check().map_err(|e| e.field()), Err("uav_arrays.spacing_wavelengths"));
//! ```

mod check;
mod model;

pub use check::RadioConfigError;
pub use model::{MOST_FACES, RadioModel};

use crate::array::{
    Codebook, CodebookConfig, GmtArrayConfig, GmtArrays, SquintConfig, SquintScheme, UavArrayConfig,
    UavArrays,
};
use crate::geometry::Real;
use crate::signal::Waveform;

/// A radio: what is sent, from where, and what hears it. `ELEVATIONS` of the transmit beams, azimuth and elevation sweeps of the squint
/// symbols.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadioConfig<
    const ELEVATIONS: usize = 3,
    const AZIMUTH_SWEEPS: usize = 3,
    const ELEVATION_SWEEPS: usize = 8,
> {
    /// Waveform of beams and squint symbols.
    pub waveform: Waveform,
    /// Receive arrays, as they are drawn. An estimator may be given arrays as calibration has found them
    /// ([`crate::paths::EstimatorConfig`]).
    pub uav_arrays: UavArrayConfig,
    /// Transmit arrays.
    pub gmt_arrays: GmtArrayConfig,
    /// Transmit beams.
    pub codebook: CodebookConfig<ELEVATIONS>,
    /// Which squint symbols are sent.
    pub squint_scheme: SquintScheme,
    /// Sweeps of the squint symbols.
    pub squint: SquintConfig<AZIMUTH_SWEEPS, ELEVATION_SWEEPS>,
}

impl Default for RadioConfig {
    /// docs/signal-model.md, "Default configuration".
    fn default() -> Self {
        Self {
            waveform: Waveform::default(),
            uav_arrays: UavArrayConfig::default(),
            gmt_arrays: GmtArrayConfig::default(),
            codebook: CodebookConfig::default(),
            squint_scheme: SquintScheme::Sequential,
            squint: SquintConfig::default(),
        }
    }
}

impl<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>
    RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>
{
    /// The receive arrays: `ARRAYS` of `ELEMENTS` elements.
    #[must_use]
    pub fn uav_arrays<T: Real, const ARRAYS: usize, const ELEMENTS: usize>(
        &self,
    ) -> UavArrays<T, ARRAYS, ELEMENTS> {
        UavArrays::new(&self.uav_arrays)
    }

    /// The transmit beams of `FACES` arrays of `COLUMNS` x `ROWS` elements.
    #[must_use]
    pub fn codebook<T: Real, const FACES: usize, const COLUMNS: usize, const ROWS: usize>(
        &self,
    ) -> Codebook<T, FACES, COLUMNS, ROWS, ELEVATIONS> {
        Codebook::new(GmtArrays::new(&self.gmt_arrays), self.codebook)
    }
}
