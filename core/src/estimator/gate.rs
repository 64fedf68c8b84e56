//! Whether a path is believed: joint chi-square of its rows.
//!
//! All rows of a path stand or fall together: a wrong path is wrong in all of them (docs/localization.md, "What it believes").

use super::covariance::Covariance;
use super::measurement::PATH_ROWS;
use super::row::Row;
use crate::geometry::Real;

/// Joint chi-square of the rows about the prediction: `r^T (H P H^T + R)^-1 r`. Infinite when the innovation covariance
/// is not positive definite or a residual is not finite.
#[inline(never)]
pub(super) fn chi_square<T: Real, const N: usize>(covariance: &Covariance<T, N>, rows: &[Row<T>]) -> f64 {
    let mut whitened = Whitened::new(rows);
    if (0..rows.len().min(PATH_ROWS)).all(|k| whitened.take(covariance, k)) {
        whitened.sum
    } else {
        f64::INFINITY
    }
}

/// Cholesky of the innovation covariance, a row at a time, and the residuals whitened by it.
struct Whitened<'a, T: Real> {
    rows: &'a [Row<T>],
    /// Rows taken so far: which, its line of the factor, its whitened residual.
    taken: heapless::Vec<(usize, [f64; PATH_ROWS], f64), PATH_ROWS>,
    sum: f64,
}

impl<'a, T: Real> Whitened<'a, T> {
    fn new(rows: &'a [Row<T>]) -> Self {
        Self {
            rows,
            taken: heapless::Vec::new(),
            sum: 0.0,
        }
    }

    /// Takes row `k` in; false when that is impossible.
    fn take<const N: usize>(&mut self, covariance: &Covariance<T, N>, k: usize) -> bool {
        let Some(row) = self.rows.get(k) else {
            return false;
        };
        let product = covariance.product(row);
        let mut line = [0.0; PATH_ROWS];
        let mut pivot = row.dot(&product).to_f64() + row.variance.to_f64();
        let mut value = row.residual.to_f64();
        for (l, (other, earlier, z)) in self.taken.iter().enumerate() {
            let Some(other) = self.rows.get(*other) else {
                return false;
            };
            let mut entry = other.dot(&product).to_f64();
            for (a, b) in line.iter().zip(earlier).take(l) {
                entry -= a * b;
            }
            entry /= earlier.get(l).copied().unwrap_or(f64::NAN);
            pivot -= entry * entry;
            value -= entry * z;
            if let Some(place) = line.get_mut(l) {
                *place = entry;
            }
        }
        if !(pivot.is_finite() && pivot > 0.0 && value.is_finite()) {
            return false;
        }
        let root = libm::sqrt(pivot);
        value /= root;
        if let Some(diagonal) = line.get_mut(self.taken.len()) {
            *diagonal = root;
        }
        self.sum += value * value;
        self.taken.push((k, line, value)).is_ok()
    }
}

/// Two estimates of the same, of three axes each, differ by no more standard deviations of their difference.
/// Derived: one honest pair in thirty is further apart.
pub(super) const APART_SIGMAS: f64 = 3.0;
