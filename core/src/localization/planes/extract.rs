//! Planes from the point cloud, a little at a time.
//!
//! Every call does a bounded piece of work: it fits the next plane anew to the points that lie on it now (the map moves
//! while points are fused), and looks at a few points that no plane explains yet: each is a seed, and the upright
//! planes through it and each of its neighbours, and the level one, are hypotheses. The best one becomes a plane when
//! enough of the neighbourhood lies on it, more than chance would put there.

use heapless::Vec;

use super::fit::{Orientation, PlaneNoise, fit, through};
use super::plane::Plane;
use crate::geometry::{Position, World};
use crate::map::{MapPoint, PointCloud};

/// Points of a neighbourhood at most.
const NEIGHBOURS: usize = 48;
/// Hypotheses need points this far apart, m.
const LEAST_BASE_M: f32 = 1.0;
/// Points count as on a plane within this many standard deviations, but at most so far, m.
const GATE_SIGMAS: f32 = 2.5;
const MOST_GATE_M: f32 = 0.4;
/// Planes whose normals are closer than this (cosine of 5 degrees) and that lie in each other are the same.
const PARALLEL: f32 = 0.996;
/// Share of the points of a neighbourhood that lie on its plane at least. So many hypotheses are tried that clutter
/// would find one.
const LEAST_SHARE: f32 = 0.3;
/// Fits of a new plane before it is judged.
const SETTLING: usize = 4;

/// What makes a plane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneConfig {
    /// Errors.
    pub noise: PlaneNoise,
    /// Radius of the neighbourhood of a seed, m.
    pub radius_m: f32,
    /// Points of a plane at least.
    pub least_support: u16,
    /// Times that many points must lie on it than chance would put there.
    pub over_chance: f32,
    /// Length of a plane along its longer side at least, m.
    pub least_length_m: f32,
    /// Height of the points of a wall at least, and width of those of a floor, m: points along a level line are either.
    pub least_width_m: f32,
    /// Points this far beyond the extent still belong to the plane, m.
    pub gap_m: f32,
    /// Seeds looked at in one call.
    pub seeds: usize,
}

impl Default for PlaneConfig {
    /// Neighbourhoods of 6 m; 8 points over 2 m x 0.8 m at least, three times chance; gaps of 4 m; 4 seeds.
    fn default() -> Self {
        Self {
            noise: PlaneNoise::default(),
            radius_m: 6.0,
            least_support: 8,
            over_chance: 3.0,
            least_length_m: 2.0,
            least_width_m: 0.8,
            gap_m: 4.0,
            seeds: 4,
        }
    }
}

/// A plane of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Number of the plane: never used again for another one.
    pub id: u32,
    /// The plane with its covariance.
    pub plane: Plane,
    /// How it stands.
    pub orientation: Orientation,
    /// Least and largest coordinate of its points along each tangent ([`Plane::tangents`]), from its centre, m.
    pub extent_m: [[f32; 2]; 2],
    /// Points on it.
    pub support: u16,
}

impl Surface {
    /// Whether a point of the plane lies within the extent, widened by `margin_m`.
    #[must_use]
    pub fn covers(&self, point: &Position<World>, margin_m: f32) -> bool {
        let away = point.from_origin(&self.plane.centre);
        let (t1, t2) = self.plane.tangents();
        let inside = |[least, most]: &[f32; 2], x: f32| x > least - margin_m && x < most + margin_m;
        let [one, two] = &self.extent_m;
        inside(one, t1.dot(&away)) && inside(two, t2.dot(&away))
    }

    /// Whether a point of the cloud belongs to the plane.
    fn holds(&self, point: &MapPoint, config: &PlaneConfig) -> bool {
        lies_on(&self.plane, point, &config.noise) && self.covers(&point.position, config.gap_m)
    }

    /// Length along the longer side, m.
    fn length_m(&self) -> f32 {
        self.extent_m
            .iter()
            .map(|[least, most]| most - least)
            .fold(0.0, f32::max)
    }
}

fn lies_on(plane: &Plane, point: &MapPoint, noise: &PlaneNoise) -> bool {
    let gate_m = (GATE_SIGMAS * libm::sqrtf(noise.variance_m2(point))).min(MOST_GATE_M);
    plane.height_m(point.position.vector()).abs() < gate_m
}

