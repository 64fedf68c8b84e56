//! Cancellation: takes a fitted path out of the taps, or puts it back.
//!
//! The band is rectangular, so a path's kernel decays with 1/|x| only: it is cancelled, not windowed away
//! (docs/signal-model.md, "Path estimation"). How far depends on its strength: up to where its sidelobes fall [`MARGIN`] in amplitude under the noise.
//! Taps are int16 and stay so; each subtraction rounds once, half up, which adds 0.3 LSB of noise to taps that already
//! carry 1.1 LSB from the transform (docs/signal-model.md, "Fixed point"). The power-delay profile is updated with exactly the integers
//! that changed, so it stays the sum of the taps' powers.

use nalgebra::{Complex, Vector3};

use super::model::{ArrayModel, place, steering};
use super::template::{SPAN, Template};
use crate::kernels::stage::Stages;
use crate::kernels::stages::{Channel, FRACTION_BITS};
use crate::kernels::{Iq, Native};
use crate::signal::{SAMPLES, phasor};

/// Sidelobes are cancelled down to a third of the noise amplitude.
/// Derived: what is left of them then holds 3.6 noise variances in all channels, a tenth of what a path must.
const MARGIN: f32 = 3.0;
/// Taps on both sides that are always cancelled.
/// Capacity: work of a cancellation.
const LEAST: usize = 8;

/// A path as it is cancelled.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source<const A: usize> {
    /// Tap to which delay and phase refer.
    pub(super) origin: usize,
    /// Delay at the body origin, taps from the origin.
    pub(super) delay_taps: f32,
    pub(super) u: Vector3<f32>,
    /// Gains at the arrays, LSB.
    pub(super) gains: [Complex<f32>; A],
}

impl<const A: usize> Source<A> {
    /// Mean power over the arrays, squared LSB of a tap.
    pub(super) fn power(&self) -> f32 {
        self.gains.iter().map(|g| g.norm_sqr()).sum::<f32>() / A as f32
    }

    /// Delay in taps from another origin, the shorter way round the period.
    pub(super) fn delay_from(&self, origin: usize) -> f32 {
        self.delay_taps + taps_between(origin, self.origin)
    }

    /// Delay from another origin, and the gains with their phase referred to it.
    pub(super) fn seen_from(&self, origin: usize, centre_turns: f32) -> (f32, [Complex<f32>; A]) {
        let delay = self.delay_from(origin);
        let turn = phasor(-centre_turns * (delay - self.delay_taps));
        (delay, self.gains.map(|g| g * turn))
    }

    /// Largest amplitude at any array, LSB of a tap.
    pub(super) fn amplitude(&self) -> f32 {
        libm::sqrtf(self.gains.iter().map(|g| g.norm_sqr()).fold(0.0, f32::max))
    }

    /// Amplitude of a source whose sidelobes are nowhere weaker than those of the difference to `other`: gains that differ, kernels that are
    /// shifted, and outermost elements whose phase turns.
    pub(super) fn difference<const E: usize>(
        &self,
        other: &Self,
        model: &ArrayModel<A, E>,
        template: &Template,
    ) -> f32 {
        use core::f32::consts::{PI, TAU};
        let (delay, gains) = other.seen_from(self.origin, template.centre_turns());
        let turned = (self.u - other.u).norm();
        let mut most = 0.0_f32;
        for ((step, lead), (new, old)) in model.arrays().zip(self.gains.iter().zip(&gains)) {
            let shifted = (self.delay_taps - delay).abs() + lead.norm() * turned;
            let phase = TAU * step.norm() * place::<E>(E - 1) * turned;
            let relative = PI * template.occupancy() * shifted + phase;
            most = most.max(libm::sqrtf((new - old).norm_sqr()) + relative * libm::sqrtf(old.norm_sqr()));
        }
        most
    }
}

/// Taps on both sides over which a path of this amplitude stands out of the noise.
pub(super) fn reach(amplitude: f32, noise: f32, occupancy: f32) -> usize {
    let ratio = amplitude / libm::sqrtf(noise.max(f32::MIN_POSITIVE));
    reach_of::<SAMPLES>(MARGIN * ratio, occupancy)
}

/// Taps of a period of `N`, on both sides, at which sidelobes are over `1 / ratio` of the peak.
pub(super) fn reach_of<const N: usize>(ratio: f32, occupancy: f32) -> usize {
    // |D(x)| <= 1 / (pi occupancy x) up to a quarter of the period, and less than twice that beyond.
    let reach = ratio / (core::f32::consts::PI * occupancy);
    (reach.min(N as f32) as usize).clamp(LEAST, N / 2)
}

/// Taps from one origin to another, the shorter way round the period.
pub(super) fn taps_between(from: usize, to: usize) -> f32 {
    let half = SAMPLES / 2;
    let between = to.wrapping_sub(from).wrapping_add(half) & (SAMPLES - 1);
    between as f32 - half as f32
}

/// Subtract or add back.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Change {
    Subtract,
    Add,
}

