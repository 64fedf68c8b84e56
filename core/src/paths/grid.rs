//! Coarse search of the direction: four spatial transforms and a table of where each direction falls in them.
//!
//! The directions lie on rings of constant zenith, one step apart. For each of them the table holds, per array, the bin
//! of a 32-point transform over the elements; their powers add up without phases between arrays (docs/signal-model.md, "Path estimation").
//! Directions themselves are computed when one is asked for: the table is all that the grid keeps.

mod planar;

use nalgebra::{Complex, Vector3};

use super::model::{ArrayModel, steering};
use crate::array::MOST_ARRAYS;
use crate::signal::{phasor, round_half_up};

/// Bins over one turn per element.
/// Derived: the nearest bin loses at most 0.06 dB with eight elements.
const BINS: usize = 32;
/// Step of the grid, degrees; divides 180.
/// Capacity: memory and work of the grid; a fit follows.
const STEP_DEG: usize = 4;
/// Derived: both poles included.
const RINGS: usize = 180 / STEP_DEG + 1;
/// Directions of the grid: 4 pi over the square of the step, rounded ring by ring.
pub(super) const DIRECTIONS: usize = directions();

/// Directions on a ring.
const fn on_ring(ring: usize) -> usize {
    // 90 sin(zenith) by Bhaskara's rational form of the sine, good to 0.2 %: a constant function has no sine.
    let x = (ring * STEP_DEG) as f64;
    let sine = 4.0 * x * (180.0 - x) / (40_500.0 - x * (180.0 - x));
    let count = (360 / STEP_DEG) as f64 * sine + 0.5;
    if count < 1.0 { 1 } else { count as usize }
}

const fn directions() -> usize {
    let (mut sum, mut ring) = (0, 0);
    while ring < RINGS {
        sum += on_ring(ring);
        ring += 1;
    }
    sum
}

/// Directions that one bound serves.
/// Capacity: work of the grid's bounds.
const GROUP: usize = 3;
/// Bins by which neighbours in the table differ at most.
/// Derived: a step along a ring or into the next one is 5.7 degrees at most, 1.6 bins, and each place is rounded.
const NEAR: usize = 2;
/// What a projection must leave of the grid's steering, as a share: under it an array cannot tell two directions apart.
/// Numerical: a guard of a division.
const LEAST_LEFT: f32 = 0.1;

/// Table of the grid for `A` arrays.
#[derive(Clone, Debug)]
pub(super) struct AngleGrid<const A: usize> {
    bins: [[u8; A]; DIRECTIONS],
    /// Whether the arrays are the rows of a planar one.
    planar: bool,
    /// `exp(-j 2 pi b / 32)`.
    roots: [Complex<f32>; BINS],
}

impl<const A: usize> AngleGrid<A> {
    #[cfg(test)]
    pub(super) fn new<const E: usize>(model: &ArrayModel<A, E>) -> Self {
        let mut grid = Self::blank();
        grid.fill(model);
        grid
    }

    /// A table of no arrays, to be filled where it lies.
    pub(super) const fn blank() -> Self {
        Self {
            bins: [[0; A]; DIRECTIONS],
            planar: false,
            roots: [Complex::new(0.0, 0.0); BINS],
        }
    }

    /// Computes the table of the model's arrays.
    pub(super) fn fill<const E: usize>(&mut self, model: &ArrayModel<A, E>) {
        let places = (0..RINGS).flat_map(|ring| (0..on_ring(ring)).map(move |i| direction_of(ring, i)));
        for (row, u) in self.bins.iter_mut().zip(places) {
            *row = match (model.planar(), model.steps().first()) {
                (Some(planar), Some(step)) => planar::bins_of(step, planar, &u),
                _ => model
                    .steps()
                    .map(|step| (round_half_up(BINS as f32 * step.dot(&u)) & (BINS as i32 - 1)) as u8),
            };
        }
        self.planar = model.planar().is_some();
        self.roots = core::array::from_fn(|b| phasor(-(b as f32) / BINS as f32));
    }

    /// Direction of the grid that explains most of `snapshot`, one complex value per channel.
    pub(super) fn strongest<const E: usize, const C: usize>(
        &self,
        snapshot: &[Complex<f32>; C],
    ) -> Vector3<f32> {
        if self.is_planar() {
            return self.scan_plane(&self.spectrum_of_plane::<E, C>(snapshot)).0;
        }
        self.scan(&self.spectra::<E, C>(snapshot)).0
    }

