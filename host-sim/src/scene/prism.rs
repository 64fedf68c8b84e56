//! Solids for the generators: prisms over any simple polygon, straight or tapering.

use super::{RawFace, Vec3};

/// A solid between two heights over a counter-clockwise footprint. Tapering shrinks the top towards the footprint's
/// centroid by a factor, which keeps every wall planar whatever the footprint's shape.
pub(super) struct Prism {
    /// Corners, counter-clockwise seen from above, m.
    pub(super) footprint: Vec<[f64; 2]>,
    /// Height of the base, m.
    pub(super) base_m: f64,
    /// Height of the top, m.
    pub(super) top_m: f64,
    /// Size of the top relative to the base; 1 for upright walls.
    pub(super) taper: f64,
}

impl Prism {
    /// Walls and roof, and a floor when the prism does not stand on the ground.
    pub(super) fn faces(&self, object: u32, with_floor: bool) -> Vec<RawFace> {
        let centre = centroid(&self.footprint);
        let n = self.footprint.len();
        let base: Vec<[f64; 3]> = self.footprint.iter().map(|p| [p[0], p[1], self.base_m]).collect();
        let top: Vec<[f64; 3]> = self
            .footprint
            .iter()
            .map(|p| {
                let [x, y] = [0, 1].map(|i| centre[i] + self.taper * (p[i] - centre[i]));
                [x, y, self.top_m]
            })
            .collect();
        let mut faces: Vec<RawFace> = (0..n)
            .map(|i| {
                let j = (i + 1) % n;
                face(vec![base[i], base[j], top[j], top[i]], object)
            })
            .collect();
        if with_floor {
            faces.push(face(base.iter().rev().copied().collect(), object));
        }
        faces.push(face(top, object));
        faces
    }
}

/// An axis-aligned rectangle as a footprint.
pub(super) fn rectangle(min: [f64; 2], max: [f64; 2]) -> Vec<[f64; 2]> {
    vec![
        [min[0], min[1]],
        [max[0], min[1]],
        [max[0], max[1]],
        [min[0], max[1]],
    ]
}

/// The polygon turned counter-clockwise about the origin by an angle (rad), then moved.
pub(super) fn placed(polygon: &[[f64; 2]], angle_rad: f64, to: [f64; 2]) -> Vec<[f64; 2]> {
    let (sin, cos) = libm::sincos(angle_rad);
    polygon
        .iter()
        .map(|p| [cos * p[0] - sin * p[1] + to[0], sin * p[0] + cos * p[1] + to[1]])
        .collect()
}

/// Horizontal ground rectangle at height 0.
pub(super) fn ground(min: [f64; 2], max: [f64; 2], object: u32) -> RawFace {
    face(
        rectangle(min, max).iter().map(|p| [p[0], p[1], 0.0]).collect(),
        object,
    )
}

pub(super) fn face(vertices: Vec<[f64; 3]>, object: u32) -> RawFace {
    RawFace {
        vertices,
        normal: None,
        object: Some(object),
    }
}

/// Centre of area of a simple polygon.
fn centroid(polygon: &[[f64; 2]]) -> [f64; 2] {
    let n = polygon.len();
    let origin = Vec3::new(polygon[0][0], polygon[0][1], 0.0);
    let mut sum = Vec3::zeros();
    let mut area2 = 0.0;
    for i in 0..n {
        let [a, b] = [i, (i + 1) % n].map(|k| Vec3::new(polygon[k][0], polygon[k][1], 0.0) - origin);
        let cross = a.x * b.y - a.y * b.x;
        sum += (a + b) * cross;
        area2 += cross;
    }
    let centre = origin + sum / (3.0 * area2);
    [centre.x, centre.y]
}
