//! The stages of the transform, portable form: the definition that the assembly form must equal bit for bit.
//!
//! 512 = 8 x 4 x 4 x 4. Forward, natural order in, digit-reversed out: each stage splits a polynomial modulo
//! `z^M - c` into four (first: eight) modulo `z^(M/4) - c_i`, so that its twiddles are constant inside a block. The
//! inverse runs the same way back. Between stages a block's words are kept in the order in which the next stage
//! reads them, hence the index arithmetic below; no pass only reorders.
//!
//! Scales: first stage 1/8, each radix-4 stage 1/2 (as much as noise grows in it), product with the waveform 1/2,
//! last inverse radix-4 stage 1/4, final stage 1/2. Every stage rounds once, half up; the halvings of the two radix-8 stages are floors (the first
//! two are exact on samples of 14 bits or less, left-aligned). Every stage reads one buffer and writes another, so its
//! input is still there when it must be repeated to count clipped lanes. Passes are inlined: where only their strain is
//! asked for, the count costs nothing.
//!
//! Given: numbers here are those of the transform and of the format Q15.

mod butterfly;

use super::iq::{Clips, Iq};
use butterfly::{butterfly, even_half, inverse_butterfly, inverse_butterfly_halved, inverse_half};

/// Samples of a symbol and points of the transform. Its radix plan, 8 x 4 x 4 x 4, is that of this length.
pub const SAMPLES: usize = 512;

/// Twiddles of legs 1, 2, 3 of a radix-4 block.
pub(crate) type Twiddles = [Iq; 3];

/// Factors of a last-stage block: the waveform at its four bins, then the block's twiddles.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Tail {
    /// Waveform `X` at the four bins, Q15; zero where no subcarrier is active.
    pub(crate) waveform: [Iq; 4],
    /// Twiddles of legs 1, 2, 3.
    pub(crate) twiddles: Twiddles,
}

impl Tail {
    pub(crate) const fn blank() -> Self {
        Self {
            waveform: [Iq::ZERO; 4],
            twiddles: [Iq::ZERO; 3],
        }
    }
}

/// The samples of one channel, or a stage's data.
pub type Channel = [Iq; SAMPLES];
/// The taps that the even bins of one channel give, delays modulo 256.
pub type FoldedChannel = [Iq; SAMPLES / 2];

/// Sum of |tap|^2 over channels, in the order of the final stage: 64 rows (see [`tap_at`]) of the delays
/// `row + 64 l`, l = 0, 4, 1, 5, 2, 6, 3, 7.
pub(crate) type Powers = [[u64; 8]; 64];
/// As [`Powers`] for the even bins: l = 0, 2, 1, 3, delays modulo 256.
pub(crate) type FoldedPowers = [[u64; 4]; 64];

/// Which multiple of 64 taps each column of [`Powers`] stands for.
pub(crate) const COLUMNS: [usize; 8] = [0, 4, 1, 5, 2, 6, 3, 7];
/// Which multiple of 64 taps each column of [`FoldedPowers`] stands for.
pub(crate) const FOLDED_COLUMNS: [usize; 4] = [0, 2, 1, 3];

/// `exp(-j pi/4)`, Q15.
pub(crate) const EIGHTH: Iq = Iq::new(23_170, -23_170);
/// `exp(+j pi/4)`, Q15.
pub(crate) const MINUS_EIGHTH: Iq = Iq::new(23_170, 23_170);

/// Tap (modulo 64) at a position of the kept data; its own inverse. Base-4 digits reversed.
#[must_use]
pub(crate) const fn tap_at(position: usize) -> usize {
    ((position & 3) << 4) | (position & 12) | ((position >> 4) & 3)
}

/// How the sums of one pass over a channel fared.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Pass {
    /// Bits of sums that differ from their neighbours where a lane left half the range.
    strain: u32,
    /// Lanes that clipped.
    pub(crate) clips: Clips,
}