/// What became of the planes, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PlaneCounters {
    /// Found.
    pub found: u32,
    /// Given up because their points went away.
    pub lost: u32,
    /// Given up because they turned out to be part of another one.
    pub merged: u32,
    /// Found but not kept because there was no room.
    pub no_room: u32,
}

/// At most `P` planes of a map.
#[derive(Clone, Debug)]
pub struct PlaneMap<const P: usize> {
    config: PlaneConfig,
    surfaces: Vec<Surface, P>,
    next_id: u32,
    /// Next plane to be fitted anew, next point to be a seed.
    turn: usize,
    seed: usize,
    counters: PlaneCounters,
}

impl<const P: usize> PlaneMap<P> {
    /// No planes.
    #[must_use]
    pub const fn new(config: PlaneConfig) -> Self {
        Self {
            config,
            surfaces: Vec::new(),
            next_id: 0,
            turn: 0,
            seed: 0,
            counters: PlaneCounters {
                found: 0,
                lost: 0,
                merged: 0,
                no_room: 0,
            },
        }
    }

    /// The planes.
    #[must_use]
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// What became of all planes so far.
    #[must_use]
    pub fn counters(&self) -> PlaneCounters {
        self.counters
    }

    /// One piece of work: about `(SETTLING + seeds + 2)` passes over the cloud. `seen_from`: a place in free space,
    /// such as the UAV's, towards which new planes face.
    pub fn update<const N: usize>(&mut self, cloud: &PointCloud<N>, seen_from: &Position<World>) {
        self.refit(cloud);
        for _ in 0..self.config.seeds {
            let Some(seed) = cloud.points().nth(self.seed) else {
                self.seed = 0;
                return;
            };
            self.seed += 1;
            if self.surfaces.iter().any(|s| s.holds(seed, &self.config)) {
                continue;
            }
            if let Some(surface) = self.grow(cloud, seed, seen_from) {
                self.keep(surface);
                return;
            }
        }
    }

    /// Fits the next plane to its points as they are now; gives it up when too few are left or when it lies in another
    /// one.
    fn refit<const N: usize>(&mut self, cloud: &PointCloud<N>) {
        if self.turn >= self.surfaces.len() {
            self.turn = 0;
        }
        let Some(old) = self.surfaces.get(self.turn).copied() else {
            return;
        };
        let fitted = self.settled(cloud, &old, 1).filter(|new| self.is_plane(new));
        let Some(new) = fitted else {
            self.counters.lost = self.counters.lost.saturating_add(1);
            self.surfaces.swap_remove(self.turn);
            return;
        };
        let swallowed = self
            .surfaces
            .iter()
            .any(|other| other.id != new.id && other.support >= new.support && self.same(other, &new));
        if swallowed {
            self.counters.merged = self.counters.merged.saturating_add(1);
            self.surfaces.swap_remove(self.turn);
            return;
        }
        if let Some(slot) = self.surfaces.get_mut(self.turn) {
            *slot = new;
        }
        self.turn += 1;
    }

    fn is_plane(&self, surface: &Surface) -> bool {
        let [along, across] = surface.extent_m.map(|[least, most]| most - least);
        let width_m = match surface.orientation {
            Orientation::Vertical => across,
            Orientation::Horizontal => along.min(across),
        };
        surface.support >= self.config.least_support
            && width_m >= self.config.least_width_m
            && surface.length_m() >= self.config.least_length_m
    }

    /// Whether two planes are one: parallel, each other's centres in each other, overlapping or nearly so.
    fn same(&self, a: &Surface, b: &Surface) -> bool {
        let near = |a: &Surface, b: &Surface| a.plane.height_m(b.plane.centre.vector()).abs() < MOST_GATE_M;
        let margin_m = self.config.gap_m + 0.5 * b.length_m();
        a.plane.normal.vector().dot(b.plane.normal.vector()).abs() > PARALLEL
            && near(a, b)
            && near(b, a)
            && a.covers(&b.plane.centre, margin_m)
    }

