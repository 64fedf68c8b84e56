//! Why a record cannot be used.

use core::fmt;

/// A record that says nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecordError {
    /// The checksum does not match.
    Checksum,
    /// Another version of the format.
    Version {
        /// Version found.
        found: u8,
    },
    /// A kind that this version does not have.
    Kind {
        /// Kind found.
        found: u8,
    },
    /// The content has another length than its kind asks for.
    Length {
        /// Length found, bytes.
        found: u16,
    },
    /// The inertial sensor's packet is not one.
    Packet,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Checksum => f.write_str("the checksum does not match"),
            Self::Version { found } => write!(f, "version {found} of the sensor stream, expected 1"),
            Self::Kind { found } => write!(f, "kind {found} is no kind of record"),
            Self::Length { found } => write!(f, "{found} bytes of content, which its kind does not have"),
            Self::Packet => f.write_str("the inertial sensor's packet is not one"),
        }
    }
}

impl core::error::Error for RecordError {}
