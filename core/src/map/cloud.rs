//! Points in a hash table of fixed size.

use super::{Voxel, VoxelError};
use crate::geometry::{Position, World};
use crate::reflection::ReflectionPoint;

/// A point of the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapPoint {
    /// Variance-weighted mean of the reflections that fell into the voxel.
    pub position: Position<World>,
    /// Trace of the covariance of that mean, errors of the reflections taken as independent, m^2. It describes noise;
    /// an error that all reflections share, such as a calibration error, does not average out.
    pub variance_m2: f32,
    /// Number of reflections fused, saturating.
    pub hits: u16,
    /// Surface that the first of them lay on, or [`NO_SURFACE`].
    surface: u16,
}

impl MapPoint {
    /// Number of the surface that the first of its reflections lay on; `None` where nobody asks for surfaces.
    #[must_use]
    pub fn surface(&self) -> Option<u16> {
        (self.surface != NO_SURFACE).then_some(self.surface)
    }
}

/// Not a number of a surface: they end before it. An `Option` would cost four bytes a voxel.
const NO_SURFACE: u16 = u16::MAX;

/// What became of an inserted point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Insertion {
    /// First point of its voxel.
    Added,
    /// Fused with the point of its voxel.
    Fused,
    /// The map was full; it took the place of a more uncertain point.
    Replaced,
    /// The map was full of better points; it was dropped.
    Dropped,
}

/// How many insertions ended in which way, saturating. Their sum is the number of insertions tried.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counters {
    /// Ended as [`Insertion::Added`].
    pub added: u32,
    /// Ended as [`Insertion::Fused`].
    pub fused: u32,
    /// Ended as [`Insertion::Replaced`].
    pub replaced: u32,
    /// Ended as [`Insertion::Dropped`].
    pub dropped: u32,
    /// Refused with [`VoxelError::OutOfRange`].
    pub out_of_range: u32,
}

/// A voxel and its point, chained with the others of the same hash.
#[derive(Clone, Copy, Debug)]
struct Cell {
    voxel: Voxel,
    point: MapPoint,
    next: u16,
}

/// End of a chain.
const NONE: u16 = u16::MAX;

/// A point cloud of at most `N` voxels (1..=65 534), without heap. About 30 bytes a voxel.
#[derive(Clone, Debug)]
pub struct PointCloud<const N: usize> {
    edge_m: f32,
    cells: heapless::Vec<Cell, N>,
    /// First cell of each chain.
    chains: [u16; N],
    /// Where the next eviction window starts.
    hand: u16,
    counters: Counters,
}

impl<const N: usize> PointCloud<N> {
    /// How many stored points a new one competes with when the map is full.
    /// Capacity: work of an insertion.
    pub const EVICTION_WINDOW: usize = 16;
    /// Default edge of a voxel, m.
    /// Given: a little over the design's median point error of 0.15 m.
    pub const DEFAULT_EDGE_M: f32 = 0.25;
    /// Smallest variance a weight is taken from, m^2: a millimetre.
    /// Numerical: A point that claims to be exact must not freeze its voxel.
    const MIN_VARIANCE_M2: f32 = 1e-6;

    const CAPACITY_FITS: () = assert!(N > 0 && N < NONE as usize, "capacity must be 1..=65534 voxels");

    /// An empty map with voxels of [`Self::DEFAULT_EDGE_M`].
    #[must_use]
    pub const fn new() -> Self {
        let () = Self::CAPACITY_FITS;
        Self {
            edge_m: Self::DEFAULT_EDGE_M,
            cells: heapless::Vec::new(),
            chains: [NONE; N],
            hand: 0,
            counters: Counters {
                added: 0,
                fused: 0,
                replaced: 0,
                dropped: 0,
                out_of_range: 0,
            },
        }
    }

    /// An empty map with voxels of another edge length, m; `None` unless it is finite and positive.
    #[must_use]
    pub fn with_edge(edge_m: f32) -> Option<Self> {
        (edge_m.is_finite() && edge_m > 0.0).then(|| Self {
            edge_m,
            ..Self::new()
        })
    }

