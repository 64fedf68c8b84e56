//! The merged map: the points of all UAVs in one bounded cloud of voxels.
//!
//! It fuses as the map on board does: a voxel holds one point, the variance-weighted mean of the reflections that fell into it. When
//! it is full, a point for a new voxel competes with a window of [`WINDOW`] stored ones, replaces the most uncertain of them or
//! is dropped, and either is counted. A point keeps its place (slot) as long as it lives, so that a page can be told of changes
//! by slot.
//!
//! Points follow the surface that they lie on: when a UAV withdraws one, what it put into the map leaves it. So a voxel keeps apart what
//! different surfaces put into it (`cell`), and a point that leaves gives its slot to the last one.

use std::collections::HashMap;

use cslam_core::geometry::Position;
use cslam_core::map::{Insertion, Voxel};

use super::model::Point;
use super::surfaces::{Step, SurfaceId};
use cell::{Cell, Part};

mod cell;

/// How many stored points a new one competes with when the cloud is full.
pub const WINDOW: usize = 16;

/// Smallest variance a weight is taken from, m^2: a millimetre.
const MIN_VARIANCE_M2: f32 = 1e-6;

/// Size of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Most points it holds. A point takes about 120 bytes, and 40 for every further surface in its voxel.
    pub capacity: u32,
    /// Edge of a voxel, m.
    pub edge_m: f32,
}

impl Default for Size {
    fn default() -> Self {
        Self {
            capacity: 1 << 20,
            edge_m: 0.25,
        }
    }
}

/// A point of the merged map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MapPoint {
    /// Fused position, world frame, m.
    pub position_m: [f32; 3],
    /// Trace of its covariance, m^2.
    pub variance_m2: f32,
    /// Number of reflections fused, saturating.
    pub hits: u32,
    /// When the last of them came, s since the start of the station.
    pub seen_s: f32,
    /// First-order probability of the most certain of them, 1/255; 255 stands for 1.
    pub probability: u8,
    /// Stop of the GMT of the last of them.
    pub gmt_index: u16,
    /// UAV that sent the last of them.
    pub uav: u8,
}

/// How many points ended in which way. The sum of all but the last is the number of points that came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Counters {
    /// First of their voxel.
    pub added: u64,
    /// Fused with the point of their voxel.
    pub fused: u64,
    /// Took the place of a more uncertain point when the cloud was full.
    pub replaced: u64,
    /// Dropped, the cloud being full of better points.
    pub dropped: u64,
    /// Too far from the origin, or no place at all.
    pub out_of_range: u64,
    /// Came after their surface had been withdrawn.
    pub late: u64,
    /// Points of the map that left it with their surface: not among those that came.
    pub withdrawn: u64,
}

/// What a point came with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Came {
    /// UAV that sent it.
    pub uav: u8,
    /// Number of the packet.
    pub counter: u32,
    /// Surface that it lies on.
    pub surface: Option<SurfaceId>,
}

/// A bounded cloud.
#[derive(Clone, Debug)]
pub struct Cloud {
    size: Size,
    slots: HashMap<Voxel, u32>,
    cells: Vec<Cell>,
    /// How many cells hold something of a surface: most events are of surfaces that have nothing left.
    of_surface: HashMap<SurfaceId, u32>,
    /// Slots that have changed since they were last taken, each once.
    changed: Vec<u32>,
    is_changed: Vec<bool>,
    /// Whether points have left since that was last asked.
    has_shrunk: bool,
    hand: usize,
    counters: Counters,
}

impl Cloud {
    /// An empty cloud.
    pub fn new(size: Size) -> Self {
        Self {
            size,
            slots: HashMap::new(),
            cells: Vec::new(),
            of_surface: HashMap::new(),
            changed: Vec::new(),
            is_changed: Vec::new(),
            has_shrunk: false,
            hand: 0,
            counters: Counters::default(),
        }
    }

    /// Its bounds.
    pub fn size(&self) -> Size {
        self.size
    }

    /// Number of points.
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// What became of all points so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Every point, in the order of slots.
    pub fn points(&self) -> impl ExactSizeIterator<Item = MapPoint> {
        self.cells.iter().map(Cell::point)
    }

    /// The point in a slot.
    pub fn get(&self, slot: u32) -> Option<MapPoint> {
        self.cells.get(slot as usize).map(Cell::point)
    }

    /// Takes in a reflection point at a time of the station, s.
    pub fn insert(&mut self, came: Came, point: &Point, now_s: f32) {
        let place = Position::from_vector(nalgebra::Vector3::from(point.position_m).map(|c| c as f32)).ok();
        let voxel = place.and_then(|place| Voxel::containing(&place, self.size.edge_m).ok());
        let (Some(place), Some(voxel)) = (place, voxel) else {
            self.counters.out_of_range += 1;
            return;
        };
        let sigma_m = point.sigma_m as f32;
        let new = MapPoint {
            position_m: place.to_array(),
            variance_m2: (sigma_m * sigma_m).max(MIN_VARIANCE_M2),
            hits: 1,
            seen_s: now_s,
            probability: (point.probability * 255.0 + 0.5) as u8,
            gmt_index: point.gmt_index,
            uav: came.uav,
        };
        let new = Part {
            surface: came.surface,
            counter: came.counter,
            point: new,
        };
        let counter = match self.place(voxel, new) {
            Insertion::Added => &mut self.counters.added,
            Insertion::Fused => &mut self.counters.fused,
            Insertion::Replaced => &mut self.counters.replaced,
            Insertion::Dropped => &mut self.counters.dropped,
        };
        *counter += 1;
    }

