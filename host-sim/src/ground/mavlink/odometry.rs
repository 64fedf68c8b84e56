//! What a pose becomes: ODOMETRY in the autopilot's axes, and the counter of its jumps.

use super::axes::{covariance_frd, covariance_ned, quaternion_ned_frd, rotation, to_ned, world_to_frd};
use super::messages::{Frame, Odometry};
use crate::ground::model::Pose;
use crate::ground::uav::RESTARTED_S;

/// The poses of one UAV as they are passed on.
#[derive(Clone, Debug, Default)]
pub(super) struct Poses {
    last: Option<Pose>,
    jumps: u8,
}

impl Poses {
    /// The latest pose.
    pub(super) fn last(&self) -> Option<&Pose> {
        self.last.as_ref()
    }

    /// Takes a pose. `false` when it was overtaken by a later one: it must not be passed on, for an autopilot takes what comes for the
    /// newest.
    pub(super) fn take(&mut self, pose: &Pose) -> bool {
        if let Some(last) = &self.last {
            // A clock that goes far back began anew, and the UAV's own count with it.
            let restarted = pose.time_s < last.time_s - RESTARTED_S;
            if !restarted && pose.time_s < last.time_s {
                return false;
            }
            let found_again = is_failed(last) && !is_failed(pose);
            if restarted || found_again || pose.resets != last.resets {
                self.jumps = self.jumps.wrapping_add(1);
            }
        }
        self.last = Some(*pose);
        true
    }

    /// The latest pose as ODOMETRY; `None` before the filter has started.
    pub(super) fn odometry(&self, frame: Frame) -> Option<Odometry> {
        let pose = self.last.filter(|pose| !pose.flags.starting)?;
        let attitude = rotation(pose.quaternion_wb)?;
        Some(Odometry {
            time_us: (pose.time_s * 1e6).round() as u64,
            frame,
            position_m: to_ned(pose.position_m),
            quaternion: quaternion_ned_frd(&attitude),
            velocity_m_per_s: world_to_frd(&attitude, pose.velocity_m_per_s),
            position_covariance: covariance_ned(&pose.position.matrix()),
            attitude_covariance: covariance_frd(&attitude, &pose.attitude.matrix()),
            velocity_covariance: covariance_frd(&attitude, &pose.velocity.matrix()),
            reset_counter: self.jumps,
            quality: quality(&pose),
        })
    }
}

/// Whether the pose is of no use.
fn is_failed(pose: &Pose) -> bool {
    pose.flags.lost || pose.flags.attitude_lost
}

/// Per cent, as autopilots compare it with their least quality; -1 failed.
fn quality(pose: &Pose) -> i8 {
    match () {
        () if is_failed(pose) => -1,
        () if pose.flags.contested => 10,
        () if pose.flags.dead_reckoning || pose.flags.inertial_missing => 30,
        () => 100,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::model::{PoseFlags, Spread};

    fn pose(time_s: f64, resets: u8, flags: PoseFlags) -> Pose {
        Pose {
            time_s,
            position_m: [1.0, 2.0, 3.0],
            velocity_m_per_s: [0.0; 3],
            quaternion_wb: [1.0, 0.0, 0.0, 0.0],
            position: Spread::default(),
            velocity: Spread::default(),
            attitude: Spread::default(),
            clock_offset_s: None,
            resets,
            flags,
        }
    }

    /// Reset counters of what is passed on; `None` where nothing is.
    fn counters(poses: &[Pose]) -> Vec<Option<u8>> {
        let mut known = Poses::default();
        let mut told = |pose: &Pose| known.take(pose).then(|| known.odometry(Frame::Frd)).flatten();
        poses
            .iter()
            .map(|pose| told(pose).map(|odometry| odometry.reset_counter))
            .collect()
    }

    #[test]
    fn every_jump_counts_once() {
        let sound = PoseFlags::default();
        let lost = PoseFlags { lost: true, ..sound };
        let starting = PoseFlags {
            starting: true,
            ..sound
        };
        let flight = [
            pose(10.0, 3, sound),
            pose(10.1, 4, sound),
            pose(10.2, 4, sound),
            // Two at once, as when packets between were lost.
            pose(10.3, 6, sound),
            // Found again by a measurement, without being set anew.
            pose(10.4, 6, lost),
            pose(10.5, 6, sound),
            // Lost and set anew.
            pose(10.6, 6, lost),
            pose(10.7, 7, sound),
            // Begun anew: nothing to say until there is a pose.
            pose(10.8, 8, starting),
            pose(10.9, 8, sound),
        ];
        let expected = [0, 1, 1, 2, 2, 3, 3, 4].map(Some);
        assert_eq!(counters(&flight), [&expected[..], &[None, Some(5)]].concat());
    }

    #[test]
    fn a_receiver_that_begins_anew_is_a_jump_and_an_overtaken_pose_is_none() {
        let sound = PoseFlags::default();
        let flight = [
            pose(50.0, 0, sound),
            pose(50.2, 1, sound),
            // Sent before the jump, came after it.
            pose(50.1, 0, sound),
            pose(50.3, 1, sound),
            // Its clock and its count are at their beginning again.
            pose(0.1, 1, sound),
        ];
        assert_eq!(counters(&flight), [Some(0), Some(1), None, Some(1), Some(2)]);
    }

    #[test]
    fn the_counter_wraps() {
        let mut known = Poses::default();
        for n in 0..=256_u32 {
            assert!(known.take(&pose(f64::from(n), (n % 256) as u8, PoseFlags::default())));
        }
        assert_eq!(
            known.odometry(Frame::Ned).map(|odometry| odometry.reset_counter),
            Some(0)
        );
    }

    #[test]
    fn the_worst_flag_decides_the_quality() {
        let of = |change: fn(&mut PoseFlags)| {
            let mut flags = PoseFlags::default();
            change(&mut flags);
            quality(&pose(0.0, 0, flags))
        };
        assert_eq!(of(|_| ()), 100);
        assert_eq!(of(|f| f.dead_reckoning = true), 30);
        assert_eq!(of(|f| f.inertial_missing = true), 30);
        assert_eq!(of(|f| (f.dead_reckoning, f.contested) = (true, true)), 10);
        assert_eq!(of(|f| (f.contested, f.lost) = (true, true)), -1);
        assert_eq!(of(|f| f.attitude_lost = true), -1);
    }
}
