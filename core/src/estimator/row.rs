//! One scalar measurement, linearised: a sparse row of the observation matrix with its residual and its variance.

use nalgebra::Vector3;

use crate::geometry::Real;

/// Chi-square of three rows up to which they are believed.
/// Derived: one honest measurement in 5900 is beyond, about one in an hour of sweeps.
pub(super) const BELIEVED_OF_THREE: f64 = 20.0;

/// Most entries of a row.
/// Capacity: the angle of arrival of a double reflection touches position, attitude, 12 calibrations and two planes.
pub const ROW_CAPACITY: usize = 24;

/// Sweeps that the position in sight remembers: over them an error that lasts counts as so many times its variance.
/// Derived: one departure errs by 0.1 m at 50 m, the position in sight by half of that: four of them.
const REMEMBERED_SWEEPS: f64 = 4.0;

/// `z - h(x) = H dx + noise`, with the few entries of `H` that are not zero.
#[derive(Clone, Copy, Debug)]
pub struct Row<T: Real> {
    entries: [(u8, T); ROW_CAPACITY],
    len: usize,
    /// Measurement less prediction.
    pub residual: T,
    /// Variance of the measurement's error.
    pub variance: T,
    /// What it counts for beyond that in an update, because part of it lasts from sweep to sweep.
    lasting: T,
    /// Standard deviation of the residual by what is not known of the measurement's origin.
    origin_sigma: T,
}

impl<T: Real> Row<T> {
    /// A row without entries.
    pub fn new(residual: f64, variance: f64) -> Self {
        Self {
            entries: [(0, T::zero()); ROW_CAPACITY],
            len: 0,
            residual: T::of(residual),
            variance: T::of(variance),
            lasting: T::zero(),
            origin_sigma: T::zero(),
        }
    }

    /// So much of the variance is of an error that the next sweeps have in common. An update takes it for one that is new each time,
    /// and as much larger as it does not average out.
    #[must_use]
    pub fn with_lasting(mut self, variance: f64) -> Self {
        self.lasting = T::of((REMEMBERED_SWEEPS - 1.0) * variance);
        self
    }

    /// Variance of the measurement's error as an update is to take it.
    pub fn update_variance(&self) -> T {
        self.variance + self.lasting
    }

    /// The row of a measurement that is with this `probability` of what the row says, or of the like with another residual, of this `mean` and
    /// `mean_square`, and else of nothing in the state, which has `of_state` of the variance of the residual: the gain is as much smaller, and not
    /// knowing which it is leaves the state as unsure as it should (probabilistic data association: Bar-Shalom and Tse 1975).
    #[must_use]
    pub fn of_origins(mut self, probability: f64, [mean, mean_square]: [f64; 2], of_state: f64) -> Self {
        self.residual = T::of(mean);
        self.variance = T::of((of_state + self.variance.to_f64()) / probability - of_state);
        self.origin_sigma = T::of(libm::sqrt((mean_square / probability - mean * mean).max(0.0)));
        self
    }

    /// Standard deviation of the residual by what is not known of the measurement's origin; 0 where it is of what it seems.
    pub fn origin_sigma(&self) -> T {
        self.origin_sigma
    }

    /// Adds the derivative with respect to one state. A row that is full takes no more: the capacity covers every
    /// measurement of this filter, which a test checks.
    pub fn push(&mut self, state: usize, derivative: f64) {
        if let (Some(entry), Ok(state)) = (self.entries.get_mut(self.len), u8::try_from(state)) {
            *entry = (state, T::of(derivative));
            self.len += 1;
        }
    }

    /// Adds the derivatives with respect to three neighbouring states.
    pub fn push_vector(&mut self, first: usize, derivative: &Vector3<f64>) {
        self.push(first, derivative.x);
        self.push(first + 1, derivative.y);
        self.push(first + 2, derivative.z);
    }

    /// The entries: state and derivative.
    pub fn entries(&self) -> &[(u8, T)] {
        self.entries.get(..self.len).unwrap_or(&[])
    }

    /// `H x` for a state vector.
    pub fn dot<const N: usize>(&self, x: &[T; N]) -> T {
        self.entries().iter().fold(T::zero(), |sum, &(state, h)| {
            sum + x.get(usize::from(state)).map_or(T::zero(), |value| h * *value)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lasts_counts_in_an_update_as_often_as_sweeps_are_remembered_and_in_a_gate_once() {
        let row = Row::<f64>::new(0.0, 4e-6).with_lasting(1e-6);
        assert!((row.variance - 4e-6).abs() < 1e-18);
        assert!((row.update_variance() - 7e-6).abs() < 1e-18);
        let new = Row::<f64>::new(0.0, 4e-6);
        assert!((new.update_variance() - new.variance).abs() < 1e-18);
    }

    #[test]
    fn the_mean_of_what_lasts_is_claimed_as_it_errs() {
        // Four readings of a constant: the part that they share does not average out, the other does.
        let (white, lasting): (f64, f64) = (3e-6, 1e-6);
        let row = Row::<f64>::new(0.0, white + lasting).with_lasting(lasting);
        let (claimed, errs) = (
            row.update_variance() / REMEMBERED_SWEEPS,
            white / REMEMBERED_SWEEPS + lasting,
        );
        assert!((claimed - errs).abs() < 1e-15);
    }
}
