//! Paths that a known mirror explains, and where it reflected them.
//!
//! A wave that a plane reflected once comes straight from the GMT's image behind it: length and direction of arrival, three
//! numbers without a free one, follow from both ends and the plane. A path that has them is nearly proven, whatever its
//! departure says, and its point lies where the straight way from the image passes through the plane. That point stays good where
//! the wave grazes the plane: there the closed form's ellipsoid runs along the way, and a decimetre of length is metres.

use super::config::Mirrored;
use super::mirrors::PLACED_M;
use super::paths::Straight;
use crate::geometry::{Direction, Matrix3, Position, Vector3, World};
use crate::localization::planes::Plane;
use crate::lscn::Probabilities;
use crate::path::Path;
use crate::reflection::{Ends, ReflectionPoint};

/// How far length and direction may be off those of a mirror, m and rad, beside three standard deviations of path and
/// pose. What the mirror's own error would allow is not added: a mirror that is known too poorly proves nothing.
const LENGTH_M: f32 = 0.15;
const ANGLE_RAD: f32 = 0.003;
/// Height over the mirror below which an end lies in it, m.
const LEAST_HEIGHT_M: f32 = 0.1;
/// Standard deviations of the ground, which is flat as far as is known: shift, m, tilts, rad.
const GROUND_SHIFT_M: f32 = 0.05;
const GROUND_TILT_RAD: f32 = 0.003;

/// The ground between two ends. `None` when there is no such number.
pub(super) fn ground(ends: &Ends, ground_z_m: f32) -> Option<Plane> {
    let mut centre = (ends.uav.vector() + ends.gmt.vector()) * 0.5;
    centre.z = ground_z_m;
    let [shift, tilt] = [GROUND_SHIFT_M, GROUND_TILT_RAD].map(|sigma| sigma * sigma);
    Some(Plane {
        normal: Direction::from_vector(Vector3::z()).ok()?,
        centre: Position::from_vector(centre).ok()?,
        covariance: Matrix3::from_diagonal(&Vector3::new(shift, tilt, tilt)),
    })
}

/// How far a path is off the one that a plane reflects, in units of what is allowed: `None` when that is more than 1, when the
/// plane does not reflect between these ends, or when the UAV's place is too unsure to tell.
pub(super) fn misfit(ends: &Ends, path: &Path<World>, plane: &Plane) -> Option<f32> {
    heights_m(ends.uav.vector(), ends.gmt.vector(), plane)?;
    is_placed(ends)
        .then(|| misfit_of(ends, path, &plane.image(ends.gmt.vector())))
        .flatten()
}

/// Whether the UAV's place is known well enough to tell what a path is.
pub(super) fn is_placed(ends: &Ends) -> bool {
    ends.uav_covariance.trace() <= PLACED_M * PLACED_M
}

/// How far a path is off the straight way from a place, in units of what is allowed: `None` when that is more than 1.
pub(super) fn misfit_of(ends: &Ends, path: &Path<World>, from_m: &Vector3<f32>) -> Option<f32> {
    let towards = from_m - ends.uav.vector();
    let off = Straight::against(path, &towards, &ends.uav_covariance)?.off(path, LENGTH_M, ANGLE_RAD);
    // In this order a number that is none fits nothing.
    (off <= 1.0).then_some(off)
}

/// One end of a straight way, and how well it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct End {
    pub(super) at: Vector3<f32>,
    pub(super) covariance: Matrix3<f32>,
}

impl End {
    /// Seen in a plane, whose own error adds to it.
    pub(super) fn mirrored(&self, plane: &Plane) -> Self {
        let normal = plane.normal.vector();
        let turn = Matrix3::identity() - normal * normal.transpose() * 2.0;
        let of_plane = plane.image_jacobian(&self.at);
        Self {
            at: plane.image(&self.at),
            covariance: turn * self.covariance * turn + of_plane * plane.covariance * of_plane.transpose(),
        }
    }
}

