//! CRC-32/ISO-HDLC over samples: polynomial 0x04C1_1DB7, reflected, all ones before and after.
//!
//! 64 KiB a frame are too much to take byte by byte, so the checksum is a trait: an STM32H743 has a unit for it, fed by
//! DMA; everyone else takes [`SoftwareCrc`], four bytes a turn with one table of 256 words for each.

use cslam_core::signal::Iq;

use super::Block;

/// Something that makes a CRC-32/ISO-HDLC.
pub trait Checksum {
    /// Checksum of the samples as they lie in memory, words little endian, channel after channel.
    fn samples(&mut self, samples: &Block) -> u32;
}

/// Tables: `TABLES[k][b]` is what byte `b` does to the state `k` bytes later.
static TABLES: [[u32; 256]; 4] = tables();

const fn tables() -> [[u32; 256]; 4] {
    /// The polynomial, reflected.
    const POLYNOMIAL: u32 = 0xedb8_8320;
    let mut tables = [[0; 256]; 4];
    let mut byte = 0;
    while byte < 256 {
        let mut state = byte as u32;
        let mut bit = 0;
        while bit < 8 {
            state = (state >> 1) ^ if state & 1 == 1 { POLYNOMIAL } else { 0 };
            bit += 1;
        }
        tables[0][byte] = state;
        byte += 1;
    }
    let mut k = 1;
    while k < 4 {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[k - 1][byte];
            tables[k][byte] = (before >> 8) ^ tables[0][(before & 255) as usize];
            byte += 1;
        }
        k += 1;
    }
    tables
}

/// What a byte does to the state `k` bytes later.
#[inline(always)]
fn after<const K: usize>(word: u32, shift: u32) -> u32 {
    TABLES[K][((word >> shift) & 255) as usize]
}

/// The checksum by tables, 4 KiB.
#[derive(Clone, Copy, Debug, Default)]
pub struct SoftwareCrc;

impl SoftwareCrc {
    /// Checksum of bytes.
    #[must_use]
    pub fn bytes(&self, bytes: &[u8]) -> u32 {
        let step = |state: u32, byte: &u8| (state >> 8) ^ after::<0>(state ^ u32::from(*byte), 0);
        !bytes.iter().fold(u32::MAX, step)
    }
}

/// The state after another word.
#[inline(always)]
fn one_word(state: u32, word: u32) -> u32 {
    let word = state ^ word;
    after::<3>(word, 0) ^ after::<2>(word, 8) ^ after::<1>(word, 16) ^ after::<0>(word, 24)
}

impl Checksum for SoftwareCrc {
    fn samples(&mut self, samples: &Block) -> u32 {
        let mut state = u32::MAX;
        for sample in samples.as_flattened() {
            state = one_word(state, in_memory(*sample));
        }
        !state
    }
}

/// The word as a little-endian machine would read it.
fn in_memory(sample: Iq) -> u32 {
    u32::from_le(sample.word())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front_end::{SAMPLE_BYTES, write_samples};
    use crate::random::Random;
    use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
    use cslam_core::signal::SAMPLES;

    #[test]
    fn the_check_value_is_that_of_the_catalogue() {
        assert_eq!(SoftwareCrc.bytes(b"123456789"), 0xcbf4_3926);
    }

    #[test]
    fn words_and_bytes_have_one_checksum() {
        let mut random = Random::new(1);
        let mut block = [[Iq::ZERO; SAMPLES]; CHANNELS];
        let mut bytes = [0; SAMPLE_BYTES];
        for _ in 0..4 {
            block
                .as_flattened_mut()
                .fill_with(|| Iq::from_word(random.below(1 << 32) as u32));
            write_samples(&block, &mut bytes);
            assert_eq!(SoftwareCrc.samples(&block), SoftwareCrc.bytes(&bytes));
        }
    }
}
