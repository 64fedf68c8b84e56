//! What a call came to.

use core::ffi::{CStr, c_char};

use cslam_core::geometry::GeometryError;
use cslam_core::reflection::InputError;

/// What a call came to: 0 when it did what it was asked to.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CslamStatus {
    /// Done.
    Ok = 0,
    /// A pointer that must not be null is null.
    Null = 1,
    /// A pointer is not aligned for what it points to.
    Misaligned = 2,
    /// The memory, or an array, is shorter than what has to go in.
    TooShort = 3,
    /// The `size` field of a struct is not that of this version.
    Size = 4,
    /// A number is NaN or infinite.
    NotFinite = 5,
    /// A number is outside its range.
    OutOfRange = 6,
    /// There is nothing at the handle: never built, ended, or copied elsewhere.
    NotReady = 7,
    /// There is something in the memory already that has not been ended.
    AlreadyReady = 8,
    /// Another thread is in a call with this handle.
    Busy = 9,
    /// The configuration cannot work; `cslam_estimator_config_wrong_field` names the field.
    Config = 10,
    /// A delay is zero or negative, or a direction has no length.
    NoLength = 11,
    /// Both ends of the link are at the same place.
    CoincidentEnds = 12,
    /// A delay is shorter than the straight way between the ends.
    DelayTooShort = 13,
    /// A variance is negative or not finite.
    Covariance = 14,
    /// An angle lies outside its range, or a direction is no unit vector.
    Angle = 15,
    /// The library itself is damaged: its models do not pass their checks.
    Damaged = 16,
    /// What was asked for is not known yet.
    NotKnown = 17,
}

impl CslamStatus {
    /// Every status, in order.
    const ALL: [Self; 18] = [
        Self::Ok,
        Self::Null,
        Self::Misaligned,
        Self::TooShort,
        Self::Size,
        Self::NotFinite,
        Self::OutOfRange,
        Self::NotReady,
        Self::AlreadyReady,
        Self::Busy,
        Self::Config,
        Self::NoLength,
        Self::CoincidentEnds,
        Self::DelayTooShort,
        Self::Covariance,
        Self::Angle,
        Self::Damaged,
        Self::NotKnown,
    ];

    fn text(self) -> &'static CStr {
        match self {
            Self::Ok => c"done",
            Self::Null => c"a pointer is null",
            Self::Misaligned => c"a pointer is not aligned",
            Self::TooShort => c"the memory or array is too short",
            Self::Size => c"the size field of a struct is not that of this version",
            Self::NotFinite => c"a number is not finite",
            Self::OutOfRange => c"a number is outside its range",
            Self::NotReady => c"the handle was never initialised, has ended, or was copied",
            Self::AlreadyReady => c"the memory holds an object that has not been ended",
            Self::Busy => c"another thread uses the handle",
            Self::Config => c"the configuration cannot work",
            Self::NoLength => c"a delay is zero or negative, or a direction has no length",
            Self::CoincidentEnds => c"both ends of the link are at the same place",
            Self::DelayTooShort => c"the delay is shorter than the straight way between the ends",
            Self::Covariance => c"a variance is negative or not finite",
            Self::Angle => c"an angle is outside its range, or a direction no unit vector",
            Self::Damaged => c"the library is damaged",
            Self::NotKnown => c"not known yet",
        }
    }

    /// Status of a call that came to this.
    pub(crate) fn of(result: Result<(), Self>) -> Self {
        result.err().unwrap_or(Self::Ok)
    }
}

impl From<InputError> for CslamStatus {
    fn from(error: InputError) -> Self {
        match error {
            InputError::NotFinite => Self::NotFinite,
            InputError::NoLength => Self::NoLength,
            InputError::CoincidentEnds => Self::CoincidentEnds,
            InputError::DelayShorterThanBaseline => Self::DelayTooShort,
            InputError::ImpossibleCovariance => Self::Covariance,
            InputError::AngleOutOfRange => Self::Angle,
            _ => Self::OutOfRange,
        }
    }
}

impl From<GeometryError> for CslamStatus {
    fn from(error: GeometryError) -> Self {
        Self::from(InputError::from(error))
    }
}

/// A status in words, never null; "unknown status" for a number that is none. Static: not to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_status_text(status: i32) -> *const c_char {
    let known = CslamStatus::ALL.into_iter().find(|known| *known as i32 == status);
    known.map_or(c"unknown status", CslamStatus::text).as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_has_a_text_of_its_own() {
        for (number, status) in CslamStatus::ALL.into_iter().enumerate() {
            assert_eq!(status as usize, number);
            assert!(
                CslamStatus::ALL[..number]
                    .iter()
                    .all(|other| other.text() != status.text())
            );
        }
    }
}