    /// The same, unless all that it explains is less than `least` (sum over the channels of the squared amplitude).
    pub(super) fn promising<const E: usize, const C: usize>(
        &self,
        snapshot: &[Complex<f32>; C],
        least: f32,
    ) -> Option<Vector3<f32>> {
        let least = E as f32 * least;
        if self.is_planar() {
            let (u, power) = self.scan_plane(&self.spectrum_of_plane::<E, C>(snapshot));
            return (power >= least).then_some(u);
        }
        let powers = self.spectra::<E, C>(snapshot);
        // Each array by itself, whatever direction that asks for.
        let most: f32 = powers
            .iter()
            .map(|row| row.iter().copied().fold(0.0, f32::max))
            .sum();
        if most < least {
            return None;
        }
        let (u, sum) = self.scan(&powers);
        (sum >= least).then_some(u)
    }

    /// Whether the arrays are the rows of a planar one, of which there are more than arrays stand around a body.
    fn is_planar(&self) -> bool {
        A > MOST_ARRAYS && self.planar
    }

    /// Powers of each array's transform over its elements.
    fn spectra<const E: usize, const C: usize>(&self, snapshot: &[Complex<f32>; C]) -> [[f32; BINS]; A] {
        const { assert!(C == A * E) };
        let mut powers = [[0.0; BINS]; A];
        for (powers, elements) in powers.iter_mut().zip(snapshot.as_chunks::<E>().0) {
            if let ([elements], []) = elements.as_chunks::<8>() {
                self.spectrum(elements, powers);
            } else {
                for (bin, power) in powers.iter_mut().enumerate() {
                    *power = self.sum(elements, bin).norm_sqr();
                }
            }
        }
        powers
    }

    /// Powers of all bins for eight elements: bins four apart are an eight-point transform.
    fn spectrum(&self, elements: &[Complex<f32>; 8], powers: &mut [f32; BINS]) {
        for first in 0..BINS / 8 {
            let turned = core::array::from_fn(|i| elements[i] * self.roots[(first * i) & (BINS - 1)]);
            for (power, bin) in powers
                .iter_mut()
                .skip(first)
                .step_by(BINS / 8)
                .zip(eight_points(&turned))
            {
                *power = bin.norm_sqr();
            }
        }
    }

    /// Two directions of the same delay that explain most of `snapshot` together, by alternating projection: each is
    /// searched with the other one's steering projected out of snapshot and grid, in turn.
    pub(super) fn strongest_pair<const E: usize, const C: usize>(
        &self,
        model: &ArrayModel<A, E>,
        snapshot: &[Complex<f32>; C],
    ) -> [Vector3<f32>; 2] {
        /// Capacity: work of a search; the second turn changes little.
        const TURNS: usize = 3;
        let mut first = self.strongest::<E, C>(snapshot);
        let mut second = self.beside::<E, C>(model, snapshot, &first);
        for _ in 1..TURNS {
            first = self.beside::<E, C>(model, snapshot, &second);
            second = self.beside::<E, C>(model, snapshot, &first);
        }
        [first, second]
    }

    /// Direction that explains most of what a path from `other` leaves.
    fn beside<const E: usize, const C: usize>(
        &self,
        model: &ArrayModel<A, E>,
        snapshot: &[Complex<f32>; C],
        other: &Vector3<f32>,
    ) -> Vector3<f32> {
        const { assert!(C == A * E) };
        if let Some(planar) = model.planar() {
            return self
                .scan_plane(&self.spectrum_beside(model, planar, snapshot, other))
                .0;
        }
        let mut powers = [[0.0; BINS]; A];
        let arrays = model.steps().iter().zip(snapshot.as_chunks::<E>().0);
        for (powers, (step, elements)) in powers.iter_mut().zip(arrays) {
            let steering = steering::<E>(step.dot(other));
            let mut gain = Complex::new(0.0, 0.0);
            for (x, s) in elements.iter().zip(&steering) {
                gain += s.conj() * x / E as f32;
            }
            let rest: [Complex<f32>; E] = core::array::from_fn(|i| elements[i] - steering[i] * gain);
            for (bin, power) in powers.iter_mut().enumerate() {
                // What the projection leaves of the grid's steering; under a tenth of it, the array cannot tell the two apart.
                let left = E as f32 - self.sum(&steering, bin).norm_sqr() / E as f32;
                *power = if left > LEAST_LEFT * E as f32 {
                    self.sum(&rest, bin).norm_sqr() * (E as f32 / left)
                } else {
                    0.0
                };
            }
        }
        self.scan(&powers).0
    }

