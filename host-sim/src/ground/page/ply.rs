//! The merged map as a PLY file.

use crate::flight_files::ply::{self, Column, Encoding};
use crate::ground::cloud::MapPoint;

/// Binary PLY with the columns of a flight's `map.ply` that a ground station knows, and the UAV.
pub(in crate::ground) fn write(points: &[MapPoint]) -> Vec<u8> {
    let floats = |of: &dyn Fn(&MapPoint) -> f32| Column::F32(points.iter().map(of).collect());
    let ints = |of: &dyn Fn(&MapPoint) -> i32| Column::I32(points.iter().map(of).collect());
    let columns = [
        ("x", floats(&|p| p.position_m[0])),
        ("y", floats(&|p| p.position_m[1])),
        ("z", floats(&|p| p.position_m[2])),
        ("covariance_trace", floats(&|p| p.variance_m2)),
        ("probability", floats(&|p| f32::from(p.probability) / 255.0)),
        ("time_s", floats(&|p| p.seen_s)),
        ("gmt_index", ints(&|p| i32::from(p.gmt_index))),
        ("hits", ints(&|p| i32::try_from(p.hits).unwrap_or(i32::MAX))),
        ("uav", ints(&|p| i32::from(p.uav))),
    ];
    let mut bytes = Vec::with_capacity(512 + 36 * points.len());
    let comment = "cslam ground: merged map, world frame ENU, metres; time since the start of the station";
    // A vector takes everything, and the columns are of one length.
    let _cannot_fail = ply::write(&mut bytes, Encoding::Binary, comment, &columns);
    bytes
}
