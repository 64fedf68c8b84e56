//! What frames there are, and how one begins.

use super::{BEAMS, MOST_FRAMES, PILOTS_OF_A_BEAM, SQUINT_SYMBOLS};

/// First bytes of a frame.
pub(super) const MAGIC: [u8; 4] = *b"CSLF";
/// Version of the format: that of frames and of registers. Version 1 had no pilots.
pub(super) const VERSION: u8 = 2;

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
    /// Samples of a pilot: a beam that was sent again.
    Pilot,
}

impl Kind {
    pub(super) const fn code(self) -> u8 {
        match self {
            Self::Begin => 1,
            Self::Beam => 2,
            Self::Squint => 3,
            Self::Pilot => 4,
        }
    }

    /// Indices lie below this.
    pub(super) const fn limit(self) -> u16 {
        match self {
            Self::Begin => MOST_FRAMES,
            Self::Beam => BEAMS,
            Self::Squint => SQUINT_SYMBOLS,
            Self::Pilot => PILOTS_OF_A_BEAM * BEAMS,
        }
    }
}
