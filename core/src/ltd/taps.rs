//! The taps of one beam: what the front end hands to the search.

use nalgebra::Complex;

use super::kernels;
use super::stages::{Channel, tap_at};
use super::tables::{RESIDUES, SAMPLES};

/// The correlated channels of one beam, one radix-8 stage before the taps, with their power-delay profile.
///
/// A tap is `h[n] = 1/512 sum_k R[k] conj(X[k]) exp(+j 2 pi k n / 512)` of the channel's spectrum `R`; its amplitude is
/// the value given here x 2^[`exponent`](Self::exponent), one exponent for all channels and taps, so that beams compare.
#[derive(Debug)]
pub struct BeamTaps<'a, const CHANNELS: usize> {
    kept: &'a mut [Channel; CHANNELS],
    profile: &'a [u64; SAMPLES],
    scratch: &'a mut Channel,
    exponent: i32,
    clips: u32,
}

impl<'a, const CHANNELS: usize> BeamTaps<'a, CHANNELS> {
    pub(super) fn new(
        kept: &'a mut [Channel; CHANNELS],
        profile: &'a [u64; SAMPLES],
        scratch: &'a mut Channel,
        exponent: i32,
        clips: u32,
    ) -> Self {
        Self {
            kept,
            profile,
            scratch,
            exponent,
            clips,
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
        self.exponent
    }

    /// Lanes that clipped inside the transform of this beam; 0 for every regular capture. A strong tone in the band or a
    /// broken capture can raise it; the affected bins are then too small.
    #[must_use]
    pub fn clips(&self) -> u32 {
        self.clips
    }

    /// Taps `first`, `first + 1`, ... (cyclic) of a channel into `out`, in LSB of a tap but without the rounding of the
    /// final stage: an eight-term sum a tap, exact but for the last f32 operations. Zeros for a channel that is not there.
    pub fn window(&self, channel: usize, first: usize, out: &mut [Complex<f32>]) {
        let kept = self.kept.get(channel);
        for (i, tap) in out.iter_mut().enumerate() {
            *tap = kept.map_or(Complex::new(0.0, 0.0), |kept| exact_tap(kept, first + i));
        }
    }

    /// All taps of all channels in place, natural order, int16 (final stage of scale 1/4, saturating). The profile is the
    /// sum of exactly these.
    #[must_use]
    pub fn into_natural(self) -> &'a mut [Channel; CHANNELS] {
        for channel in self.kept.iter_mut() {
            kernels::natural(channel, self.scratch);
            *channel = *self.scratch;
        }
        self.kept
    }
}

/// `1/4 sum_p Y_p exp(+j pi p l / 4)` at tap `position + 64 l`, from integers.
fn exact_tap(kept: &Channel, tap: usize) -> Complex<f32> {
    let (position, l) = (tap_at(tap & 63), (tap >> 6) & 7);
    // Terms turned by a multiple of 90 deg, and those turned by 45 deg more.
    let (mut straight, mut diagonal) = ([0_i32; 2], [0_i32; 2]);
    for (slot, residue) in RESIDUES.into_iter().enumerate() {
        let y = kept[(64 * slot + position) & 511];
        let (re, im) = (i32::from(y.re()), i32::from(y.im()));
        let turn = residue * l;
        let (re, im) = match (turn >> 1) & 3 {
            0 => (re, im),
            1 => (-im, re),
            2 => (-re, -im),
            _ => (im, -re),
        };
        if turn & 1 == 0 {
            straight = [straight[0] + re, straight[1] + im];
        } else {
            // (1 + j) y, sqrt(2) too long.
            diagonal = [diagonal[0] + re - im, diagonal[1] + re + im];
        }
    }
    // The sums stay under 2^19, so they are exact in f32.
    let part = |i: usize| 0.25 * (straight[i] as f32 + core::f32::consts::FRAC_1_SQRT_2 * diagonal[i] as f32);
    Complex::new(part(0), part(1))
}
