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
mod tests;