impl Pass {
    /// Whether a sum left half the range, without which no lane can have clipped. In the first stage: whether a lane
    /// clipped.
    pub(crate) fn strained(&self) -> bool {
        self.strain & 0x8000_8000 != 0
    }

    /// Notes whether a lane of a butterfly's results left half the range, where its upper two bits differ. Every lane
    /// that clips inside a butterfly shows in one of its four results.
    fn watch(&mut self, results: [Iq; 4]) -> [Iq; 4] {
        for x in results {
            self.strain |= x.word() ^ (x.word() << 1);
        }
        results
    }
}

/// First stage, radix 8, no twiddles, scale 1/8.
#[inline(always)]
pub(crate) fn first(input: &Channel, out: &mut Channel) -> Pass {
    let mut clips = 0;
    for n in 0..64 {
        let to = first_position(n);
        let (sums, differences) = fold(input, n);
        for (slot, y) in even_half(sums).into_iter().enumerate() {
            out[(64 * slot + to) & 511] = y;
        }
        let [d0, d1, d2, d3] = differences;
        let (u0, u1) = (d0.halving_sub_j(d2), d0.halving_add_j(d2));
        let v0 = d1.halving_sub_j(d3).full_product(EIGHTH, &mut clips);
        // exp(-j 3 pi/4) = -j exp(-j pi/4).
        let v1 = d1.halving_add_j(d3).full_product(EIGHTH, &mut clips);
        let odd = [
            u0.halving_add(v0),
            u1.halving_sub_j(v1),
            u0.halving_sub(v0),
            u1.halving_add_j(v1),
        ];
        for (slot, y) in odd.into_iter().enumerate() {
            out[(256 + 64 * slot + to) & 511] = y;
        }
    }
    Pass {
        strain: if clips > 0 { u32::MAX } else { 0 },
        clips,
    }
}

/// First stage for the even bins only (the first half of `out`), scale 1/8. Cannot clip.
pub(crate) fn first_folded(input: &Channel, out: &mut Channel) {
    for n in 0..64 {
        let to = first_position(n);
        for (slot, y) in even_half(fold(input, n).0).into_iter().enumerate() {
            out[(64 * slot + to) & 511] = y;
        }
    }
}

/// Where coefficient `n` of a block of 64 is written, so that the second stage reads its legs in a row.
const fn first_position(n: usize) -> usize {
    4 * (n & 15) + (n >> 4)
}

/// Half sums and half differences of the samples 256 apart.
fn fold(input: &Channel, n: usize) -> ([Iq; 4], [Iq; 4]) {
    let pair = |i: usize| (input[(n + 64 * i) & 511], input[(n + 64 * i + 256) & 511]);
    (
        core::array::from_fn(|i| pair(i).0.halving_add(pair(i).1)),
        core::array::from_fn(|i| pair(i).0.halving_sub(pair(i).1)),
    )
}

/// Four words in a row.
fn row(x: &Channel, at: usize) -> [Iq; 4] {
    core::array::from_fn(|i| x[(at + i) & 511])
}

/// Four words `step` apart.
fn column(x: &Channel, at: usize, step: usize) -> [Iq; 4] {
    core::array::from_fn(|i| x[(at + i * step) & 511])
}

/// Writes four words `step` apart.
fn put(out: &mut Channel, at: usize, step: usize, y: [Iq; 4]) {
    for (i, y) in y.into_iter().enumerate() {
        out[(at + i * step) & 511] = y;
    }
}

/// Second stage, radix 4 on blocks of 64, scale 1/2.
#[inline(always)]
pub(crate) fn second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> Pass {
    let mut pass = Pass::default();
    for (block, w) in twiddles.iter().enumerate() {
        for n in 0..16 {
            let y = butterfly(row(input, 64 * block + 4 * n), w, &mut pass);
            put(out, 64 * block + 4 * (n & 3) + (n >> 2), 16, y);
        }
    }
    pass
}

