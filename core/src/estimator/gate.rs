//! Whether a path is believed: joint chi-square of its rows, and agreement of neighbouring sweeps.
//!
//! All rows of a path stand or fall together: a wrong path is wrong in all of them. A path that the filter rejects may
//! still be right when the filter is wrong; then the next sweep errs in the same way, which chance does not
//! (docs/localization.md, "What it believes").

use super::covariance::Covariance;
use super::measurement::PATH_ROWS;
use super::row::Row;
use super::window::{LINE_TOLERANCE_M, SIGHT_SCATTER_RAD, SUSPECT_S};
use crate::geometry::Real;
use nalgebra::Vector3;

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

/// How a line-of-sight sweep differs from the filter, kept until the next one: by the place where the path alone puts the UAV,
/// which compares however far off the filter is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Innovation {
    /// UAV clock of the sweep, ns.
    pub(super) time_ns: u64,
    /// Place by delay and departure less position, m, world axes.
    pub(super) offset_m: Vector3<f64>,
    /// Direction of arrival less that from this place to the GMT, world axes.
    pub(super) turn_rad: Vector3<f64>,
    /// Standard deviations of both by what the path itself claims, along each axis, m and rad.
    pub(super) sigma: [Vector3<f64>; 2],
}

/// Two estimates of the same, of three axes each, differ by no more standard deviations of their difference.
/// Derived: one honest pair in thirty is further apart.
pub(super) const APART_SIGMAS: f64 = 3.0;

impl Innovation {
    /// What an update leaves: a later sweep agrees with it when it agrees with the filter.
    pub(super) fn none(time_ns: u64) -> Self {
        Self {
            time_ns,
            offset_m: Vector3::zeros(),
            turn_rad: Vector3::zeros(),
            sigma: [Vector3::zeros(); 2],
        }
    }

    /// Whether a later sweep errs in the same way: within [`LINE_TOLERANCE_M`], [`SIGHT_SCATTER_RAD`], what both claim to err by, and what an
    /// uncertain velocity explains (`sigma_m_per_s` at a range of `range_m`).
    pub(super) fn agrees(&self, later: &Self, sigma_m_per_s: f64, range_m: f64) -> bool {
        let dt = later.time_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        let moved = (1.0 + APART_SIGMAS * sigma_m_per_s) * dt;
        let [place, turn] = self.sigma;
        let [later_place, later_turn] = later.sigma;
        let moved_rad = moved / range_m.max(1.0);
        dt > 0.0
            && dt < SUSPECT_S
            && is_within(
                &(self.offset_m - later.offset_m),
                &place.zip_map(&later_place, tolerance(LINE_TOLERANCE_M + moved)),
            )
            && is_within(
                &(self.turn_rad - later.turn_rad),
                &turn.zip_map(&later_turn, tolerance(SIGHT_SCATTER_RAD + moved_rad)),
            )
    }
}

/// How far two estimates with these standard deviations may differ along an axis, beside `least`.
fn tolerance(least: f64) -> impl Fn(f64, f64) -> f64 {
    move |a, b| least + APART_SIGMAS * libm::hypot(a, b)
}

/// Whether a difference is within the ellipsoid of these half axes.
fn is_within(difference: &Vector3<f64>, half_axes: &Vector3<f64>) -> bool {
    difference.component_div(half_axes).norm_squared() < 1.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sweeps_agree_within_what_they_claim_to_err_by() {
        let seen = |time_ns, offset_m: f64, sigma: (f64, f64)| Innovation {
            time_ns,
            offset_m: Vector3::new(offset_m, 0.0, 0.0),
            turn_rad: Vector3::zeros(),
            sigma: [sigma.0, sigma.1].map(Vector3::repeat),
        };
        // Half a second in which an unsure velocity explains 0.5 m, and 0.43 m of scatter at 20 m.
        let agrees = |apart_m, sigma| {
            let before = seen(0, 0.0, sigma);
            before.agrees(&seen(500_000_000, apart_m, sigma), 0.0, 20.0)
        };
        assert!(agrees(0.9, (0.0, 0.0)) && !agrees(1.0, (0.0, 0.0)));
        // Two of 0.2 m are 0.28 m apart, three standard deviations of it 0.85 m.
        assert!(agrees(1.7, (0.2, 0.0)) && !agrees(1.9, (0.2, 0.0)));
        assert!(!seen(0, 0.0, (0.2, 0.0)).agrees(&seen(3_500_000_000, 0.0, (0.2, 0.0)), 0.0, 20.0));
    }

    #[test]
    fn a_height_that_is_unsure_excuses_no_difference_beside_it() {
        let seen = |time_ns, offset_m| Innovation {
            time_ns,
            offset_m,
            turn_rad: Vector3::zeros(),
            sigma: [Vector3::new(0.1, 0.1, 1.0), Vector3::zeros()],
        };
        let before = seen(0, Vector3::zeros());
        let agrees = |offset_m| before.agrees(&seen(500_000_000, offset_m), 0.0, 20.0);
        assert!(agrees(Vector3::new(0.0, 0.0, 3.0)) && agrees(Vector3::new(0.5, 0.5, 1.0)));
        assert!(!agrees(Vector3::new(2.0, 0.0, 0.0)) && !agrees(Vector3::new(0.0, 2.0, 1.0)));
    }
}
