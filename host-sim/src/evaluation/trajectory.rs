//! The trajectory against the truth: absolute and relative error, attitude, velocity.
//!
//! The world frame is absolute (the GMT is known in it), so the absolute trajectory error is taken without alignment; the
//! aligned one (the rotation and shift that fit best, no scale) is given beside it, as the tools of the field do.

use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, UnitQuaternion, Vector3};
use serde::Serialize;

use super::figures::{Spread, share};
use crate::flight_log::{FlightLog, PoseEstimate, PoseRecord, PoseTruth};
use crate::statistics::rms;

/// A sweep with line of sight counts for this long, s.
const FRESH_S: f64 = 0.55;
/// The pose is settled this long after line of sight came back, s (docs/localization.md, "The model").
pub const SETTLING_S: f64 = 1.5;

/// Figures of a trajectory. Absent without a pose.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct TrajectoryFigures {
    /// Poses compared.
    pub poses: usize,
    /// Time of the first pose, s.
    pub first_pose_s: Option<f64>,
    /// Rms position error over the whole flight, unaligned, m.
    pub position_rmse_m: Option<f64>,
    /// Median of the same, m.
    pub position_median_m: Option<f64>,
    /// 95 % quantile of the same, m.
    pub position_p95_m: Option<f64>,
    /// Largest of the same, m.
    pub position_max_m: Option<f64>,
    /// Rms position error after the rotation and shift that fit best, m.
    pub position_aligned_rmse_m: Option<f64>,
    /// Rms position error with line of sight, 1.5 s and more after it came back, m.
    pub settled_position_rmse_m: Option<f64>,
    /// Share of the poses that are settled.
    pub settled_share: Option<f64>,
    /// Rms translation error of the motion from one pose to the next, m.
    pub rpe_rmse_m: Option<f64>,
    /// Rms rotation error of the same, deg.
    pub rpe_rmse_deg: Option<f64>,
    /// Rms translation error of the motion over the number of poses nearest to one second, m.
    pub rpe_1s_rmse_m: Option<f64>,
    /// Rms rotation error of the same, deg.
    pub rpe_1s_rmse_deg: Option<f64>,
    /// Rms of the length of the velocity error, m/s.
    pub velocity_rmse_m_per_s: Option<f64>,
    /// Rms attitude error: angle of the rotation between truth and estimate, deg.
    pub attitude_rmse_deg: Option<f64>,
    /// Its part about the world's x axis, deg.
    pub attitude_x_rmse_deg: Option<f64>,
    /// Its part about the world's y axis, deg.
    pub attitude_y_rmse_deg: Option<f64>,
    /// Its part about the vertical (heading), deg.
    pub attitude_z_rmse_deg: Option<f64>,
}

/// Error of one pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// GMT time, s.
    pub time_s: f64,
    /// Estimated less true position, world frame, m.
    pub position_m: Vector3<f64>,
    /// Rotation vector that turns the true attitude into the estimated one, world axes, rad.
    pub attitude_rad: Vector3<f64>,
    /// Estimated less true velocity, m/s.
    pub velocity_m_per_s: Vector3<f64>,
    /// Estimated less true clock offset, s.
    pub clock_s: Option<f64>,
    /// Line of sight, and settled.
    pub settled: bool,
}

/// A quaternion [w, x, y, z] as a rotation.
pub(super) fn rotation([w, x, y, z]: [f64; 4]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
}

/// Rotation vector that turns the true attitude into the estimated one, world axes, rad.
pub fn attitude_error_rad(estimate: &PoseEstimate, truth: &PoseTruth) -> Vector3<f64> {
    (rotation(estimate.quaternion_wb) * rotation(truth.quaternion_wb).inverse()).scaled_axis()
}

/// Errors of all poses that there are.
pub(super) fn errors(log: &FlightLog) -> Vec<PoseError> {
    let visible = visible_spans(log);
    let mut all = Vec::new();
    for record in log.trajectory().iter() {
        let (Some(estimate), Some(truth)) = (record.estimate, record.truth) else {
            continue;
        };
        let difference = |a: [f64; 3], b: [f64; 3]| Vector3::from(a) - Vector3::from(b);
        all.push(PoseError {
            time_s: record.time_s,
            position_m: difference(estimate.position_m, truth.position_m),
            attitude_rad: attitude_error_rad(&estimate, &truth),
            velocity_m_per_s: difference(estimate.velocity_m_per_s, truth.velocity_m_per_s),
            clock_s: estimate
                .clock_offset_s
                .map(|offset| offset - truth.clock_offset_s),
            settled: visible
                .iter()
                .any(|(from, to)| (from + SETTLING_S..=to + FRESH_S).contains(&record.time_s)),
        });
    }
    all
}

/// First and last sweep time of every run of sweeps with line of sight.
pub fn visible_spans(log: &FlightLog) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    let mut open = false;
    for sweep in &log.sweeps {
        let visible = sweep.truth.los_visible();
        match spans.last_mut() {
            Some(last) if visible && open => last.1 = sweep.time_s,
            _ if visible => spans.push((sweep.time_s, sweep.time_s)),
            _ => {}
        }
        open = visible;
    }
    spans
}

