//! The powers of a sweep's beams, behind the header of its begin (docs/front-end.md section 5).
//!
//! The front end holds a whole sweep before it hands the first block over, so it knows which beams are strong, and hands them over in that
//! order. The powers say what comes; a receiver takes blocks in any order, and holds the powers against the blocks.
//!
//! [`BEAMS`] numbers, `f32`, little endian, beam 0 first: the mean over the samples of `|x|^2`, all channels added, W. 0 for a beam
//! that is not sent.

use cslam_core::signal::Iq;

use super::checksum::SoftwareCrc;
use super::{BEAMS, Block};

/// Bytes of the powers.
pub const POWER_BYTES: usize = 4 * BEAMS as usize;

/// Mean power of each beam, W.
pub type Powers = [f32; BEAMS as usize];

/// The powers that lie at the beginning of a frame's samples.
pub(super) fn read(samples: &Block) -> Powers {
    let mut powers = [0.0; BEAMS as usize];
    for (power, word) in powers.iter_mut().zip(samples.as_flattened()) {
        *power = f32::from_bits(u32::from_le(word.word()));
    }
    powers
}

/// Puts powers at the beginning of a frame's samples, as a front end does; the rest is filler.
pub fn write_powers(powers: &Powers, samples: &mut Block) {
    for (power, word) in powers.iter().zip(samples.as_flattened_mut()) {
        *word = Iq::from_word(power.to_bits().to_le());
    }
}

/// Checksum of powers, as [`Header::payload_checksum`](super::Header::payload_checksum) has it.
#[must_use]
pub fn powers_checksum(powers: &Powers) -> u32 {
    let mut bytes = [0; POWER_BYTES];
    for (four, power) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(powers) {
        *four = power.to_le_bytes();
    }
    SoftwareCrc.bytes(&bytes)
}
