//! Correlation of beam blocks with the known waveform, and of a few channels at half length for detection.
//!
//! Per channel: transform, product with the conjugate waveform, inverse transform. The waveform's product is fused with
//! the stages beside it, and the final stage adds up powers while it writes the taps in the place of the samples.
//! [`Correlator`] is immutable; all state is in [`Workspace`], which one receiver needs once.

use core::marker::PhantomData;

use super::strain::Watch;
use super::tables::Tables;
use super::taps::BeamTaps;
use crate::kernels::stages::{
    self, COLUMNS, Channel, FOLDED_COLUMNS, FoldedChannel, FoldedPowers, Powers, tap_at,
};
use crate::kernels::{Iq, Kernels, Native};
use crate::signal::{BeamBlock, Measured, SAMPLES, Scaled, Waveform};

/// Taps of the half-length correlation.
pub const FOLDED_TAPS: usize = SAMPLES / 2;
/// Channels of the half-length correlation, at most.
/// Capacity: memory of the folded taps.
pub const FOLDED_CHANNELS: usize = 8;

/// Given: stages scale by 2^-12 in all, a tap is defined with 1/512.
pub(crate) const TAP_EXPONENT: i32 = 12 - 9;

/// What the cheap stage saw of a beam.
#[derive(Debug)]
pub struct Folded<'a> {
    /// The taps of each channel that was looked at, in the order asked for; what lies behind them is of earlier beams.
    pub taps: &'a mut [FoldedChannel; FOLDED_CHANNELS],
    /// Sum over the channels of |h|^2 at each delay modulo 256 taps, squared LSB of a tap.
    pub profile: &'a mut [u64; FOLDED_TAPS],
    /// A sum left half the range in some pass, so that lanes may have clipped: the profile may fall short.
    pub strained: bool,
}

/// Transform and correlation with one waveform, by one set of kernels.
#[derive(Clone, Debug)]
pub struct Correlator<K = Native> {
    tables: Tables,
    kernels: PhantomData<K>,
}

/// Scratch of the transform and the profiles it makes. 22 KiB.
#[derive(Clone, Debug)]
pub struct Workspace {
    ping: Channel,
    pong: Channel,
    powers: Powers,
    profile: [u64; SAMPLES],
    folded: [u64; FOLDED_TAPS],
    folded_taps: [FoldedChannel; FOLDED_CHANNELS],
}

impl Workspace {
    /// An empty workspace.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            ping: [Iq::ZERO; SAMPLES],
            pong: [Iq::ZERO; SAMPLES],
            powers: [[0; 8]; 64],
            profile: [0; SAMPLES],
            folded: [0; FOLDED_TAPS],
            folded_taps: [[Iq::ZERO; FOLDED_TAPS]; FOLDED_CHANNELS],
        }
    }
}

impl Default for Workspace {
    fn default() -> Self {
        Self::new()
    }
}

impl<K: Kernels> Correlator<K> {
    /// Correlator for a waveform. Its symbols are rounded to Q15.
    #[must_use]
    pub fn new(waveform: &Waveform) -> Self {
        let mut correlator = Self::blank();
        correlator.fill(waveform);
        correlator
    }

    /// Correlator for no waveform, to be filled where it lies.
    pub(crate) const fn blank() -> Self {
        Self {
            tables: Tables::blank(),
            kernels: PhantomData,
        }
    }

    /// Computes the tables of a waveform.
    pub(crate) fn fill(&mut self, waveform: &Waveform) {
        self.tables.fill(waveform);
    }

    /// Spectrum of a channel, digit-reversed: [`super::bin_at`] names the bin of each position. Scale 2^-6. Returns how
    /// many lanes clipped; none does while every bin and partial sum stays under 2^21 / sqrt(2) before scaling.
    pub fn spectrum(&self, samples: &Channel, out: &mut Channel, work: &mut Workspace) -> u32 {
        let Workspace { ping, pong, .. } = work;
        let Tables { second, third, last } = &self.tables;
        let mut watch = Watch::default();
        watch.pass(K::first(samples, ping), || stages::first(samples, ping));
        watch.pass(K::second(ping, pong, second), || {
            stages::second(ping, pong, second)
        });
        watch.pass(K::third(pong, ping, third), || stages::third(pong, ping, third));
        watch.pass(K::last(ping, out, last), || stages::last(ping, out, last));
        watch.clips
    }

