//! Which faces can a wave go to from a face? A property of the scene alone, found once per face when first asked for.

use std::sync::OnceLock;

use super::beam::{Clipper, Plane, one_face_crosses};
use crate::scene::Scene;

/// For every face, the faces that some of it may light.
#[derive(Debug)]
pub(super) struct FacePairs {
    lit: Vec<OnceLock<Vec<u32>>>,
}

impl FacePairs {
    pub(super) fn new(faces: usize) -> Self {
        Self {
            lit: (0..faces).map(|_| OnceLock::new()).collect(),
        }
    }

    /// Faces that look at `from` and of which it sees anything. Ascending.
    pub(super) fn lit_by(&self, scene: &Scene, from: u32) -> &[u32] {
        self.lit[from as usize].get_or_init(|| {
            (0..scene.faces().len() as u32)
                .filter(|&to| to != from && may_light(scene, from, to))
                .collect()
        })
    }
}

/// False only when no point of `from` sees a point of `to`: they do not face each other, or one convex face stands
/// between all of both. The shadow argument of [`hidden`](super::beam::hidden) goes both ways: a face that hides every
/// corner of `to` from each corner of `from` hides all of one from all of the other.
fn may_light(scene: &Scene, from: u32, to: u32) -> bool {
    let (a, b) = (&scene.faces()[from as usize], &scene.faces()[to as usize]);
    let (mut near, mut far) = (Clipper::default(), Clipper::default());
    if !near.clip(a.hull(), &[Plane::front_of(b)]) || !far.clip(b.hull(), &[Plane::front_of(a)]) {
        return false;
    }
    let corners = near
        .polygon
        .iter()
        .flat_map(|p| far.polygon.iter().map(move |q| (*p, *q)));
    !one_face_crosses(scene, corners, Some(from), to)
}
