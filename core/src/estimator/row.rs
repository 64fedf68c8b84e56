//! One scalar measurement, linearised: a sparse row of the observation matrix with its residual and its variance.

use nalgebra::Vector3;

use crate::geometry::Real;

/// Chi-square of three rows up to which they are believed.
/// Derived: one honest measurement in 5900 is beyond, about one in an hour of sweeps.
pub(super) const BELIEVED_OF_THREE: f64 = 20.0;

/// Most entries of a row.
/// Capacity: the angle of arrival of a double reflection touches position, attitude, 12 calibrations and two planes.
pub const ROW_CAPACITY: usize = 24;

/// `z - h(x) = H dx + noise`, with the few entries of `H` that are not zero.
#[derive(Clone, Copy, Debug)]
pub struct Row<T: Real> {
    entries: [(u8, T); ROW_CAPACITY],
    len: usize,
    /// Measurement less prediction.
    pub residual: T,
    /// Variance of the measurement noise.
    pub variance: T,
}

impl<T: Real> Row<T> {
    /// A row without entries.
    pub fn new(residual: f64, variance: f64) -> Self {
        Self {
            entries: [(0, T::zero()); ROW_CAPACITY],
            len: 0,
            residual: T::of(residual),
            variance: T::of(variance),
        }
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
