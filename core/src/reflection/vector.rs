//! The vector form of the closed solution.

use nalgebra::Vector3;

use crate::geometry::Real;

/// Distance to the reflection point, with the quantities its covariance and its gates need.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VectorSolution<T: Real = f32> {
    /// Distance d from the UAV to the point, m.
    pub distance_m: T,
    /// `D = c tau + u.b`, m.
    pub denominator_m: T,
    /// `1 + cos beta` with the bistatic angle beta at the point: 2 for backscatter, 0 on the line between the ends.
    /// Its inverse is how much a range error is magnified.
    pub one_plus_cos_bistatic: T,
}

/// Solves `d = (c tau - |b|)(c tau + |b|) / (2 D)`, `D = c tau + u.b`, with `b = R - G` in m, the unit vector `u` from
/// the UAV towards the arriving wave and the path length `c tau` in m (docs/signal-model.md, "Reflection point"). The reflection point is
/// `P = R + d u`.
///
/// The difference of squares is taken as a product: squares of two nearly equal lengths would cancel in `f32`.
///
/// `None` when D is not positive, that is when the direction points away from every point of the ellipsoid, or when
/// `c tau` is not longer than `|b|`.
pub fn vector_point<T: Real>(
    baseline: &Vector3<T>,
    direction: &Vector3<T>,
    c_tau_m: T,
) -> Option<VectorSolution<T>> {
    let length_m = baseline.norm_squared().root();
    let denominator_m = c_tau_m + direction.dot(baseline);
    let excess_m = c_tau_m - length_m;
    if denominator_m <= T::zero() || excess_m <= T::zero() {
        return None;
    }
    let distance_m = excess_m * (c_tau_m + length_m) / (denominator_m * T::of(2.0));
    let from_gmt_m = c_tau_m - distance_m;
    let usable = distance_m.is_finite() && from_gmt_m > T::zero();
    usable.then(|| VectorSolution {
        distance_m,
        denominator_m,
        one_plus_cos_bistatic: denominator_m / from_gmt_m,
    })
}
