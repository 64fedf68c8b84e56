//! How likely a path is over a chain: a Gaussian of the innovation, and a mixture for the departure.
//!
//! ```text
//! S = H P H' + R
//! p(z | chain) = N(r3; 0, S3) [ (1 - e) N(r_departure | r3) + e / 2 pi ]
//! ```
//! r3 is delay and arrival. Whether a departure means anything depends on the hypothesis: one that leaves below the beams predicts that it
//! is noise. So the departure never rejects alone, and never proves alone.

use nalgebra::SMatrix;

use super::chain::{Derivatives, MOST_REFLECTIONS, ROWS};
use super::pose::PoseEstimate;
use crate::geometry::Plane;

/// Natural logarithm of two pi.
/// Given: mathematics.
pub(super) const LOG_TWO_PI: f64 = 1.837_877_066_409_345_5;

/// Derivatives by each surface once: a surface that a chain meets twice has the sum of both.
pub(super) fn joined(derivatives: &Derivatives, ids: &[u16]) -> [SMatrix<f64, 3, ROWS>; MOST_REFLECTIONS] {
    let mut joined = [SMatrix::zeros(); MOST_REFLECTIONS];
    for (id, of) in ids.iter().zip(&derivatives.surfaces) {
        let first = ids.iter().position(|other| other == id).unwrap_or(0);
        if let Some(sum) = joined.get_mut(first) {
            *sum += of;
        }
    }
    joined
}

/// `S = H P H' + R` with the pose's joint covariance and each surface's own; cross terms of pose and surfaces are zero, see
/// [`crate::surfaces::SurfaceConfig::least_shift_m`].
pub(super) fn innovation_covariance(
    derivatives: &Derivatives,
    joined: &[SMatrix<f64, 3, ROWS>; MOST_REFLECTIONS],
    planes: &[Plane<f64>],
    pose: &PoseEstimate,
    noise: &SMatrix<f64, ROWS, ROWS>,
) -> SMatrix<f64, ROWS, ROWS> {
    let mut s = noise + derivatives.pose.tr_mul(&(pose.covariance * derivatives.pose));
    for (plane, of) in planes.iter().zip(joined) {
        s += of.tr_mul(&(plane.covariance * of));
    }
    s
}

/// What a path over a chain says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Likelihood {
    /// Logarithm of the density of delay, arrival and departure, 1/(m rad^2), and 1/rad^2 more with a departure.
    pub log: f64,
    /// Normalised innovation squared of delay and arrival.
    pub chi_square: f64,
    /// Probability that the departure is the path's; 0 without one.
    pub departure_held: f64,
}

/// Density of an innovation. `outliers`: share of departures that mean nothing; `None` without a departure. `None` when the covariance is not
/// positive definite.
pub(super) fn likelihood(
    innovation: &SMatrix<f64, ROWS, 1>,
    covariance: &SMatrix<f64, ROWS, ROWS>,
    outliers: Option<f64>,
) -> Option<Likelihood> {
    let [(chi_square, log_three), (chi_square_all, log_all)] =
        gaussians(innovation, covariance, outliers.is_some())?;
    let log_three = log_three - 1.5 * LOG_TWO_PI;
    let Some(outliers) = outliers else {
        return Some(Likelihood {
            log: log_three,
            chi_square,
            departure_held: 0.0,
        });
    };
    let log_departure = log_all - 2.5 * LOG_TWO_PI - log_three;
    let held = (1.0 - outliers) * libm::exp(log_departure);
    let both = held + outliers * libm::exp(-LOG_TWO_PI);
    (chi_square_all.is_finite() && both > 0.0).then(|| Likelihood {
        log: log_three + libm::log(both),
        chi_square,
        departure_held: held / both,
    })
}

