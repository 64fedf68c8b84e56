//! Mirrors known by what they reflected: a wall is found by two reflections, long before a plane can be fitted to points.
//!
//! Where a wave was reflected the mirror's normal halves the angle between the ways to both ends, so a reflection point
//! that is solved with a good pose is a piece of plane, offset and both tilts. Two that lie in one another are a mirror;
//! more of them make it more precise. The filter holds the pose by them until the map has the plane itself.

use heapless::Vec;

use super::known::Bounds;
use crate::geometry::{Direction, Matrix3, Position, Vector3, World};
use crate::localization::filter::MappedPlane;
use crate::localization::planes::Plane;
use crate::reflection::Ends;

/// Mirrors kept that paths of one reflection have shown, and that paths of more have.
pub(super) const MIRRORS: usize = 16;
pub(super) const SUPPOSED: usize = 24;
/// Position of which a point is used, standard deviation (norm), m.
pub(super) const PLACED_M: f32 = 0.25;
/// Standard deviations of a mirror: shift, m, tilts, rad.
const SHIFT_M: f32 = 0.15;
const TILT_RAD: f32 = 0.012;
/// Weight of what is known against a new piece, at most.
const MOST_SWEEPS: u16 = 8;
/// Numbers of mirrors begin here, those of the map's planes at zero.
const FIRST_ID: u32 = 1 << 30;

/// What makes pieces of plane one mirror, and a mirror a known one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rule {
    /// Distance of a centre from the other plane, m, and cosine of the angle between the normals, of pieces that are one.
    same_m: f32,
    same_cosine: f32,
    /// Sweeps that must have shown it, and stops of the GMT that they were of.
    sweeps: u16,
    stops: u16,
    first_id: u32,
}

impl Rule {
    /// Of paths of one reflection: 0.4 m and 3 degrees. Three sweeps prove a mirror: two may be wrong in the same way.
    const SINGLE: Self = Self {
        same_m: 0.4,
        same_cosine: 0.9986,
        sweeps: 3,
        stops: 1,
        first_id: FIRST_ID,
    };
    /// Of what paths of two reflections make one suppose: 0.2 m and 1.5 degrees, four sweeps. While the GMT stands still
    /// the source of any path does, and with it whatever plane is supposed; when it moves on, the source of another chain of
    /// mirrors moves otherwise. So two stops must agree.
    const SUPPOSED: Self = Self {
        same_m: 0.2,
        same_cosine: 0.999_657,
        sweeps: 4,
        stops: 2,
        first_id: 2 * FIRST_ID,
    };

    fn same(&self, a: &Plane, b: &Plane) -> bool {
        a.normal.vector().dot(b.normal.vector()) > self.same_cosine
            && a.height_m(b.centre.vector()).abs() < self.same_m
            && b.height_m(a.centre.vector()).abs() < self.same_m
    }
}

/// Whether two planes are of one wall.
pub(super) fn same(a: &Plane, b: &Plane) -> bool {
    Rule::SINGLE.same(a, b)
}

/// A piece of plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Mirror {
    /// The plane and its number.
    pub(super) of: MappedPlane,
    /// Around the points where it was seen.
    pub(super) bounds_m: Bounds,
    sweeps: u16,
    sweep: u32,
    stops: u16,
    stop: u32,
}

/// The newest mirrors.
#[derive(Clone, Debug)]
pub(super) struct Mirrors<const N: usize> {
    rule: Rule,
    mirrors: Vec<Mirror, N>,
    found: u32,
}

impl Mirrors<MIRRORS> {
    /// None yet; those that paths of one reflection show.
    pub(super) fn single() -> Self {
        Self::by(Rule::SINGLE)
    }
}

impl Mirrors<SUPPOSED> {
    /// None yet; those that paths of two reflections make one suppose.
    pub(super) fn supposed() -> Self {
        Self::by(Rule::SUPPOSED)
    }
}

