//! Mirrors known by what they reflected: a wall is found by two reflections, long before a plane can be fitted to points.
//!
//! Where a wave was reflected the mirror's normal halves the angle between the ways to both ends, so a reflection point
//! that is solved with a good pose is a piece of plane, offset and both tilts. Two that lie in one another are a mirror;
//! more of them make it more precise. The filter holds the pose by them until the map has the plane itself.

use heapless::Vec;

use crate::geometry::{Direction, Matrix3, Position, World};
use crate::localization::filter::MappedPlane;
use crate::localization::planes::{Plane, Surface};
use crate::reflection::Ends;

/// Mirrors kept.
pub(super) const MIRRORS: usize = 8;
/// Planes within this are one: distance of a centre, m, and cosine of the angle between the normals (3 degrees).
const SAME_M: f32 = 0.4;
const SAME_COSINE: f32 = 0.9986;
/// Position of which a point is used, standard deviation (norm), m.
const PLACED_M: f32 = 0.25;
/// Standard deviations of a mirror: shift, m, tilts, rad.
const SHIFT_M: f32 = 0.15;
const TILT_RAD: f32 = 0.012;
/// Weight of what is known against a new point, at most.
const MOST_HITS: u16 = 8;
/// Sweeps that must have shown a mirror before it may prove what a path is: two may be wrong in the same way.
const PROVEN_HITS: u16 = 3;
/// Numbers of mirrors begin here, those of the map's planes at zero.
const FIRST_ID: u32 = 1 << 31;

/// A piece of plane.
#[derive(Clone, Copy, Debug)]
struct Mirror {
    id: u32,
    plane: Plane,
    hits: u16,
    sweep: u32,
}

/// The newest mirrors.
#[derive(Clone, Debug, Default)]
pub(super) struct Mirrors {
    mirrors: Vec<Mirror, MIRRORS>,
    found: u32,
}

fn same(a: &Plane, b: &Plane) -> bool {
    a.normal.vector().dot(b.normal.vector()) > SAME_COSINE
        && a.height_m(b.centre.vector()).abs() < SAME_M
        && b.height_m(a.centre.vector()).abs() < SAME_M
}

impl Mirrors {
    /// Takes in a point where a wave was reflected in this sweep.
    pub(super) fn enter(&mut self, sweep: u32, ends: &Ends, point: &Position<World>) {
        let way = |end: &Position<World>| Direction::<World>::from_vector(end.from_origin(point)).ok();
        let (Some(to_gmt), Some(to_uav)) = (way(&ends.gmt), way(&ends.uav)) else {
            return;
        };
        let sigma_m = libm::sqrtf(ends.uav_covariance.trace().max(0.0));
        let Ok(normal) = Direction::from_vector(to_gmt.vector() + to_uav.vector()) else {
            return;
        };
        if sigma_m > PLACED_M {
            return;
        }
        let tilt = TILT_RAD * TILT_RAD;
        let plane = Plane {
            normal,
            centre: *point,
            covariance: Matrix3::new(SHIFT_M * SHIFT_M, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0, tilt),
        };
        if let Some(known) = self.mirrors.iter_mut().find(|known| same(&known.plane, &plane)) {
            let share = 1.0 / f32::from(known.hits.saturating_add(1));
            let mean = |old: &nalgebra::Vector3<f32>, new: &nalgebra::Vector3<f32>| old + (new - old) * share;
            let normal = Direction::from_vector(mean(known.plane.normal.vector(), normal.vector()));
            let centre = Position::from_vector(mean(known.plane.centre.vector(), point.vector()));
            if let (Ok(normal), Ok(centre)) = (normal, centre) {
                (known.plane.normal, known.plane.centre) = (normal, centre);
                if known.sweep != sweep {
                    known.hits = known.hits.saturating_add(1).min(MOST_HITS);
                }
                known.sweep = sweep;
            }
            return;
        }
        let mirror = Mirror {
            id: FIRST_ID | self.found,
            plane,
            hits: 1,
            sweep,
        };
        self.found = self.found.wrapping_add(1) & !FIRST_ID;
        if self.mirrors.push(mirror).is_err()
            && let Some(oldest) = self
                .mirrors
                .iter_mut()
                .min_by_key(|old| (old.hits > 1, old.sweep))
        {
            *oldest = mirror;
        }
    }

    /// Those that more than one sweep has shown, and that are none of the map's planes.
    pub(super) fn beside<'a>(&'a self, surfaces: &'a [Surface]) -> impl Iterator<Item = MappedPlane> + 'a {
        self.seen(2, surfaces)
    }

    /// Those of them that may prove what a path is.
    pub(super) fn proven<'a>(&'a self, surfaces: &'a [Surface]) -> impl Iterator<Item = MappedPlane> + 'a {
        self.seen(PROVEN_HITS, surfaces)
    }

