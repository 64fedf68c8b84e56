//! What the angle of departure tells of a path: whether it left towards the point that a single reflection would have.

use nalgebra::{Matrix3, Vector3};

use super::twins::agreement;
use super::{
    ANGLE_UNIT_RAD, GEOMETRIC_INPUTS, GEOMETRIC_WITH_DEPARTURE_INPUTS, LinkGeometry, NEAREST_M, compressed,
};
use crate::geometry::{Direction, World};
use crate::kernels::sqrt;
use crate::path::{Departure, Path};
use crate::reflection::InputError;

/// The point of a path seen from the GMT.
pub(super) struct Point {
    pub(super) from_gmt: Vector3<f32>,
    pub(super) line: Direction<World>,
    pub(super) covariance: Matrix3<f32>,
}

impl LinkGeometry<'_> {
    /// The features that need an angle of departure. `group` are the path and its twins.
    pub(super) fn departure_features<'p>(
        &self,
        path: &Path<World>,
        departure: &Departure,
        point: &Point,
        group: impl Iterator<Item = &'p Path<World>>,
    ) -> Result<[f32; GEOMETRIC_WITH_DEPARTURE_INPUTS - GEOMETRIC_INPUTS], InputError> {
        let (left, line) = (&departure.direction, point.line.vector());
        let mismatch_rad = point.line.angle_to_rad(left);
        // Only the point's error across the line from the GMT turns it; both tangents together.
        let across_m2 = (point.covariance.trace() - line.dot(&(point.covariance * line))).max(0.0);
        let variance = 2.0 * departure.sigma_rad * departure.sigma_rad
            + across_m2 / point.from_gmt.norm_squared().max(NEAREST_M * NEAREST_M);
        let straight = Direction::<World>::from_vector(self.baseline)?;
        // Off a right-angled corner, the commonest double bounce of a town, the wave comes back against the way it left.
        let (a, d) = (path.aoa.vector(), left.vector());
        let turn_rad = libm::atan2f((a.x * d.y - a.y * d.x).abs(), a.x * d.x + a.y * d.y);
        let (mut plan_rad, mut plan_sigmas) = (0.0, 0.0);
        if let Some(agreement) = agreement(&point.from_gmt, group) {
            let level = Vector3::new(-point.from_gmt.y, point.from_gmt.x, 0.0);
            let distance_m2 = level.norm_squared().max(NEAREST_M * NEAREST_M);
            let across_m2 = level.dot(&(point.covariance * level)).max(0.0) / distance_m2;
            let variance = agreement.variance_rad2 + across_m2 / distance_m2;
            plan_rad = agreement.mismatch_rad.abs();
            plan_sigmas = plan_rad / sqrt(variance).max(1e-6);
        }
        Ok([
            compressed(mismatch_rad, ANGLE_UNIT_RAD),
            compressed(mismatch_rad, sqrt(variance).max(1e-6)),
            compressed(straight.angle_to_rad(left), ANGLE_UNIT_RAD),
            compressed(turn_rad, ANGLE_UNIT_RAD),
            compressed(plan_rad, ANGLE_UNIT_RAD),
            compressed(plan_sigmas, 1.0),
        ])
    }
}
