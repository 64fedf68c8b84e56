//! Why there is no point.

use core::fmt;

use serde::{Deserialize, Serialize};

/// The input is no measurement of a propagation path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum InputError {
    /// A coordinate, angle or delay is NaN or infinite.
    NotFinite,
    /// The delay is zero or negative.
    NoLength,
    /// UAV and GMT are at the same place.
    CoincidentEnds,
    /// The delay is shorter than the straight way between UAV and GMT, beyond its uncertainty.
    DelayShorterThanBaseline,
    /// A variance is negative or not finite.
    ImpossibleCovariance,
    /// An angle lies outside its range.
    AngleOutOfRange,
}

impl InputError {
    /// Every reason, in the order of the wire format.
    pub const ALL: [Self; 6] = [
        Self::NotFinite,
        Self::NoLength,
        Self::CoincidentEnds,
        Self::DelayShorterThanBaseline,
        Self::ImpossibleCovariance,
        Self::AngleOutOfRange,
    ];

    /// The reason in words.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::NotFinite => "input: a number is not finite",
            Self::NoLength => "input: the delay is zero or negative",
            Self::CoincidentEnds => "input: UAV and GMT are at the same place",
            Self::DelayShorterThanBaseline => {
                "input: the delay is shorter than the straight way from GMT to UAV"
            }
            Self::ImpossibleCovariance => "input: a variance is negative or not finite",
            Self::AngleOutOfRange => "input: an angle lies outside its range",
        }
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::error::Error for InputError {}

impl From<crate::geometry::GeometryError> for InputError {
    fn from(error: crate::geometry::GeometryError) -> Self {
        use crate::geometry::GeometryError;
        match error {
            GeometryError::NotFinite => Self::NotFinite,
            GeometryError::ZeroLength => Self::NoLength,
            GeometryError::ZenithOutOfRange | GeometryError::NotUnit => Self::AngleOutOfRange,
        }
    }
}

/// A path that is not, or cannot be trusted as, one reflection. The gates are those of docs/signal-model.md, "Reflection point".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Rejection {
    /// No excess delay, and it arrives from where the GMT is: line of sight has no reflection point.
    LineOfSight,
    /// No excess delay to speak of, yet it does not arrive from the GMT's direction: the point would be anywhere.
    ExcessDelayTooSmall,
    /// The errors of delay, angles and pose move the point further than allowed; on the straight line between the ends they
    /// grow without bound.
    IllConditioned,
    /// The point is too close to the UAV.
    TooCloseToUav,
    /// The point is too close to the GMT.
    TooCloseToGmt,
    /// The way over the point is not as long as the path.
    LengthMismatch,
    /// The direction from the GMT to the point is not the direction in which the wave left: more than one reflection.
    DepartureMismatch,
    /// The point lies under the ground: more than one reflection.
    UnderGround,
    /// The point lies outside the scene's bounds: more than one reflection.
    OutOfBounds,
    /// The paper's tangent form is singular in this direction.
    Singular,
}

impl Rejection {
    /// Every reason, in the order of the wire format.
    pub const ALL: [Self; 10] = [
        Self::LineOfSight,
        Self::ExcessDelayTooSmall,
        Self::IllConditioned,
        Self::TooCloseToUav,
        Self::TooCloseToGmt,
        Self::LengthMismatch,
        Self::DepartureMismatch,
        Self::UnderGround,
        Self::OutOfBounds,
        Self::Singular,
    ];

    /// The reason in words.
    pub fn as_str(&self) -> &'static str {
        match self {
            Self::LineOfSight => "line of sight",
            Self::ExcessDelayTooSmall => "excess delay too small",
            Self::IllConditioned => "ill-conditioned: the point's error is too large",
            Self::TooCloseToUav => "point too close to the UAV",
            Self::TooCloseToGmt => "point too close to the GMT",
            Self::LengthMismatch => "point beyond the path's length",
            Self::DepartureMismatch => "higher order: angle of departure disagrees",
            Self::UnderGround => "higher order: point under the ground",
            Self::OutOfBounds => "higher order: point outside the scene's bounds",
            Self::Singular => "the tangent form is singular in this direction",
        }
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}