/// Changes the taps by the sum of the sources' models and keeps `profile` in step. Close sources of opposite phase are
/// larger than their sum, which is what fits int16: they must go together. `reach`: taps on both sides of the first source's origin
/// ([`reach`]). Returns over how many taps.
#[inline(never)]
pub(super) fn change<const L: usize, const A: usize, const E: usize, const C: usize>(
    model: &ArrayModel<A, E>,
    template: &Template,
    taps: &mut [Channel; C],
    profile: &mut [u64; SAMPLES],
    sources: &[Source<A>; L],
    reach: usize,
    change: Change,
) -> usize {
    const { assert!(C == A * E && L > 0) };
    let origin = sources[0].origin;
    // The whole period once: from -256 to 255.
    let count = (2 * reach + 1).min(SAMPLES);
    let first = -(reach as i32);
    // In two stretches where it runs over the period's end.
    let start = origin.wrapping_sub(reach) & (SAMPLES - 1);
    let ahead = count.min(SAMPLES - start);
    let mut columns = [[[0_i32; 2]; L]; SAMPLES];
    for (j, ((step, lead), rows)) in model.arrays().zip(taps.as_chunks_mut::<E>().0).enumerate() {
        for (l, source) in sources.iter().enumerate() {
            let (away, gain) = source.seen_from(origin, template.centre_turns());
            let delay = away - lead.dot(&source.u);
            let scaled = gain.get(j).copied().unwrap_or_default() * (1 << FRACTION_BITS) as f32;
            let column = columns.as_flattened_mut().get_mut(l..).unwrap_or_default();
            fill(template, first, count, delay, scaled, (column, L));
        }
        let phases: [[Iq; E]; L] = sources
            .each_ref()
            .map(|source| steering::<E>(step.dot(&source.u)).map(q15));
        let columns = columns.as_flattened();
        let (before, behind) = columns.split_at_checked(L * ahead).unwrap_or((columns, &[]));
        let behind = behind.get(..L * (count - ahead)).unwrap_or(&[]);
        for (e, row) in rows.iter_mut().enumerate() {
            let phases = phases.each_ref().map(|elements| elements[e]);
            for (at, part) in [(start, before), (0, behind)] {
                if let (Some(taps), Some(powers)) = (row.get_mut(at..), profile.get_mut(at..)) {
                    Native::cancel(taps, powers, part, &phases, change == Change::Add);
                }
            }
        }
    }
    count
}

/// Q15 of a phase factor, parts within +-32 767; the cast cuts towards zero.
pub(super) fn q15(s: Complex<f32>) -> Iq {
    let part = |x: f32| (x * 32_768.0).clamp(-32_767.0, 32_767.0) as i16;
    Iq::new(part(s.re), part(s.im))
}

/// Fills a column with the kernel times `gain`, cut to integers, at coordinates `first`, `first + 1`, ..., `count` of them: from the table near
/// the peak, by the closed form beyond, band centre put back. Phases advance by products, anew on each side of the peak and around
/// it: their rounding stays under 3e-5 of values that are a fortieth of the peak at most. The column is every so-manyth value, from the
/// first one on. Of one kind for all numbers of sources: flash is short.
#[inline(never)]
pub(super) fn fill(
    template: &Template,
    first: i32,
    count: usize,
    delay: f32,
    gain: Complex<f32>,
    (column, stride): (&mut [[i32; 2]], usize),
) {
    let mut column = column
        .chunks_mut(stride.max(1))
        .filter_map(|row| row.first_mut())
        .take(count);
    let place = |tap: usize| (first + tap as i32) as f32 - delay;
    // As many taps as lie further ahead of the peak than the table reaches, and as many as do not lie as far behind it: the casts
    // cut towards zero and give 0 below it.
    let ahead = (((1 - NEAR - first) as f32 + delay) as usize).min(count);
    let mut near = [[0.0; 2]; 2 * NEAR as usize];
    let behind = (((1 + NEAR - first) as f32 + delay) as usize)
        .min(ahead + near.len())
        .min(count)
        .max(ahead);
    let centre = template.centre_turns();
    let turned = |tap: usize| gain * phasor(centre * (first + tap as i32) as f32);
    far(template, place(0), ahead, turned(0), &mut column);
    template.row(place(ahead), &mut near);
    let (mut here, step) = (turned(ahead), phasor(centre));
    for ([d, _], value) in near.iter().take(behind - ahead).zip(&mut column) {
        *value = [(here.re * d) as i32, (here.im * d) as i32];
        here *= step;
    }
    far(
        template,
        place(behind),
        count - behind,
        turned(behind),
        &mut column,
    );
}

/// Taps to either side of the peak that come from the table.
const NEAR: i32 = SPAN as i32 - 1;

/// The kernel by its closed form, `D(x) = sin(pi Na x / N) / (Na sin(pi x / N))`, at `x`, `x + 1`, ..., `count` of them, times a gain
/// that the band's centre turns from tap to tap.
#[inline(always)]
fn far<'a>(
    template: &Template,
    x: f32,
    count: usize,
    gain: Complex<f32>,
    column: &mut impl Iterator<Item = &'a mut [i32; 2]>,
) {
    if count == 0 {
        return;
    }
    // Half turns per tap of the two sines.
    let (band_step, period_step) = (0.5 * template.occupancy(), 0.5 / template.period());
    let (band, band_turn) = (phasor(band_step * x), phasor(band_step));
    let (mut band, mut before, twice) = (band.im, (band * band_turn.conj()).im, 2.0 * band_turn.re);
    let (mut period, period_turn) = (phasor(period_step * x), phasor(period_step));
    let (mut here, step) = (gain / template.active(), phasor(template.centre_turns()));
    for value in column.take(count) {
        let d = band / period.im;
        *value = [(here.re * d) as i32, (here.im * d) as i32];
        here *= step;
        period *= period_turn;
        // sin(a + b) + sin(a - b) = 2 cos(b) sin(a).
        (before, band) = (band, twice * band - before);
    }
}

#[cfg(test)]
mod tests;
