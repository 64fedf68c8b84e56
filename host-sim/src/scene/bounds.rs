//! Boxes along the axes of the world.

use super::{Face, Vec3};

/// An axis-aligned box, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Corner of least coordinates, m.
    pub min_m: [f64; 3],
    /// Corner of greatest coordinates, m.
    pub max_m: [f64; 3],
}

impl Bounds {
    /// Whether the point lies in the closed box.
    pub fn contains(&self, point_m: [f64; 3]) -> bool {
        (0..3).all(|i| self.min_m[i] <= point_m[i] && point_m[i] <= self.max_m[i])
    }

    /// Its eight corners.
    pub(super) fn corners(&self) -> [Vec3; 8] {
        let of = |corner: usize, axis: usize| match corner >> axis & 1 {
            0 => self.min_m[axis],
            _ => self.max_m[axis],
        };
        core::array::from_fn(|corner| Vec3::from_fn(|axis, _| of(corner, axis)))
    }

    /// Smallest box around the vertices of all faces; `None` without a vertex.
    pub(super) fn of(faces: &[Face]) -> Option<Self> {
        Self::around(faces.iter().flat_map(Face::vertices))
    }

    /// Smallest box around points; `None` without one.
    pub(super) fn around<'p>(points: impl IntoIterator<Item = &'p Vec3>) -> Option<Self> {
        let mut vertices = points.into_iter();
        let first = vertices.next()?;
        let (min, max) = vertices.fold((*first, *first), |(lo, hi), v| (lo.inf(v), hi.sup(v)));
        Some(Self {
            min_m: min.into(),
            max_m: max.into(),
        })
    }
}
