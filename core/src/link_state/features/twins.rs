//! Twins of a path: the link's other paths that went the same way in plan, over the ground, a roof or a ceiling besides.
//!
//! A level surface mirrors the apparent source of a path straight up or down. So whoever met the same walls has its source
//! above or below, and left the GMT in the same azimuth: its measured departure is a second measurement of the first one's,
//! with an error of its own. A path off one wall nearly always has such a twin off wall and ground; of the paths off two
//! walls every other one has none, because both ways must be free for both.

use nalgebra::Vector3;

use super::Received;
use crate::geometry::World;
use crate::kernels::sqrt;
use crate::path::Path;

/// Twins have their sources above each other within this many standard deviations.
const TWIN_SIGMAS: f32 = 3.0;

/// How well the departures of a path and its twins agree with a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Agreement {
    /// Mean angle in plan between measured departures and the direction of the point, rad, signed; its sine indeed, and
    /// beyond a right angle 1.
    pub(super) mismatch_rad: f32,
    /// Variance of that mean by the errors of the departures, rad^2.
    pub(super) variance_rad2: f32,
}

/// The apparent source of a path seen from the UAV, in plan, m, and the variance of it along one axis, m^2.
fn source(path: &Path<World>) -> ([f32; 2], f32) {
    let (length, arrival) = (path.c_tau_m, path.aoa.vector());
    let angles = 0.5 * (path.covariance.m22 + path.covariance.m33);
    let variance = path.covariance.m11 + length * length * angles;
    ([length * arrival.x, length * arrival.y], variance)
}

/// Twins of the path that stands at `rank` among `paths`.
pub(super) fn twins<'p>(
    path: &Path<World>,
    rank: Option<usize>,
    paths: &'p [Received],
) -> impl Iterator<Item = &'p Path<World>> + use<'p> {
    let ([x, y], own) = source(path);
    let others = paths.iter().enumerate();
    others
        .filter(move |(index, _)| Some(*index) != rank)
        .map(|(_, received)| &received.path)
        .filter(move |other| {
            let ([other_x, other_y], variance) = source(other);
            let (dx, dy) = (x - other_x, y - other_y);
            dx * dx + dy * dy <= TWIN_SIGMAS * TWIN_SIGMAS * (own + variance)
        })
}

/// Agreement of departures with a point, seen from the GMT. `None` when the point is above or below it, or no departure
/// has a direction in plan.
pub(super) fn agreement<'p>(
    point: &Vector3<f32>,
    paths: impl Iterator<Item = &'p Path<World>>,
) -> Option<Agreement> {
    let distance = sqrt(point.x * point.x + point.y * point.y);
    let (mut sum, mut weights) = (0.0, 0.0);
    for departure in paths.filter_map(|path| path.aod) {
        let left = departure.direction.vector();
        let level = sqrt(left.x * left.x + left.y * left.y);
        let reach = distance * level;
        if reach <= 0.0 {
            continue;
        }
        let (along, across) = (
            point.x * left.x + point.y * left.y,
            point.x * left.y - point.y * left.x,
        );
        let sine = if along > 0.0 {
            across / reach
        } else {
            libm::copysignf(1.0, across)
        };
        // An azimuth is known the worse the steeper the direction.
        let spread = departure.sigma_rad.max(LEAST_SIGMA_RAD) / level;
        let weight = 1.0 / (spread * spread);
        sum += weight * sine;
        weights += weight;
    }
    (weights > 0.0).then(|| Agreement {
        mismatch_rad: sum / weights,
        variance_rad2: 1.0 / weights,
    })
}

/// No departure is known better, rad: keeps weights finite.
const LEAST_SIGMA_RAD: f32 = 1e-5;
