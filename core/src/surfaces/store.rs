//! The store: add, find, merge, retire.

use heapless::Vec;

use super::birth::Birth;
use super::evidence::Evidence;
use super::surface::{Kind, Status, Surface};
use super::waiting::WaitingPoints;
use super::{SurfaceConfig, SurfaceIds};
use crate::geometry::{Direction, Matrix3, Position, Vector3};
use crate::localization::planes::Plane;

/// Number of the ground.
pub const GROUND: u16 = 0;
/// Paths that wait for their surfaces. A flight has a few dozen at a time; when it is full the oldest goes.
const WAITING: usize = 64;

/// What happened in the store, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SurfaceCounters {
    /// Surfaces born.
    pub born: u32,
    /// Births refused: the store was full of surfaces at least as likely, or the numbers were used up.
    pub refused: u32,
    /// Tentative surfaces that made room for a likelier one.
    pub evicted: u32,
    /// Surfaces that were confirmed.
    pub confirmed: u32,
    /// Confirmed surfaces that became tentative again.
    pub demoted: u32,
    /// Surfaces that evidence refuted.
    pub died: u32,
    /// Surfaces that were merged into another.
    pub merged: u32,
    /// Paths that waited and were forgotten: no room, their surface died, or their points are not there any more.
    pub forgotten: u32,
}

/// Counts one up, to the end.
pub(crate) fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}

/// What a sweep changed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StatusChanges<const N: usize> {
    /// Surfaces that were confirmed: what waited for them may be mapped.
    pub confirmed: Vec<u16, N>,
    /// Surfaces that were confirmed before and are not any more: their points leave the map.
    pub demoted: Vec<u16, N>,
    /// Surfaces that died.
    pub died: Vec<u16, N>,
}

/// At most `N` surfaces.
#[derive(Clone, Debug)]
pub struct Surfaces<const N: usize> {
    config: SurfaceConfig,
    surfaces: Vec<Surface, N>,
    next_id: u16,
    pub(crate) waiting: WaitingPoints<WAITING>,
    /// What happened so far.
    pub counters: SurfaceCounters,
}

impl<const N: usize> Surfaces<N> {
    /// None yet.
    #[must_use]
    pub fn new(config: SurfaceConfig) -> Self {
        Self {
            config,
            surfaces: Vec::new(),
            next_id: GROUND + 1,
            waiting: WaitingPoints::default(),
            counters: SurfaceCounters::default(),
        }
    }

    /// The ground alone, level at the height of this point, to within [`SurfaceConfig::ground_shift_m`] and
    /// [`SurfaceConfig::ground_tilt_rad`]. It exists, and is tentative until its height is known.
    #[must_use]
    pub fn with_ground(config: SurfaceConfig, beneath: Position) -> Self {
        let mut surfaces = Self::new(config);
        let [shift, tilt] = [config.ground_shift_m, config.ground_tilt_rad].map(|sigma| sigma * sigma);
        if let Ok(normal) = Direction::from_vector(Vector3::z()) {
            let _first = surfaces.surfaces.push(Surface {
                id: GROUND,
                kind: Kind::Ground,
                plane: Plane {
                    normal,
                    centre: beneath,
                    covariance: Matrix3::from_diagonal(&Vector3::new(shift, tilt, tilt)),
                },
                log_odds: config.most_log_odds(),
                status: Status::Tentative,
                extent_m: [[0.0; 2]; 2],
                evidence: Evidence::begun(&Vector3::zeros()),
            });
        }
        surfaces
    }

    /// Settings.
    #[must_use]
    pub fn config(&self) -> &SurfaceConfig {
        &self.config
    }

    /// All surfaces, the ground first.
    pub fn iter(&self) -> impl Iterator<Item = &Surface> {
        self.surfaces.iter()
    }

    /// How many.
    #[must_use]
    pub fn len(&self) -> usize {
        self.surfaces.len()
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.surfaces.is_empty()
    }

    /// The surface of a number.
    #[must_use]
    pub fn get(&self, id: u16) -> Option<&Surface> {
        self.surfaces.iter().find(|surface| surface.id == id)
    }

    pub(crate) fn get_mut(&mut self, id: u16) -> Option<&mut Surface> {
        self.surfaces.iter_mut().find(|surface| surface.id == id)
    }

    /// Paths that wait for their surfaces.
    #[must_use]
    pub fn waiting(&self) -> &[super::Waiting] {
        self.waiting.paths()
    }

