//! Control points of a flight's curves: how far apart they are, how they are smoothed, and how many stand still.

use nalgebra::SVector;

/// Knot interval of the curve, s. The corner of a tour is rounded over about four of them.
pub(super) const KNOT_S: f64 = 0.4;
/// Passes of the binomial kernel (1 4 6 4 1)/16 over the control points.
pub(super) const SMOOTHING: usize = 2;
/// First control points that stand still so that the UAV does for `rest_s`: all six around an instant must. Smoothing reaches two points a
/// pass, first over the places, then over the heading that follows from them.
pub(super) fn still(rest_s: f64) -> usize {
    (rest_s / KNOT_S) as usize + 7 + 4 * SMOOTHING
}

/// One pass of the kernel (1 4 6 4 1)/16; the ends are continued by their own values.
pub(super) fn smooth<const D: usize>(points: &[SVector<f64, D>]) -> Vec<SVector<f64, D>> {
    let at = |k: usize, shift: usize| points[(k + shift).saturating_sub(2).min(points.len() - 1)];
    (0..points.len())
        .map(|k| (at(k, 0) + at(k, 4) + (at(k, 1) + at(k, 3)) * 4.0 + at(k, 2) * 6.0) / 16.0)
        .collect()
}
