//! The sensors' events as the receiver takes them.

use cslam_core::cslam::Beacon;
use cslam_core::geometry::{Gmt, Rotation, World as WorldFrame};
use nalgebra::Vector3;

use crate::sensors;
use crate::world::World;

/// Magnetic field in body axes, uT.
pub(super) fn field_ut(sample: &sensors::MagnetometerSample) -> Vector3<f32> {
    sample.field_ut().map(|c| c as f32)
}

/// What a beacon says; `None` when its angles are no attitude.
pub(super) fn beacon(beacon: &sensors::Beacon) -> Option<Beacon> {
    let [heading, pitch, roll] = beacon.heading_pitch_roll_rad.map(|c| c as f32);
    let about =
        |x: f32, y: f32, z: f32| Rotation::<Gmt, Gmt>::from_rotation_vector(&Vector3::new(x, y, z)).ok();
    let tilt = about(0.0, pitch, 0.0)?.after(&about(roll, 0.0, 0.0)?);
    let turn = about(0.0, 0.0, heading)?.after(&tilt);
    Some(Beacon {
        sweep: beacon.sweep,
        position_m: beacon.position_m.into(),
        sigma_m: beacon.position_sigma_m,
        attitude: Rotation::<Gmt, WorldFrame>::from_matrix(*turn.matrix()).ok()?,
        sweeps_per_stop: beacon.sweeps_per_stop,
    })
}

/// Time of the GMT when the UAV's clock shows `at_ns`. The clock is off by microseconds, so one correction does.
pub(super) fn gmt_time_s(world: &World<'_>, at_ns: u64) -> f64 {
    let shown_s = at_ns as f64 * 1e-9;
    2.0 * shown_s - world.flight().clock().reading_s(shown_s)
}
