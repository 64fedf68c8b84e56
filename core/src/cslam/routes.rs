//! Paths for tests, made of the points where they were reflected: the mirrors follow from the path, not the path from mirrors.

use heapless::Vec;

use super::known::{Bounds, Known};
use super::mirrors::piece_of;
use crate::geometry::{Direction, Matrix3, Position, Vector3, World};
use crate::path::{Departure, Path, diagonal_covariance};
use crate::reflection::Ends;

/// The way of a wave: GMT, reflections, UAV.
pub(super) struct Route {
    points: Vec<Vector3<f32>, 5>,
}

impl Route {
    pub(super) fn over(points: &[[f32; 3]]) -> Self {
        Self {
            points: points.iter().map(|point| Vector3::from(*point)).collect(),
        }
    }

    /// Over walls that stand upright: between its ends, of these heights, the wave rises evenly.
    pub(super) fn upright(plan: &[[f32; 2]], gmt_z_m: f32, uav_z_m: f32) -> Self {
        let mut flat = Self {
            points: plan.iter().map(|[x, y]| Vector3::new(*x, *y, 0.0)).collect(),
        };
        let all_m = flat.length_m();
        let (mut gone_m, mut from) = (0.0, flat.points[0]);
        for point in &mut flat.points {
            gone_m += (*point - from).norm();
            from = *point;
            point.z = gmt_z_m + (uav_z_m - gmt_z_m) * gone_m / all_m;
        }
        flat
    }

    /// The same way from the UAV's place to the GMT's.
    pub(super) fn back(&self) -> Self {
        Self {
            points: self.points.iter().rev().copied().collect(),
        }
    }

    fn length_m(&self) -> f32 {
        self.legs().map(|(from, to)| (to - from).norm()).sum()
    }

    /// The straight pieces of the way.
    pub(super) fn legs(&self) -> impl Iterator<Item = (Vector3<f32>, Vector3<f32>)> {
        self.points.windows(2).map(|pair| (pair[0], pair[1]))
    }

    pub(super) fn reflections(&self) -> &[Vector3<f32>] {
        &self.points[1..self.points.len() - 1]
    }

    /// Its ends; the UAV's is known to 5 cm an axis.
    pub(super) fn ends(&self) -> Ends {
        Ends {
            gmt: at(self.points[0]),
            uav: at(self.points[self.points.len() - 1]),
            uav_covariance: Matrix3::identity() * 0.0025,
        }
    }

    /// As it is measured, without an error.
    pub(super) fn path(&self) -> Path<World> {
        let towards =
            |from: Vector3<f32>, to: Vector3<f32>| Direction::from_vector(to - from).expect("apart");
        let (gmt, first) = self.legs().next().expect("two points");
        let (last, uav) = self.legs().last().expect("two points");
        Path {
            c_tau_m: self.length_m(),
            aoa: towards(uav, last),
            aod: Some(Departure {
                direction: towards(gmt, first),
                sigma_rad: 0.003,
            }),
            covariance: diagonal_covariance(0.04, 0.002),
        }
    }

    /// The mirror of a reflection: it halves the angle there. It was seen within a metre of that point, and is said by another
    /// of its points.
    pub(super) fn mirror(&self, index: usize) -> Known {
        let point = self.points[index + 1];
        let [before, after] = [index, index + 2].map(|end| (self.points[end] - point).normalize());
        let normal = Direction::from_vector(before + after).expect("not straight on");
        let mut plane = piece_of(normal, at(point));
        let (t1, t2) = plane.tangents();
        plane.centre = at(point + t1 * 0.7 - t2 * 0.4);
        Known {
            plane,
            bounds_m: within_a_metre(&point),
        }
    }
}

pub(super) fn at(point: Vector3<f32>) -> Position<World> {
    Position::from_vector(point).expect("finite")
}

pub(super) fn within_a_metre(point: &Vector3<f32>) -> Bounds {
    let mut bounds = Bounds::at(point);
    for away in [-1.0, 1.0] {
        bounds.take_in(&(point + Vector3::repeat(away)));
    }
    bounds
}

/// A wall across the middle of a leg; it was seen there, or so far aside.
pub(super) fn across((from, to): (Vector3<f32>, Vector3<f32>), aside_m: f32) -> Known {
    let mut level = to - from;
    level.z = 0.0;
    let plane = piece_of(
        Direction::from_vector(-level).expect("a leg"),
        at((from + to) * 0.5),
    );
    let (t1, _) = plane.tangents();
    Known {
        plane,
        bounds_m: within_a_metre(&(plane.centre.vector() + t1 * aside_m)),
    }
}

/// A direction turned to the left by so much.
pub(super) fn turned(direction: &Direction<World>, by_rad: f32) -> Direction<World> {
    let left = Vector3::z().cross(direction.vector()).normalize();
    Direction::from_vector(direction.vector() + left * libm::tanf(by_rad)).expect("not zero")
}

/// The same path, with its departure turned to the left.
pub(super) fn left_turned(path: &Path<World>, by_rad: f32) -> Path<World> {
    Path {
        aod: path.aod.map(|departure| Departure {
            direction: turned(&departure.direction, by_rad),
            ..departure
        }),
        ..*path
    }
}