/// Where a plane reflects between these ends, with the errors of both and of the plane. `None` when it does not.
pub(super) fn point_on(uav: &End, gmt: &End, plane: &Plane) -> Option<ReflectionPoint> {
    let (uav_m, gmt_m) = heights_m(&uav.at, &gmt.at, plane)?;
    let normal = plane.normal.vector();
    let [from, to] = [(&uav.at, uav_m), (&gmt.at, gmt_m)].map(|(end, height)| end - normal * height);
    let both_m = uav_m + gmt_m;
    let share = uav_m / both_m;
    let along = to - from;
    let position = Position::from_vector(from + along * share).ok()?;
    // Of changes of both heights and of the normal.
    let moved = |uav: f32, gmt: f32, turn: &Vector3<f32>| {
        let from = -normal * uav - turn * uav_m;
        let to = -normal * gmt - turn * gmt_m;
        from * (1.0 - share) + to * share + along * ((gmt_m * uav - uav_m * gmt) / (both_m * both_m))
    };
    let (t1, t2) = plane.tangents();
    let [uav_away, gmt_away] = [uav, gmt].map(|end| end.at - plane.centre.vector());
    let tilted = |t: &Vector3<f32>| moved(t.dot(&uav_away), t.dot(&gmt_away), t);
    let zero = Vector3::zeros();
    let of_plane = Matrix3::from_columns(&[moved(-1.0, -1.0, &zero), tilted(&t1), tilted(&t2)]);
    let of_uav = Matrix3::identity() * (1.0 - share) + moved(1.0, 0.0, &zero) * normal.transpose();
    let of_gmt = Matrix3::identity() * share + moved(0.0, 1.0, &zero) * normal.transpose();
    let spread = |by: &Matrix3<f32>, covariance: &Matrix3<f32>| by * covariance * by.transpose();
    Some(ReflectionPoint {
        position,
        covariance: spread(&of_plane, &plane.covariance)
            + spread(&of_uav, &uav.covariance)
            + spread(&of_gmt, &gmt.covariance),
        distance_m: (position.vector() - uav.at).norm(),
    })
}

/// Both ends of a link, UAV first; the GMT's place is taken as its beacon says.
pub(super) fn both(ends: &Ends) -> [End; 2] {
    [
        End {
            at: *ends.uav.vector(),
            covariance: ends.uav_covariance,
        },
        End {
            at: *ends.gmt.vector(),
            covariance: Matrix3::zeros(),
        },
    ]
}

/// Least probability of first order that makes a path one reflection.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Least {
    /// Of a path that a known mirror explains, whatever its most probable state.
    Mirrored(f32),
    /// Of any other, whose state it must be.
    Alone(f32),
}

impl Least {
    pub(super) fn is_reached(self, probabilities: &Probabilities) -> bool {
        match self {
            Self::Mirrored(least) => probabilities.first_order >= least,
            Self::Alone(least) => probabilities.is_first_order(least),
        }
    }
}

/// The better known of the point that a path alone gives and of the one on the mirror that explains it; `None` when it is not
/// known well enough: to `most_m` by the path alone.
pub(super) fn better(
    solved: &ReflectionPoint,
    most_m: f32,
    mirrored: Option<&(Mirrored, ReflectionPoint)>,
) -> Option<ReflectionPoint> {
    let (point, most_m) = match mirrored {
        Some((asked, on_mirror)) if on_mirror.sigma_m() < solved.sigma_m() => (on_mirror, asked.max_sigma_m),
        _ => (solved, most_m),
    };
    (point.sigma_m() <= most_m).then_some(*point)
}

/// Whether a point lies before a plane, and not in it.
pub(super) fn is_before(plane: &Plane, point: &Vector3<f32>) -> bool {
    plane.height_m(point) > LEAST_HEIGHT_M
}

/// Heights of both ends over a plane that reflects between them: UAV, GMT, m.
fn heights_m(uav: &Vector3<f32>, gmt: &Vector3<f32>, plane: &Plane) -> Option<(f32, f32)> {
    let [uav, gmt] = [uav, gmt].map(|end| plane.height_m(end));
    (uav > LEAST_HEIGHT_M && gmt > LEAST_HEIGHT_M).then_some((uav, gmt))
}

#[cfg(test)]
mod tests;
