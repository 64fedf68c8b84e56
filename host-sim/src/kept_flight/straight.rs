//! Which estimated path came along the straight way between GMT and UAV.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::Frame;
use cslam_core::paths::EstimatedPath;
use cslam_core::signal::Waveform;

use crate::evaluation::matching::MatchGates;
use crate::sensors::Truth;

/// A path that comes from further beside the straight way is not the line of sight, deg: twice the gate of matching, beyond which one bent wave in
/// twenty arrives.
const BESIDE_DEG: f64 = 6.0;

/// Whether a path came along the straight way between GMT and UAV: as long as that but for the gate of matching, and from no further beside it than
/// [`BESIDE_DEG`]. The line of sight does, and a wave that is bent round an edge or went through leaves or a pane.
pub(super) fn is_straight<D: Frame>(path: &EstimatedPath<D>, truth: &Truth) -> bool {
    let way_m = truth.gmt_position_m - truth.uav.position_m;
    let path = &path.path;
    let late_m = f64::from(path.c_tau_m) - truth.clock_offset_s * SPEED_OF_LIGHT_M_PER_S - way_m.norm();
    let arrival = truth.uav.attitude * path.aoa.vector().map(f64::from);
    Waveform::default().delay_period().wrap_m(late_m).abs() <= MatchGates::default().delay_m
        && arrival.angle(&way_m).to_degrees() <= BESIDE_DEG
}
