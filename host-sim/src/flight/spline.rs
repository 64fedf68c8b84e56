//! Uniform quintic B-splines: curves with four continuous derivatives, all known in closed form.
//!
//! A curve of control points `c_j`, one every `knot_s` seconds, lies within the convex hull of the six control points
//! around each instant, and so do its derivatives within the hull of the control points' differences. Limits on speed,
//! acceleration and jerk are therefore checked on the control points, for all times at once.

use nalgebra::SVector;

/// Coefficients of the six basis polynomials over one knot interval, times 120: `BASIS[m][k]` multiplies u^k, u in
/// 0..1, for the m-th control point of the interval.
const BASIS: [[f64; 6]; 6] = [
    [1.0, -5.0, 10.0, -10.0, 5.0, -1.0],
    [26.0, -50.0, 20.0, 20.0, -20.0, 5.0],
    [66.0, 0.0, -60.0, 0.0, 30.0, -10.0],
    [26.0, 50.0, 20.0, -20.0, -20.0, 10.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, -5.0],
    [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
];

/// A quintic B-spline in `D` dimensions over times from 0 on.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline<const D: usize> {
    control: Vec<SVector<f64, D>>,
    knot_s: f64,
}

impl<const D: usize> Spline<D> {
    /// A spline of control points `knot_s` seconds apart; control point j has its greatest weight at (j - 2) `knot_s`.
    /// `None` for fewer than six control points or a knot interval that is not a positive number.
    pub fn new(control: Vec<SVector<f64, D>>, knot_s: f64) -> Option<Self> {
        (control.len() >= 6 && knot_s > 0.0 && knot_s.is_finite()).then_some(Self { control, knot_s })
    }

    /// The curve that passes `values[j]` at j `knot_s` and ends with the last of them. It comes from rest at the first one, and goes on
    /// straight after the last one. `None` for fewer than two values or a knot interval that is not a positive number.
    pub fn through(values: &[SVector<f64, D>], knot_s: f64) -> Option<Self> {
        let (first, last) = (values.first()?, values.last()?);
        let step = last - values.get(values.len().checked_sub(2)?)?;
        // Beyond so many knots at either end the control points are the values: both of rest and of a straight line they are, and
        // what is left of a change dies out by .43 from knot to knot.
        const BEYOND: usize = 40;
        let wanted = |j: usize| match j.checked_sub(BEYOND) {
            None => *first,
            Some(j) => values
                .get(j)
                .copied()
                .unwrap_or_else(|| last + step * (j + 1 - values.len()) as f64),
        };
        let control = interpolating(&(0..values.len() + 2 * BEYOND).map(wanted).collect::<Vec<_>>());
        // The curve at knot j is (c[j] + 26 c[j + 1] + 66 c[j + 2] + 26 c[j + 3] + c[j + 4]) / 120 of its control points.
        let from = BEYOND - 2;
        Self::new(control.get(from..from + values.len() + 4)?.to_vec(), knot_s)
    }

    /// The same value for `duration_s`, which is above 0.
    pub(super) fn constant(value: SVector<f64, D>, duration_s: f64) -> Self {
        Self {
            control: vec![value; 6],
            knot_s: duration_s,
        }
    }

    /// Control points.
    pub fn control(&self) -> &[SVector<f64, D>] {
        &self.control
    }

    /// The curve of other control points at the same times: that of moved ones is the moved curve.
    #[must_use]
    pub(super) fn with_control(self, at: impl Fn(&SVector<f64, D>) -> SVector<f64, D>) -> Self {
        Self {
            control: self.control.iter().map(at).collect(),
            ..self
        }
    }

    /// Knot interval, s.
    pub fn knot_s(&self) -> f64 {
        self.knot_s
    }

    /// End of the curve, s.
    pub fn duration_s(&self) -> f64 {
        (self.control.len() - 5) as f64 * self.knot_s
    }

    /// Value and the first four derivatives with respect to time at `time_s`, which is clamped to the curve.
    pub fn at(&self, time_s: f64) -> [SVector<f64, D>; 5] {
        let place = (time_s / self.knot_s).clamp(0.0, (self.control.len() - 5) as f64);
        // The last instant belongs to the last interval.
        let interval = (place as usize).min(self.control.len() - 6);
        let u = place - interval as f64;
        let mut polynomial = [SVector::<f64, D>::zeros(); 6];
        for (point, basis) in self.control[interval..].iter().zip(&BASIS) {
            for (coefficient, weight) in polynomial.iter_mut().zip(basis) {
                *coefficient += point * (weight / 120.0);
            }
        }
        let mut scale = 1.0;
        core::array::from_fn(|order| {
            let mut value = SVector::<f64, D>::zeros();
            for k in (order..6).rev() {
                // d^order u^k = k (k-1) .. (k-order+1) u^(k-order).
                let factor: f64 = (k - order + 1..=k).map(|f| f as f64).product();
                value = value * u + polynomial[k] * factor;
            }
            value *= scale;
            scale /= self.knot_s;
            value
        })
    }

    /// Largest length of the `order`-th difference of the control points over `knot_s`^order in each control interval:
    /// a bound of the derivative near that control point, valid between the samples of any grid.
    pub fn derivative_bounds(&self, order: usize) -> Vec<f64> {
        let mut differences = self.control.clone();
        for _ in 0..order {
            differences = differences
                .windows(2)
                .map(|w| (w[1] - w[0]) / self.knot_s)
                .collect();
        }
        differences.iter().map(SVector::norm).collect()
    }
}

