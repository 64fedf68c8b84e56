//! Free space on the ground of a scene.

use crate::scene::{Scene, Vec3, triangles};

/// What is lower does not stand in the way, m above the ground: kerbs, and the ground's own relief.
const KERB_M: f64 = 0.3;

/// Faces that look up more than this are floors and roofs, on which things stand.
const LEVEL: f64 = 0.7;

/// An upright box on the ground that shall be free, seen from above.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Floor {
    /// Its middle, m; on the ground.
    pub(crate) middle: Vec3,
    /// A horizontal unit vector.
    pub(crate) along: Vec3,
    /// Half of its length along that, and of its width, m.
    pub(crate) half_m: [f64; 2],
    /// m.
    pub(crate) height_m: f64,
}

/// What stands on the ground of a scene.
pub(crate) struct Room<'s> {
    scene: &'s Scene,
    /// Triangles of walls and ceilings, with the boxes around them.
    walls: Vec<([Vec3; 3], [Vec3; 2])>,
}

impl<'s> Room<'s> {
    pub(crate) fn of(scene: &'s Scene) -> Self {
        let walls = scene.faces().iter().filter(|face| face.normal().z < LEVEL);
        let walls = walls.flat_map(triangles).map(|corners| {
            let [a, b, c] = corners;
            (corners, [a.inf(&b).inf(&c), a.sup(&b).sup(&c)])
        });
        Self {
            scene,
            walls: walls.collect(),
        }
    }

    /// Height of the ground, m.
    pub(crate) fn ground_m(&self) -> f64 {
        self.scene.bounds().min_m[2]
    }

    /// Corners of the ground's rectangle: west and south, east and north, m.
    pub(crate) fn sides_m(&self) -> [[f64; 2]; 2] {
        let bounds = self.scene.bounds();
        [bounds.min_m, bounds.max_m].map(|corner| [corner[0], corner[1]])
    }

    /// Whether something is over a place.
    pub(crate) fn is_roofed(&self, place: &Vec3) -> bool {
        let bounds = self.scene.bounds();
        let sky = place + Vec3::z() * (bounds.max_m[2] - bounds.min_m[2] + 1.0);
        self.scene.blocked((*place).into(), sky.into())
    }

    /// Whether a box on the ground lies within the scene and meets no wall.
    pub(crate) fn is_free(&self, floor: &Floor) -> bool {
        let across = Vec3::z().cross(&floor.along);
        let [half_length, half_width] = floor.half_m;
        let base_m = self.ground_m() + KERB_M;
        let half_height = 0.5 * (floor.height_m - KERB_M);
        let centre = Vec3::new(floor.middle.x, floor.middle.y, base_m + half_height);
        let reach = Vec3::from_fn(|i, _| match i {
            2 => half_height,
            _ => half_length * floor.along[i].abs() + half_width * across[i].abs(),
        });
        let (low, high) = (centre - reach, centre + reach);
        let bounds = self.scene.bounds();
        if (0..2).any(|i| low[i] < bounds.min_m[i] || high[i] > bounds.max_m[i]) {
            return false;
        }
        let half = Vec3::new(half_length, half_width, half_height);
        let seen = |point: &Vec3| {
            let off = point - centre;
            Vec3::new(off.dot(&floor.along), off.dot(&across), off.z)
        };
        let meets = |(corners, [least, most]): &([Vec3; 3], [Vec3; 2])| {
            (0..3).all(|i| least[i] <= high[i] && most[i] >= low[i])
                && reaches_into(corners.map(|c| seen(&c)), &half)
        };
        !self.walls.iter().any(meets) && {
            let foot = Vec3::new(centre.x, centre.y, base_m);
            !self.scene.inside_solid(foot.into())
        }
    }
}

/// Whether a triangle reaches into the box of half sides about the origin.
fn reaches_into(triangle: [Vec3; 3], half: &Vec3) -> bool {
    let mut polygon = triangle.to_vec();
    for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
        let depth = |p: &Vec3| half[axis] - sign * p[axis];
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (i, to) in polygon.iter().enumerate() {
            let from = polygon[(i + polygon.len() - 1) % polygon.len()];
            let (a, b) = (depth(&from), depth(to));
            if (a < 0.0) != (b < 0.0) {
                kept.push(from + (to - from) * (a / (a - b)));
            }
            if b >= 0.0 {
                kept.push(*to);
            }
        }
        polygon = kept;
        if polygon.is_empty() {
            return false;
        }
    }
    true
}
