//! How far a pose is from the truth.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::estimator::Pose;
use cslam_core::signal::Waveform;
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::evaluation::normalised_squared;
use crate::sensors::Truth;

/// Errors of a pose.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PoseErrors {
    /// Position, 3-D, m.
    pub position_m: f64,
    /// The same in standard deviations: over the root of the covariance's trace.
    pub position_sigmas: f64,
    /// Square root of e^T P^-1 e of the position's error e with its covariance P; infinite unless that is positive definite.
    pub position_mahalanobis: f64,
    /// Attitude, deg.
    pub attitude_deg: f64,
    /// Of the attitude as of the position.
    pub attitude_mahalanobis: f64,
    /// Velocity, 3-D, m/s.
    pub velocity_m_per_s: f64,
    /// Of the velocity as of the position.
    pub velocity_mahalanobis: f64,
    /// Clock but for whole delay periods, ns.
    pub clock_ns: f64,
}

/// Compares a pose with the truth at its time.
#[must_use]
pub fn pose_errors(pose: &Pose, truth: &Truth) -> PoseErrors {
    let off_m = pose.position.vector().map(f64::from) - truth.uav.position_m;
    let position_m = off_m.norm();
    let sigma_m = f64::from(pose.position_covariance_m2.trace()).sqrt();
    let off_m_per_s = pose.velocity_m_per_s.map(f64::from) - truth.uav.velocity_m_per_s;
    let attitude = Rotation3::from_matrix_unchecked(pose.attitude.matrix().map(f64::from));
    // By the quaternion: of a matrix in single precision that is nearly none the arc cosine may be of more than one.
    let turned = UnitQuaternion::from_rotation_matrix(&(attitude * truth.uav.attitude.inverse()));
    let turn_rad = turned.scaled_axis();
    let late_m = pose.clock.offset_m - truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
    let clock_m = Waveform::default().delay_period().wrap_m(late_m);
    PoseErrors {
        position_m,
        position_sigmas: position_m / sigma_m,
        position_mahalanobis: mahalanobis(&off_m, &pose.position_covariance_m2),
        attitude_deg: turn_rad.norm().to_degrees(),
        attitude_mahalanobis: mahalanobis(&turn_rad, &pose.attitude_covariance_rad2),
        velocity_m_per_s: off_m_per_s.norm(),
        velocity_mahalanobis: mahalanobis(&off_m_per_s, &pose.velocity_covariance_m2_per_s2),
        clock_ns: clock_m.abs() / SPEED_OF_LIGHT_M_PER_S * 1e9,
    }
}

/// Square root of e^T P^-1 e.
fn mahalanobis(error: &Vector3<f64>, covariance: &Matrix3<f32>) -> f64 {
    normalised_squared(error, &covariance.map(f64::from)).map_or(f64::INFINITY, f64::sqrt)
}

#[cfg(test)]
mod tests {
    use cslam_core::estimator::ClockEstimate;
    use cslam_core::geometry::{Position, Rotation};

    use super::*;
    use crate::random::Stream;
    use crate::statistics::{mean, median};
    use crate::test_flight::turned;

    const DRAWS: usize = 4000;

    /// A pose whose errors are drawn from the covariances that it claims, three different ones.
    fn drawn(truth: &Truth, draws: &mut Stream) -> Pose {
        // Correlated, and of different size along each axis.
        let root = Matrix3::new(0.3, 0.0, 0.0, 0.1, 0.2, 0.0, -0.2, 0.05, 0.6);
        let mut error = |scale: f64| {
            let white = Vector3::from_fn(|_, _| draws.normal());
            let covariance = (root * root.transpose() * scale * scale).map(|value| value as f32);
            (root * white * scale, covariance)
        };
        let [(off_m, position), (off_m_per_s, velocity), (turn_rad, attitude)] =
            [1.0, 0.2, 0.02].map(&mut error);
        let turned = Rotation3::from_scaled_axis(turn_rad) * truth.uav.attitude;
        Pose {
            time_ns: 20_000_000_000,
            position: Position::from_vector(truth.uav.position_m + off_m).expect("finite"),
            velocity_m_per_s: (truth.uav.velocity_m_per_s + off_m_per_s).map(|value| value as f32),
            attitude: Rotation::from_matrix(turned.matrix().map(|value| value as f32)).expect("a rotation"),
            clock: ClockEstimate {
                offset_m: truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S,
                offset_sigma_m: 0.1,
                drift_m_per_s: 0.0,
                drift_sigma_m_per_s: 0.1,
            },
            position_covariance_m2: position,
            velocity_covariance_m2_per_s2: velocity,
            attitude_covariance_rad2: attitude,
            position_attitude_covariance_m_rad: Matrix3::zeros(),
            resets: 0,
        }
    }

    #[test]
    fn errors_that_are_as_large_as_they_claim_have_a_nees_of_one() {
        let truth = turned();
        let mut draws = Stream::new(1, 0);
        let errors: Vec<PoseErrors> = (0..DRAWS)
            .map(|_| pose_errors(&drawn(&truth, &mut draws), &truth))
            .collect();
        let figures: [fn(&PoseErrors) -> f64; 3] = [
            |e| e.position_mahalanobis,
            |e| e.attitude_mahalanobis,
            |e| e.velocity_mahalanobis,
        ];
        for figure in figures {
            let nees: Vec<f64> = errors.iter().map(|e| figure(e).powi(2) / 3.0).collect();
            let (mean, median) = (mean(nees.iter().copied()), median(&nees));
            let (mean, median) = (mean.expect("draws"), median.expect("draws"));
            // Standard deviations 0.013 and 0.015; the median of chi-square of three is 2.366.
            assert!((mean - 1.0).abs() < 0.05, "{mean}");
            assert!((median - 2.366 / 3.0).abs() < 0.06, "{median}");
        }
    }

    #[test]
    fn an_attitude_that_is_right_but_for_its_rounding_has_no_error() {
        let mut draws = Stream::new(3, 0);
        for _ in 0..DRAWS {
            let mut truth = turned();
            let turn = Vector3::from_fn(|_, _| draws.normal());
            truth.uav.attitude = Rotation3::from_scaled_axis(turn);
            let rounded = truth.uav.attitude.matrix().map(|value| value as f32);
            let pose = Pose {
                attitude: Rotation::from_matrix(rounded).expect("a rotation"),
                ..drawn(&truth, &mut draws)
            };
            let errors = pose_errors(&pose, &truth);
            assert!(errors.attitude_deg < 1e-4, "{}", errors.attitude_deg);
            assert!(errors.attitude_mahalanobis < 0.01);
        }
    }

    #[test]
    fn a_covariance_that_is_none_claims_nothing() {
        let truth = turned();
        let mut pose = drawn(&truth, &mut Stream::new(2, 0));
        pose.velocity_covariance_m2_per_s2 = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, 1.0));
        assert_eq!(pose_errors(&pose, &truth).velocity_mahalanobis, f64::INFINITY);
    }
}
