//! What can be wrong with a frame.

use core::fmt;

use super::kind::{Kind, MAGIC, VERSION};

/// A frame that is of no use. Each says where to look.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FrameError {
    /// No frame begins here.
    Magic {
        /// First four bytes, little endian.
        found: u32,
    },
    /// The header's checksum does not match.
    HeaderChecksum,
    /// The front end sends another version of the format.
    Version {
        /// Version found.
        found: u8,
    },
    /// No kind of frame.
    Kind {
        /// Code found.
        found: u8,
    },
    /// An index that this kind of frame does not have.
    Index {
        /// Kind of the frame.
        kind: Kind,
        /// Index found.
        found: u16,
        /// Indices lie below this.
        limit: u16,
    },
    /// An exponent that is no gain setting.
    Exponent {
        /// Exponent found.
        found: i16,
    },
    /// Samples of another number than this kind of frame has.
    Length {
        /// Bytes found.
        found: u32,
        /// Bytes that the kind asks for.
        expected: u32,
    },
    /// A frame of another session than the one that was opened.
    Session {
        /// Session found; 0 from a front end that has just started.
        found: u16,
        /// Session that was opened.
        expected: u16,
    },
    /// The samples' checksum does not match.
    PayloadChecksum {
        /// Number of the frame.
        sequence: u32,
    },
    /// The frame has been taken before.
    Repeated {
        /// Number of the frame.
        sequence: u32,
    },
    /// A frame from so far back that nobody remembers whether it has been taken.
    Stale {
        /// Number of the frame.
        sequence: u32,
        /// Newest number taken.
        newest: u32,
    },
}

impl fmt::Display for FrameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Magic { found } => write!(
                f,
                "no frame begins here ({found:#010x}, expected {:#010x}): check the edge of the pixel clock and that VSYNC opens every frame",
                u32::from_le_bytes(MAGIC)
            ),
            Self::HeaderChecksum => {
                f.write_str("a header is damaged: check data lines, termination and the pixel clock's rate")
            }
            Self::Version { found } => write!(
                f,
                "frames of version {found}, expected {VERSION}: the front end and this receiver are of different releases"
            ),
            Self::Kind { found } => write!(f, "frame of kind {found}: there are 1, 2 and 3"),
            Self::Index { kind, found, limit } => write!(
                f,
                "index {found} in a frame of kind {kind:?}, expected less than {limit}: check the front end's codebook"
            ),
            Self::Exponent { found } => {
                write!(
                    f,
                    "exponent {found} is no gain setting: check the front end's gain table"
                )
            }
            Self::Length { found, expected } => write!(
                f,
                "{found} bytes of samples, expected {expected}: check channels and samples of the front end"
            ),
            Self::Session { found: 0, expected } => write!(
                f,
                "the front end has restarted in session {expected}: open a new one and check its supply"
            ),
            Self::Session { found, expected } => write!(
                f,
                "a frame of session {found}, open is {expected}: it was under way when the session was opened"
            ),
            Self::PayloadChecksum { sequence } => write!(
                f,
                "the samples of frame {sequence} are damaged: check data lines, and cache maintenance of the buffer"
            ),
            Self::Repeated { sequence } => write!(f, "frame {sequence} came twice"),
            Self::Stale { sequence, newest } => {
                write!(f, "frame {sequence} came long after {newest}: it is not taken")
            }
        }
    }
}

impl core::error::Error for FrameError {}