/// Third stage, radix 4 on blocks of 16, scale 1/2.
#[inline(always)]
pub(crate) fn third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> Pass {
    let mut pass = Pass::default();
    for (block, w) in twiddles.iter().enumerate() {
        for n in 0..4 {
            let y = butterfly(row(input, 16 * block + 4 * n), w, &mut pass);
            put(out, 16 * block + n, 4, y);
        }
    }
    pass
}

/// Last forward stage, radix 4 on blocks of 4, scale 1/2: the spectrum, digit-reversed.
#[inline(always)]
pub(crate) fn last(input: &Channel, out: &mut Channel, tails: &[Tail]) -> Pass {
    let mut pass = Pass::default();
    for (block, tail) in tails.iter().enumerate() {
        let bins = butterfly(row(input, 4 * block), &tail.twiddles, &mut pass);
        put(out, 4 * block, 1, bins);
    }
    pass
}

/// Last forward stage, product with the conjugate waveform, first inverse stage; scale 1/8. The spectrum is not kept.
#[inline(always)]
pub(crate) fn correlate(input: &Channel, out: &mut Channel, tails: &[Tail]) -> Pass {
    let mut pass = Pass::default();
    for (block, tail) in tails.iter().enumerate() {
        let bins = butterfly(row(input, 4 * block), &tail.twiddles, &mut pass);
        let [b0, b1, b2, b3] = bins;
        let [x0, x1, x2, x3] = tail.waveform;
        let z = [
            b0.half_product_conj(x0),
            b1.half_product_conj(x1),
            b2.half_product_conj(x2),
            b3.half_product_conj(x3),
        ];
        put(out, 4 * block, 1, inverse_butterfly(z, &tail.twiddles, &mut pass));
    }
    pass
}

