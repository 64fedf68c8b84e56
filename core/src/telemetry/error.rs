//! Why a packet could not be made or read.

use core::fmt;

/// A packet that could not be encoded or decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TelemetryError {
    /// The output buffer is too small.
    BufferTooSmall,
    /// The frame is longer than any packet; it was skipped up to the next zero byte.
    FrameTooLong,
    /// The frame is shorter than version and checksum.
    FrameTooShort,
    /// The frame's byte stuffing is damaged.
    Framing,
    /// The checksum does not match.
    Checksum,
    /// The packet is of another version of the wire format.
    Version,
    /// The checksum is right but the content is not a message of this version.
    Content,
}

impl fmt::Display for TelemetryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::BufferTooSmall => "the output buffer is too small",
            Self::FrameTooLong => "the frame is longer than any packet",
            Self::FrameTooShort => "the frame is shorter than version and checksum",
            Self::Framing => "the frame's byte stuffing is damaged",
            Self::Checksum => "the checksum does not match",
            Self::Version => "the packet is of another version",
            Self::Content => "the content is not a message of this version",
        })
    }
}

impl core::error::Error for TelemetryError {}