    /// One bin of the transform over the elements of an array.
    fn sum<const E: usize>(&self, elements: &[Complex<f32>; E], bin: usize) -> Complex<f32> {
        let mut sum = Complex::new(0.0, 0.0);
        for (i, x) in elements.iter().enumerate() {
            sum += x * self.roots[(bin * i) & (BINS - 1)];
        }
        sum
    }

    /// Direction with the largest sum of its bins' powers, the first of equals, and that sum. Neighbours in the table lie within [`NEAR`] bins
    /// of each other, so one look at the largest powers near a direction bounds it and both its neighbours, and most need
    /// no look of their own.
    fn scan(&self, powers: &[[f32; BINS]; A]) -> (Vector3<f32>, f32) {
        let upper = powers.each_ref().map(widened);
        let (mut bounds, mut promising) = ([0.0; DIRECTIONS.div_ceil(GROUP)], (0, -1.0));
        for (group, (bound, members)) in bounds.iter_mut().zip(self.bins.chunks(GROUP)).enumerate() {
            let middle = members.get(1).or(members.first());
            *bound = middle.map_or(0.0, |bins| total(&upper, bins));
            if *bound > promising.1 {
                promising = (group, *bound);
            }
        }
        let members = self.bins.chunks(GROUP).nth(promising.0).unwrap_or(&[]);
        let reached = members.iter().map(|bins| total(powers, bins)).fold(0.0, f32::max);
        // A little less than what the most promising group reaches: the best one exceeds it.
        let (mut best, mut most) = (0, 0.999 * reached);
        for (group, (bound, members)) in bounds.iter().zip(self.bins.chunks(GROUP)).enumerate() {
            if *bound > most {
                for (i, bins) in members.iter().enumerate() {
                    let sum = total(powers, bins);
                    if sum > most {
                        (best, most) = (GROUP * group + i, sum);
                    }
                }
            }
        }
        (direction(best), most)
    }
}

/// Eight-point transform.
fn eight_points(x: &[Complex<f32>; 8]) -> [Complex<f32>; 8] {
    let minus_j = |z: Complex<f32>| Complex::new(z.im, -z.re);
    let four = |a: Complex<f32>, b: Complex<f32>, c: Complex<f32>, d: Complex<f32>| {
        let (s, t, u, v) = (a + c, a - c, b + d, minus_j(b - d));
        [s + u, t + v, s - u, t - v]
    };
    let even = four(x[0], x[2], x[4], x[6]);
    let [o0, o1, o2, o3] = four(x[1], x[3], x[5], x[7]);
    // exp(-j pi/4) = (1 - j) / sqrt(2), exp(-j 3 pi/4) = -j of it.
    let eighth = |z: Complex<f32>| Complex::new(z.re + z.im, z.im - z.re) * core::f32::consts::FRAC_1_SQRT_2;
    let odd = [o0, eighth(o1), minus_j(o2), minus_j(eighth(o3))];
    core::array::from_fn(|k| {
        if k < 4 {
            even[k] + odd[k]
        } else {
            even[k - 4] - odd[k - 4]
        }
    })
}

/// Sum of the powers in one bin of each array.
fn total<const A: usize>(powers: &[[f32; BINS]; A], bins: &[u8; A]) -> f32 {
    let mut sum = 0.0;
    for (powers, bin) in powers.iter().zip(bins) {
        sum += powers[usize::from(*bin) & (BINS - 1)];
    }
    sum
}

/// The largest power within [`NEAR`] bins of each.
fn widened(powers: &[f32; BINS]) -> [f32; BINS] {
    let at = |bin: usize| powers[bin & (BINS - 1)];
    let pairs: [f32; BINS] = core::array::from_fn(|bin| at(bin).max(at(bin + 1)));
    let pair = |bin: usize| pairs[bin & (BINS - 1)];
    // Pairs from bin - 2, from bin, and the bin two above.
    core::array::from_fn(|bin| pair(bin + BINS - NEAR).max(pair(bin)).max(at(bin + NEAR)))
}

/// Direction of a grid index; the last one's for an index beyond the grid.
fn direction(index: usize) -> Vector3<f32> {
    let mut rest = index;
    for ring in 0..RINGS {
        let count = on_ring(ring);
        if rest < count {
            return direction_of(ring, rest);
        }
        rest -= count;
    }
    -Vector3::z()
}

fn direction_of(ring: usize, i: usize) -> Vector3<f32> {
    let zenith = phasor((ring * STEP_DEG) as f32 / 360.0);
    let azimuth = phasor(i as f32 / on_ring(ring) as f32);
    Vector3::new(zenith.im * azimuth.re, zenith.im * azimuth.im, zenith.re)
}

#[cfg(test)]
mod tests;
