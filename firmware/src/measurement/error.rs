//! Why a record could not be read.

use core::fmt;

/// A record that is not what a sender of this version wrote.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum RecordError {
    /// It is shorter or longer than a record.
    Length,
    /// The checksum does not match.
    Checksum,
    /// It is of another version of the layout.
    Version,
    /// The checksum is right but kind or flags are unknown.
    Content,
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Length => "the record has the wrong length",
            Self::Checksum => "the checksum does not match",
            Self::Version => "the record is of another version",
            Self::Content => "the kind or the flags of the record are unknown",
        })
    }
}

impl core::error::Error for RecordError {}
