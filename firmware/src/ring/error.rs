//! What can be wrong with a ring.

use core::fmt;

use super::AccessError;

/// A ring that cannot be used, or cannot be used any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RingError {
    /// No magic number: the other party has not made the ring, or not yet.
    NotReady,
    /// The ring is of another version of the layout.
    Version {
        /// Version found.
        found: u32,
    },
    /// The slots are not of the size that both parties must agree on.
    SlotSize {
        /// Size found, bytes.
        found: u32,
        /// Size wanted, bytes.
        expected: u32,
    },
    /// The number of slots is no power of two in 1..=2^31.
    SlotCount {
        /// Number found.
        found: u32,
    },
    /// The memory is too small for header and slots.
    TooLarge,
    /// Head and tail are further apart than there are slots.
    Indices {
        /// Records published.
        head: u32,
        /// Records taken.
        tail: u32,
    },
    /// The other party's index has disagreed with its complement for as long as no write takes.
    IndexDamaged,
    /// The memory itself failed.
    Access(AccessError),
}

impl fmt::Display for RingError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotReady => f.write_str("there is no ring in the shared memory"),
            Self::Version { found } => write!(
                f,
                "the ring has layout version {found}, expected {}",
                super::VERSION
            ),
            Self::SlotSize { found, expected } => {
                write!(f, "the ring has slots of {found} bytes, expected {expected}")
            }
            Self::SlotCount { found } => write!(f, "{found} slots are not a power of two in 1..=2^31"),
            Self::TooLarge => f.write_str("the shared memory is too small for the ring"),
            Self::Indices { head, tail } => {
                write!(
                    f,
                    "head {head} and tail {tail} are further apart than there are slots"
                )
            }
            Self::IndexDamaged => f.write_str("an index disagrees with its complement"),
            Self::Access(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for RingError {}

impl From<AccessError> for RingError {
    fn from(error: AccessError) -> Self {
        Self::Access(error)
    }
}
