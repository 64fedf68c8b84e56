//! Known paths held against a beam: matched filters, least squares of them all together, and what is found taken out.

use nalgebra::Complex;

use super::{FITTED, Known};
use crate::kernels::Native;
use crate::kernels::stage::Stages;
use crate::kernels::stages::FRACTION_BITS;
use crate::paths::cancel::{fill, q15, reach_of};
use crate::paths::model::{ArrayModel, steering};
use crate::paths::template::Template;
use crate::signal::{FOLDED_TAPS, Folded, phasor};

/// Taps of the matched filter on both sides of a path.
/// Derived: as in the fit ([`crate::paths::fit::REACH`]).
const REACH: usize = 6;
const WINDOW: usize = 2 * REACH + 1;

/// Sidelobes are cancelled down to a quarter of the amplitude asked for.
/// Derived: what is left of them lies 12 dB under a path at the floor.
const MARGIN: f32 = 4.0;

/// Load on the diagonal of the joint fit.
/// Numerical: two paths that a beam cannot tell apart share what is there.
const LOAD: f32 = 1e-3;

/// A known path held against a beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Match<const A: usize, const E: usize> {
    /// Place of the path among those known.
    pub(super) index: usize,
    /// Folded tap below its delay at the body origin.
    origin: usize,
    /// Delay at each array, taps from tap 0.
    delays: [f32; A],
    steering: [[Complex<f32>; E]; A],
    /// Gain at each array, folded; phase reference is tap 0.
    gains: [Complex<f32>; A],
}

impl<const A: usize, const E: usize> Match<A, E> {
    /// Matched filters: the gains as if nothing else were there.
    pub(super) fn new(
        model: &ArrayModel<A, E>,
        template: &Template,
        channels: &[u8],
        folded: &Folded<'_>,
        index: usize,
        known: &Known,
    ) -> Self {
        let mut delay = known.delay_taps;
        if delay >= FOLDED_TAPS as f32 {
            delay -= FOLDED_TAPS as f32;
        }
        let mut found = Self {
            index,
            origin: delay.max(0.0) as usize & (FOLDED_TAPS - 1),
            delays: [delay; A],
            steering: [[Complex::new(0.0, 0.0); E]; A],
            gains: [Complex::new(0.0, 0.0); A],
        };
        let first = found.origin as i32 - REACH as i32;
        let twist: [Complex<f32>; WINDOW] =
            core::array::from_fn(|i| phasor(-template.centre_turns() * (first + i as i32) as f32));
        for (j, (step, lead)) in model.arrays().enumerate() {
            let at_array = delay - lead.dot(&known.u);
            let steering = steering::<E>(step.dot(&known.u));
            let mut kernel = [[0.0; 2]; WINDOW];
            template.row(first as f32 - at_array, &mut kernel);
            let power: f32 = kernel.iter().map(|[value, _]| value * value).sum();
            let weights: [Complex<f32>; WINDOW] = core::array::from_fn(|i| twist[i] * kernel[i][0]);
            let (mut sum, mut count) = (Complex::new(0.0, 0.0), 0.0);
            for (taps, element) in folded.taps.iter().zip(elements::<E>(channels, j)) {
                let Some(element) = element else { continue };
                let mut value = Complex::new(0.0, 0.0);
                for (i, weight) in weights.iter().enumerate() {
                    let tap = taps[first.wrapping_add(i as i32) as usize & (FOLDED_TAPS - 1)];
                    value += weight * Complex::new(f32::from(tap.re()), f32::from(tap.im()));
                }
                sum += value
                    * steering
                        .get(element)
                        .map_or(Complex::new(0.0, 0.0), Complex::conj);
                count += 1.0;
            }
            if let (Some(d), Some(s), Some(g)) = (
                found.delays.get_mut(j),
                found.steering.get_mut(j),
                found.gains.get_mut(j),
            ) {
                (*d, *s, *g) = (at_array, steering, sum / (count * power).max(f32::MIN_POSITIVE));
            }
        }
        found
    }

    /// Sum over the arrays of the gains' squares.
    pub(super) fn power(&self) -> f32 {
        self.gains.iter().map(|g| g.norm_sqr()).sum()
    }