/// Control points c with (c[j - 2] + 26 c[j - 1] + 66 c[j] + 26 c[j + 1] + c[j + 2]) / 120 = v[j], where those beyond either end are the
/// values there. By elimination: the middle one outweighs the others, so no order of rows is needed.
fn interpolating<const D: usize>(values: &[SVector<f64, D>]) -> Vec<SVector<f64, D>> {
    let n = values.len();
    let mut right: Vec<SVector<f64, D>> = values.iter().map(|v| v * 120.0).collect();
    // Equations of the two at either end: they are their values.
    let is_end = |j: usize| j < 2 || j + 2 >= n;
    let row = |j: usize| {
        if is_end(j) {
            [0.0, 0.0, 120.0, 0.0, 0.0]
        } else {
            [1.0, 26.0, 66.0, 26.0, 1.0]
        }
    };
    let mut rows: Vec<[f64; 5]> = (0..n).map(row).collect();
    for j in 0..n {
        for below in 1..=2 {
            let Some(under) = rows.get(j + below).copied() else {
                continue;
            };
            let [_, _, pivot, next, second] = rows[j];
            // Row j + below has column j at its place 2 - below.
            let factor = under[2 - below] / pivot;
            let mut left = under;
            left[2 - below] = 0.0;
            left[3 - below] -= factor * next;
            left[4 - below] -= factor * second;
            rows[j + below] = left;
            let taken = right[j] * factor;
            right[j + below] -= taken;
        }
    }
    for j in (0..n).rev() {
        let [.., pivot, next, second] = rows[j];
        let known = |k: usize| right.get(k).copied().unwrap_or_else(SVector::zeros);
        right[j] = (right[j] - known(j + 1) * next - known(j + 2) * second) / pivot;
    }
    right
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector2;

    use super::*;

    fn wavy() -> Spline<2> {
        let control = (0..30)
            .map(|k| f64::from(k) * 0.7)
            .map(|x| Vector2::new(libm::sin(x), libm::cos(1.3 * x)));
        Spline::new(control.collect(), 0.4).expect("long enough")
    }

    #[test]
    fn derivatives_match_central_differences() {
        let (spline, h) = (wavy(), 1e-4);
        for k in 1..200 {
            let t = f64::from(k) * 0.0473;
            let (before, here, after) = (spline.at(t - h), spline.at(t), spline.at(t + h));
            for order in 0..4 {
                let numeric = (after[order] - before[order]) / (2.0 * h);
                assert!((numeric - here[order + 1]).norm() < 1e-4, "order {order} at {t}");
            }
        }
    }

    #[test]
    fn a_straight_line_is_reproduced_and_four_derivatives_are_continuous() {
        let line = Spline::new((0..9).map(|k| Vector2::new(f64::from(k), 2.0)).collect(), 0.5).expect("six");
        // Control point j stands at (j - 2) knots: position 2 + t / 0.5.
        let [p, v, a, ..] = line.at(1.3);
        assert!((p - Vector2::new(4.6, 2.0)).norm() < 1e-14);
        assert!((v - Vector2::new(2.0, 0.0)).norm() < 1e-13 && a.norm() < 1e-12);
        let spline = wavy();
        for knot in 1..20 {
            let t = f64::from(knot) * 0.4;
            let (left, right) = (spline.at(t - 1e-9), spline.at(t + 1e-9));
            for order in 0..5 {
                assert!(
                    (left[order] - right[order]).norm() < 1e-6,
                    "order {order} at knot {knot}"
                );
            }
        }
    }

    #[test]
    fn control_differences_bound_the_derivatives() {
        let spline = wavy();
        for order in 1..4 {
            let bound = spline.derivative_bounds(order).into_iter().fold(0.0, f64::max);
            let largest = (0..1000)
                .map(|k| spline.at(f64::from(k) * 0.01)[order].norm())
                .fold(0.0, f64::max);
            assert!(
                largest <= bound && largest > 0.2 * bound,
                "order {order}: {largest} of {bound}"
            );
        }
    }

    #[test]
    fn too_few_points_make_no_curve() {
        assert!(Spline::new(vec![Vector2::new(0.0, 0.0); 5], 0.4).is_none());
        assert!(Spline::new(vec![Vector2::new(0.0, 0.0); 6], 0.0).is_none());
        assert!(Spline::new(vec![Vector2::new(0.0, 0.0); 6], f64::NAN).is_none());
    }
    #[test]
    fn a_curve_through_values_comes_from_rest_and_goes_on_straight() {
        let values: Vec<_> = (0..40)
            .map(|k| match f64::from(k) {
                k if k < 12.0 => Vector2::new(1.0, 2.0),
                k => Vector2::new(
                    1.0 + 0.04 * (k - 12.0) * (k - 12.0),
                    2.0 - 0.1 * (0.5 * (k - 12.0)).sin(),
                ),
            })
            .collect();
        let spline = Spline::through(&values, 0.5).expect("enough");
        assert_eq!(spline.duration_s(), 19.5);
        for (k, value) in values.iter().enumerate() {
            assert!((spline.at(0.5 * k as f64)[0] - value).norm() < 1e-12, "{k}");
        }
        let [_, v, a, ..] = spline.at(0.0);
        assert!(v.norm() < 1e-4 && a.norm() < 1e-3, "{v} {a}");
        let [_, v, ..] = spline.at(19.5);
        let step = (values[39] - values[38]) / 0.5;
        assert!((v - step).norm() < 0.2 * step.norm(), "{v} {step}");
        let line: Vec<_> = (0..5).map(|k| Vector2::new(2.0 * f64::from(k), 1.0)).collect();
        let end = Spline::through(&line, 1.0).expect("enough").at(4.0);
        assert!((end[1] - Vector2::new(2.0, 0.0)).norm() < 0.1);
        assert!(Spline::through(&values[..1], 0.5).is_none());
        assert!(Spline::through(&values, 0.0).is_none());
    }
}
