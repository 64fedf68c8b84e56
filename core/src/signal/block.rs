//! The samples of one transmit beam.

use crate::kernels::Iq;
use crate::signal::SAMPLES;

/// What the front end hands over for one transmit beam: `CHANNELS` x `LENGTH` samples, channels array-major (8 j + i), the
/// beam they were taken in and the block's common scale. A view of a buffer that the receiver works in.
#[derive(Debug)]
pub struct BeamBlock<'a, const CHANNELS: usize = 32, const LENGTH: usize = SAMPLES> {
    /// Samples by channel and sample; sample 0 is delay 0. Left-aligned, full scale 32 768.
    pub samples: &'a mut [[Iq; LENGTH]; CHANNELS],
    /// Transmit beam, 0..codebook length.
    pub beam: u16,
    /// Amplitude = integer x 2^exponent. **Each beam has its own**: gain control sets it block by block. One exponent for a whole
    /// sweep gives paths that look right and are wrong.
    pub exponent: i32,
}

impl<const CHANNELS: usize, const LENGTH: usize> BeamBlock<'_, CHANNELS, LENGTH> {
    /// Mean over the samples of `|x|^2`, all channels added, amplitude units squared: what beams are ordered by, strongest first,
    /// before they are given to a [`crate::paths::PathEstimator`].
    #[must_use]
    pub fn power(&self) -> f32 {
        let energy: u64 = self.samples.iter().flatten().map(|x| u64::from(x.power())).sum();
        let mean = energy as f64 / LENGTH as f64;
        libm::scalbn(mean, self.exponent.saturating_mul(2)) as f32
    }
}