    /// Measures a beam block, which stays as it is.
    pub fn measure<'a, const CHANNELS: usize>(
        &self,
        block: BeamBlock<'a, CHANNELS>,
    ) -> Measured<'a, CHANNELS> {
        Measured::new::<K>(block)
    }

    /// Measures a beam block and brings it to the level of the transform, in place.
    pub fn scale<'a, const CHANNELS: usize>(&self, block: BeamBlock<'a, CHANNELS>) -> Scaled<'a, CHANNELS> {
        self.measure(block).scale()
    }

    /// Correlates all channels of a beam, in place, and sums their power.
    pub fn correlate<'a, const CHANNELS: usize>(
        &self,
        beam: Scaled<'a, CHANNELS>,
        work: &'a mut Workspace,
    ) -> BeamTaps<'a, CHANNELS> {
        let BeamBlock {
            samples,
            beam,
            exponent,
        } = beam.into_block();
        work.powers = [[0; 8]; 64];
        let mut watch = Watch::default();
        for channel in samples.iter_mut() {
            self.taps(channel, work, &mut watch);
        }
        for (position, row) in work.powers.iter().enumerate() {
            for (column, &power) in COLUMNS.iter().zip(row) {
                work.profile[(tap_at(position) + 64 * column) & 511] = power;
            }
        }
        let taps = BeamBlock {
            samples,
            beam,
            exponent: exponent.saturating_add(TAP_EXPONENT),
        };
        BeamTaps::new(taps, &work.profile, watch)
    }

    /// Correlates one channel, in place. For a channel that was made of others, at their level.
    pub(crate) fn correlate_channel(&self, channel: &mut Channel, work: &mut Workspace) {
        self.taps(channel, work, &mut Watch::default());
    }

    /// Taps of a channel in place of its samples; their power is added.
    #[inline(never)]
    fn taps(&self, channel: &mut Channel, work: &mut Workspace, watch: &mut Watch) {
        let Tables { second, third, last } = &self.tables;
        let Workspace {
            ping, pong, powers, ..
        } = work;
        watch.pass(K::first(channel, ping), || stages::first(channel, ping));
        watch.pass(K::second(ping, pong, second), || {
            stages::second(ping, pong, second)
        });
        watch.pass(K::third(pong, ping, third), || stages::third(pong, ping, third));
        watch.pass(K::correlate(ping, pong, last), || {
            stages::correlate(ping, pong, last)
        });
        watch.pass(K::inverse_third(pong, ping, third), || {
            stages::inverse_third(pong, ping, third)
        });
        watch.pass(K::inverse_second(ping, pong, second), || {
            stages::inverse_second(ping, pong, second)
        });
        K::taps(pong, channel, powers);
    }

    /// Cheap stage: taps and profile of the even subcarriers of a few channels (those that exist, [`FOLDED_CHANNELS`] of
    /// them at most), delays modulo 256 taps.
    /// Against the full profile it loses 3 dB of processing gain and what the fewer channels gather; it costs an eighth
    /// with 8 of 32 channels. Scale of the full taps: same exponent, a path's tap half as large.
    pub fn detect<'a, const CHANNELS: usize>(
        &self,
        beam: &Scaled<'_, CHANNELS>,
        channels: &[u8],
        work: &'a mut Workspace,
    ) -> Folded<'a> {
        let Tables { second, third, last } = &self.tables;
        let (second, third, last) = (first_half(second), first_half(third), first_half(last));
        let mut powers: FoldedPowers = [[0; 4]; 64];
        let Workspace { ping, pong, .. } = work;
        let mut strained = false;
        for (taps, channel) in work.folded_taps.iter_mut().zip(channels) {
            let Some(samples) = beam.samples().get(usize::from(*channel)) else {
                *taps = [Iq::ZERO; FOLDED_TAPS];
                continue;
            };
            K::first_folded(samples, ping);
            strained |= K::second(ping, pong, second);
            strained |= K::third(pong, ping, third);
            strained |= K::correlate(ping, pong, last);
            strained |= K::inverse_third(pong, ping, third);
            strained |= K::inverse_second(ping, pong, second);
            K::taps_folded(pong, taps, &mut powers);
        }
        for (position, row) in powers.iter().enumerate() {
            for (column, &power) in FOLDED_COLUMNS.iter().zip(row) {
                work.folded[(tap_at(position) + 64 * column) & 255] = power;
            }
        }
        Folded {
            taps: &mut work.folded_taps,
            profile: &mut work.folded,
            strained,
        }
    }
}

/// First half of a table: the even bins.
fn first_half<T>(table: &[T]) -> &[T] {
    table.get(..table.len() / 2).unwrap_or(table)
}
