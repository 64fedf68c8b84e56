//! Paths that a sweep has shown already, recognised in a beam from an eighth of the work.
//!
//! One path shows in many beams, most of which see it less well than an earlier one did. Where it lies is known then; what such
//! a beam adds is how strong it is there, for the angle of departure. That much a few channels and the even subcarriers tell:
//! the gains of all known paths are fitted jointly to the folded taps, each path's free gain per array, and the paths are
//! taken out. A beam in which none of them is stronger than ever before, and that shows nothing else, need not be transformed.

use heapless::Vec;
use nalgebra::{Complex, Vector3};

use super::cancel::{fill, q15, reach_of};
use super::effort::{Effort, Work};
use super::model::{ArrayModel, steering};
use super::place::Place;
use super::template::Template;
use crate::kernels::Native;
use crate::kernels::stage::Stages;
use crate::kernels::stages::FRACTION_BITS;
use crate::signal::{FOLDED_CHANNELS, FOLDED_TAPS, Folded, phasor};

/// Paths remembered: the strongest.
/// Capacity: twice what a sweep reports, for pairs and for what a path looks like through a neighbour.
const MOST: usize = 18;
/// Paths fitted to one beam: the strongest in it; what is left of others counts as unknown.
/// Capacity: work of a beam.
pub(super) const FITTED: usize = 10;
/// Gates within which a path is the same one.
/// Derived: 0.4 taps (0.5 m) and 6 degrees, as in the merge.
const GATE_TAPS: f32 = 0.41;
/// Derived: the cosine of 6 degrees, as in the merge.
const GATE_COSINE: f32 = 0.994_5;
/// A peak may be a known path whose delay is this near, taps.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const NEAR_TAPS: f32 = 0.75;
/// Taps of the matched filter on both sides of a path.
/// Derived: as in the fit ([`super::fit::REACH`]).
const REACH: usize = 6;
const WINDOW: usize = 2 * REACH + 1;
/// Paths are taken out when they may hold this share of the energy asked for.
/// Derived: what is left in makes a path at the floor look half a decibel stronger at most.
const SHARE: f32 = 0.125;
/// Power that a path half-way between two taps shows in each.
/// Derived: the square of `sinc(1/2)`, `(2 / pi)^2`.
const HALF_WAY: f32 = 0.4;
/// Sidelobes are cancelled down to a quarter of the amplitude asked for.
/// Derived: what is left of them lies 12 dB under a path at the floor.
const MARGIN: f32 = 4.0;
/// A path is worth another transform where it is stronger than in any beam before by this factor, 1 dB.
/// Tuned: `cslam accuracy`, and `cslam campaign` with tuning seeds (docs/path-estimation.md).
const BETTER: f32 = 1.26;
/// Load on the diagonal of the joint fit.
/// Numerical: two paths that a beam cannot tell apart share what is there.
const LOAD: f32 = 1e-3;

/// A path of this sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    /// Delay at the body origin, taps of the full period.
    pub(super) delay_taps: f32,
    pub(super) u: Vector3<f32>,
    /// Energy in the beam that told most of it, as [`super::merge::Detection::energy`].
    pub(super) energy: f32,
    /// That beam.
    beam: u16,
}

/// What a beam is asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Levels {
    /// Energy of the weakest path worth reporting, squared LSB of a full tap.
    pub(super) floor: f32,
    /// Variance of a full tap, squared LSB.
    pub(super) noise: f32,
    /// Turns energies of the sweep into squared LSB.
    pub(super) to_lsb: f32,
    /// A candidate is a path when its fit explains this many noise variances.
    pub(super) threshold: f32,
}

/// A known path in a beam.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Seen {
    /// Index among the known paths.
    pub(super) index: usize,
    /// Energy, sum over all channels at a tap's peak, squared LSB of a full tap. Noise's share is taken off.
    pub(super) energy: f32,
}

/// The paths of a sweep so far.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownPaths {
    paths: Vec<Known, MOST>,
}

impl KnownPaths {
    pub(super) fn clear(&mut self) {
        self.paths.clear();
    }

    /// The strongest path near a delay, if a beam has shown it with this much energy: its place. Delays are seen from tap
    /// `origin`.
    pub(super) fn near(&self, origin: usize, delay_taps: f32, energy: f32) -> Option<Place> {
        let period = 2.0 * FOLDED_TAPS as f32;
        let away = |known: &Known| {
            let away = known.delay_taps - origin as f32;
            if away < -0.5 * period {
                away + period
            } else if away > 0.5 * period {
                away - period
            } else {
                away
            }
        };
        self.paths
            .iter()
            .filter(|known| known.energy >= energy && (away(known) - delay_taps).abs() < NEAR_TAPS)
            .max_by(|a, b| a.energy.total_cmp(&b.energy))
            .map(|known| Place {
                delay_taps: away(known),
                u: known.u,
            })
    }

