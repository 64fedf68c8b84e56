//! How far down and up a codebook's beams reach.

use core::f64::consts::FRAC_PI_2;

/// From a beam's middle to where it has half of the power, rad, for an aperture of [`APERTURE_WAVELENGTHS`].
/// Derived: 0.443 over the aperture in sines, of a beam that looks up by 25 degrees.
const HALF_POWER_RAD: f64 = 7.0 * core::f64::consts::PI / 180.0;
/// Height of the face that this is of, wavelengths.
/// Given: eight rows half a wavelength apart.
const APERTURE_WAVELENGTHS: f64 = 4.0;

/// Elevations that the beams of a transmitter reach, as sines: half of the power, and no less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeamReach {
    lowest: f64,
    highest: f64,
}

impl BeamReach {
    /// Of beams that look up by these elevations, rad, from faces of `rows` rows of elements, `spacing_wavelengths` apart. Without an elevation
    /// nothing is reached.
    #[must_use]
    pub fn of(elevations_rad: &[f64], rows: usize, spacing_wavelengths: f64) -> Self {
        let beside_rad = HALF_POWER_RAD * APERTURE_WAVELENGTHS / (rows as f64 * spacing_wavelengths);
        let lowest_rad = elevations_rad.iter().copied().fold(f64::INFINITY, f64::min) - beside_rad;
        let highest_rad = elevations_rad.iter().copied().fold(f64::NEG_INFINITY, f64::max) + beside_rad;
        // Beyond the vertical a beam looks down again on the other side.
        Self {
            lowest: libm::sin(lowest_rad.max(-FRAC_PI_2)),
            highest: libm::sin(highest_rad.min(FRAC_PI_2)),
        }
    }

    /// Whether a direction is among them, by its vertical component in the transmitter's frame.
    #[must_use]
    pub fn contains(&self, upwards: f64) -> bool {
        (self.lowest..=self.highest).contains(&upwards)
    }
}

impl Default for BeamReach {
    /// That of the default codebook: from 7 degrees below the horizontal to 32 above.
    fn default() -> Self {
        let elevations_rad = super::CodebookConfig::default().elevations_rad;
        let spacing_wavelengths = super::GmtArrayConfig::default().spacing_wavelengths;
        Self::of(&elevations_rad, 8, spacing_wavelengths)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn holds(reach: &BeamReach, elevation_deg: f64) -> bool {
        reach.contains(libm::sin(elevation_deg.to_radians()))
    }

    #[test]
    fn the_default_beams_reach_seven_degrees_beyond_the_lowest_and_the_highest() {
        let reach = BeamReach::default();
        assert!(holds(&reach, -6.9) && !holds(&reach, -7.1));
        assert!(holds(&reach, 31.9) && !holds(&reach, 32.1));
    }

    #[test]
    fn twice_the_aperture_reaches_half_as_far_beside() {
        let reach = BeamReach::of(&[0.0, 14_f64.to_radians()], 16, 0.5);
        assert!(holds(&reach, -3.4) && !holds(&reach, -3.6));
        assert!(holds(&reach, 17.4) && !holds(&reach, 17.6));
        // The same by the spacing.
        assert_eq!(reach, BeamReach::of(&[0.0, 14_f64.to_radians()], 32, 0.25));
    }

    #[test]
    fn beams_end_at_the_vertical_and_no_beam_reaches_nothing() {
        let up = BeamReach::of(&[80_f64.to_radians()], 2, 0.5);
        assert!(holds(&up, 89.0) && up.contains(1.0) && !holds(&up, 10.0));
        let none = BeamReach::of(&[], 8, 0.5);
        assert!(!holds(&none, 0.0));
    }
}
