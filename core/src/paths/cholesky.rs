//! Small symmetric systems: the step of a fit, and its covariance, from the Gauss-Newton Hessian.

/// Smallest share of its information that a direction may have left beside the others.
/// Numerical: a guard of the division by a pivot, ten times the rounding of single precision.
const LEAST_SHARE: f32 = 1e-6;

/// Solves `(H + damping diag H) x = g`. A direction without information gets no step.
pub(super) fn solve<const D: usize>(hessian: &[[f32; D]; D], gradient: &[f32; D], damping: f32) -> [f32; D] {
    let mut damped = *hessian;
    for (i, row) in damped.iter_mut().enumerate() {
        if let Some(x) = row.get_mut(i) {
            *x += damping * *x;
        }
    }
    substitute(&factor(&damped), *gradient)
}

/// Rows and columns of the inverse Hessian that belong to path `index`, three each. Means something only
/// for a [`regular`] one.
pub(super) fn spread<const D: usize>(hessian: &[[f32; D]; D], index: usize) -> [[f32; 3]; 3] {
    let factor = factor(hessian);
    core::array::from_fn(|column| {
        let mut unit = [0.0; D];
        if let Some(one) = unit.get_mut(3 * index + column) {
            *one = 1.0;
        }
        let solved = substitute(&factor, unit);
        core::array::from_fn(|row| solved.get(3 * index + row).copied().unwrap_or(0.0))
    })
}

/// Whether every direction has information of its own. Where two paths of a fit coincide, or their gains cancel, it has not,
/// and neither step nor covariance would mean anything.
pub(super) fn regular<const D: usize>(hessian: &[[f32; D]; D]) -> bool {
    let factor = factor(hessian);
    (0..D).all(|i| factor[i][i] > 0.0 && factor[i][i].is_finite())
}

/// Cholesky factor, lower triangle. A direction with less than [`LEAST_SHARE`] of its information left is marked by zero: the
/// others explain it.
#[allow(
    clippy::needless_range_loop,
    reason = "triangles of indices read best as such"
)]
fn factor<const D: usize>(matrix: &[[f32; D]; D]) -> [[f32; D]; D] {
    let mut factor = *matrix;
    for i in 0..D {
        let floor = LEAST_SHARE * factor[i][i];
        for j in 0..=i {
            let mut sum = factor[i][j];
            for k in 0..j {
                sum -= factor[i][k] * factor[j][k];
            }
            factor[i][j] = if i == j {
                if sum > floor { libm::sqrtf(sum) } else { 0.0 }
            } else if factor[j][j] > 0.0 {
                sum / factor[j][j]
            } else {
                0.0
            };
        }
    }
    factor
}

/// Solves `L L^T x = x0`. Directions marked by zero stay zero.
#[allow(
    clippy::needless_range_loop,
    reason = "triangles of indices read best as such"
)]
fn substitute<const D: usize>(factor: &[[f32; D]; D], mut x: [f32; D]) -> [f32; D] {
    for i in 0..D {
        for k in 0..i {
            x[i] -= factor[i][k] * x[k];
        }
        x[i] = if factor[i][i] > 0.0 {
            x[i] / factor[i][i]
        } else {
            0.0
        };
    }
    for i in (0..D).rev() {
        for k in i + 1..D {
            x[i] -= factor[k][i] * x[k];
        }
        x[i] = if factor[i][i] > 0.0 {
            x[i] / factor[i][i]
        } else {
            0.0
        };
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solver_ignores_what_has_no_information() {
        let x = solve(
            &[[4.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 2.0]],
            &[8.0, 1.0, 3.0],
            0.0,
        );
        assert!(
            (x[0] - 2.0).abs() < 1e-6 && x[1] == 0.0 && (x[2] - 1.5).abs() < 1e-6,
            "{x:?}"
        );
        let x = solve(&[[4.0, 2.0], [2.0, 5.0]], &[10.0, 13.0], 0.0);
        assert!((x[0] - 1.5).abs() < 1e-6 && (x[1] - 2.0).abs() < 1e-6, "{x:?}");
    }

    #[test]
    fn spread_is_the_inverse() {
        let hessian = [[4.0, 2.0, 0.0], [2.0, 5.0, 0.0], [0.0, 0.0, 2.0]];
        let exact = [[0.3125, -0.125, 0.0], [-0.125, 0.25, 0.0], [0.0, 0.0, 0.5]];
        let spread = spread(&hessian, 0);
        for (got, exact) in spread.iter().flatten().zip(exact.iter().flatten()) {
            assert!((got - exact).abs() < 1e-6, "{spread:?}");
        }
        assert!(regular(&hessian));
    }

    #[test]
    fn coinciding_paths_are_not_regular() {
        let one = [4.0, 5.0, 2.0];
        let twins = |own: f32| -> [[f32; 6]; 6] {
            core::array::from_fn(|i| {
                core::array::from_fn(|k| match (i % 3 == k % 3, i == k) {
                    (true, true) => own * one[i % 3],
                    (true, false) => one[i % 3],
                    _ => 0.0,
                })
            })
        };
        assert!(regular(&twins(1.001)) && !regular(&twins(1.0)) && !regular(&twins(0.9)));
        assert!(!regular(&[[f32::NAN; 3]; 3]) && !regular(&[[-1.0]]) && !regular(&[[0.0]]));
    }
}