    /// Whether all surfaces of a chain are confirmed.
    #[must_use]
    pub fn are_confirmed(&self, chain: &SurfaceIds) -> bool {
        chain
            .iter()
            .all(|id| self.get(*id).is_some_and(Surface::is_confirmed))
    }

    /// The surface that a plane seen at a point belongs to: parallel, near, and seen near there.
    #[must_use]
    pub fn along(&self, plane: &Plane, within_m: f32) -> Option<&Surface> {
        self.surfaces.iter().find(|surface| {
            surface.is_along(plane, within_m, &self.config)
                && surface.outside_m(plane.centre.vector()) <= self.config.reach_m
        })
    }

    /// Adds a new surface that a path suggested while the transmitter was there. `None` when a parallel surface is near, or when the store is
    /// full of surfaces that are at least as likely; else the least of the tentative ones makes room.
    pub fn add(&mut self, birth: &Birth, transmitter_m: &Vector3<f32>, sweep: u32) -> Option<u16> {
        if self.along(&birth.plane, self.config.same_m).is_some() {
            return None;
        }
        if !self.has_room(birth.log_odds) || self.next_id == u16::MAX {
            count(&mut self.counters.refused);
            return None;
        }
        let id = self.next_id;
        let mut evidence = Evidence::begun(transmitter_m);
        evidence.last_sweep = sweep;
        let mut surface = Surface {
            id,
            kind: birth.kind,
            plane: birth.plane,
            log_odds: birth.log_odds,
            status: Status::Tentative,
            extent_m: [[0.0; 2]; 2],
            evidence,
        };
        surface.floor_covariance(&self.config);
        self.surfaces.push(surface).ok()?;
        self.next_id += 1;
        count(&mut self.counters.born);
        Some(id)
    }

    /// Makes room for a surface of these log-odds, if need be.
    fn has_room(&mut self, log_odds: f32) -> bool {
        if !self.surfaces.is_full() {
            return true;
        }
        let least = self
            .surfaces
            .iter()
            .filter(|surface| !surface.is_confirmed() && surface.kind != Kind::Ground)
            .min_by(|a, b| {
                let odds = a.log_odds.total_cmp(&b.log_odds);
                odds.then(a.evidence.last_sweep.cmp(&b.evidence.last_sweep))
            })
            .filter(|least| least.log_odds < log_odds)
            .map(|least| least.id);
        let Some(least) = least else {
            return false;
        };
        self.remove(least);
        count(&mut self.counters.evicted);
        true
    }

    fn remove(&mut self, id: u16) {
        self.surfaces.retain(|surface| surface.id != id);
        self.forget(id);
    }

    fn forget(&mut self, id: u16) {
        let forgotten = u32::try_from(self.waiting.forget(id)).unwrap_or(u32::MAX);
        self.counters.forgotten = self.counters.forgotten.saturating_add(forgotten);
    }

    /// Makes surfaces one that lie in each other: the older one stays. Which went into which.
    pub fn merge(&mut self) -> Vec<(u16, u16), N> {
        let mut merged = Vec::new();
        while let Some((stays, goes)) = self.pair_to_merge() {
            let Some(other) = self.get(goes).copied() else {
                break;
            };
            let config = self.config;
            if let Some(surface) = self.get_mut(stays) {
                absorb(surface, &other, &config);
            }
            self.surfaces.retain(|surface| surface.id != goes);
            self.waiting.rename(goes, stays);
            count(&mut self.counters.merged);
            // Each merge takes one of at most `N` away.
            let _fits = merged.push((goes, stays));
        }
        merged
    }

    fn pair_to_merge(&self) -> Option<(u16, u16)> {
        let within_m = 0.5 * self.config.same_m;
        self.surfaces.iter().enumerate().find_map(|(index, one)| {
            let others = self.surfaces.iter().skip(index + 1);
            let other = others
                .filter(|other| one.is_along(&other.plane, within_m, &self.config))
                .find(|other| gap_m(one, other) <= self.config.reach_m)?;
            Some((one.id.min(other.id), one.id.max(other.id)))
        })
    }

