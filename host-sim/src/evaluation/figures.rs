//! Summary of a list of errors.

use crate::statistics::{median, quantile, rms};

/// Summary of a list of error magnitudes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spread {
    /// Median.
    pub(super) median: Option<f64>,
    /// Root mean square.
    pub(super) rmse: Option<f64>,
    /// 95 % quantile.
    pub(super) p95: Option<f64>,
    /// Largest.
    pub(super) max: Option<f64>,
}

impl Spread {
    /// Of a list of error magnitudes.
    pub(super) fn of(values: &[f64]) -> Self {
        Self {
            median: median(values),
            rmse: rms(values),
            p95: quantile(values, 0.95),
            max: quantile(values, 1.0),
        }
    }
}

/// `part` of `whole` as a share; `None` of nothing.
pub(super) fn share(part: usize, whole: usize) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}

/// Length of the difference of two points.
pub(super) fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square = |k: usize| (a[k] - b[k]) * (a[k] - b[k]);
    libm::sqrt(square(0) + square(1) + square(2))
}