    /// Inner product with another path at an array, one for the path with itself.
    fn overlap(&self, other: &Self, template: &Template, channels: &[u8], array: usize) -> Complex<f32> {
        let (Some(a), Some(b)) = (self.steering.get(array), other.steering.get(array)) else {
            return Complex::new(0.0, 0.0);
        };
        let (mut sum, mut count) = (Complex::new(0.0, 0.0), 0.0);
        for element in elements::<E>(channels, array).flatten() {
            if let (Some(a), Some(b)) = (a.get(element), b.get(element)) {
                sum += a.conj() * b;
                count += 1.0;
            }
        }
        let delay = |path: &Self| path.delays.get(array).copied().unwrap_or(0.0);
        sum * (template.anywhere(delay(self) - delay(other)) / f32::max(count, 1.0))
    }

    /// Cancels the path in the folded taps, as far as it exceeds `power`, the square of a tap, by its sidelobes. Returns over how many taps.
    pub(super) fn take_out(
        &self,
        template: &Template,
        channels: &[u8],
        folded: &mut Folded<'_>,
        power: f32,
    ) -> usize {
        let strongest = self.gains.iter().map(|g| g.norm_sqr()).fold(0.0, f32::max);
        let ratio = strongest / power.max(f32::MIN_POSITIVE);
        let reach = reach_of::<FOLDED_TAPS>(MARGIN * libm::sqrtf(ratio), template.occupancy());
        let count = (2 * reach + 1).min(FOLDED_TAPS);
        let first = self.origin as i32 - reach as i32;
        let start = first as usize & (FOLDED_TAPS - 1);
        let ahead = count.min(FOLDED_TAPS - start);
        let mut columns = [[0_i32; 2]; FOLDED_TAPS];
        for (array, ((delay, gain), steering)) in self
            .delays
            .iter()
            .zip(&self.gains)
            .zip(&self.steering)
            .enumerate()
        {
            let scaled = gain * (1 << FRACTION_BITS) as f32;
            fill(template, first, count, *delay, scaled, (&mut columns, 1));
            let (before, behind) = columns.split_at_checked(ahead).unwrap_or((&columns, &[]));
            let behind = behind.get(..count - ahead).unwrap_or(&[]);
            for (taps, element) in folded.taps.iter_mut().zip(elements::<E>(channels, array)) {
                let Some(phase) = element.and_then(|element| steering.get(element)) else {
                    continue;
                };
                for (at, part) in [(start, before), (0, behind)] {
                    if let (Some(taps), Some(powers)) = (taps.get_mut(at..), folded.profile.get_mut(at..)) {
                        Native::cancel(taps, powers, part, &[q15(*phase)], false);
                    }
                }
            }
        }
        count
    }
}

/// For each channel its element, where it belongs to an array of `E`.
fn elements<const E: usize>(channels: &[u8], array: usize) -> impl Iterator<Item = Option<usize>> {
    channels
        .iter()
        .map(move |channel| (usize::from(*channel) / E == array).then_some(usize::from(*channel) % E))
}

/// Turns the matched filters' outputs at one array into gains: least squares for all paths together.
pub(super) fn separate<const A: usize, const E: usize>(
    template: &Template,
    channels: &[u8],
    array: usize,
    matches: &mut [Match<A, E>],
) {
    if matches.len() < 2 {
        return;
    }
    let zero = Complex::new(0.0, 0.0);
    let (mut gram, mut gains) = ([[zero; FITTED]; FITTED], [zero; FITTED]);
    for ((row, gain), a) in gram.iter_mut().zip(&mut gains).zip(matches.iter()) {
        for (value, b) in row.iter_mut().zip(matches.iter()) {
            *value = if core::ptr::eq(a, b) {
                Complex::new(1.0 + LOAD, 0.0)
            } else {
                a.overlap(b, template, channels, array)
            };
        }
        *gain = a.gains.get(array).copied().unwrap_or(zero);
    }
    // Gauss-Jordan: the matrix is positive definite.
    for p in 0..matches.len().min(FITTED) {
        let (row, gain) = (gram[p], gains[p]);
        let inverse = 1.0 / row[p].re.max(LOAD);
        for r in 0..matches.len().min(FITTED) {
            if r != p {
                let factor = gram[r][p] * inverse;
                for s in p..FITTED {
                    gram[r][s] -= factor * row[s];
                }
                gains[r] -= factor * gain;
            }
        }
    }
    for (p, found) in matches.iter_mut().enumerate().take(FITTED) {
        if let Some(gain) = found.gains.get_mut(array) {
            *gain = gains[p] / gram[p][p].re.max(LOAD);
        }
    }
}
