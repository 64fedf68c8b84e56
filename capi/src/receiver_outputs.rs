//! What the whole receiver gives: packets, pose, map.

use cslam_core::geometry::Matrix3;

use crate::pointer;
use crate::receiver::{CslamReceiver, with};
use crate::receiver_values::{CslamMapPoint, CslamPose};
use crate::status::CslamStatus;

/// Takes what waits for the radio: `taken` bytes, at most `capacity`, a part of the stream of frames. At most 4096 wait; more is dropped.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `bytes`: room for `capacity`; `taken` as its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_take_packets(
    receiver: *mut CslamReceiver,
    bytes: *mut u8,
    capacity: usize,
    taken: *mut usize,
) -> CslamStatus {
    let take = || {
        // SAFETY: the caller's promise.
        let taken = unsafe { pointer::place(taken)? };
        pointer::check(bytes.cast_const())?;
        // SAFETY: the caller's promise.
        let count = unsafe {
            with(receiver, |app| {
                let mut count = 0;
                let mut byte = [0];
                // One by one into memory that may not be initialised.
                while count < capacity && app.downlink().take(&mut byte) == 1 {
                    bytes.add(count).write(byte[0]);
                    count += 1;
                }
                Ok(count)
            })?
        };
        taken.write(count);
        Ok(())
    };
    CslamStatus::of(take())
}

/// Pose by the newest inertial data. `CSLAM_STATUS_NOT_KNOWN` before there is one.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `pose` with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_pose(
    receiver: *mut CslamReceiver,
    pose: *mut CslamPose,
) -> CslamStatus {
    let known = || {
        // SAFETY: the caller's promise.
        unsafe { pointer::check_size(pose.cast_const())? };
        // SAFETY: the caller's promise.
        let found = unsafe { with(receiver, |app| app.cslam().pose().ok_or(CslamStatus::NotKnown))? };
        let rows = |m: &Matrix3<f32>| [m.m11, m.m12, m.m13, m.m21, m.m22, m.m23, m.m31, m.m32, m.m33];
        // SAFETY: checked above.
        unsafe { pointer::place(pose)? }.write(CslamPose {
            size: size_of::<CslamPose>() as u32,
            resets: found.resets,
            time_ns: found.time_ns,
            position_m: found.position.to_array(),
            clock_offset_m: found.clock.offset_m,
            velocity_m_per_s: found.velocity_m_per_s.into(),
            attitude_wb: rows(found.attitude.matrix()),
            position_covariance_m2: rows(&found.position_covariance_m2),
            velocity_covariance_m2_per_s2: rows(&found.velocity_covariance_m2_per_s2),
            attitude_covariance_rad2: rows(&found.attitude_covariance_rad2),
            clock_offset_sigma_m: found.clock.offset_sigma_m,
        });
        Ok(())
    };
    CslamStatus::of(known())
}

/// The map: writes at most `capacity` points, and to `found` how many there are (at most 3072). `points` may be null when `capacity` is 0.
///
/// # Safety
/// `receiver` from `cslam_receiver_init`; `points`: `capacity` structs, the first with its size; `found` as its type says.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_receiver_map(
    receiver: *mut CslamReceiver,
    points: *mut CslamMapPoint,
    capacity: usize,
    found: *mut usize,
) -> CslamStatus {
    let map = || {
        // SAFETY: the caller's promise.
        let found = unsafe { pointer::place(found)? };
        if capacity > 0 {
            // SAFETY: the caller's promise.
            unsafe { pointer::check_size(points.cast_const())? };
        }
        // SAFETY: the caller's promise.
        let count = unsafe {
            with(receiver, |app| {
                for (index, point) in app.cslam().map().points().take(capacity).enumerate() {
                    points.add(index).write(CslamMapPoint {
                        size: size_of::<CslamMapPoint>() as u32,
                        hits: point.hits.into(),
                        position_m: point.position.to_array(),
                        variance_m2: point.variance_m2,
                        surface: point.surface().map_or(-1, i32::from),
                    });
                }
                Ok(app.cslam().map().len())
            })?
        };
        found.write(count);
        Ok(())
    };
    CslamStatus::of(map())
}
