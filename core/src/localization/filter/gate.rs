//! Whether a path is believed: joint chi-square of its rows, and agreement of neighbouring sweeps.
//!
//! All rows of a path stand or fall together: a wrong path is wrong in all of them. A path that the filter rejects may
//! still be right when the filter is wrong; then the next sweep errs in the same way, which chance does not
//! (localization.md section 2, "vote").

use super::covariance::Covariance;
use super::measurement::PATH_ROWS;
use super::row::Row;
use crate::geometry::Real;

/// Joint chi-square of the rows about the prediction: `r^T (H P H^T + R)^-1 r`. Infinite when the innovation covariance
/// is not positive definite or a residual is not finite.
pub(super) fn chi_square<T: Real, const N: usize>(covariance: &Covariance<T, N>, rows: &[Row<T>]) -> f64 {
    let mut s = [[0.0f64; PATH_ROWS]; PATH_ROWS];
    let rows = rows.get(..rows.len().min(PATH_ROWS)).unwrap_or(&[]);
    for (k, (line, row)) in s.iter_mut().zip(rows).enumerate() {
        let product = covariance.product(row);
        for (l, (value, other)) in line.iter_mut().zip(rows).enumerate() {
            *value = other.dot(&product).to_f64();
            if k == l {
                *value += row.variance.to_f64();
            }
        }
    }
    let mut z = [0.0f64; PATH_ROWS];
    for (z, row) in z.iter_mut().zip(rows) {
        *z = row.residual.to_f64();
    }
    whitened_square(&mut s, &mut z, rows.len())
}

/// `z^T s^-1 z` by Cholesky; both are overwritten.
fn whitened_square(s: &mut [[f64; PATH_ROWS]; PATH_ROWS], z: &mut [f64; PATH_ROWS], order: usize) -> f64 {
    let mut sum = 0.0;
    for k in 0..order.min(PATH_ROWS) {
        let (done, rest) = s.split_at_mut(k);
        let (solved, left) = z.split_at_mut(k);
        let (Some(line), Some(value)) = (rest.first_mut(), left.first_mut()) else {
            return f64::INFINITY;
        };
        let mut pivot = line.get(k).copied().unwrap_or(f64::NAN);
        for (l, (finished, earlier)) in done.iter().zip(solved.iter()).enumerate() {
            let (factors, open) = line.split_at_mut(l);
            let (Some(entry), Some(diagonal)) = (open.first_mut(), finished.get(l)) else {
                return f64::INFINITY;
            };
            for (a, b) in factors.iter().zip(finished) {
                *entry -= a * b;
            }
            *entry /= diagonal;
            pivot -= *entry * *entry;
            *value -= *entry * earlier;
        }
        if !(pivot.is_finite() && pivot > 0.0 && value.is_finite()) {
            return f64::INFINITY;
        }
        let root = libm::sqrt(pivot);
        if let Some(diagonal) = line.get_mut(k) {
            *diagonal = root;
        }
        *value /= root;
        sum += *value * *value;
    }
    sum
}

/// Innovations of a line-of-sight sweep, kept until the next one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Innovation {
    /// UAV clock of the sweep, ns.
    pub(super) time_ns: u64,
    /// Delay, m.
    pub(super) delay_m: f64,
    /// Angles of arrival, rad.
    pub(super) aoa_rad: [f64; 2],
}

impl Innovation {
    /// That of a path's rows. (Without rows of arrival, while the attitude is lost, the cosines of departure stand in their place:
    /// they are angles just as well.)
    pub(super) fn of<T: Real>(time_ns: u64, rows: &[Row<T>]) -> Self {
        let at = |k: usize| rows.get(k).map_or(0.0, |row| row.residual.to_f64());
        Self {
            time_ns,
            delay_m: at(0),
            aoa_rad: [at(1), at(2)],
        }
    }

    /// What an update leaves: a later sweep agrees with it when it agrees with the filter.
    pub(super) fn none(time_ns: u64) -> Self {
        Self {
            time_ns,
            delay_m: 0.0,
            aoa_rad: [0.0; 2],
        }
    }

    /// Whether a later sweep errs in the same way: within 0.34 deg and 0.35 m and what an uncertain velocity explains
    /// (`sigma_m_per_s` at a range of `range_m`). Sweeps more than 3 s apart never agree.
    pub(super) fn agrees(&self, later: &Self, sigma_m_per_s: f64, range_m: f64) -> bool {
        let dt = later.time_ns.saturating_sub(self.time_ns) as f64 * 1e-9;
        let moved = (1.0 + 3.0 * sigma_m_per_s) * dt;
        let angle = 0.006 + moved / range_m.max(1.0);
        let near = |a: f64, b: f64, limit: f64| (a - b).abs() < limit;
        dt > 0.0
            && dt < 3.0
            && near(self.delay_m, later.delay_m, 0.35 + moved)
            && near(self.aoa_rad[0], later.aoa_rad[0], angle)
            && near(self.aoa_rad[1], later.aoa_rad[1], angle)
    }
}
