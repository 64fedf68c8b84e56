//! The taps of one beam: what the front end hands to the search.

use core::f32::consts::FRAC_1_SQRT_2;
use core::marker::PhantomData;

use nalgebra::Complex;

use super::correlator::Watch;
use super::kernels::{Kernels, Native};
use super::stages::{Channel, tap_at};
use crate::block::BeamBlock;
use crate::waveform::SAMPLES;

/// The correlated channels of one beam, one radix-8 stage before the taps, with their power-delay profile.
///
/// A tap is `h[n] = 1/512 sum_k R[k] conj(X[k]) exp(+j 2 pi k n / 512)` of the channel's spectrum `R`; its amplitude is
/// the value given here x 2^[`exponent`](Self::exponent), one exponent for all channels and taps, so that beams compare.
#[derive(Debug)]
pub struct BeamTaps<'a, const CHANNELS: usize, K = Native> {
    kept: BeamBlock<'a, CHANNELS>,
    profile: &'a [u64; SAMPLES],
    scratch: &'a mut Channel,
    watch: Watch,
    kernels: PhantomData<K>,
}

impl<'a, const CHANNELS: usize, K: Kernels> BeamTaps<'a, CHANNELS, K> {
    pub(super) fn new(
        kept: BeamBlock<'a, CHANNELS>,
        profile: &'a [u64; SAMPLES],
        scratch: &'a mut Channel,
        watch: Watch,
    ) -> Self {
        Self {
            kept,
            profile,
            scratch,
            watch,
            kernels: PhantomData,
        }
    }

    /// Sum over the channels of |h|^2 at each tap, natural order, in squared LSB of a tap.
    #[must_use]
    pub fn profile(&self) -> &[u64; SAMPLES] {
        self.profile
    }

    /// Amplitude of a tap = value x 2^exponent.
    #[must_use]
    pub fn exponent(&self) -> i32 {
        self.kept.exponent
    }

    /// Transmit beam.
    #[must_use]
    pub fn beam(&self) -> u16 {
        self.kept.beam
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

    /// Taps `first`, `first + 1`, ... (cyclic) of a channel into `out`, in LSB of a tap but without the rounding of the
    /// final stage: an eight-term sum a tap, exact but for the last f32 operations. Zeros for a channel that is not there.
    pub fn window(&self, channel: usize, first: usize, out: &mut [Complex<f32>]) {
        let kept = self.kept.samples.get(channel);
        for (i, tap) in out.iter_mut().enumerate() {
            *tap = kept.map_or(Complex::new(0.0, 0.0), |kept| exact_tap(kept, first + i));
        }
    }

    /// All taps of all channels in place, natural order, int16 (final stage of scale 1/2, saturating). The profile is the
    /// sum of exactly these.
    #[must_use]
    pub fn into_natural(self) -> BeamBlock<'a, CHANNELS> {
        for channel in self.kept.samples.iter_mut() {
            K::natural(channel, self.scratch);
        }
        self.kept
    }
}

/// `1/2 sum_p Y_p exp(+j pi p l / 4)` at tap `position + 64 l`, from integers: the even residues p are in the first four
/// slots, the odd ones in the others.
fn exact_tap(kept: &Channel, tap: usize) -> Complex<f32> {
    let (position, l) = (tap_at(tap & 63), tap >> 6);
    let [even_re, even_im] = four_point(kept, position, l);
    let [re, im] = four_point(kept, position + 256, l);
    let [odd_re, odd_im] = match (l >> 1) & 3 {
        0 => [re, im],
        1 => [-im, re],
        2 => [-re, -im],
        _ => [im, -re],
    };
    // All sums stay under 2^19, so they are exact in f32.
    let (re, im) = if l & 1 == 0 {
        ((even_re + odd_re) as f32, (even_im + odd_im) as f32)
    } else {
        // exp(+j pi/4) = (1 + j) / sqrt(2).
        (
            even_re as f32 + FRAC_1_SQRT_2 * (odd_re - odd_im) as f32,
            even_im as f32 + FRAC_1_SQRT_2 * (odd_re + odd_im) as f32,
        )
    };
    Complex::new(0.5 * re, 0.5 * im)
}

/// `sum_q Y_q j^(q l)` over the four slots from `at`.
fn four_point(kept: &Channel, at: usize, l: usize) -> [i32; 2] {
    let y = |slot: usize| {
        let y = kept[(at + 64 * slot) & 511];
        [i32::from(y.re()), i32::from(y.im())]
    };
    let (a, b, c, d) = (y(0), y(1), y(2), y(3));
    let (first, second) = if l & 1 == 0 {
        ([a[0] + c[0], a[1] + c[1]], [b[0] + d[0], b[1] + d[1]])
    } else {
        ([a[0] - c[0], a[1] - c[1]], [d[1] - b[1], b[0] - d[0]])
    };
    if l & 2 == 0 {
        [first[0] + second[0], first[1] + second[1]]
    } else {
        [first[0] - second[0], first[1] - second[1]]
    }
}
