//! The same search over the elements of a planar array: one transform over rows and columns, and only what is before the array.

use nalgebra::{Complex, Vector3};

use super::{AngleGrid, BINS, LEAST_LEFT, direction};
use crate::paths::model::{ArrayModel, Planar, steering};
use crate::signal::round_half_up;

/// Bin of a direction that the array does not hear.
/// Given: no bin of the transform.
const BEHIND: u8 = u8::MAX;

/// Powers by the bin along the rows, then by that along the columns, in the units of [`AngleGrid::scan`].
pub(super) type Spectrum = [[f32; BINS]; BINS];

/// Bins of a direction along rows and columns, in the first two places.
pub(super) fn bins_of<const A: usize>(step: &Vector3<f32>, planar: &Planar, u: &Vector3<f32>) -> [u8; A] {
    let bin = |turns: f32| (round_half_up(BINS as f32 * turns) & (BINS as i32 - 1)) as u8;
    let mut bins = [BEHIND; A];
    if planar.normal.dot(u) > 0.0 {
        for (slot, turns) in bins.iter_mut().zip([step, &planar.row_turns]) {
            *slot = bin(turns.dot(u));
        }
    }
    bins
}

impl<const A: usize> AngleGrid<A> {
    /// Powers of the transform over all elements, over the number of rows.
    pub(super) fn spectrum_of_plane<const E: usize, const C: usize>(
        &self,
        snapshot: &[Complex<f32>; C],
    ) -> Spectrum {
        self.transform(snapshot.as_chunks::<E>().0, |power, _, _| power / A as f32)
    }

    /// The same of what a path from `other` leaves, over what that leaves of the grid's own steering.
    pub(super) fn spectrum_beside<const E: usize, const C: usize>(
        &self,
        model: &ArrayModel<A, E>,
        planar: &Planar,
        snapshot: &[Complex<f32>; C],
        other: &Vector3<f32>,
    ) -> Spectrum {
        let along_row = model.steps().first().map_or(0.0, |step| step.dot(other));
        let row = steering::<E>(along_row);
        let column = steering::<A>(planar.row_turns.dot(other));
        let count = (A * E) as f32;
        let mut gain = Complex::new(0.0, 0.0);
        for (elements, c) in snapshot.as_chunks::<E>().0.iter().zip(&column) {
            for (x, r) in elements.iter().zip(&row) {
                gain += (r * c).conj() * x / count;
            }
        }
        let mut rest = [[Complex::new(0.0, 0.0); E]; A];
        let rows = snapshot.as_chunks::<E>().0.iter().zip(&column);
        for (rest, (elements, c)) in rest.iter_mut().zip(rows) {
            for (rest, (x, r)) in rest.iter_mut().zip(elements.iter().zip(&row)) {
                *rest = x - r * c * gain;
            }
        }
        let [of_row, of_column] = [self.powers_of(&row), self.powers_of(&column)];
        self.transform(&rest, |power, b, d| {
            let left = count - of_row[b] * of_column[d] / count;
            if left > LEAST_LEFT * count {
                power * E as f32 / left
            } else {
                0.0
            }
        })
    }

    /// Direction with the largest power of those before the array, the first of equals, and that power.
    pub(super) fn scan_plane(&self, powers: &Spectrum) -> (Vector3<f32>, f32) {
        let (mut best, mut most) = (0, -1.0);
        for (index, bins) in self.bins.iter().enumerate() {
            let mut both = bins.iter().map(|bin| usize::from(*bin));
            let row = both.next().and_then(|bin| powers.get(bin));
            let power = row.zip(both.next()).and_then(|(row, bin)| row.get(bin));
            if let Some(power) = power.filter(|power| **power > most) {
                (best, most) = (index, *power);
            }
        }
        (direction(best), most)
    }

    /// Powers of all bins of the transform over rows and columns, each made into what it counts for.
    fn transform<const E: usize>(
        &self,
        rows: &[[Complex<f32>; E]],
        worth: impl Fn(f32, usize, usize) -> f32,
    ) -> Spectrum {
        let mut powers = [[0.0; BINS]; BINS];
        for (b, powers) in powers.iter_mut().enumerate() {
            let mut sums = [Complex::new(0.0, 0.0); A];
            for (sum, elements) in sums.iter_mut().zip(rows) {
                *sum = self.sum(elements, b);
            }
            for (d, power) in powers.iter_mut().enumerate() {
                *power = worth(self.sum(&sums, d).norm_sqr(), b, d);
            }
        }
        powers
    }

    fn powers_of<const N: usize>(&self, elements: &[Complex<f32>; N]) -> [f32; BINS] {
        core::array::from_fn(|bin| self.sum(elements, bin).norm_sqr())
    }
}