    /// Forgets every point and every count; the edge stays.
    pub fn clear(&mut self) {
        self.cells.clear();
        self.chains.fill(NONE);
        self.hand = 0;
        self.counters = Counters::default();
    }

    /// Edge of a voxel, m.
    #[must_use]
    pub fn edge_m(&self) -> f32 {
        self.edge_m
    }

    /// Number of occupied voxels, at most `N`.
    #[must_use]
    pub fn len(&self) -> usize {
        self.cells.len()
    }

    /// Whether no voxel is occupied.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// What became of all insertions so far.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Every point, in the order in which the places were first taken.
    pub fn points(&self) -> impl ExactSizeIterator<Item = &MapPoint> + Clone {
        self.cells.iter().map(|cell| &cell.point)
    }

    /// The point of a voxel.
    #[must_use]
    pub fn get(&self, voxel: Voxel) -> Option<&MapPoint> {
        self.find(voxel)
            .and_then(|index| self.cells.get(usize::from(index)))
            .map(|cell| &cell.point)
    }

    /// Puts a solved reflection point into the map, of no surface.
    ///
    /// # Errors
    /// [`VoxelError::OutOfRange`] when the point is too far from the origin for a voxel; the map is unchanged.
    pub fn insert(&mut self, reflection: &ReflectionPoint) -> Result<Insertion, VoxelError> {
        self.insert_on(None, reflection)
    }

    /// Puts a point of a surface into the map. A voxel that holds points of two surfaces, at a corner, goes with the first of them.
    ///
    /// # Errors
    /// [`VoxelError::OutOfRange`] when the point is too far from the origin for a voxel; the map is unchanged.
    pub fn insert_on(
        &mut self,
        surface: Option<u16>,
        reflection: &ReflectionPoint,
    ) -> Result<Insertion, VoxelError> {
        let voxel = match Voxel::containing(&reflection.position, self.edge_m) {
            Ok(voxel) => voxel,
            Err(error) => {
                self.counters.out_of_range = self.counters.out_of_range.saturating_add(1);
                return Err(error);
            }
        };
        let sigma_m = reflection.sigma_m();
        let point = MapPoint {
            position: reflection.position,
            variance_m2: (sigma_m * sigma_m).max(Self::MIN_VARIANCE_M2),
            hits: 1,
            surface: surface.unwrap_or(NO_SURFACE),
        };
        let insertion = self.place(voxel, point);
        let counter = match insertion {
            Insertion::Added => &mut self.counters.added,
            Insertion::Fused => &mut self.counters.fused,
            Insertion::Replaced => &mut self.counters.replaced,
            Insertion::Dropped => &mut self.counters.dropped,
        };
        *counter = counter.saturating_add(1);
        Ok(insertion)
    }

    /// Points of a surface belong to another one now, into which it was merged.
    pub fn rename(&mut self, from: u16, to: u16) {
        for cell in &mut self.cells {
            if cell.point.surface == from {
                cell.point.surface = to;
            }
        }
    }

    /// Takes the points of a surface out of the map: how many voxels are free now.
    pub fn withdraw(&mut self, surface: u16) -> usize {
        let before = self.cells.len();
        // From the end on: a place that becomes free is taken by a cell that has been looked at.
        for index in (0..before).rev() {
            let of_surface = |cell: &Cell| cell.point.surface == surface;
            if self.cells.get(index).is_some_and(of_surface) {
                self.remove(index as u16);
            }
        }
        before - self.cells.len()
    }

    /// Frees a place; the last cell takes it.
    fn remove(&mut self, index: u16) {
        self.unlink(index);
        let Some(last) = self.cells.pop() else {
            return;
        };
        let moved_from = self.cells.len() as u16;
        if moved_from == index {
            return;
        }
        self.relink(Self::chain_of(last.voxel), moved_from, index);
        if let Some(cell) = self.cells.get_mut(usize::from(index)) {
            *cell = last;
        }
    }

