//! Level of a beam block: its energy, and the shift that leaves the transform the right headroom.
//!
//! One shift serves all channels of a block, so that they keep their amplitudes relative to each other. A receiver
//! whose gain control holds the strongest channel at -12 dB of full scale needs no shift, and pays one pass of
//! multiply-accumulates. With `r` the rms of the strongest channel, Cauchy-Schwarz bounds the taps of any
//! input by `sqrt(416)/8 r = 2.55 r` LSB, all values of the final stage by `2.9 r`, and [`MAX_MEAN_POWER`] keeps that under
//! 32 767: the final stage never clips. Forward bins reach `8 r` for a bare tone; there, lanes may clip, and are counted.
//!
//! Derived: numbers here follow from the range of 16 bits.

use libm::scalbn;

use crate::kernels::Kernels;
use crate::kernels::stages::Channel;
use crate::signal::{BeamBlock, SAMPLES};

/// Largest mean |x|^2 of a channel the transform takes as it is: `r` = 9159, -11.1 dB of full scale (32 768).
pub(crate) const MAX_MEAN_POWER: u64 = (1 << 26) + (1 << 24);

/// Amplitudes of blocks with gains of their own are compared in units of 2^-34: thermal noise in sqrt(W) is then of the order of one.
pub(crate) const REFERENCE_EXPONENT: i32 = -34;

/// A weak block is scaled up by at most this many bits: 12-bit samples at one LSB rms, left-aligned, still fill the range.
const MAX_GAIN_BITS: i32 = 9;

/// A beam block whose power is known, as it came.
#[derive(Debug)]
pub struct Measured<'a, const CHANNELS: usize> {
    block: BeamBlock<'a, CHANNELS>,
    mean_power: f64,
    /// Energy of its strongest channel, squared LSB.
    strongest: u64,
}

impl<'a, const CHANNELS: usize> Measured<'a, CHANNELS> {
    /// Measures a block.
    pub(crate) fn new<K: Kernels>(block: BeamBlock<'a, CHANNELS>) -> Self {
        let (mut energy, mut strongest) = (0_u64, 0_u64);
        for channel in block.samples.iter() {
            let channel_energy = K::energy(channel);
            energy += channel_energy;
            strongest = strongest.max(channel_energy);
        }
        let mean_power = scalbn(energy as f64 / SAMPLES as f64, block.exponent.saturating_mul(2));
        Self {
            block,
            mean_power,
            strongest,
        }
    }

    /// See [`Scaled::mean_power`].
    #[must_use]
    pub fn mean_power(&self) -> f64 {
        self.mean_power
    }

    /// Transmit beam.
    pub(crate) fn beam(&self) -> u16 {
        self.block.beam
    }

    /// Shifts the block in place where its level asks for it.
    #[must_use]
    pub fn scale(self) -> Scaled<'a, CHANNELS> {
        let Self {
            mut block,
            mean_power,
            strongest,
        } = self;
        let shift = match shift(strongest) {
            shift if shift < 0 => shift.max(-headroom(block.samples)),
            shift => shift,
        };
        rescale(block.samples, shift);
        block.exponent = block.exponent.saturating_add(shift);
        Scaled { block, mean_power }
    }
}

/// A beam block at the level of the transform.
#[derive(Debug)]
pub struct Scaled<'a, const CHANNELS: usize> {
    block: BeamBlock<'a, CHANNELS>,
    mean_power: f64,
}

impl<'a, const CHANNELS: usize> Scaled<'a, CHANNELS> {
    /// Mean power of a sample, all channels added, in squared amplitude units (exponent applied): comparable over beams.
    /// No path of the beam can be stronger.
    #[must_use]
    pub fn mean_power(&self) -> f64 {
        self.mean_power
    }

    /// Amplitude of the scaled samples = integer x 2^exponent.
    #[must_use]
    pub fn exponent(&self) -> i32 {
        self.block.exponent
    }

    /// Transmit beam.
    pub(crate) fn beam(&self) -> u16 {
        self.block.beam
    }

    /// The scaled samples.
    #[must_use]
    pub fn samples(&self) -> &[Channel; CHANNELS] {
        self.block.samples
    }

    /// Gives the block back, scaled.
    #[must_use]
    pub fn into_block(self) -> BeamBlock<'a, CHANNELS> {
        self.block
    }
}

/// Right shift (left when negative) that brings the strongest channel, by its energy, nearest under
/// [`MAX_MEAN_POWER`].
fn shift(strongest: u64) -> i32 {
    let limit = MAX_MEAN_POWER * SAMPLES as u64;
    if strongest > limit {
        // At most 2^40 / limit = 25.6: 3.
        (1..=3).find(|bits| strongest >> (2 * bits) <= limit).unwrap_or(3)
    } else {
        -(1..=MAX_GAIN_BITS)
            .take_while(|bits| strongest << (2 * bits) <= limit)
            .last()
            .unwrap_or(0)
    }
}

/// Bits by which every sample of a block can grow.
fn headroom<const CHANNELS: usize>(block: &[Channel; CHANNELS]) -> i32 {
    let used = block.iter().flatten().fold(0, |used, x| used | x.magnitudes());
    ((used | (used >> 16)) as u16).leading_zeros() as i32 - 1
}

/// Shifts every sample right by `bits`, round half up, or left when negative.
fn rescale<const CHANNELS: usize>(block: &mut [Channel; CHANNELS], bits: i32) {
    let samples = block.as_flattened_mut();
    if bits > 0 {
        samples.iter_mut().for_each(|x| *x = x.shifted_right(bits));
    } else if bits < 0 {
        samples.iter_mut().for_each(|x| *x = x.shifted_left(-bits));
    }
}