/// Judges a trajectory.
pub(super) fn judge(log: &FlightLog, errors: &[PoseError]) -> TrajectoryFigures {
    let position: Vec<f64> = errors.iter().map(|e| e.position_m.norm()).collect();
    let settled: Vec<f64> = errors
        .iter()
        .filter(|e| e.settled)
        .map(|e| e.position_m.norm())
        .collect();
    let velocity: Vec<f64> = errors.iter().map(|e| e.velocity_m_per_s.norm()).collect();
    let degrees = |value: &dyn Fn(&PoseError) -> f64| {
        rms(&errors.iter().map(|e| value(e).to_degrees()).collect::<Vec<_>>())
    };
    let known: Vec<PoseRecord> = log
        .trajectory()
        .iter()
        .filter(|p| p.estimate.is_some())
        .copied()
        .collect();
    let (next, second) = (relative(&known, 1), relative(&known, poses_a_second(&known)));
    let spread = Spread::of(&position);
    TrajectoryFigures {
        poses: errors.len(),
        first_pose_s: errors.first().map(|e| e.time_s),
        position_rmse_m: spread.rmse,
        position_median_m: spread.median,
        position_p95_m: spread.p95,
        position_max_m: spread.max,
        position_aligned_rmse_m: aligned_rmse_m(&known),
        settled_position_rmse_m: rms(&settled),
        settled_share: share(settled.len(), errors.len()),
        rpe_rmse_m: next.0,
        rpe_rmse_deg: next.1,
        rpe_1s_rmse_m: second.0,
        rpe_1s_rmse_deg: second.1,
        velocity_rmse_m_per_s: rms(&velocity),
        attitude_rmse_deg: degrees(&|e| e.attitude_rad.norm()),
        attitude_x_rmse_deg: degrees(&|e| e.attitude_rad.x),
        attitude_y_rmse_deg: degrees(&|e| e.attitude_rad.y),
        attitude_z_rmse_deg: degrees(&|e| e.attitude_rad.z),
    }
}

/// Estimated and true positions of a pose that has an estimate.
fn positions(record: &PoseRecord) -> Option<(Vector3<f64>, Vector3<f64>)> {
    Some((
        record.estimate?.position_m.into(),
        record.truth?.position_m.into(),
    ))
}

/// Rms distance after the rigid motion of the estimate that makes it least (Umeyama 1991, without scale).
fn aligned_rmse_m(known: &[PoseRecord]) -> Option<f64> {
    let pairs: Vec<_> = known.iter().filter_map(positions).collect();
    // Three points fix a rotation.
    if pairs.len() < 3 {
        return None;
    }
    let count = pairs.len() as f64;
    let mean = |places: &mut dyn Iterator<Item = Vector3<f64>>| places.sum::<Vector3<f64>>() / count;
    let (from, to) = (
        mean(&mut pairs.iter().map(|p| p.0)),
        mean(&mut pairs.iter().map(|p| p.1)),
    );
    let covariance = pairs
        .iter()
        .map(|(e, t)| (t - to) * (e - from).transpose())
        .sum::<Matrix3<f64>>();
    let svd = covariance.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut flip = Matrix3::identity();
    flip[(2, 2)] = libm::copysign(1.0, u.determinant() * v_t.determinant());
    let turn = u * flip * v_t;
    let apart: Vec<f64> = pairs
        .iter()
        .map(|(e, t)| (turn * (e - from) - (t - to)).norm())
        .collect();
    rms(&apart)
}

/// Number of poses whose span is nearest to a second, at least one; by the median distance in time.
fn poses_a_second(known: &[PoseRecord]) -> usize {
    let mut steps: Vec<f64> = known.windows(2).map(|w| w[1].time_s - w[0].time_s).collect();
    steps.sort_by(f64::total_cmp);
    let step_s = steps.get(steps.len() / 2).copied().unwrap_or(1.0).max(1e-3);
    (libm::floor(1.0 / step_s + 0.5) as usize).max(1)
}

/// Rms translation (m) and rotation (deg) of (true motion)^-1 (estimated motion) over all pairs `delta` poses apart.
fn relative(known: &[PoseRecord], delta: usize) -> (Option<f64>, Option<f64>) {
    let pose = |position: [f64; 3], attitude: [f64; 4]| {
        Isometry3::from_parts(Translation3::from(Vector3::from(position)), rotation(attitude))
    };
    let both = |record: &PoseRecord| {
        let (estimate, truth) = (record.estimate?, record.truth?);
        Some((
            pose(estimate.position_m, estimate.quaternion_wb),
            pose(truth.position_m, truth.quaternion_wb),
        ))
    };
    let poses: Vec<_> = known.iter().filter_map(both).collect();
    let pairs = poses.iter().zip(poses.iter().skip(delta));
    let (mut shift, mut turn) = (Vec::new(), Vec::new());
    for ((estimate, truth), (estimate_then, truth_then)) in pairs {
        let error = (truth.inverse() * truth_then).inverse() * (estimate.inverse() * estimate_then);
        shift.push(error.translation.vector.norm());
        turn.push(Rotation3::from(error.rotation).angle().to_degrees());
    }
    (rms(&shift), rms(&turn))
}
