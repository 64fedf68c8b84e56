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
use crate::lscn::{LinkState, Probabilities};
use crate::path::Path;
use crate::reflection::{Ends, ReflectionPoint};

/// How far length and direction may be off those of a mirror, m and rad, beside three standard deviations of path and
/// pose. What the mirror's own error would allow is not added: a mirror that is known too poorly proves nothing.
const LENGTH_M: f32 = 0.15;
const ANGLE_RAD: f32 = 0.003;
/// Height over the mirror below which an end lies in it, m.
pub(super) const LEAST_HEIGHT_M: f32 = 0.1;
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
            Self::Alone(least) => {
                probabilities.state() == LinkState::FirstOrder && probabilities.first_order >= least
            }
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

/// Heights of both ends over a plane that reflects between them: UAV, GMT, m.
fn heights_m(uav: &Vector3<f32>, gmt: &Vector3<f32>, plane: &Plane) -> Option<(f32, f32)> {
    let [uav, gmt] = [uav, gmt].map(|end| plane.height_m(end));
    (uav > LEAST_HEIGHT_M && gmt > LEAST_HEIGHT_M).then_some((uav, gmt))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::path::diagonal_covariance;

    fn at(x: f32, y: f32, z: f32) -> Position<World> {
        Position::new(x, y, z).expect("finite")
    }

    /// A wall that faces west at x = 10, known to 3 cm and 2 mrad, and both ends before it.
    fn wall() -> (Ends, Plane) {
        let ends = Ends {
            gmt: at(1.0, 0.0, 1.5),
            uav: at(6.0, 30.0, 9.0),
            uav_covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 0.004, 0.0025)),
        };
        let plane = Plane {
            normal: Direction::from_vector(-Vector3::x()).expect("some"),
            centre: at(10.0, 12.0, 4.0),
            covariance: Matrix3::from_diagonal(&Vector3::new(9e-4, 4e-6, 4e-6)),
        };
        (ends, plane)
    }

    fn reflected(ends: &Ends, plane: &Plane) -> Option<ReflectionPoint> {
        let [uav, gmt] = both(ends);
        point_on(&uav, &gmt, plane)
    }

    /// The path that a plane reflects, longer and turned towards north by so much.
    fn path(ends: &Ends, plane: &Plane, longer_m: f32, turned_rad: f32) -> Path<World> {
        let towards = plane.image(ends.gmt.vector()) - ends.uav.vector();
        let across = Vector3::z().cross(&towards).normalize() * (towards.norm() * libm::tanf(turned_rad));
        Path {
            c_tau_m: towards.norm() + longer_m,
            aoa: Direction::from_vector(towards + across).expect("some"),
            aod: None,
            covariance: diagonal_covariance(0.04, 0.002),
        }
    }

    #[test]
    fn a_wall_explains_the_path_that_it_reflects_and_no_other() {
        let (ends, plane) = wall();
        let misfit = |longer_m, turned_rad| misfit(&ends, &path(&ends, &plane, longer_m, turned_rad), &plane);
        assert!(misfit(0.0, 0.0).expect("its own") < 0.01);
        // 0.15 m and three times hypot(0.04, 0.07) m; 3 mrad and three times hypot(2, 3.7) mrad.
        assert!(misfit(0.3, 0.0).is_some() && misfit(0.5, 0.0).is_none() && misfit(-0.5, 0.0).is_none());
        assert!(misfit(0.0, 0.012).is_some() && misfit(0.0, 0.018).is_none());
        let mut poor = path(&ends, &plane, 0.0, 0.0);
        poor.c_tau_m = f32::NAN;
        assert_eq!(super::misfit(&ends, &poor, &plane), None);
    }

    #[test]
    fn a_wall_explains_nothing_from_behind_or_to_a_uav_that_is_nowhere() {
        let (ends, plane) = wall();
        let path = path(&ends, &plane, 0.0, 0.0);
        let behind = Ends {
            gmt: at(19.0, 0.0, 1.5),
            ..ends
        };
        let seen = Path {
            c_tau_m: ends.uav.distance_m(&at(1.0, 0.0, 1.5)),
            aoa: Direction::from_vector(at(1.0, 0.0, 1.5).from_origin(&ends.uav)).expect("some"),
            ..path
        };
        assert_eq!(misfit(&behind, &seen, &plane), None);
        assert_eq!(reflected(&behind, &plane), None);
        let unsure = Ends {
            uav_covariance: ends.uav_covariance * 9.0,
            ..ends
        };
        assert_eq!(misfit(&unsure, &path, &plane), None);
    }

    #[test]
    fn the_point_lies_on_the_wall_and_halves_the_way() {
        let (ends, plane) = wall();
        let point = reflected(&ends, &plane).expect("before it");
        // Heights 4 and 9 m: four thirteenths of the way along the wall.
        let expected = Vector3::new(10.0, 30.0 - 30.0 * 4.0 / 13.0, 9.0 - 7.5 * 4.0 / 13.0);
        assert!((point.position.vector() - expected).norm() < 1e-4, "{point:?}");
        let length_m = point.distance_m + point.position.distance_m(&ends.gmt);
        let image_m = (plane.image(ends.gmt.vector()) - ends.uav.vector()).norm();
        assert!((length_m - image_m).abs() < 1e-4);
    }

    #[test]
    fn its_covariance_is_that_of_difference_quotients() {
        let (ends, plane) = wall();
        let here = *reflected(&ends, &plane).expect("before it").position.vector();
        let step = 0.02;
        let by = |ends: &Ends, plane: &Plane| {
            (reflected(ends, plane).expect("before it").position.vector() - here) / step
        };
        let mut expected = Matrix3::zeros();
        for axis in 0..3 {
            let mut away = Vector3::zeros();
            away[axis] = step;
            let moved = Ends {
                uav: Position::from_vector(ends.uav.vector() + away).expect("finite"),
                ..ends
            };
            let column = by(&moved, &plane);
            expected += column * column.transpose() * ends.uav_covariance[(axis, axis)];
            let mut change = [0.0; 3];
            change[axis] = step;
            let moved = plane.corrected(change, plane.covariance).expect("finite");
            let column = by(&ends, &moved);
            expected += column * column.transpose() * plane.covariance[(axis, axis)];
        }
        let found = reflected(&ends, &plane).expect("before it").covariance;
        assert!(
            (found - expected).norm() < 0.02 * expected.norm(),
            "{found} {expected}"
        );
    }

    #[test]
    fn a_mirror_asks_less_of_the_network() {
        let of = |los, first_order| Probabilities {
            los,
            first_order,
            higher_order: 1.0 - los - first_order,
        };
        let cases = [
            (of(0.0, 0.85), true, true),
            (of(0.0, 0.4), false, true),
            (of(0.0, 0.2), false, false),
        ];
        for (probabilities, alone, mirrored) in cases {
            assert_eq!(
                Least::Alone(0.8).is_reached(&probabilities),
                alone,
                "{probabilities:?}"
            );
            assert_eq!(
                Least::Mirrored(0.3).is_reached(&probabilities),
                mirrored,
                "{probabilities:?}"
            );
        }
        // However little is asked, alone the state must be first order.
        assert!(!Least::Alone(0.0).is_reached(&of(0.5, 0.4)));
    }

    #[test]
    fn the_better_known_point_is_taken_if_it_is_known_well_enough() {
        let known_to = |sigma_m: f32, x: f32| ReflectionPoint {
            position: at(x, 0.0, 0.0),
            covariance: Matrix3::from_diagonal(&Vector3::new(sigma_m * sigma_m, 0.0, 0.0)),
            distance_m: 1.0,
        };
        let asked = Mirrored {
            max_sigma_m: 1.5,
            ..Mirrored::default()
        };
        let x_of = |solved_m, mirror_m: Option<f32>| {
            let on_mirror = mirror_m.map(|sigma_m| (asked, known_to(sigma_m, 2.0)));
            better(&known_to(solved_m, 1.0), 0.5, on_mirror.as_ref()).map(|point| point.position.vector().x)
        };
        assert_eq!([x_of(0.4, None), x_of(0.6, None)], [Some(1.0), None]);
        assert_eq!(
            [x_of(0.4, Some(0.45)), x_of(0.4, Some(0.1))],
            [Some(1.0), Some(2.0)]
        );
        assert_eq!([x_of(9.0, Some(1.4)), x_of(9.0, Some(1.6))], [Some(2.0), None]);
        // A poor mirror does not excuse a poor path.
        assert_eq!(x_of(0.6, Some(0.7)), None);
    }

    #[test]
    fn the_ground_lies_level_at_its_height() {
        let (ends, _) = wall();
        let plane = ground(&ends, -0.5).expect("a number");
        assert_eq!(plane.height_m(&Vector3::new(40.0, -7.0, -0.5)), 0.0);
        let point = reflected(&ends, &plane).expect("above it");
        assert!((point.position.vector().z + 0.5).abs() < 1e-5);
        assert!(point.covariance.m33 < 1.1 * (GROUND_SHIFT_M * GROUND_SHIFT_M) + 1e-3);
        assert_eq!(ground(&ends, f32::NAN), None);
    }
}