    /// A point came after its surface had been withdrawn.
    pub fn leave_out(&mut self) {
        self.counters.late += 1;
    }

    fn place(&mut self, voxel: Voxel, new: Part) -> Insertion {
        let counted = new.surface;
        if let Some(&slot) = self.slots.get(&voxel) {
            let cell = self.cells.get_mut(slot as usize);
            if cell.is_some_and(|cell| cell.add(new)) {
                self.count(counted);
            }
            self.change(slot);
            return Insertion::Fused;
        }
        if self.cells.len() < self.size.capacity as usize {
            let slot = self.cells.len() as u32;
            self.cells.push(Cell::new(voxel, new));
            self.is_changed.push(false);
            self.slots.insert(voxel, slot);
            self.count(counted);
            self.change(slot);
            return Insertion::Added;
        }
        let worst = self.worst_in_window();
        let Some(cell) = worst.and_then(|slot| self.cells.get_mut(slot)) else {
            return Insertion::Dropped;
        };
        if cell.point().variance_m2 <= new.point.variance_m2 {
            return Insertion::Dropped;
        }
        let old = std::mem::replace(cell, Cell::new(voxel, new));
        self.slots.remove(&old.voxel);
        for part in old.parts() {
            self.uncount(part.surface);
        }
        self.count(counted);
        let slot = worst.unwrap_or_default() as u32;
        self.slots.insert(voxel, slot);
        self.change(slot);
        Insertion::Replaced
    }

    fn count(&mut self, surface: Option<SurfaceId>) {
        if let Some(surface) = surface {
            *self.of_surface.entry(surface).or_default() += 1;
        }
    }

    fn uncount(&mut self, surface: Option<SurfaceId>) {
        let Some(surface) = surface else { return };
        if let Some(count) = self.of_surface.get_mut(&surface) {
            *count -= 1;
            if *count == 0 {
                self.of_surface.remove(&surface);
            }
        }
    }

    /// Follows what became of a surface.
    pub fn follow(&mut self, step: &Step) {
        let (surface, into, before) = match *step {
            Step::Withdraw { surface, before } => (surface, None, before),
            Step::Merge { gone, stays, before } => (gone, Some(stays), before),
        };
        if !self.of_surface.contains_key(&surface) {
            return;
        }
        // From the end on: a slot that becomes free is taken by a point that has been looked at.
        for slot in (0..self.cells.len()).rev() {
            let Some(cell) = self.cells.get_mut(slot) else {
                continue;
            };
            let Some(part) = cell.take(surface, before) else {
                continue;
            };
            let is_empty = match into {
                Some(stays) => {
                    let moved = Part {
                        surface: Some(stays),
                        ..part
                    };
                    if cell.add(moved) {
                        self.count(Some(stays));
                    }
                    false
                }
                None => cell.is_empty(),
            };
            self.uncount(Some(surface));
            if is_empty {
                self.remove(slot);
            } else {
                self.change(slot as u32);
            }
        }
    }

    /// Takes a point out of the map; the last one takes its slot.
    fn remove(&mut self, slot: usize) {
        let gone = self.cells.swap_remove(slot);
        self.is_changed.pop();
        self.slots.remove(&gone.voxel);
        self.counters.withdrawn += 1;
        self.has_shrunk = true;
        if let Some(moved) = self.cells.get(slot) {
            self.slots.insert(moved.voxel, slot as u32);
            self.change(slot as u32);
        }
    }

    /// Whether points have left since this was last asked.
    pub fn take_shrunk(&mut self) -> bool {
        std::mem::take(&mut self.has_shrunk)
    }

    /// Slot of the most uncertain of the next [`WINDOW`] points; the window moves on.
    fn worst_in_window(&mut self) -> Option<usize> {
        let count = self.cells.len();
        let window = (0..WINDOW.min(count)).map(|k| (self.hand + k) % count);
        let worst = window.max_by(|a, b| {
            let variance = |slot: usize| self.cells.get(slot).map_or(0.0, |cell| cell.point().variance_m2);
            variance(*a).total_cmp(&variance(*b))
        });
        self.hand = (self.hand + WINDOW) % count.max(1);
        worst
    }

    fn change(&mut self, slot: u32) {
        if let Some(flag) = self.is_changed.get_mut(slot as usize)
            && !std::mem::replace(flag, true)
        {
            self.changed.push(slot);
        }
    }

    /// Takes at most `most` of the slots that have changed, in ascending order.
    pub fn take_changed(&mut self, most: usize) -> Vec<u32> {
        let kept = self.changed.len().saturating_sub(most);
        let mut taken = self.changed.split_off(kept);
        for slot in &taken {
            if let Some(flag) = self.is_changed.get_mut(*slot as usize) {
                *flag = false;
            }
        }
        taken.sort_unstable();
        taken.dedup();
        // Slots that are free now.
        taken.truncate(taken.partition_point(|slot| (*slot as usize) < self.cells.len()));
        taken
    }
}

#[cfg(test)]
mod tests;