/// Inverse of [`third`], scale 1/2.
#[inline(always)]
pub(crate) fn inverse_third(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> Pass {
    let mut pass = Pass::default();
    for (block, w) in twiddles.iter().enumerate() {
        for n in 0..4 {
            let y = inverse_butterfly(column(input, 16 * block + n, 4), w, &mut pass);
            put(out, 16 * block + 4 * n, 1, y);
        }
    }
    pass
}

/// Inverse of [`second`], scale 1/4: a path gathers its energy here, and a strong one would
/// pass half the range at 1/2, which the assembly's probe takes for possible clipping. Its output is the kept form of a channel: one radix-8 stage before the taps.
#[inline(always)]
pub(crate) fn inverse_second(input: &Channel, out: &mut Channel, twiddles: &[Twiddles]) -> Pass {
    let mut pass = Pass::default();
    for (block, w) in twiddles.iter().enumerate() {
        for n in 0..16 {
            let y = inverse_butterfly_halved(column(input, 64 * block + n, 16), w, &mut pass);
            put(out, 64 * block + 4 * n, 1, y);
        }
    }
    pass
}

/// Final inverse stage, radix 8, no twiddles, scale 1/2: the taps `tap_at(position) + 64 l` in the order of
/// [`COLUMNS`]. The level set before the transform bounds every intermediate value (see [`super::level`]); were it
/// broken, the result would saturate, not wrap.
pub(crate) fn final_taps(kept: &Channel, position: usize) -> [Iq; 8] {
    let unbounded = &mut 0;
    let at = |slot: usize| kept[(64 * slot + position) & 511];
    let g = inverse_half([at(0), at(1), at(2), at(3)]);
    let h = inverse_half([at(4), at(5), at(6), at(7)]);
    // h_l exp(+j pi l / 4), l = 0..3; exp(+j 3 pi/4) = j exp(+j pi/4).
    let h1 = h[1].full_product(MINUS_EIGHTH, unbounded);
    let h3 = h[3].full_product(MINUS_EIGHTH, unbounded);
    [
        g[0].saturating_add(h[0], unbounded),
        g[0].saturating_sub(h[0], unbounded),
        g[1].saturating_add(h1, unbounded),
        g[1].saturating_sub(h1, unbounded),
        g[2].saturating_add_j(h[2], unbounded),
        g[2].saturating_sub_j(h[2], unbounded),
        g[3].saturating_add_j(h3, unbounded),
        g[3].saturating_sub_j(h3, unbounded),
    ]
}

/// Final inverse stage of a channel: its taps in natural order, and their powers added to `powers`.
pub(crate) fn taps(kept: &Channel, out: &mut Channel, powers: &mut Powers) {
    for (position, row) in powers.iter_mut().enumerate() {
        let columns = COLUMNS.into_iter().zip(row);
        for ((column, sum), tap) in columns.zip(final_taps(kept, position)) {
            out[(tap_at(position) + 64 * column) & 511] = tap;
            *sum += u64::from(tap.power());
        }
    }
}

/// As [`taps`] for the even bins (`kept` holds them in its first half).
pub(crate) fn taps_folded(kept: &Channel, out: &mut FoldedChannel, powers: &mut FoldedPowers) {
    for (position, row) in powers.iter_mut().enumerate() {
        let [g0, g1, g2, g3] = inverse_half(core::array::from_fn(|slot| kept[(64 * slot + position) & 511]));
        let columns = FOLDED_COLUMNS.into_iter().zip(row);
        for ((column, sum), tap) in columns.zip([g0, g2, g1, g3]) {
            out[(tap_at(position) + 64 * column) & 255] = tap;
            *sum += u64::from(tap.power());
        }
    }
}

/// Bits behind the point of the amplitudes in [`cancel`]'s columns.
pub(crate) const FRACTION_BITS: i32 = 8;

/// Takes the sum of some models out of a stretch of a channel's taps, or adds it, saturating, and keeps `powers`, the sum of
/// |tap|^2 over channels, in step. A model is a column of complex amplitudes, [`FRACTION_BITS`] behind the point, times a
/// phase factor (Q15, parts within +-32 767); `columns` holds one amplitude of every model for each tap. The sum is rounded
/// once, half up, and limited to int16: the same integers are subtracted and added, so that adding undoes subtracting unless
/// a tap saturates.
pub(crate) fn cancel(taps: &mut [Iq], powers: &mut [u64], columns: &[[i32; 2]], phases: &[Iq], add: bool) {
    // A product drops one bit: Q15 times 2^-16.
    const BITS: i32 = FRACTION_BITS - 1;
    let limited = |x: i32| (x >> BITS).clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16;
    let rows = taps.iter_mut().zip(powers);
    for ((tap, power), amplitudes) in rows.zip(columns.chunks_exact(phases.len().max(1))) {
        let (mut re, mut im) = (1 << (BITS - 1), 1 << (BITS - 1));
        for ([x, y], w) in amplitudes.iter().zip(phases) {
            re = high(*x, w.re()).wrapping_add(re);
            im = high(*x, w.im()).wrapping_add(im);
            re = high(*y, -w.im()).wrapping_add(re);
            im = high(*y, w.re()).wrapping_add(im);
        }
        let (old, model, unbounded) = (*tap, Iq::new(limited(re), limited(im)), &mut 0);
        let new = if add {
            old.saturating_add(model, unbounded)
        } else {
            old.saturating_sub(model, unbounded)
        };
        *tap = new;
        *power = power
            .wrapping_add(u64::from(new.power()))
            .wrapping_sub(u64::from(old.power()));
    }
}

/// `x w / 2^16`, floor (SMULWB).
fn high(x: i32, w: i16) -> i32 {
    ((i64::from(x) * i64::from(w)) >> 16) as i32
}

/// Sum of |x|^2 over a channel, at most 2^40.
pub(crate) fn energy(input: &Channel) -> u64 {
    input.iter().map(|x| u64::from(x.power())).sum()
}
