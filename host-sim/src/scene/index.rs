//! Which faces does a segment cross? A bounding volume hierarchy (crate `bvh`, surface area heuristic) over the faces'
//! boxes, searched with boxes cut to the segment; the in-plane test of [`Face`] decides.
//!
//! The library builds the tree. The search over its nodes is ours, because its own ray query neither ends at the far end
//! of a segment nor skips the faces that a path has just been reflected by.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::{Bvh, BvhNode};
use nalgebra::Point3;

use super::{Face, Vec3};

/// Crossings closer than this to either end of a segment do not count, m.
pub const SURFACE_MARGIN_M: f64 = 1e-6;

/// Faces are flat, boxes must not be: each is this much larger on every side, m.
const BOX_PADDING_M: f64 = 1e-6;

/// Deepest tree that the search's stack holds. The heuristic splits at least in halves where it cannot do better, so even
/// millions of faces stay below.
const MAX_DEPTH: usize = 96;

#[derive(Debug)]
pub(super) struct FaceIndex {
    tree: Bvh<f64, 3>,
    /// A ball around all faces, m.
    centre: Vec3,
    radius_m: f64,
}

/// A face's box on its way into the tree.
struct Leaf {
    bounds: Aabb<f64, 3>,
    node: usize,
}

impl Bounded<f64, 3> for Leaf {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.bounds
    }
}

impl BHShape<f64, 3> for Leaf {
    fn set_bh_node_index(&mut self, node: usize) {
        self.node = node;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

impl FaceIndex {
    /// Builds the tree; `None` when it would be deeper than the search can follow.
    pub(super) fn new(faces: &[Face]) -> Option<Self> {
        let mut leaves: Vec<Leaf> = faces
            .iter()
            .map(|face| {
                let mut bounds = Aabb::empty();
                for v in face.vertices() {
                    bounds.grow_mut(&Point3::from(v.add_scalar(BOX_PADDING_M)));
                    bounds.grow_mut(&Point3::from(v.add_scalar(-BOX_PADDING_M)));
                }
                Leaf { bounds, node: 0 }
            })
            .collect();
        let all = leaves
            .iter()
            .fold(Aabb::empty(), |all: Aabb<f64, 3>, leaf| all.join(&leaf.bounds));
        let tree = Bvh::build(&mut leaves);
        (depth(&tree) <= MAX_DEPTH).then(|| Self {
            tree,
            centre: all.center().coords,
            radius_m: 0.5 * all.size().norm() + 1.0,
        })
    }

    /// First face in tree order that crosses the segment, its margins excepted, and that the predicate accepts.
    pub(super) fn find_crossed(
        &self,
        faces: &[Face],
        from: Vec3,
        to: Vec3,
        mut accept: impl FnMut(u32) -> bool,
    ) -> Option<u32> {
        let margin = margin(&from, &to);
        self.search(&Slab::new(from, to - from), |shape| {
            crosses(&faces[shape], &from, &to, margin) && accept(shape as u32)
        })
        .map(|shape| shape as u32)
    }

    /// Calls back for every face that a ray from a point (not at it) meets, with the distance, m. `direction` is a unit
    /// vector; the ray ends behind the farthest face.
    pub(super) fn each_along(
        &self,
        faces: &[Face],
        point: Vec3,
        direction: Vec3,
        mut each: impl FnMut(u32, f64),
    ) {
        let reach_m = (point - self.centre).norm() + self.radius_m;
        let end = point + direction * reach_m;
        self.search(&Slab::new(point, end - point), |shape| {
            if let Some(t) = faces[shape].crossing(&point, &end) {
                let distance_m = t * reach_m;
                if distance_m > SURFACE_MARGIN_M {
                    each(shape as u32, distance_m);
                }
            }
            false
        });
    }

    /// Visits the shapes whose boxes the segment meets until the visitor says stop; returns the shape it stopped at.
    #[inline]
    fn search(&self, segment: &Slab, mut visit: impl FnMut(usize) -> bool) -> Option<usize> {
        if self.tree.nodes.is_empty() {
            return None;
        }
        let mut stack = [0_usize; MAX_DEPTH + 1];
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            match &self.tree.nodes[stack[waiting]] {
                BvhNode::Leaf { shape_index, .. } => {
                    if visit(*shape_index) {
                        return Some(*shape_index);
                    }
                }
                BvhNode::Node {
                    child_l_index,
                    child_l_aabb,
                    child_r_index,
                    child_r_aabb,
                    ..
                } => {
                    for (child, bounds) in [(child_l_index, child_l_aabb), (child_r_index, child_r_aabb)] {
                        if segment.meets(bounds) {
                            stack[waiting] = *child;
                            waiting += 1;
                        }
                    }
                }
            }
        }
        None
    }
}

/// [`SURFACE_MARGIN_M`] as a fraction of a segment.
pub(super) fn margin(from: &Vec3, to: &Vec3) -> f64 {
    SURFACE_MARGIN_M / (to - from).norm()
}

/// Whether the face crosses the segment outside the margins at its ends.
#[inline]
pub(super) fn crosses(face: &Face, from: &Vec3, to: &Vec3, margin: f64) -> bool {
    face.crossing(from, to)
        .is_some_and(|t| t > margin && t < 1.0 - margin)
}

/// Number of nodes on the longest way from the root to a leaf.
fn depth(tree: &Bvh<f64, 3>) -> usize {
    let mut deepest = 0;
    let mut waiting: Vec<(usize, usize)> = tree.nodes.first().map(|_| (0, 1)).into_iter().collect();
    while let Some((node, level)) = waiting.pop() {
        deepest = deepest.max(level);
        if let BvhNode::Node {
            child_l_index,
            child_r_index,
            ..
        } = tree.nodes[node]
        {
            waiting.push((child_l_index, level + 1));
            waiting.push((child_r_index, level + 1));
        }
    }
    deepest
}

/// A segment prepared for box tests.
struct Slab {
    from: Vec3,
    inverse: Vec3,
}

impl Slab {
    fn new(from: Vec3, along: Vec3) -> Self {
        Self {
            from,
            inverse: along.map(|c| 1.0 / c),
        }
    }

    /// Whether the segment meets the box. A zero direction component gives infinite bounds; a NaN, where the segment also
    /// runs in a side of the box, compares false and so either changes nothing or rejects a box that it only touches:
    /// no face is lost, since boxes are padded.
    #[inline]
    fn meets(&self, bounds: &Aabb<f64, 3>) -> bool {
        let (mut enter, mut leave) = (0.0, 1.0);
        for axis in 0..3 {
            let a = (bounds.min[axis] - self.from[axis]) * self.inverse[axis];
            let b = (bounds.max[axis] - self.from[axis]) * self.inverse[axis];
            // Comparisons instead of `min` and `max`, whose care for NaN takes half of the time here.
            let (near, far) = if a < b { (a, b) } else { (b, a) };
            if near > enter {
                enter = near;
            }
            if far < leave {
                leave = far;
            }
        }
        enter <= leave
    }
}