/// Normalised square and log density, up to the powers of two pi: of the first three numbers, and of all with the departure. By the Cholesky
/// factor, whose first rows are those of the three; without a departure it ends there.
fn gaussians(
    innovation: &SMatrix<f64, ROWS, 1>,
    covariance: &SMatrix<f64, ROWS, ROWS>,
    departure: bool,
) -> Option<[(f64, f64); 2]> {
    let rows: [[f64; ROWS]; ROWS] = (*covariance).into();
    let [residual]: [[f64; ROWS]; 1] = (*innovation).into();
    let mut factor = [[0.0; ROWS]; ROWS];
    let mut whitened = [0.0; ROWS];
    let (mut square, mut log) = (0.0, 0.0);
    let mut of_three = (0.0, 0.0);
    for i in 0..ROWS {
        if i == 3 {
            of_three = (square, log - 0.5 * square);
            if !departure {
                break;
            }
        }
        let mut rest = residual[i];
        for j in 0..=i {
            let done: f64 = factor[i].iter().zip(&factor[j]).take(j).map(|(a, b)| a * b).sum();
            let sum = rows[j][i] - done;
            if i == j {
                // In this order a number that is none is not positive.
                if !(sum > 0.0 && sum.is_finite()) {
                    return None;
                }
                factor[i][i] = libm::sqrt(sum);
            } else {
                factor[i][j] = sum / factor[j][j];
                rest -= factor[i][j] * whitened[j];
            }
        }
        whitened[i] = rest / factor[i][i];
        square += whitened[i] * whitened[i];
        log -= libm::log(factor[i][i]);
    }
    square
        .is_finite()
        .then_some([of_three, (square, log - 0.5 * square)])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covariance() -> SMatrix<f64, ROWS, ROWS> {
        let root = SMatrix::<f64, ROWS, ROWS>::from_fn(|i, j| {
            if i == j {
                0.1 + 0.02 * i as f64
            } else {
                0.01 * (i as f64 - j as f64)
            }
        });
        root * root.transpose()
    }

    #[test]
    fn the_density_is_the_textbooks() {
        let s = covariance();
        let r = SMatrix::<f64, ROWS, 1>::from([[0.05, -0.1, 0.02, 0.07, -0.03]]);
        let log_of = |square: f64, determinant: f64, n: f64| {
            (square, -0.5 * (square + libm::log(determinant) + n * LOG_TWO_PI))
        };
        let (s3, r3) = (
            s.fixed_view::<3, 3>(0, 0).into_owned(),
            r.fixed_rows::<3>(0).into_owned(),
        );
        let three = (r3.transpose() * s3.try_inverse().expect("regular") * r3)[(0, 0)];
        let all = (r.transpose() * s.try_inverse().expect("regular") * r)[(0, 0)];
        let density = [
            log_of(three, s3.determinant(), 3.0),
            log_of(all, s.determinant(), 5.0),
        ];
        let three = likelihood(&r, &s, None).expect("regular");
        assert!((three.chi_square - density[0].0).abs() < 1e-9 && (three.log - density[0].1).abs() < 1e-9);
        let five = likelihood(&r, &s, Some(0.0)).expect("regular");
        assert!((five.log - density[1].1).abs() < 1e-9 && (five.departure_held - 1.0).abs() < 1e-12);
        let mixture = likelihood(&r, &s, Some(0.25)).expect("regular");
        let conditional = libm::exp(density[1].1 - density[0].1);
        let expected = density[0].1 + libm::log(0.75 * conditional + 0.25 / core::f64::consts::TAU);
        assert!((mixture.log - expected).abs() < 1e-9);
    }

    #[test]
    fn a_departure_never_rejects_alone() {
        let s = SMatrix::<f64, ROWS, ROWS>::identity() * 1e-6;
        let off = |by: f64| SMatrix::<f64, ROWS, 1>::from([[0.0, 0.0, 0.0, by, 0.0]]);
        let far = likelihood(&off(0.5), &s, Some(0.03)).expect("regular");
        let none = likelihood(&off(0.0), &s, None).expect("regular");
        assert!((far.log - none.log - libm::log(0.03 / core::f64::consts::TAU)).abs() < 1e-9);
        assert!(far.departure_held < 1e-9);
        assert!(
            likelihood(&off(0.0), &s, Some(0.03))
                .expect("regular")
                .departure_held
                > 0.99
        );
    }

    #[test]
    fn what_is_no_covariance_has_no_density() {
        let mut s = covariance();
        s[(1, 1)] = -1.0;
        assert!(likelihood(&SMatrix::zeros(), &s, None).is_none());
        s[(1, 1)] = f64::NAN;
        assert!(likelihood(&SMatrix::zeros(), &s, None).is_none());
    }
}
