//! What frames there are, and how one begins.

use super::{BEAMS, SQUINT_SYMBOLS};

/// First bytes of a frame.
pub(super) const MAGIC: [u8; 4] = *b"CSLF";
/// Version of the format.
pub(super) const VERSION: u8 = 1;

/// What a frame is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// A sweep begins: no samples, but the beams' powers, where the front end tells them; the index says how many frames follow.
    Begin,
    /// Samples of a transmit beam.
    Beam,
    /// Samples of a beam squint symbol.
    Squint,
}

impl Kind {
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::Begin => 1,
            Self::Beam => 2,
            Self::Squint => 3,
        }
    }

    /// Indices lie below this.
    pub(super) const fn limit(self) -> u16 {
        match self {
            Self::Begin => BEAMS + SQUINT_SYMBOLS + 1,
            Self::Beam => BEAMS,
            Self::Squint => SQUINT_SYMBOLS,
        }
    }
}
