//! Why a geometric value could not be made.

use core::fmt;

/// A number that does not describe a direction, a position or a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum GeometryError {
    /// A coordinate, an angle or a quaternion component is NaN or infinite.
    NotFinite,
    /// A vector or quaternion is too short to have a direction.
    ZeroLength,
    /// A zenith angle lies outside 0..=pi.
    ZenithOutOfRange,
    /// A vector that should be of unit length is not.
    NotUnit,
}

impl fmt::Display for GeometryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotFinite => "a number is not finite",
            Self::ZeroLength => "a vector of zero length has no direction",
            Self::ZenithOutOfRange => "the zenith angle lies outside 0..pi",
            Self::NotUnit => "a vector is not of unit length",
        })
    }
}

impl core::error::Error for GeometryError {}
