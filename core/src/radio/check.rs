//! What the description of a radio cannot be.
//!
//! Given: every number here is a bound of what is accepted.

use core::f64::consts::{FRAC_PI_2, TAU};
use core::fmt;

use super::RadioConfig;
use crate::array::UavLayout;
use crate::signal::WaveformError;

/// An array further than this from the body's centre is none of a UAV's, m.
const MOST_RADIUS_M: f64 = 10.0;
/// Elements further apart than this hear, or send to, two directions alike; wavelengths.
const MOST_SPACING: f64 = 0.5;

/// Why no receiver can be made for a radio: the field, in the words of [`RadioConfigError::field`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RadioConfigError {
    /// A field of the waveform.
    Waveform(WaveformError),
    /// `uav_arrays.layout` is a planar array that looks at no azimuth.
    Layout,
    /// `uav_arrays.radius_m` is negative, 10 m or more, or no number.
    Radius,
    /// `uav_arrays.tilt_rad` is steeper than vertical.
    Tilt,
    /// `uav_arrays.spacing_wavelengths` is not above 0 and at most 0.5: two directions of arrival look alike.
    Aliasing,
    /// A figure of `uav_arrays.element` is no number.
    UavElement,
    /// `gmt_arrays.spacing_wavelengths` is not above 0 and at most 0.5: a beam looks in two directions.
    GratingLobes,
    /// A figure of `gmt_arrays.element` is no number.
    GmtElement,
    /// `codebook.azimuths` is 0, or it has no elevation: there is no beam.
    NoBeams,
    /// `codebook.sector_rad` is not above 0 and at most a quarter of a turn.
    Sector,
    /// `codebook.elevations_rad` has one beyond the vertical.
    Elevations,
    /// `squint.half_width` is not above 0 and at most 1.
    SquintHalfWidth,
    /// `squint.elevations` has one that is no direction cosine.
    SquintElevations,
    /// `squint.rise` has an end that is no direction cosine, or stands still.
    SquintRise,
    /// `squint.sector` is no direction cosine.
    SquintSector,
    /// `squint.passes` is 0.
    SquintPasses,
    /// `squint.raster_rise` has an end that is no direction cosine, or stands still.
    SquintRasterRise,
}

impl RadioConfigError {
    /// Name of the field that is wrong.
    #[must_use]
    pub fn field(self) -> &'static str {
        match self {
            Self::Waveform(error) => error.field(),
            Self::Layout => "uav_arrays.layout",
            Self::Radius => "uav_arrays.radius_m",
            Self::Tilt => "uav_arrays.tilt_rad",
            Self::Aliasing => "uav_arrays.spacing_wavelengths",
            Self::UavElement => "uav_arrays.element",
            Self::GratingLobes => "gmt_arrays.spacing_wavelengths",
            Self::GmtElement => "gmt_arrays.element",
            Self::NoBeams => "codebook.azimuths",
            Self::Sector => "codebook.sector_rad",
            Self::Elevations => "codebook.elevations_rad",
            Self::SquintHalfWidth => "squint.half_width",
            Self::SquintElevations => "squint.elevations",
            Self::SquintRise => "squint.rise",
            Self::SquintSector => "squint.sector",
            Self::SquintPasses => "squint.passes",
            Self::SquintRasterRise => "squint.raster_rise",
        }
    }

    /// What was expected of it.
    #[must_use]
    pub fn expected(self) -> &'static str {
        match self {
            Self::Waveform(error) => error.expected(),
            Self::Layout => "an azimuth of at most a turn",
            Self::Radius => "0 to 10 m",
            Self::Tilt | Self::Elevations => "at most a quarter of a turn up or down",
            Self::Aliasing | Self::GratingLobes => "above 0 and at most 0.5",
            Self::UavElement | Self::GmtElement => "finite numbers",
            Self::NoBeams => "at least one beam a face",
            Self::Sector => "above 0 and at most a quarter of a turn",
            Self::SquintHalfWidth
            | Self::SquintElevations
            | Self::SquintRise
            | Self::SquintSector
            | Self::SquintPasses
            | Self::SquintRasterRise => "direction cosines, and a sweep that moves",
        }
    }
}

