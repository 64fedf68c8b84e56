//! What the configuration of an estimator cannot be.
//!
//! Given: every number here is a bound of what is accepted.

use core::fmt;

use super::{Estimator, EstimatorConfig};
use crate::array::MOST_ARRAYS;
use crate::signal::WaveformError;

/// Weaker paths than this under the strongest one lie under the rounding of 16 bit, dB.
const MOST_RANGE_DB: f32 = 120.0;
/// Errors as large as the response itself leave no array.
const MOST_ELEMENT_ERROR: f32 = 1.0;
/// A beam whose gain is known no better than this says nothing of a direction, dB.
const MOST_GAIN_DB: f32 = 20.0;
/// The square of a unit vector is one within this.
const UNIT_WITHIN: f32 = 1e-3;
/// An array further than this from the body's centre is none of a UAV's, m.
const MOST_LEVER_M: f32 = 10.0;
/// Rounding of half a wavelength in single precision.
const HALF_WAVELENGTH_WITHIN: f32 = 1.000_1;

/// Why an estimator cannot be built: the field, in the words of [`EstimatorConfigError::field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum EstimatorConfigError {
    /// A field of the waveform.
    Waveform(WaveformError),
    /// `arrays`: an axis or a normal is no unit vector, a centre not finite or 10 m and more off.
    Arrays,
    /// `arrays`: a planar one has no more rows than arrays stand around a body.
    Layout,
    /// `arrays`: elements are more than half a wavelength apart, so that two directions look alike.
    Aliasing,
    /// `codebook` has no beam, or one without a direction.
    Codebook,
    /// `codebook` has not as many beams as the estimator has room for.
    Beams,
    /// `false_alarms_per_sweep` is not above 0 and at most 1.
    FalseAlarms,
    /// `dynamic_range_db` is not 0 to 120.
    DynamicRange,
    /// `element_errors` are not 0 to 1.
    ElementErrors,
    /// `beam_gain_sigma_db` is not 0 to 20.
    BeamGain,
}

impl EstimatorConfigError {
    /// Name of the field that is wrong.
    #[must_use]
    pub fn field(self) -> &'static str {
        match self {
            Self::Waveform(error) => error.field(),
            Self::Arrays => "arrays",
            Self::Layout => "arrays.layout",
            Self::Aliasing => "arrays.spacing_wavelengths",
            Self::Codebook | Self::Beams => "codebook",
            Self::FalseAlarms => "false_alarms_per_sweep",
            Self::DynamicRange => "dynamic_range_db",
            Self::ElementErrors => "element_errors",
            Self::BeamGain => "beam_gain_sigma_db",
        }
    }

    /// What was expected of it.
    #[must_use]
    pub fn expected(self) -> &'static str {
        match self {
            Self::Waveform(error) => error.expected(),
            Self::Arrays => "unit vectors, and centres within 10 m",
            Self::Layout => "a planar array of five rows or more",
            Self::Aliasing => "elements at most half a wavelength apart",
            Self::Codebook => "beams with a direction",
            Self::Beams => "as many beams as the estimator's type says",
            Self::FalseAlarms => "above 0 and at most 1",
            Self::DynamicRange => "0 to 120 dB",
            Self::ElementErrors => "0 to 1",
            Self::BeamGain => "0 to 20 dB",
        }
    }
}

impl fmt::Display for EstimatorConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}", self.field(), self.expected())
    }
}

impl core::error::Error for EstimatorConfigError {}

impl From<WaveformError> for EstimatorConfigError {
    fn from(error: WaveformError) -> Self {
        Self::Waveform(error)
    }
}

impl<
    const A: usize,
    const E: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const ELEVATIONS: usize,
> EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>
{
    /// Whether an estimator of `beams` transmit beams can be built of it. [`Estimator::new`] takes anything and does not ask:
    /// what is wrong here gives wrong paths there, never an error.
    ///
    /// # Errors
    /// [`EstimatorConfigError`] naming the first field that is wrong.
    pub fn check(&self, beams: usize) -> Result<(), EstimatorConfigError> {
        use EstimatorConfigError as Error;
        self.waveform.check()?;
        let unit = |v: &nalgebra::Vector3<f32>| (v.norm_squared() - 1.0).abs() < UNIT_WITHIN;
        let placed = |v: &nalgebra::Vector3<f32>| v.norm_squared() < MOST_LEVER_M * MOST_LEVER_M;
        let arrays = self.arrays.arrays();
        let directed = |m| {
            let beam = self.codebook.beam(m);
            beam.is_some_and(|beam| beam.direction().iter().all(|c| c.is_finite()))
        };
        let phase_step_rad = self.arrays.phase_per_element_rad();
        let within = |x: f32, most: f32| (0.0..=most).contains(&x);
        let sound = [
            (
                arrays
                    .iter()
                    .all(|a| unit(&a.axis) && unit(&a.normal) && placed(&a.centre_m)),
                Error::Arrays,
            ),
            (self.arrays.column().is_none() || A > MOST_ARRAYS, Error::Layout),
            (
                phase_step_rad > 0.0 && phase_step_rad < core::f32::consts::PI * HALF_WAVELENGTH_WITHIN,
                Error::Aliasing,
            ),
            (
                !self.codebook.is_empty() && (0..self.codebook.len()).all(directed),
                Error::Codebook,
            ),
            (self.codebook.len() == beams, Error::Beams),
            (
                self.false_alarms_per_sweep > 0.0 && self.false_alarms_per_sweep <= 1.0,
                Error::FalseAlarms,
            ),
            (within(self.dynamic_range_db, MOST_RANGE_DB), Error::DynamicRange),
            (
                within(self.element_errors.sigma(), MOST_ELEMENT_ERROR),
                Error::ElementErrors,
            ),
            (within(self.beam_gain_sigma_db, MOST_GAIN_DB), Error::BeamGain),
        ];
        match sound.into_iter().find(|(is_sound, _)| !is_sound) {
            Some((_, error)) => Err(error),
            None => Ok(()),
        }
    }
}

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K>
{
    /// [`Estimator::new`] of a configuration that was checked.
    ///
    /// # Errors
    /// [`EstimatorConfigError`] naming the first field that is wrong.
    pub fn checked<const ELEVATIONS: usize>(
        config: &EstimatorConfig<A, E, FACES, X, Z, ELEVATIONS>,
    ) -> Result<Self, EstimatorConfigError> {
        config.check(BEAMS)?;
        Ok(Self::new(config))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::array::{Codebook, CodebookConfig, GmtArrays, UavArrayConfig, UavArrays, UavLayout};
    use crate::paths::ElementErrors;
    use crate::profile::quad_4x8_gmt_72::{BEAMS, Config};

    fn field(change: impl Fn(&mut Config)) -> Result<(), &'static str> {
        let mut config = Config::default();
        change(&mut config);
        config.check(BEAMS).map_err(EstimatorConfigError::field)
    }

    fn codebook(config: CodebookConfig) -> Codebook {
        Codebook::new(GmtArrays::default(), config)
    }

    #[test]
    fn every_wrong_field_is_named() {
        assert_eq!(field(|_| {}), Ok(()));
        assert_eq!(field(|c| *c = Config::single_sweeps()), Ok(()));
        assert_eq!(field(|c| c.waveform.active = 415), Err("waveform.active"));
        assert_eq!(field(|c| c.arrays.arrays_mut()[2].axis *= 1.1), Err("arrays"));
        assert_eq!(
            field(|c| c.arrays.arrays_mut()[0].centre_m.x = f32::NAN),
            Err("arrays")
        );
        let wide = UavArrayConfig {
            spacing_wavelengths: 0.6,
            ..UavArrayConfig::default()
        };
        assert_eq!(
            field(|c| c.arrays = UavArrays::new(&wide)),
            Err("arrays.spacing_wavelengths")
        );
        // Four arrays are too few rows for a planar one.
        let flat = UavArrayConfig {
            layout: UavLayout::Planar { azimuth_rad: 0.0 },
            ..UavArrayConfig::default()
        };
        assert_eq!(field(|c| c.arrays = UavArrays::new(&flat)), Err("arrays.layout"));
        for azimuths in [0, 7] {
            let fewer = CodebookConfig {
                azimuths,
                ..CodebookConfig::default()
            };
            assert_eq!(field(|c| c.codebook = codebook(fewer)), Err("codebook"));
        }
        let nowhere = CodebookConfig {
            elevations_rad: [0.0, f64::NAN, 0.4],
            ..CodebookConfig::default()
        };
        assert_eq!(field(|c| c.codebook = codebook(nowhere)), Err("codebook"));
        for wrong in [0.0, -1.0, 1.1, f64::NAN] {
            assert_eq!(
                field(|c| c.false_alarms_per_sweep = wrong),
                Err("false_alarms_per_sweep")
            );
        }
        for wrong in [-0.1, f32::NAN, f32::INFINITY] {
            assert_eq!(field(|c| c.dynamic_range_db = wrong), Err("dynamic_range_db"));
            assert_eq!(
                field(|c| c.element_errors = ElementErrors::Learned(wrong)),
                Err("element_errors")
            );
            assert_eq!(field(|c| c.beam_gain_sigma_db = wrong), Err("beam_gain_sigma_db"));
        }
    }
}
