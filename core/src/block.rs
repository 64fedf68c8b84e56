//! The samples of one transmit beam.

use crate::ltd::Iq;
use crate::waveform::SAMPLES;

/// What the front end hands over for one transmit beam: `CHANNELS` x `LENGTH` samples, channels array-major (8 j + i), the
/// beam they were taken in and the block's common scale. A view of a buffer that the receiver works in.
#[derive(Debug)]
pub struct BeamBlock<'a, const CHANNELS: usize = 32, const LENGTH: usize = SAMPLES> {
    /// Samples by channel and sample; sample 0 is delay 0. Left-aligned, full scale 32 768.
    pub samples: &'a mut [[Iq; LENGTH]; CHANNELS],
    /// Transmit beam, 0..codebook length.
    pub beam: u16,
    /// Amplitude = integer x 2^exponent; one scale over all blocks, so beams compare.
    pub exponent: i32,
}
