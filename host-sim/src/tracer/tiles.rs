//! Faces cut into tiles, for what they scatter: squares of a given side and the quarters of them, less at the rims.

use crate::scene::{Face, Scene, Vec3};

/// No scene is cut into many more tiles than this.
const MOST_TILES: f64 = 250e3;

/// Part of a tile that a face may be wider than whole tiles without another one: rounding, which a turned scene has and another has not.
const ROUNDING: f64 = 1e-9;

/// Tiles along a side of a block.
const BLOCK: u32 = 8;

/// A part of a face that scatters as one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    /// Centre of its area, m.
    pub(super) centre: Vec3,
    /// Area, m^2.
    pub(super) area_m2: f64,
    /// Number within its face: tiles have multiples of 5, their quarters the four numbers that follow.
    pub(super) number: u32,
    /// Half of its side, m.
    pub(super) half_m: f64,
    /// Number within its face of the block of 8 x 8 tiles that it is in.
    pub(super) block: u32,
}

/// A tile of a face and its quarters.
#[derive(Debug)]
pub(super) struct Tile {
    pub(super) face: u32,
    pub(super) whole: Piece,
    /// Its quarters, in the list of all.
    pub(super) quarters: core::ops::Range<u32>,
}

/// All tiles of a scene.
#[derive(Debug)]
pub(super) struct Tiles {
    pub(super) tiles: Vec<Tile>,
    pub(super) quarters: Vec<Piece>,
    /// Axes of every face's plane, along which it is cut.
    pub(super) axes: Vec<[Vec3; 2]>,
    /// Tiles in a row of every face: the number of the tile above is so many times 5 higher.
    pub(super) columns: Vec<u32>,
    /// Side of a tile, m.
    pub(super) side_m: f64,
}

impl Tiles {
    /// Cuts all faces into tiles of a side, m; larger ones in scenes that would have more than [`MOST_TILES`].
    pub(super) fn of(scene: &Scene, tile_m: f64) -> Self {
        let total_m2: f64 = scene.faces().iter().map(area_m2).sum();
        let side_m = tile_m.max((total_m2 / MOST_TILES).sqrt());
        let mut all = Self {
            tiles: Vec::new(),
            quarters: Vec::new(),
            axes: scene.faces().iter().map(axes).collect(),
            columns: Vec::new(),
            side_m,
        };
        for (index, face) in scene.faces().iter().enumerate() {
            all.cut(index as u32, face, side_m);
        }
        all
    }

    /// The quarters of a tile.
    pub(super) fn quarters_of(&self, tile: &Tile) -> &[Piece] {
        &self.quarters[tile.quarters.start as usize..tile.quarters.end as usize]
    }

    fn cut(&mut self, index: u32, face: &Face, side_m: f64) {
        let axes = axes(face);
        let origin = face.vertices()[0];
        let flat: Vec<[f64; 2]> = face
            .vertices()
            .iter()
            .map(|v| axes.map(|axis| (v - origin).dot(&axis)))
            .collect();
        let least = |i: usize| flat.iter().map(|p| p[i]).fold(f64::INFINITY, f64::min);
        let most = |i: usize| flat.iter().map(|p| p[i]).fold(f64::NEG_INFINITY, f64::max);
        let corner = [least(0), least(1)];
        let counts = [0, 1].map(|i| (((most(i) - corner[i]) / side_m - ROUNDING).ceil() as u32).max(1));
        self.columns.push(counts[0]);
        // Whole squares to the face's own size, so that none is a sliver.
        let sides = [0, 1].map(|i| (most(i) - corner[i]) / f64::from(counts[i]));
        for row in 0..counts[1] {
            let from = corner[1] + f64::from(row) * sides[1];
            let strip = between(&flat, 1, from, from + sides[1]);
            for column in 0..counts[0] {
                let left = corner[0] + f64::from(column) * sides[0];
                let cell = between(&strip, 0, left, left + sides[0]);
                let number = 5 * (row * counts[0] + column);
                let block = row / BLOCK * counts[0].div_ceil(BLOCK) + column / BLOCK;
                let begin = self.quarters.len() as u32;
                let (mut area, mut moment) = (0.0, [0.0; 2]);
                for quarter in 0..4 {
                    let at = [
                        left + 0.5 * sides[0] * f64::from(quarter % 2),
                        from + 0.5 * sides[1] * f64::from(quarter / 2),
                    ];
                    let part = between(&cell, 0, at[0], at[0] + 0.5 * sides[0]);
                    let part = between(&part, 1, at[1], at[1] + 0.5 * sides[1]);
                    let (part_m2, centre) = centre(&part);
                    if part_m2 <= 0.0 {
                        continue;
                    }
                    area += part_m2;
                    moment = [0, 1].map(|i| moment[i] + part_m2 * centre[i]);
                    self.quarters.push(Piece {
                        centre: origin + axes[0] * centre[0] + axes[1] * centre[1],
                        area_m2: part_m2,
                        number: number + 1 + quarter,
                        half_m: 0.25 * sides[0].min(sides[1]),
                        block,
                    });
                }
                if area > 0.0 {
                    self.tiles.push(Tile {
                        face: index,
                        whole: Piece {
                            centre: origin + axes[0] * (moment[0] / area) + axes[1] * (moment[1] / area),
                            area_m2: area,
                            number,
                            half_m: 0.5 * sides[0].min(sides[1]),
                            block,
                        },
                        quarters: begin..self.quarters.len() as u32,
                    });
                }
            }
        }
    }
}

