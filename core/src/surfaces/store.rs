//! The store: add, find, merge, retire.

use heapless::Vec;

use super::birth::Birth;
use super::evidence::Evidence;
use super::surface::{Kind, Status, Surface};
use super::waiting::WaitingPoints;
use super::{SurfaceConfig, SurfaceIds};
use crate::geometry::{Direction, Matrix3, Plane, Position, Vector3};

/// Number of the ground.
/// Given: a name.
pub const GROUND: u16 = 0;
/// Paths that wait for their surfaces. A flight has a few dozen at a time; when it is full the oldest goes.
/// Capacity: memory of the store.
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
                evidence: Evidence::default(),
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

    /// Takes what a filter has learnt of a surface, which it held in its state. One that is not there any more needs nothing.
    pub fn give_back(&mut self, id: u16, plane: &Plane) {
        let config = self.config;
        if let Some(surface) = self.get_mut(id) {
            surface.replace_plane(plane);
            surface.floor_covariance(&config);
        }
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
        let mut evidence = Evidence::begun(transmitter_m, birth.plane.centre.vector());
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
mod tests;