impl fmt::Display for RadioConfigError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}", self.field(), self.expected())
    }
}

impl core::error::Error for RadioConfigError {}

impl From<WaveformError> for RadioConfigError {
    fn from(error: WaveformError) -> Self {
        Self::Waveform(error)
    }
}

impl<const ELEVATIONS: usize, const AZIMUTH_SWEEPS: usize, const ELEVATION_SWEEPS: usize>
    RadioConfig<ELEVATIONS, AZIMUTH_SWEEPS, ELEVATION_SWEEPS>
{
    /// Whether a receiver can be made for it. What is made takes anything and does not ask: what is wrong here gives wrong paths and a
    /// wrong pose there, never an error.
    ///
    /// # Errors
    /// [`RadioConfigError`] naming the first field that is wrong.
    pub fn check(&self) -> Result<(), RadioConfigError> {
        use RadioConfigError as Error;
        self.waveform.check()?;
        let (uav, codebook) = (&self.uav_arrays, &self.codebook);
        let (heard, sent) = (&uav.element, &self.gmt_arrays.element);
        let uav_element = [
            heard.side_attenuation_db,
            heard.rear_attenuation_db,
            heard.front_gain_db,
        ];
        let gmt_element = [sent.least_cosine, sent.rear_amplitude];
        let spaced = |wavelengths: f64| wavelengths > 0.0 && wavelengths <= MOST_SPACING;
        let angle = |rad: &f64| rad.abs() <= FRAC_PI_2;
        let squint = &self.squint;
        let cosine = |cosine: &f64| cosine.abs() <= 1.0;
        let moves = |[first, last]: &[f64; 2]| cosine(first) && cosine(last) && first != last;
        let looks_somewhere = match uav.layout {
            UavLayout::Around => true,
            UavLayout::Planar { azimuth_rad } => azimuth_rad.abs() <= TAU,
        };
        let sound = [
            (looks_somewhere, Error::Layout),
            ((0.0..MOST_RADIUS_M).contains(&uav.radius_m), Error::Radius),
            (angle(&uav.tilt_rad), Error::Tilt),
            (spaced(uav.spacing_wavelengths), Error::Aliasing),
            (uav_element.iter().all(|x| x.is_finite()), Error::UavElement),
            (spaced(self.gmt_arrays.spacing_wavelengths), Error::GratingLobes),
            (gmt_element.iter().all(|x| x.is_finite()), Error::GmtElement),
            (codebook.azimuths > 0 && ELEVATIONS > 0, Error::NoBeams),
            (
                codebook.sector_rad > 0.0 && angle(&codebook.sector_rad),
                Error::Sector,
            ),
            (codebook.elevations_rad.iter().all(angle), Error::Elevations),
            (
                squint.half_width > 0.0 && cosine(&squint.half_width),
                Error::SquintHalfWidth,
            ),
            (squint.elevations.iter().all(cosine), Error::SquintElevations),
            (moves(&squint.rise), Error::SquintRise),
            (cosine(&squint.sector), Error::SquintSector),
            (squint.passes > 0, Error::SquintPasses),
            (moves(&squint.raster_rise), Error::SquintRasterRise),
        ];
        match sound.into_iter().find(|(is_sound, _)| !is_sound) {
            Some((_, error)) => Err(error),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a change of the default is refused for.
    fn refused(change: impl Fn(&mut RadioConfig)) -> Option<&'static str> {
        let mut radio = RadioConfig::default();
        change(&mut radio);
        radio.check().err().map(RadioConfigError::field)
    }

    #[test]
    fn what_cannot_work_is_refused_by_its_field() {
        assert_eq!(refused(|_| {}), None);
        assert_eq!(
            refused(|r| r.waveform.carrier_hz = 0.0),
            Some("waveform.carrier_hz")
        );
        for active in [0, 415, 514] {
            assert_eq!(refused(|r| r.waveform.active = active), Some("waveform.active"));
        }
        for root in [0, 409, 818] {
            assert_eq!(refused(|r| r.waveform.root = root), Some("waveform.root"));
        }
        for azimuth_rad in [7.0, f64::NAN] {
            let layout = UavLayout::Planar { azimuth_rad };
            assert_eq!(
                refused(|r| r.uav_arrays.layout = layout),
                Some("uav_arrays.layout")
            );
        }
        let ahead = UavLayout::Planar { azimuth_rad: 0.0 };
        assert_eq!(refused(|r| r.uav_arrays.layout = ahead), None);
        for radius_m in [-0.1, 10.0, f64::NAN] {
            assert_eq!(
                refused(|r| r.uav_arrays.radius_m = radius_m),
                Some("uav_arrays.radius_m")
            );
        }
        for tilt_rad in [1.6, f64::NAN] {
            assert_eq!(
                refused(|r| r.uav_arrays.tilt_rad = tilt_rad),
                Some("uav_arrays.tilt_rad")
            );
        }
        for spacing in [0.0, -0.5, 0.51, f64::NAN] {
            let uav = refused(|r| r.uav_arrays.spacing_wavelengths = spacing);
            let gmt = refused(|r| r.gmt_arrays.spacing_wavelengths = spacing);
            assert_eq!(uav, Some("uav_arrays.spacing_wavelengths"), "{spacing}");
            assert_eq!(gmt, Some("gmt_arrays.spacing_wavelengths"), "{spacing}");
        }
        assert_eq!(refused(|r| r.codebook.azimuths = 0), Some("codebook.azimuths"));
        for sector_rad in [0.0, 1.6, f64::NAN] {
            assert_eq!(
                refused(|r| r.codebook.sector_rad = sector_rad),
                Some("codebook.sector_rad")
            );
        }
        let element = refused(|r| r.uav_arrays.element.front_gain_db = f64::NAN);
        assert_eq!(element, Some("uav_arrays.element"));
        let element = refused(|r| r.gmt_arrays.element.rear_amplitude = f64::INFINITY);
        assert_eq!(element, Some("gmt_arrays.element"));
        for elevation_rad in [-1.6, f64::NAN] {
            let elevations = refused(|r| r.codebook.elevations_rad[1] = elevation_rad);
            assert_eq!(elevations, Some("codebook.elevations_rad"));
        }
    }

    #[test]
    fn a_codebook_without_elevations_is_empty() {
        let default = RadioConfig::default();
        let radio = RadioConfig::<0, 3, 8> {
            codebook: crate::array::CodebookConfig {
                azimuths: 8,
                sector_rad: 1.0,
                elevations_rad: [],
            },
            waveform: default.waveform,
            uav_arrays: default.uav_arrays,
            gmt_arrays: default.gmt_arrays,
            squint_scheme: default.squint_scheme,
            squint: default.squint,
        };
        assert_eq!(radio.check(), Err(RadioConfigError::NoBeams));
        assert!(radio.codebook::<f32, 3, 8, 8>().is_empty());
    }

    #[test]
    fn sweeps_are_of_direction_cosines_and_move() {
        type Change = fn(&mut RadioConfig);
        let wrong: [(Change, &str); 8] = [
            (|r| r.squint.half_width = 0.0, "squint.half_width"),
            (|r| r.squint.half_width = 1.1, "squint.half_width"),
            (|r| r.squint.elevations[0] = f64::NAN, "squint.elevations"),
            (|r| r.squint.rise = [0.2, 0.2], "squint.rise"),
            (|r| r.squint.rise[1] = 1.5, "squint.rise"),
            (|r| r.squint.sector = -1.1, "squint.sector"),
            (|r| r.squint.passes = 0, "squint.passes"),
            (|r| r.squint.raster_rise = [0.0, 0.0], "squint.raster_rise"),
        ];
        for (change, field) in wrong {
            assert_eq!(refused(change), Some(field));
        }
    }
}
