//! The pose as the association takes it: with the joint covariance of all that a path depends on.

use nalgebra::{SMatrix, Vector3};

use super::chain::POSE_STATES;
use crate::estimator::Pose;
use crate::geometry::{Body, Rotation, World};
use crate::signal::DelayPeriod;

/// Position, attitude and clock with their joint covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseEstimate {
    /// Place of the UAV, world frame, m.
    pub position_m: Vector3<f64>,
    /// Attitude.
    pub attitude: Rotation<Body, World, f64>,
    /// UAV clock less transmitter clock, m.
    pub clock_offset_m: f64,
    /// Period of the delays of its paths.
    pub delay_period: DelayPeriod,
    /// Covariance of the errors of position (3, m), attitude (3, rad, a small rotation vector in world axes) and clock (1, m).
    pub covariance: SMatrix<f64, POSE_STATES, POSE_STATES>,
}

impl PoseEstimate {
    /// Of a pose and of the delays of its paths. The pose does not hold the cross terms with the clock: they are zero. `None` when its attitude is no rotation.
    #[must_use]
    pub fn of(pose: &Pose, delay_period: DelayPeriod) -> Option<Self> {
        let mut covariance = SMatrix::<f64, POSE_STATES, POSE_STATES>::zeros();
        let wide = |m: &nalgebra::Matrix3<f32>| m.map(f64::from);
        let cross = wide(&pose.position_attitude_covariance_m_rad);
        covariance
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&wide(&pose.position_covariance_m2));
        covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&cross);
        covariance
            .fixed_view_mut::<3, 3>(3, 0)
            .copy_from(&cross.transpose());
        covariance
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&wide(&pose.attitude_covariance_rad2));
        let clock = f64::from(pose.clock.offset_sigma_m);
        covariance.fixed_view_mut::<1, 1>(6, 6).fill(clock * clock);
        Some(Self {
            position_m: *pose.position.vector(),
            attitude: Rotation::from_matrix(pose.attitude.matrix().map(f64::from)).ok()?,
            clock_offset_m: pose.clock.offset_m,
            delay_period,
            covariance,
        })
    }

    /// The same pose for a transmitter whose place is known to `sigma_m` an axis: it moves every source as the UAV's error does.
    pub(super) fn relative_to(&self, sigma_m: f64) -> Self {
        let mut relative = *self;
        for axis in 0..3 {
            if let Some(variance) = relative.covariance.get_mut((axis, axis)) {
                *variance += sigma_m * sigma_m;
            }
        }
        relative
    }

    /// Variance of the clock's offset, m^2.
    pub(super) fn clock_variance_m2(&self) -> f64 {
        self.covariance.get((6, 6)).copied().unwrap_or(0.0)
    }

    /// Standard deviations of position and attitude as norms, m and rad, and of the clock, m.
    pub(super) fn sigmas(&self) -> [f64; 3] {
        let variance = |from: usize, count: usize| -> f64 {
            let diagonal = self.covariance.diagonal();
            diagonal.iter().skip(from).take(count).sum()
        };
        [variance(0, 3), variance(3, 3), variance(6, 1)].map(|v: f64| libm::sqrt(v.max(0.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimator::ClockEstimate;
    use crate::geometry::{Matrix3, Position};
    use crate::signal::Waveform;

    #[test]
    fn a_pose_of_the_filter_keeps_its_cross_terms() {
        let cross = Matrix3::new(1e-4, 2e-4, 0.0, 0.0, 3e-4, 0.0, 0.0, 0.0, 4e-4);
        let pose = Pose {
            time_ns: 0,
            position: Position::new(1.0, 2.0, 3.0).expect("finite"),
            velocity_m_per_s: Vector3::zeros(),
            attitude: Rotation::from_yaw_pitch_roll(0.4, 0.1, 0.0).expect("finite"),
            clock: ClockEstimate {
                offset_m: 12.5,
                offset_sigma_m: 0.1,
                drift_m_per_s: 0.0,
                drift_sigma_m_per_s: 0.0,
            },
            position_covariance_m2: Matrix3::identity() * 0.01,
            velocity_covariance_m2_per_s2: Matrix3::zeros(),
            attitude_covariance_rad2: Matrix3::identity() * 1e-5,
            position_attitude_covariance_m_rad: cross,
            resets: 0,
        };
        let estimate = PoseEstimate::of(&pose, Waveform::default().delay_period()).expect("a rotation");
        let covariance = estimate.covariance;
        assert!((covariance - covariance.transpose()).norm() < 1e-12);
        assert!((covariance[(0, 4)] - 2e-4).abs() < 1e-9 && (covariance[(4, 0)] - 2e-4).abs() < 1e-9);
        assert!((covariance[(6, 6)] - 0.01).abs() < 1e-6 && covariance[(6, 0)] == 0.0);
        let [position, attitude, clock] = estimate.relative_to(0.3).sigmas();
        assert!((position - libm::sqrt(0.03 + 0.27)).abs() < 1e-6);
        assert!((attitude - libm::sqrt(3e-5)).abs() < 1e-6 && (clock - 0.1).abs() < 1e-6);
    }
}