    /// Confirms, demotes and removes surfaces as their evidence says.
    pub fn update_status(&mut self) -> StatusChanges<N> {
        let mut changes = StatusChanges::default();
        for surface in &mut self.surfaces {
            let next = surface.next_status(&self.config);
            // There is room for all of them.
            let _fits = match (surface.status, next) {
                (Status::Tentative, Status::Confirmed) => {
                    count(&mut self.counters.confirmed);
                    changes.confirmed.push(surface.id)
                }
                (Status::Confirmed, Status::Tentative) => {
                    count(&mut self.counters.demoted);
                    changes.demoted.push(surface.id)
                }
                _ => Ok(()),
            };
            surface.status = next;
            if surface.is_dead(&self.config) {
                let _fits = changes.died.push(surface.id);
            }
        }
        for id in &changes.died {
            self.remove(*id);
            count(&mut self.counters.died);
        }
        changes
    }

    /// Forgets everything but the ground: the map that it belongs to was cleared.
    pub fn clear(&mut self) {
        self.surfaces.retain(|surface| surface.kind == Kind::Ground);
        self.waiting.clear();
    }
}

/// How far apart what was seen of two surfaces is, m: the distance of the second's box from the first's, at most.
fn gap_m(one: &Surface, other: &Surface) -> f32 {
    corners(other)
        .iter()
        .chain(core::iter::once(other.plane.centre.vector()))
        .fold(f32::INFINITY, |least, corner| least.min(one.outside_m(corner)))
}

/// Corners of what was seen of a surface, m.
fn corners(surface: &Surface) -> [Vector3<f32>; 4] {
    let (t1, t2) = surface.plane.tangents();
    let [[a, b], [c, d]] = surface.extent_m;
    [[a, c], [a, d], [b, c], [b, d]].map(|[x, y]| surface.plane.centre.vector() + t1 * x + t2 * y)
}

