//! The merged map: the points of all UAVs in one bounded cloud of voxels.
//!
//! It fuses as the map on board does: a voxel holds one point, the variance-weighted mean of the reflections that fell into it. When
//! it is full, a point for a new voxel competes with a window of [`WINDOW`] stored ones, replaces the most uncertain of them or
//! is dropped, and either is counted. A point keeps its place (slot) as long as it lives, so that a page can be told of changes
//! by slot.

use std::collections::HashMap;

use cslam_core::geometry::Position;
use cslam_core::map::{Insertion, Voxel};

use super::model::Point;

/// How many stored points a new one competes with when the cloud is full.
pub const WINDOW: usize = 16;

/// Smallest variance a weight is taken from, m^2: a millimetre.
const MIN_VARIANCE_M2: f32 = 1e-6;

/// Size of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Size {
    /// Most points it holds. A point takes about 80 bytes.
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
#[derive(Clone, Copy, Debug, PartialEq)]
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

/// How many points ended in which way. Their sum is the number of points that came.
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
}

/// A bounded cloud.
#[derive(Clone, Debug)]
pub struct Cloud {
    size: Size,
    slots: HashMap<Voxel, u32>,
    points: Vec<(Voxel, MapPoint)>,
    /// Slots that have changed since they were last taken, each once.
    changed: Vec<u32>,
    is_changed: Vec<bool>,
    hand: usize,
    counters: Counters,
}

impl Cloud {
    /// An empty cloud.
    pub fn new(size: Size) -> Self {
        Self {
            size,
            slots: HashMap::new(),
            points: Vec::new(),
            changed: Vec::new(),
            is_changed: Vec::new(),
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
        self.points.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// What became of all points so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Every point, in the order of slots.
    pub fn points(&self) -> impl ExactSizeIterator<Item = &MapPoint> {
        self.points.iter().map(|(_, point)| point)
    }

    /// The point in a slot.
    pub fn get(&self, slot: u32) -> Option<&MapPoint> {
        self.points.get(slot as usize).map(|(_, point)| point)
    }

    /// Takes in a reflection point of a UAV at a time of the station, s.
    pub fn insert(&mut self, uav: u8, point: &Point, now_s: f32) {
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
            uav,
        };
        let counter = match self.place(voxel, new) {
            Insertion::Added => &mut self.counters.added,
            Insertion::Fused => &mut self.counters.fused,
            Insertion::Replaced => &mut self.counters.replaced,
            Insertion::Dropped => &mut self.counters.dropped,
        };
        *counter += 1;
    }

    fn place(&mut self, voxel: Voxel, new: MapPoint) -> Insertion {
        if let Some(&slot) = self.slots.get(&voxel) {
            if let Some((_, point)) = self.points.get_mut(slot as usize) {
                *point = fuse(point, &new);
            }
            self.change(slot);
            return Insertion::Fused;
        }
        if self.points.len() < self.size.capacity as usize {
            let slot = self.points.len() as u32;
            self.points.push((voxel, new));
            self.is_changed.push(false);
            self.slots.insert(voxel, slot);
            self.change(slot);
            return Insertion::Added;
        }
        let worst = self.worst_in_window();
        let Some((old, point)) = worst.and_then(|slot| self.points.get_mut(slot)) else {
            return Insertion::Dropped;
        };
        if point.variance_m2 <= new.variance_m2 {
            return Insertion::Dropped;
        }
        self.slots.remove(old);
        (*old, *point) = (voxel, new);
        let slot = worst.unwrap_or_default() as u32;
        self.slots.insert(voxel, slot);
        self.change(slot);
        Insertion::Replaced
    }

    /// Slot of the most uncertain of the next [`WINDOW`] points; the window moves on.
    fn worst_in_window(&mut self) -> Option<usize> {
        let count = self.points.len();
        let window = (0..WINDOW.min(count)).map(|k| (self.hand + k) % count);
        let worst = window.max_by(|a, b| {
            let variance = |slot: usize| self.points.get(slot).map_or(0.0, |(_, p)| p.variance_m2);
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
        taken
    }
}

/// Mean of two points of a voxel, weighted by their variances.
fn fuse(old: &MapPoint, new: &MapPoint) -> MapPoint {
    let weight = old.variance_m2 / (old.variance_m2 + new.variance_m2);
    let mean = |i: usize| old.position_m[i] + (new.position_m[i] - old.position_m[i]) * weight;
    MapPoint {
        position_m: std::array::from_fn(mean),
        variance_m2: (old.variance_m2 * (1.0 - weight)).max(f32::MIN_POSITIVE),
        hits: old.hits.saturating_add(1),
        probability: old.probability.max(new.probability),
        ..*new
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64, sigma_m: f64) -> Point {
        Point {
            position_m: [x, 0.1, 0.1],
            sigma_m,
            probability: 0.5,
            sweep: 0,
            gmt_index: 0,
        }
    }

    fn small(capacity: u32) -> Cloud {
        Cloud::new(Size {
            capacity,
            edge_m: 1.0,
        })
    }

    #[test]
    fn points_of_a_voxel_fuse_by_their_variances() {
        let mut cloud = small(8);
        cloud.insert(1, &at(0.2, 0.1), 1.0);
        cloud.insert(2, &at(0.5, 0.2), 3.0);
        let point = *cloud.get(0).expect("one");
        assert_eq!((cloud.len(), point.hits, point.uav, point.seen_s), (1, 2, 2, 3.0));
        assert!((point.position_m[0] - 0.26).abs() < 1e-6, "{point:?}");
        assert!((point.variance_m2 - 0.008).abs() < 1e-6, "{point:?}");
    }

    #[test]
    fn a_full_cloud_keeps_the_better_points_and_counts_every_one() {
        let mut cloud = small(100);
        for k in 0..100 {
            cloud.insert(1, &at(f64::from(k) + 0.5, 0.5), 0.0);
        }
        // Worse ones have no place, better ones take one each.
        for k in 100..200 {
            cloud.insert(1, &at(f64::from(k) + 0.5, 1.0), 0.0);
        }
        assert_eq!((cloud.counters().dropped, cloud.len()), (100, 100));
        for k in 200..250 {
            cloud.insert(1, &at(f64::from(k) + 0.5, 0.1), 0.0);
        }
        let counters = cloud.counters();
        assert_eq!(
            (counters.added, counters.replaced, counters.dropped),
            (100, 50, 100)
        );
        assert_eq!(cloud.points().filter(|p| p.variance_m2 < 0.02).count(), 50);
        // Whoever was replaced is forgotten: the same voxel is new again.
        assert_eq!(cloud.slots.len(), 100);
        cloud.insert(1, &at(f64::NAN, 0.1), 0.0);
        assert_eq!(cloud.counters().out_of_range, 1);
    }

    #[test]
    fn changes_are_told_once_and_in_order() {
        let mut cloud = small(100);
        for k in [5, 3, 5, 9] {
            cloud.insert(1, &at(f64::from(k) + 0.5, 0.5), 0.0);
        }
        assert_eq!(cloud.take_changed(2), [1, 2]);
        assert_eq!(cloud.take_changed(9), [0]);
        assert!(cloud.take_changed(9).is_empty());
        cloud.insert(1, &at(9.5, 0.5), 0.0);
        cloud.insert(1, &at(3.5, 0.5), 0.0);
        assert_eq!(cloud.take_changed(9), [1, 2]);
    }
}