    fn seen<'a>(&'a self, least: u16, surfaces: &'a [Surface]) -> impl Iterator<Item = MappedPlane> + 'a {
        self.mirrors
            .iter()
            .filter(move |mirror| mirror.hits >= least)
            .filter(|mirror| !surfaces.iter().any(|surface| same(&surface.plane, &mirror.plane)))
            .map(|mirror| MappedPlane {
                id: mirror.id,
                plane: mirror.plane,
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Vector3;
    use crate::localization::planes::Orientation;

    /// A wall x = 10 that faces west, the ends before it, and the point where it reflects.
    fn reflection(uav_y: f32) -> (Ends, Position<World>) {
        let ends = Ends {
            gmt: Position::new(0.0, 0.0, 1.5).expect("finite"),
            uav: Position::new(5.0, uav_y, 6.5).expect("finite"),
            uav_covariance: Matrix3::identity() * 0.01,
        };
        // Of the way from the image at x = 20, the first two thirds lie behind the wall.
        let image = Vector3::new(20.0, 0.0, 1.5);
        let point = image + (ends.uav.vector() - image) * (2.0 / 3.0);
        (ends, Position::from_vector(point).expect("finite"))
    }

    fn known(mirrors: &Mirrors, surfaces: &[Surface]) -> Vec<MappedPlane, MIRRORS> {
        mirrors.beside(surfaces).collect()
    }

    #[test]
    fn two_reflections_of_two_sweeps_are_the_wall() {
        let mut mirrors = Mirrors::default();
        for (sweep, uav_y) in [(7, 9.0), (7, 10.0)] {
            let (ends, point) = reflection(uav_y);
            mirrors.enter(sweep, &ends, &point);
        }
        assert!(known(&mirrors, &[]).is_empty(), "one sweep may be wrong");
        let (ends, point) = reflection(12.0);
        mirrors.enter(8, &ends, &point);
        let found = known(&mirrors, &[]);
        assert_eq!(found.len(), 1);
        let plane = found[0].plane;
        assert!((plane.normal.vector() + Vector3::x()).norm() < 1e-5, "{plane:?}");
        assert!(
            plane.height_m(&Vector3::new(10.0, -30.0, 2.0)).abs() < 1e-4,
            "{plane:?}"
        );
        assert!(found[0].id >= FIRST_ID);
        assert_eq!(mirrors.proven(&[]).count(), 0, "two may be wrong in the same way");
        let (ends, point) = reflection(13.0);
        mirrors.enter(9, &ends, &point);
        assert_eq!(mirrors.proven(&[]).count(), 1);
    }

    #[test]
    fn a_place_that_is_not_known_well_shows_no_mirror() {
        let mut mirrors = Mirrors::default();
        for sweep in 0..4 {
            let (ends, point) = reflection(9.0 + sweep as f32);
            let unsure = Ends {
                uav_covariance: Matrix3::identity() * 0.04,
                ..ends
            };
            mirrors.enter(sweep, &unsure, &point);
        }
        assert!(known(&mirrors, &[]).is_empty());
    }

    #[test]
    fn a_plane_of_the_map_is_not_named_twice() {
        let mut mirrors = Mirrors::default();
        for sweep in 0..2 {
            let (ends, point) = reflection(9.0 + sweep as f32);
            mirrors.enter(sweep, &ends, &point);
        }
        let mut plane = known(&mirrors, &[])[0].plane;
        let surface = |plane| Surface {
            id: 0,
            plane,
            orientation: Orientation::Vertical,
            extent_m: [[-3.0, 3.0]; 2],
            support: 9,
        };
        assert!(known(&mirrors, &[surface(plane)]).is_empty());
        plane.centre = Position::new(12.0, 0.0, 2.0).expect("finite");
        assert_eq!(
            known(&mirrors, &[surface(plane)]).len(),
            1,
            "another wall, 2 m behind"
        );
    }

    #[test]
    fn mirrors_seen_once_make_room_first_and_then_the_oldest() {
        let mut mirrors = Mirrors::default();
        let enter = |mirrors: &mut Mirrors, sweep: u32, x_m: f32| {
            let (ends, point) = reflection(9.0 + sweep as f32 * 0.01);
            let aside =
                |p: &Position<World>| Position::from_vector(p.vector() + Vector3::x() * x_m).expect("finite");
            let ends = Ends {
                gmt: aside(&ends.gmt),
                uav: aside(&ends.uav),
                ..ends
            };
            mirrors.enter(sweep, &ends, &aside(&point));
        };
        enter(&mut mirrors, 0, 0.0);
        enter(&mut mirrors, 1, 0.0);
        for k in 1..=(MIRRORS as u32 + 3) {
            enter(&mut mirrors, 1 + k, 5.0 * k as f32);
        }
        let found = known(&mirrors, &[]);
        assert_eq!(found.len(), 1, "the one that two sweeps have shown stays");
        assert!((found[0].plane.centre.vector().x - 10.0).abs() < 1e-3);
    }
}