/// Two unit vectors of a face's plane, the first along its first side.
fn axes(face: &Face) -> [Vec3; 2] {
    let along = (face.vertices()[1] - face.vertices()[0]).normalize();
    let across = face.normal().cross(&along).normalize();
    [along, across]
}

fn area_m2(face: &Face) -> f64 {
    let origin = face.vertices()[0];
    let axes = axes(face);
    let flat: Vec<[f64; 2]> = face
        .vertices()
        .iter()
        .map(|v| axes.map(|axis| (v - origin).dot(&axis)))
        .collect();
    centre(&flat).0
}

/// The part of a counter-clockwise polygon between two values of a coordinate (Sutherland and Hodgman). Of a polygon that is
/// not convex, parts may hang together by lines without area.
fn between(polygon: &[[f64; 2]], axis: usize, least: f64, most: f64) -> Vec<[f64; 2]> {
    let half = |polygon: &[[f64; 2]], sign: f64, bound: f64| {
        let mut kept = Vec::with_capacity(polygon.len() + 2);
        for (i, to) in polygon.iter().enumerate() {
            let from = polygon[(i + polygon.len() - 1) % polygon.len()];
            let (a, b) = (sign * (from[axis] - bound), sign * (to[axis] - bound));
            if (a < 0.0) != (b < 0.0) {
                let t = a / (a - b);
                kept.push([0, 1].map(|k| from[k] + t * (to[k] - from[k])));
            }
            if b >= 0.0 {
                kept.push(*to);
            }
        }
        kept
    };
    half(&half(polygon, 1.0, least), -1.0, most)
}

/// Area and its centre.
fn centre(polygon: &[[f64; 2]]) -> (f64, [f64; 2]) {
    let Some(&origin) = polygon.first() else {
        return (0.0, [0.0; 2]);
    };
    let (mut area2, mut moment) = (0.0, [0.0; 2]);
    for pair in polygon.windows(2) {
        let [a, b] = [pair[0], pair[1]].map(|p| [p[0] - origin[0], p[1] - origin[1]]);
        let cross = a[0] * b[1] - a[1] * b[0];
        area2 += cross;
        moment = [0, 1].map(|i| moment[i] + cross * (a[i] + b[i]));
    }
    // Slivers of rounding are none.
    if area2 < 1e-9 {
        return (0.0, origin);
    }
    (0.5 * area2, [0, 1].map(|i| origin[i] + moment[i] / (3.0 * area2)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_cover_every_face_once() {
        for name in ["outdoor_a", "outdoor", "indoor"] {
            let scene = Scene::load(name).unwrap();
            let tiles = Tiles::of(&scene, 1.0);
            for (index, face) in scene.faces().iter().enumerate() {
                let own: Vec<&Tile> = tiles.tiles.iter().filter(|t| t.face == index as u32).collect();
                let covered: f64 = own.iter().map(|tile| tile.whole.area_m2).sum();
                let area = area_m2(face);
                assert!((covered - area).abs() < 1e-6 * area, "{name}: {covered} {area}");
                let quarters = own.iter().flat_map(|tile| tiles.quarters_of(tile));
                assert!((quarters.map(|q| q.area_m2).sum::<f64>() - area).abs() < 1e-6 * area);
                // First moments too, and all of it in the plane.
                let mean =
                    |points: Vec<(f64, Vec3)>| points.iter().map(|(a, p)| p * *a).sum::<Vec3>() / covered;
                let of_tiles = mean(own.iter().map(|t| (t.whole.area_m2, t.whole.centre)).collect());
                let triangles = crate::scene::triangles(face);
                let of_triangles = mean(
                    triangles
                        .iter()
                        .map(|[a, b, c]| (0.5 * (b - a).cross(&(c - a)).norm(), (a + b + c) / 3.0))
                        .collect(),
                );
                assert!((of_tiles - of_triangles).norm() < 1e-5, "{name} {index}");
                assert!(own.iter().all(|t| face.height_m(&t.whole.centre).abs() < 1e-4));
                let mut numbers: Vec<u32> = own.iter().map(|t| t.whole.number).collect();
                numbers.dedup();
                assert_eq!(numbers.len(), own.len());
            }
        }
    }
}
