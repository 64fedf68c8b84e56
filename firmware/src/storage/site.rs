//! What a receiver is told about where it flies: where its GMT was set up, and the earth's magnetic field there.
//!
//! In whole thousandths of the units, so that settings compare exactly and no bytes can make a number that is none.

use cslam_core::estimator::Setup;
use cslam_core::inertial::MagneticField;
use nalgebra::Vector3;

/// Where whoever set the GMT up says that its antenna is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GmtPlace {
    position_mm: [i32; 3],
    within_mm: u32,
}

impl GmtPlace {
    /// World frame, mm; the first beacon may be up to `within_mm` from there, more than 0, or there is none.
    #[must_use]
    pub const fn new(position_mm: [i32; 3], within_mm: u32) -> Option<Self> {
        if within_mm == 0 {
            return None;
        }
        Some(Self {
            position_mm,
            within_mm,
        })
    }

    /// As the filter takes it.
    #[must_use]
    pub fn setup(&self) -> Setup {
        Setup {
            position_m: Vector3::from(self.position_mm.map(|c| f64::from(c) / 1e3)),
            within_m: f64::from(self.within_mm) / 1e3,
        }
    }

    pub(super) fn to_words(self) -> [i32; 4] {
        let [x, y, z] = self.position_mm;
        [x, y, z, self.within_mm.cast_signed()]
    }

    pub(super) fn from_words([x, y, z, within]: [i32; 4]) -> Option<Self> {
        Self::new([x, y, z], within.cast_unsigned())
    }
}

/// The earth's magnetic field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EarthField {
    strength_nt: i32,
    inclination_mdeg: i32,
    declination_mdeg: i32,
}

impl EarthField {
    /// Strength, nT, 1000 to 100 000 (the earth's is 22 000 to 67 000); angle below the horizon, -90 000 to 90 000
    /// thousandths of a degree; angle of magnetic north east of true north, -180 000 to 180 000 of them. `None` outside.
    #[must_use]
    pub fn new(strength_nt: i32, inclination_mdeg: i32, declination_mdeg: i32) -> Option<Self> {
        let sound = (1_000..=100_000).contains(&strength_nt)
            && (-90_000..=90_000).contains(&inclination_mdeg)
            && (-180_000..=180_000).contains(&declination_mdeg);
        sound.then_some(Self {
            strength_nt,
            inclination_mdeg,
            declination_mdeg,
        })
    }

    /// As the receiver takes it.
    #[must_use]
    pub fn field(&self) -> MagneticField {
        // Exact: below 2^24.
        let thousandth = |value: i32| value as f32 / 1e3;
        MagneticField::new(
            thousandth(self.strength_nt),
            thousandth(self.inclination_mdeg).to_radians(),
            thousandth(self.declination_mdeg).to_radians(),
        )
    }

    pub(super) fn to_words(self) -> [i32; 3] {
        [self.strength_nt, self.inclination_mdeg, self.declination_mdeg]
    }

    pub(super) fn from_words([strength, inclination, declination]: [i32; 3]) -> Option<Self> {
        Self::new(strength, inclination, declination)
    }
}