/// Takes another surface into this one: the mean weighted by information, what was seen of both, the stronger existence.
fn absorb(surface: &mut Surface, other: &Surface, config: &SurfaceConfig) {
    let mut moved = *other;
    let away = surface.plane.centre.vector() - other.plane.centre.vector();
    let (t1, t2) = other.plane.tangents();
    moved.recentre([t1.dot(&away), t2.dot(&away)]);
    let (t1, t2) = surface.plane.tangents();
    let normal = moved.plane.normal.vector();
    let difference = Vector3::new(
        surface.plane.height_m(moved.plane.centre.vector()),
        t1.dot(normal),
        t2.dot(normal),
    );
    let own = surface.plane.covariance;
    if let Some(inverse) = (own + moved.plane.covariance).try_inverse() {
        let gain = own * inverse;
        let covariance = (Matrix3::identity() - gain) * own;
        let by = gain * difference;
        let covariance = (covariance + covariance.transpose()) * 0.5;
        if let Some(plane) = surface.plane.corrected([by.x, by.y, by.z], covariance) {
            surface.plane = plane;
        }
    }
    for corner in corners(other) {
        surface.extend(&corner.map(f64::from));
    }
    surface.floor_covariance(config);
    if other.is_confirmed() {
        surface.status = Status::Confirmed;
    }
    if other.log_odds > surface.log_odds {
        surface.log_odds = other.log_odds;
        surface.evidence = other.evidence;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surfaces::Waiting;

    fn birth(east_m: f32, north_m: f32, log_odds: f32) -> Birth {
        Birth {
            kind: Kind::Wall,
            plane: Plane {
                normal: Direction::from_vector(-Vector3::x()).expect("not zero"),
                centre: Position::new(east_m, north_m, 3.0).expect("finite"),
                covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 1e-4, 2.5e-5)),
            },
            log_odds,
        }
    }

    fn store() -> Surfaces<3> {
        let beneath = Position::new(0.0, 0.0, 0.0).expect("finite");
        Surfaces::with_ground(SurfaceConfig::default(), beneath)
    }

    fn wait(surfaces: &mut Surfaces<3>, id: u16) {
        surfaces.waiting.push(Waiting {
            sweep: 1,
            path: 0,
            chain: SurfaceIds::from_slice(&[id]).expect("one"),
            transmitter_m: Vector3::zeros(),
            uav_m: Vector3::zeros(),
            uav_covariance_m2: Matrix3::identity(),
        });
    }

    #[test]
    fn the_ground_is_surface_0_and_of_unknown_height() {
        let surfaces = store();
        let ground = surfaces.get(GROUND).expect("there");
        assert_eq!((ground.kind, ground.status), (Kind::Ground, Status::Tentative));
        assert!((ground.plane.covariance.m11 - 0.25).abs() < 1e-6 && ground.existence() > 0.99);
        assert_eq!(ground.outside_m(&Vector3::new(500.0_f32, -900.0, 3.0)), 0.0);
    }

    #[test]
    fn no_wall_is_born_twice() {
        let mut surfaces = store();
        let origin = Vector3::zeros();
        let first = surfaces.add(&birth(20.0, 0.0, 0.0), &origin, 1);
        assert_eq!(first, Some(1));
        assert_eq!(surfaces.add(&birth(20.3, 4.0, 0.0), &origin, 1), None);
        assert_eq!(surfaces.counters.refused, 0);
        assert_eq!(
            surfaces.add(&birth(20.3, 9.0, 0.0), &origin, 1),
            Some(2),
            "far along it"
        );
        assert_eq!(surfaces.len(), 3);
    }

    #[test]
    fn when_full_the_least_tentative_makes_room_for_a_likelier_one() {
        let mut surfaces = store();
        let origin = Vector3::zeros();
        surfaces.add(&birth(20.0, 0.0, -1.0), &origin, 1);
        surfaces.add(&birth(40.0, 0.0, 0.5), &origin, 1);
        wait(&mut surfaces, 1);
        assert_eq!(surfaces.add(&birth(60.0, 0.0, -1.0), &origin, 2), None);
        assert_eq!(surfaces.counters.refused, 1);
        assert_eq!(surfaces.add(&birth(60.0, 0.0, 0.0), &origin, 2), Some(3));
        assert!(surfaces.get(1).is_none() && surfaces.get(GROUND).is_some());
        assert_eq!((surfaces.counters.evicted, surfaces.counters.forgotten), (1, 1));
    }

    #[test]
    fn two_of_one_wall_are_merged_and_the_older_stays() {
        let mut surfaces = store();
        let origin = Vector3::zeros();
        surfaces.add(&birth(20.0, 0.0, 0.0), &origin, 1);
        surfaces.add(&birth(20.5, 0.0, 2.0), &origin, 1);
        surfaces.get_mut(2).expect("born").plane.centre = Position::new(20.1, 0.0, 3.0).expect("finite");
        surfaces.get_mut(2).expect("born").plane.covariance.m11 = 0.03;
        wait(&mut surfaces, 2);
        assert_eq!(surfaces.merge().as_slice(), [(2, 1)]);
        let wall = surfaces.get(1).expect("stays");
        // 1 : 3 by their variances.
        assert!((wall.plane.centre.vector().x - 20.025).abs() < 1e-4);
        assert!((wall.plane.covariance.m11 - 0.0075).abs() < 1e-5);
        assert!((wall.log_odds - 2.0).abs() < 1e-6);
        assert_eq!(surfaces.waiting()[0].chain.as_slice(), [1]);
        assert_eq!(surfaces.len(), 2);
    }

    #[test]
    fn walls_one_behind_the_other_stay_two() {
        let mut surfaces = store();
        surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
        surfaces.add(&birth(20.5, 0.0, 0.0), &Vector3::zeros(), 1);
        assert!(surfaces.merge().is_empty());
    }

    #[test]
    fn evidence_confirms_demotes_and_removes() {
        let mut surfaces = store();
        surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
        let set = |surfaces: &mut Surfaces<3>, odds: f32| {
            surfaces.get_mut(1).expect("there").log_odds = odds;
            surfaces.update_status()
        };
        assert_eq!(set(&mut surfaces, 3.0).confirmed.as_slice(), [1]);
        assert_eq!(set(&mut surfaces, 0.5), StatusChanges::default());
        assert_eq!(set(&mut surfaces, -0.5).demoted.as_slice(), [1]);
        wait(&mut surfaces, 1);
        assert_eq!(set(&mut surfaces, -3.0).died.as_slice(), [1]);
        assert!(surfaces.get(1).is_none() && surfaces.waiting().is_empty());
        let counters = surfaces.counters;
        assert_eq!((counters.confirmed, counters.demoted, counters.died), (1, 1, 1));
    }

    #[test]
    fn a_clear_leaves_the_ground() {
        let mut surfaces = store();
        surfaces.add(&birth(20.0, 0.0, 0.0), &Vector3::zeros(), 1);
        wait(&mut surfaces, 1);
        surfaces.clear();
        assert_eq!(surfaces.len(), 1);
        assert!(surfaces.get(GROUND).is_some() && surfaces.waiting().is_empty());
    }
}