    /// A surface fitted `times` to the points that lie on it.
    fn settled<const N: usize>(
        &self,
        cloud: &PointCloud<N>,
        surface: &Surface,
        times: usize,
    ) -> Option<Surface> {
        let mut surface = *surface;
        for _ in 0..times {
            let now = surface;
            let points = cloud.points().filter(|point| now.holds(point, &self.config));
            let fitted = fit(points, &now.plane, now.orientation, &self.config.noise)?;
            surface = Surface {
                plane: fitted.plane,
                extent_m: fitted.extent_m,
                support: fitted.support,
                ..now
            };
        }
        Some(surface)
    }

    /// A plane through a seed, if its neighbourhood has one.
    fn grow<const N: usize>(
        &self,
        cloud: &PointCloud<N>,
        seed: &MapPoint,
        seen_from: &Position<World>,
    ) -> Option<Surface> {
        let radius_m = self.config.radius_m;
        let mut neighbours: Vec<&MapPoint, NEIGHBOURS> = Vec::new();
        for point in cloud.points() {
            let taken = || self.surfaces.iter().any(|s| s.holds(point, &self.config));
            if point.position.distance_m(&seed.position) < radius_m
                && !taken()
                && neighbours.push(point).is_err()
            {
                break;
            }
        }
        if neighbours.len() < usize::from(self.config.least_support) {
            return None;
        }
        let upright = neighbours.iter().filter(|b| {
            let away = b.position.from_origin(&seed.position);
            away.x * away.x + away.y * away.y > LEAST_BASE_M * LEAST_BASE_M
        });
        let hypotheses = upright
            .filter_map(|b| Some((through(seed, Some(b))?, Orientation::Vertical)))
            .chain(through(seed, None).map(|plane| (plane, Orientation::Horizontal)));
        let noise = &self.config.noise;
        let mut best: Option<(usize, Plane, Orientation)> = None;
        for (plane, orientation) in hypotheses {
            let count = neighbours
                .iter()
                .filter(|point| lies_on(&plane, point, noise))
                .count();
            if best.as_ref().is_none_or(|(most, _, _)| count > *most) {
                best = Some((count, plane, orientation));
            }
        }
        let (count, mut plane, orientation) = best?;
        // Of points anywhere in the ball, a slab of the gate's thickness holds this many.
        let gate_m: f32 = neighbours
            .iter()
            .map(|p| (GATE_SIGMAS * libm::sqrtf(noise.variance_m2(p))).min(MOST_GATE_M))
            .sum();
        let chance = 1.5 * gate_m / radius_m;
        let least = (self.config.over_chance * chance)
            .max(LEAST_SHARE * neighbours.len() as f32)
            .max(f32::from(self.config.least_support));
        if (count as f32) < least {
            return None;
        }
        if plane.height_m(seen_from.vector()) < 0.0 {
            let n = -plane.normal.vector();
            plane.normal = crate::geometry::Direction::from_vector(n).ok()?;
        }
        let start = Surface {
            id: self.next_id,
            plane,
            orientation,
            extent_m: [[0.0; 2]; 2],
            support: 0,
        };
        // Two points make a crude direction: first the neighbourhood, then whatever the plane reaches.
        let near = fit(
            neighbours
                .iter()
                .copied()
                .filter(|point| lies_on(&plane, point, noise)),
            &plane,
            orientation,
            noise,
        )?;
        let start = Surface {
            plane: near.plane,
            extent_m: near.extent_m,
            support: near.support,
            ..start
        };
        let grown = self.settled(cloud, &start, SETTLING)?;
        self.is_plane(&grown).then_some(grown)
    }

    fn keep(&mut self, surface: Surface) {
        if self.surfaces.iter().any(|old| self.same(old, &surface)) {
            self.counters.merged = self.counters.merged.saturating_add(1);
            return;
        }
        match self.surfaces.push(surface) {
            Ok(()) => {
                self.counters.found = self.counters.found.saturating_add(1);
                self.next_id = self.next_id.wrapping_add(1);
            }
            Err(surface) => {
                // The least supported one makes room for a better one.
                let weakest = self.surfaces.iter_mut().min_by_key(|s| s.support);
                match weakest {
                    Some(slot) if slot.support < surface.support => {
                        *slot = surface;
                        self.counters.found = self.counters.found.saturating_add(1);
                        self.counters.lost = self.counters.lost.saturating_add(1);
                        self.next_id = self.next_id.wrapping_add(1);
                    }
                    _ => self.counters.no_room = self.counters.no_room.saturating_add(1),
                }
            }
        }
    }
}
