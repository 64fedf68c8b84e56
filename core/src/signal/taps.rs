//! The taps of one beam: what the front end hands to the search.

use super::strain::Watch;
use crate::signal::{BeamBlock, SAMPLES};

/// The correlated channels of one beam with their power-delay profile.
///
/// A tap is `h[n] = 1/512 sum_k R[k] conj(X[k]) exp(+j 2 pi k n / 512)` of the channel's spectrum `R`; its amplitude is
/// the value given here x 2^[`exponent`](Self::exponent), one exponent for all channels and taps, so that beams compare.
#[derive(Debug)]
pub struct BeamTaps<'a, const CHANNELS: usize> {
    taps: BeamBlock<'a, CHANNELS>,
    profile: &'a [u64; SAMPLES],
    watch: Watch,
}

impl<'a, const CHANNELS: usize> BeamTaps<'a, CHANNELS> {
    pub(crate) fn new(taps: BeamBlock<'a, CHANNELS>, profile: &'a [u64; SAMPLES], watch: Watch) -> Self {
        Self { taps, profile, watch }
    }

    /// Sum over the channels of |h|^2 at each tap, in squared LSB of a tap.
    #[must_use]
    pub fn profile(&self) -> &[u64; SAMPLES] {
        self.profile
    }

    /// Amplitude of a tap = value x 2^exponent.
    #[must_use]
    pub fn exponent(&self) -> i32 {
        self.taps.exponent
    }

    /// Transmit beam.
    #[must_use]
    pub fn beam(&self) -> u16 {
        self.taps.beam
    }

    /// Lanes that clipped in the transform of this beam, as far as its passes were examined: 0 for every regular capture.
    /// A strong tone in the band can raise it; the affected bins are then too small. 0 with
    /// [`unexamined`](Self::unexamined) 0 means that nothing clipped.
    #[must_use]
    pub fn clips(&self) -> u32 {
        self.watch.clips
    }

    /// Passes (six a channel) in which a sum left half the range, so that lanes may have clipped, and which were not
    /// examined: only the first six such passes of a beam are, to bound the time that a jammer can take.
    #[must_use]
    pub fn unexamined(&self) -> u32 {
        self.watch.unexamined
    }

    /// All taps of all channels, where the samples were: int16, natural order. The profile is the sum of exactly these.
    #[must_use]
    pub fn into_block(self) -> BeamBlock<'a, CHANNELS> {
        self.taps
    }
}
