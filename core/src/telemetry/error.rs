//! Why a packet could not be made or read.

use core::fmt;

/// A packet that could not be encoded or decoded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum TelemetryError {
    /// A value of the message lies outside what the wire format can say, or is not a number.
    OutOfRange,
    /// The counter has come to the limit that is stored, or to its end.
    CounterExhausted,
    /// The output buffer is too small.
    BufferTooSmall,
    /// The frame is longer than any packet; it was skipped up to the next zero byte.
    FrameTooLong,
    /// The frame is shorter than header, authentication code and checksum.
    FrameTooShort,
    /// The frame's byte stuffing is damaged.
    Framing,
    /// The checksum does not match.
    Checksum,
    /// The packet is of another version of the wire format.
    Version,
    /// The packet is of another UAV, or goes the other way.
    WrongLink,
    /// The packet is not signed.
    Unsigned,
    /// The packet is signed, and there is no key to check it with.
    KeyMissing,
    /// The authentication code is wrong: another key, or forged.
    Forged,
    /// A packet with this counter was taken before.
    Replayed,
    /// The counter lies too far behind the newest one to tell whether it was taken before.
    Stale,
    /// The packet is genuine, but its counter could not be set aside in the memory that survives a reset.
    Unreserved,
    /// Everything is right about the packet, but its content is not a message of this version.
    Content,
}

impl TelemetryError {
    /// Every error, in the order in which counters of them are kept.
    pub const ALL: [Self; 16] = [
        Self::OutOfRange,
        Self::CounterExhausted,
        Self::BufferTooSmall,
        Self::FrameTooLong,
        Self::FrameTooShort,
        Self::Framing,
        Self::Checksum,
        Self::Version,
        Self::WrongLink,
        Self::Unsigned,
        Self::KeyMissing,
        Self::Forged,
        Self::Replayed,
        Self::Stale,
        Self::Unreserved,
        Self::Content,
    ];

    /// The reason in words.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::OutOfRange => "a value lies outside the range of the wire format",
            Self::CounterExhausted => "the counter has come to its limit",
            Self::BufferTooSmall => "the output buffer is too small",
            Self::FrameTooLong => "the frame is longer than any packet",
            Self::FrameTooShort => "the frame is shorter than header, authentication code and checksum",
            Self::Framing => "the frame's byte stuffing is damaged",
            Self::Checksum => "the checksum does not match",
            Self::Version => "the packet is of another version",
            Self::WrongLink => "the packet is of another link",
            Self::Unsigned => "the packet is not signed",
            Self::KeyMissing => "the packet is signed and there is no key to check it",
            Self::Forged => "the authentication code is wrong",
            Self::Replayed => "the packet came before",
            Self::Stale => "the packet is too old",
            Self::Unreserved => "the counter could not be stored ahead of its use",
            Self::Content => "the content is not a message of this version",
        }
    }

    /// Whether the bytes were damaged on the way; everything else was sent as it came.
    #[must_use]
    pub fn is_damage(self) -> bool {
        matches!(
            self,
            Self::FrameTooLong | Self::FrameTooShort | Self::Framing | Self::Checksum
        )
    }
}

impl fmt::Display for TelemetryError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

impl core::error::Error for TelemetryError {}
