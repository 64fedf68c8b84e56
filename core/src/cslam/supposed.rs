//! Mirrors that only paths of two reflections show: the wall across the street, which never reflects the GMT itself.
//!
//! With one mirror of such a path known, it is a path of one reflection: the GMT seen in the first mirror, or the UAV in the last. Length and
//! direction of arrival then give the other one, a plane that halves the way between two images. Nothing is left over to prove it
//! but that walls stand upright and that the path left the GMT for its first point; so the plane is only supposed, until
//! sweeps from several stops of the GMT agree on it ([`super::mirrors`]).

use super::higher_order::left_towards;
use super::known::{Known, crossing, is_blocked};
use super::mirrors::piece_of;
use super::specular::{is_before, is_placed};
use crate::geometry::{Direction, Position, Vector3, World};
use crate::localization::planes::Plane;
use crate::path::Path;
use crate::reflection::Ends;

/// Walls lean no more than this: vertical component of a normal.
const MOST_LEAN: f32 = 0.04;
/// How far the departure may be off, rad (0.7 degrees): half of those known at all are known to 0.2.
const DEPARTURE_RAD: f32 = 0.012;

/// Hands over every plane that makes a path one of two reflections, the other one off a known mirror.
pub(super) fn suppose(
    ends: &Ends,
    path: &Path<World>,
    known: &[Known],
    ground_z_m: Option<f32>,
    mut take: impl FnMut(&Plane),
) {
    if path.aod.is_none() || !is_placed(ends) {
        return;
    }
    let two = Two {
        uav: *ends.uav.vector(),
        gmt: *ends.gmt.vector(),
        source: ends.uav.vector() + path.aoa.vector() * path.c_tau_m,
    };
    for mirror in known {
        for found in [two.after(mirror), two.before(mirror)].into_iter().flatten() {
            let above = |point: &Vector3<f32>| ground_z_m.is_none_or(|ground_z_m| point.z > ground_z_m);
            let way = [two.gmt, found.first, found.last, two.uav];
            if above(&found.first)
                && above(&found.last)
                && left_towards(ends, path, &found.first, DEPARTURE_RAD)
                && !is_blocked(known, &[mirror], &way)
            {
                take(&found.plane);
            }
        }
    }
}

/// A path of two reflections: its ends, and where it seems to come from.
struct Two {
    uav: Vector3<f32>,
    gmt: Vector3<f32>,
    source: Vector3<f32>,
}

/// A plane that explains it, and both points.
struct Found {
    plane: Plane,
    first: Vector3<f32>,
    last: Vector3<f32>,
}

impl Two {
    /// The wall that the path met after this mirror.
    fn after(&self, mirror: &Known) -> Option<Found> {
        let image = is_before(&mirror.plane, &self.gmt).then(|| mirror.plane.image(&self.gmt))?;
        let wall = between(&image, &self.source)?;
        let last = met(&wall, &self.uav, &self.source)?;
        let first = met(&mirror.plane, &last, &image)?;
        let fits = is_before(&wall, &first) && mirror.reaches(&first);
        fits.then(|| Found::new(&wall, last, first, last)).flatten()
    }

    /// The wall that it met before this mirror.
    fn before(&self, mirror: &Known) -> Option<Found> {
        let image = is_before(&mirror.plane, &self.uav).then(|| mirror.plane.image(&self.source))?;
        let wall = between(&self.gmt, &image)?;
        let last = met(&mirror.plane, &self.uav, &self.source)?;
        let first = met(&wall, &last, &image)?;
        let fits = is_before(&mirror.plane, &first) && mirror.reaches(&last);
        fits.then(|| Found::new(&wall, first, first, last)).flatten()
    }
}

impl Found {
    /// On a wall that is known at this point.
    fn new(wall: &Plane, at: Vector3<f32>, first: Vector3<f32>, last: Vector3<f32>) -> Option<Self> {
        let plane = piece_of(wall.normal, Position::from_vector(at).ok()?);
        Some(Self { plane, first, last })
    }
}

/// The plane in which two places are images of each other, its front towards the first. `None` when it does not stand upright.
fn between(front: &Vector3<f32>, behind: &Vector3<f32>) -> Option<Plane> {
    let normal = Direction::from_vector(front - behind).ok()?;
    let middle = Position::from_vector((front + behind) * 0.5).ok()?;
    (normal.vector().z.abs() < MOST_LEAN).then(|| piece_of(normal, middle))
}

/// Where the straight way from a point before a plane to one behind passes through it.
fn met(plane: &Plane, from: &Vector3<f32>, to: &Vector3<f32>) -> Option<Vector3<f32>> {
    (is_before(plane, from) && plane.height_m(to) < 0.0).then(|| crossing(plane, from, to))
}

#[cfg(test)]
mod tests;