impl<const N: usize> Mirrors<N> {
    fn by(rule: Rule) -> Self {
        Self {
            rule,
            mirrors: Vec::new(),
            found: 0,
        }
    }

    /// Takes in a piece of plane that was seen in this sweep, from this stop of the GMT. Whether it has just proven a mirror.
    pub(super) fn enter(&mut self, sweep: u32, stop: u32, plane: &Plane) -> bool {
        let rule = self.rule;
        if let Some(known) = self
            .mirrors
            .iter_mut()
            .find(|known| rule.same(&known.of.plane, plane))
        {
            let before = known.is_proven(&rule);
            known.join(sweep, stop, plane);
            return !before && known.is_proven(&rule);
        }
        let mirror = Mirror {
            of: MappedPlane {
                id: rule.first_id | self.found,
                plane: *plane,
            },
            bounds_m: Bounds::at(plane.centre.vector()),
            sweeps: 1,
            sweep,
            stops: 1,
            stop,
        };
        self.found = self.found.wrapping_add(1) & (FIRST_ID - 1);
        if self.mirrors.push(mirror).is_err()
            && let Some(oldest) = self
                .mirrors
                .iter_mut()
                .min_by_key(|old| (old.sweeps > 1, old.sweep))
        {
            *oldest = mirror;
        }
        false
    }

    /// Those that more than one sweep has shown: good enough to hold a pose that they must fit.
    pub(super) fn seen(&self) -> impl Iterator<Item = &Mirror> {
        self.mirrors.iter().filter(|mirror| mirror.sweeps > 1)
    }

    /// Those that may prove what a path is.
    pub(super) fn proven(&self) -> impl Iterator<Item = &Mirror> {
        self.mirrors.iter().filter(|mirror| mirror.is_proven(&self.rule))
    }
}

impl Mirror {
    fn is_proven(&self, rule: &Rule) -> bool {
        self.sweeps >= rule.sweeps && self.stops >= rule.stops
    }

    /// Takes in another piece of it.
    fn join(&mut self, sweep: u32, stop: u32, plane: &Plane) {
        let share = 1.0 / f32::from(self.sweeps.saturating_add(1));
        let mean = |old: &Vector3<f32>, new: &Vector3<f32>| old + (new - old) * share;
        let known = &mut self.of.plane;
        let normal = Direction::from_vector(mean(known.normal.vector(), plane.normal.vector()));
        let centre = Position::from_vector(mean(known.centre.vector(), plane.centre.vector()));
        let (Ok(normal), Ok(centre)) = (normal, centre) else {
            return;
        };
        self.bounds_m.take_in(plane.centre.vector());
        (known.normal, known.centre) = (normal, centre);
        if self.sweep != sweep {
            self.sweeps = self.sweeps.saturating_add(1).min(MOST_SWEEPS);
        }
        if self.stop != stop {
            self.stops = self.stops.saturating_add(1);
        }
        (self.sweep, self.stop) = (sweep, stop);
    }
}

/// The piece of plane at a point where a wave was reflected. `None` when the UAV's place is not known well enough.
pub(super) fn piece(ends: &Ends, point: &Position<World>) -> Option<Plane> {
    let way = |end: &Position<World>| Direction::<World>::from_vector(end.from_origin(point)).ok();
    let normal = Direction::from_vector(way(&ends.gmt)?.vector() + way(&ends.uav)?.vector()).ok()?;
    let sigma_m = libm::sqrtf(ends.uav_covariance.trace().max(0.0));
    (sigma_m <= PLACED_M).then(|| piece_of(normal, *point))
}

/// A piece of plane of which one path tells.
pub(super) fn piece_of(normal: Direction<World>, centre: Position<World>) -> Plane {
    let tilt = TILT_RAD * TILT_RAD;
    Plane {
        normal,
        centre,
        covariance: Matrix3::new(SHIFT_M * SHIFT_M, 0.0, 0.0, 0.0, tilt, 0.0, 0.0, 0.0, tilt),
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