    fn place(&mut self, voxel: Voxel, point: MapPoint) -> Insertion {
        if let Some(index) = self.find(voxel) {
            if let Some(cell) = self.cells.get_mut(usize::from(index)) {
                cell.point = fuse(&cell.point, &point);
            }
            return Insertion::Fused;
        }
        let chain = Self::chain_of(voxel);
        let next = self.chains.get(chain).copied().unwrap_or(NONE);
        let index = self.cells.len() as u16;
        if self.cells.push(Cell { voxel, point, next }).is_ok() {
            self.set_chain(chain, index);
            return Insertion::Added;
        }
        let Some((worst, variance_m2)) = self.worst_in_window() else {
            return Insertion::Dropped;
        };
        if variance_m2 <= point.variance_m2 {
            return Insertion::Dropped;
        }
        self.unlink(worst);
        // Read again: unlinking may have changed the head of this very chain.
        let next = self.chains.get(chain).copied().unwrap_or(NONE);
        if let Some(cell) = self.cells.get_mut(usize::from(worst)) {
            *cell = Cell { voxel, point, next };
        }
        self.set_chain(chain, worst);
        Insertion::Replaced
    }

    fn chain_of(voxel: Voxel) -> usize {
        voxel.hash() as usize % N
    }

    fn set_chain(&mut self, chain: usize, index: u16) {
        if let Some(head) = self.chains.get_mut(chain) {
            *head = index;
        }
    }

    fn find(&self, voxel: Voxel) -> Option<u16> {
        let mut index = self.chains.get(Self::chain_of(voxel)).copied()?;
        while let Some(cell) = self.cells.get(usize::from(index)) {
            if cell.voxel == voxel {
                return Some(index);
            }
            index = cell.next;
        }
        None
    }

    /// Most uncertain point of the next window, and moves the window on.
    fn worst_in_window(&mut self) -> Option<(u16, f32)> {
        let mut worst: Option<(u16, f32)> = None;
        for _ in 0..Self::EVICTION_WINDOW.min(self.cells.len()) {
            let index = if usize::from(self.hand) < self.cells.len() {
                self.hand
            } else {
                0
            };
            self.hand = index + 1;
            let variance_m2 = self.cells.get(usize::from(index))?.point.variance_m2;
            if worst.is_none_or(|(_, w)| variance_m2 > w) {
                worst = Some((index, variance_m2));
            }
        }
        worst
    }

    /// Takes a cell out of its chain; its place stays.
    fn unlink(&mut self, target: u16) {
        let Some(cell) = self.cells.get(usize::from(target)).copied() else {
            return;
        };
        self.relink(Self::chain_of(cell.voxel), target, cell.next);
    }

    /// In a chain, what points to a place points to another one now.
    fn relink(&mut self, chain: usize, from: u16, to: u16) {
        let mut index = self.chains.get(chain).copied().unwrap_or(NONE);
        if index == from {
            self.set_chain(chain, to);
            return;
        }
        while let Some(link) = self.cells.get_mut(usize::from(index)) {
            if link.next == from {
                link.next = to;
                return;
            }
            index = link.next;
        }
    }
}

impl<const N: usize> Default for PointCloud<N> {
    fn default() -> Self {
        Self::new()
    }
}

/// Variance-weighted mean. A convex combination of two points of a cube stays in the cube.
fn fuse(old: &MapPoint, new: &MapPoint) -> MapPoint {
    let sum = old.variance_m2 + new.variance_m2;
    let weight = old.variance_m2 / sum;
    let mean = old.position.vector() + new.position.from_origin(&old.position) * weight;
    MapPoint {
        position: Position::from_vector(mean).unwrap_or(old.position),
        variance_m2: old.variance_m2 * new.variance_m2 / sum,
        hits: old.hits.saturating_add(1),
        surface: old.surface,
    }
}