    pub(super) fn get(&self, index: usize) -> Option<&Known> {
        self.paths.get(index)
    }

    /// Remembers a path of a beam, its delay in taps within half a period of 0 or within one after it. Where it is known, the beam that shows it best tells where it lies; two paths of one beam
    /// are never the same.
    pub(super) fn learn(&mut self, delay_taps: f32, u: Vector3<f32>, energy: f32, beam: u16) {
        let period = 2.0 * FOLDED_TAPS as f32;
        let delay_taps = if delay_taps < 0.0 {
            delay_taps + period
        } else {
            delay_taps
        };
        let new = Known {
            delay_taps,
            u,
            energy,
            beam,
        };
        let same = self.paths.iter_mut().find(|known| {
            let apart = (known.delay_taps - delay_taps).abs();
            apart.min(period - apart) < GATE_TAPS && known.u.dot(&u) > GATE_COSINE && known.beam != beam
        });
        if let Some(known) = same {
            if energy > known.energy {
                *known = new;
            }
        } else if let Err(new) = self.paths.push(new) {
            let weakest = self.paths.iter_mut().min_by(|a, b| a.energy.total_cmp(&b.energy));
            if let Some(weakest) = weakest.filter(|weakest| weakest.energy < new.energy) {
                *weakest = new;
            }
        }
    }

    /// Finds the known paths in a beam's folded taps, those of `channels` out of the `C` of the arrays, and takes them out, where
    /// they may matter to a search for paths of the floor's energy. None when one of them is stronger by [`BETTER`] than in any
    /// beam before.
    pub(super) fn recognise<const A: usize, const E: usize, const C: usize>(
        &self,
        model: &ArrayModel<A, E>,
        template: &Template,
        channels: &[u8],
        folded: &mut Folded<'_>,
        levels: &Levels,
        effort: &Effort,
    ) -> Option<Vec<Seen, FITTED>> {
        const { assert!(C == A * E) };
        let Levels {
            floor, noise, to_lsb, ..
        } = *levels;
        // Channels, and arrays that have one of them: each as many.
        let count = channels.len().clamp(1, FOLDED_CHANNELS);
        let arrays = count.min(A);
        let each = (count / arrays) as f32;
        // Amplitudes are half as large in the folded taps, and only some channels add up.
        let to_full = 4.0 * C as f32 / count as f32;
        let least = SHARE * floor / to_full;
        // Each array's gain has the noise of its channels' mean, half as strong as in full taps.
        let of_noise = 0.5 * arrays as f32 * noise;
        let mut matches: Vec<Match<A, E>, FITTED> = Vec::new();
        for (index, known) in self.paths.iter().enumerate() {
            // A path half-way between two taps shows 0.4 of its power in each.
            let near = known.delay_taps as usize;
            let power = |n: usize| folded.profile[n & (FOLDED_TAPS - 1)];
            // What no beam has shown over the floor is not expected to matter here: often it is a blend, which a joint fit would
            // set against the paths that it blends. Were it strong here, it would remain.
            if known.energy * to_lsb < floor || (power(near).max(power(near + 1)) as f32) < HALF_WAY * least {
                continue;
            }
            let found = Match::new(model, template, channels, folded, index, known);
            if each * found.power() < least + of_noise {
                continue;
            }
            if let Err(found) = matches.push(found) {
                let weakest = matches.iter_mut().min_by(|a, b| a.power().total_cmp(&b.power()));
                if let Some(weakest) = weakest.filter(|weakest| weakest.power() < found.power()) {
                    *weakest = found;
                }
            }
        }
        for array in 0..A {
            separate(template, channels, array, &mut matches);
        }
        let mut seen = Vec::new();
        for found in &matches {
            let energy = to_full * (each * found.power() - of_noise).max(0.0);
            let before = self
                .paths
                .get(found.index)
                .map_or(0.0, |known| known.energy * to_lsb);
            if energy > floor.max(BETTER * before) {
                return None;
            }
            // As many as matches.
            let _ = seen.push(Seen {
                index: found.index,
                energy,
            });
        }
        let mut taps = 0;
        for found in &matches {
            taps += found.take_out(template, channels, folded, 0.25 * floor / C as f32);
        }
        effort.spend(Work::Recognise {
            paths: matches.len(),
            taps,
        });
        Some(seen)
    }
}

/// A known path held against a beam.
#[derive(Clone, Copy, Debug)]
struct Match<const A: usize, const E: usize> {
    index: usize,
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
    fn new(
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
    fn power(&self) -> f32 {
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
    fn take_out(&self, template: &Template, channels: &[u8], folded: &mut Folded<'_>, power: f32) -> usize {
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
fn separate<const A: usize, const E: usize>(
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

#[cfg(test)]
mod tests;
