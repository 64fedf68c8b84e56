//! Floors of an office: 30 x 20 x 4 m, six rooms off a corridor, doors with lintels, boxes as furniture. Seeded ones
//! differ in rooms, doors and furniture.

use core::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::prism::{Prism, face, placed, rectangle};
use super::{Bounds, DEFAULT_FREQUENCY_HZ, Material, RawFace, Scene, SceneError};

/// Seed of the built-in `indoor`.
const SEED: u64 = 5;
/// Stream of the seed that moves the walls between rooms; doors and furniture are drawn from stream 0.
const WALLS_STREAM: u64 = 1;
/// Seeded floors have these walls moved by up to this much, m.
const WALL_SHIFT_M: f64 = 1.2;
const SIZE_M: [f64; 3] = [30.0, 20.0, 4.0];
const HALF_WALL_M: f64 = 0.075;
const DOOR_HEIGHT_M: f64 = 2.2;
const HALF_DOOR_M: f64 = 0.6;
/// Centre lines of the two corridor walls, m.
const CORRIDOR_M: [f64; 2] = [8.5, 11.5];
/// Centre lines of the walls between rooms, m, south and north of the corridor.
const PARTITIONS_M: [[f64; 2]; 2] = [[9.0, 19.5], [11.0, 21.0]];
const BOXES_PER_ROOM: usize = 2;

/// The floor that is built in.
pub(super) fn indoor() -> Result<Scene, SceneError> {
    office("indoor", SEED, PARTITIONS_M)
}

/// The floor of a seed. The same seed gives the same floor on every machine.
pub(super) fn seeded(name: &str, seed: u64) -> Result<Scene, SceneError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(WALLS_STREAM);
    let moved = PARTITIONS_M.map(|side| side.map(|x| x + rng.random_range(-WALL_SHIFT_M..WALL_SHIFT_M)));
    office(name, seed, moved)
}

fn office(name: &str, seed: u64, partitions_m: [[f64; 2]; 2]) -> Result<Scene, SceneError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut faces = shell();
    let mut object = 0;
    let mut add = |prism: Prism, with_floor: bool| {
        object += 1;
        faces.extend(prism.faces(object, with_floor));
    };
    for side in 0..2 {
        let y = CORRIDOR_M[side];
        let [first, second] = partitions_m[side];
        let rooms = [[0.0, first], [first, second], [second, SIZE_M[0]]];
        // The corridor wall runs from door to door; a lintel closes it above each.
        let mut from = 0.0;
        for [west, east] in rooms {
            let door = 0.5 * (west + east) + rng.random_range(-1.5..1.5);
            add(wall([from, y], [door - HALF_DOOR_M, y], 0.0), false);
            add(
                wall([door - HALF_DOOR_M, y], [door + HALF_DOOR_M, y], DOOR_HEIGHT_M),
                true,
            );
            from = door + HALF_DOOR_M;
        }
        add(wall([from, y], [SIZE_M[0], y], 0.0), false);
        let (south, north) = if side == 0 {
            (0.0, y - HALF_WALL_M)
        } else {
            (y + HALF_WALL_M, SIZE_M[1])
        };
        for x in [first, second] {
            add(wall([x, south], [x, north], 0.0), false);
        }
        for [west, east] in rooms {
            for half in 0..BOXES_PER_ROOM {
                // Each box keeps to its half of the room and off the walls, whatever way it is turned.
                let low = west + 1.8 + (east - west - 3.6) * half as f64 / BOXES_PER_ROOM as f64;
                let high = west + 1.8 + (east - west - 3.6) * (half + 1) as f64 / BOXES_PER_ROOM as f64;
                let at = [
                    rng.random_range(low + 0.6..high - 0.6),
                    rng.random_range(south + 1.5..north - 2.5),
                ];
                let half_size = [rng.random_range(0.3..0.8), rng.random_range(0.2..0.45)];
                let footprint = rectangle([-half_size[0], -half_size[1]], half_size);
                let furniture = Prism {
                    footprint: placed(&footprint, rng.random_range(-PI..PI), at),
                    base_m: 0.0,
                    top_m: rng.random_range(0.7..2.0),
                    taper: 1.0,
                };
                add(furniture, false);
            }
        }
    }
    let bounds = Bounds {
        min_m: [0.0; 3],
        max_m: SIZE_M,
    };
    Scene::new(name, Material::PAPER, DEFAULT_FREQUENCY_HZ, Some(bounds), faces)
}

/// Floor, ceiling and the four outer walls, facing inwards.
fn shell() -> Vec<RawFace> {
    let [x, y, z] = SIZE_M;
    let corners = rectangle([0.0, 0.0], [x, y]);
    let floor: Vec<[f64; 3]> = corners.iter().map(|p| [p[0], p[1], 0.0]).collect();
    let ceiling: Vec<[f64; 3]> = corners.iter().map(|p| [p[0], p[1], z]).collect();
    let mut faces: Vec<RawFace> = (0..4)
        .map(|i| {
            let j = (i + 1) % 4;
            face(vec![floor[j], floor[i], ceiling[i], ceiling[j]], 0)
        })
        .collect();
    faces.push(face(floor, 0));
    faces.push(face(ceiling.into_iter().rev().collect(), 0));
    faces
}

/// A wall along x or y between two points of its centre line, from a height up to the ceiling.
fn wall(from: [f64; 2], to: [f64; 2], base_m: f64) -> Prism {
    let thick = if from[1] == to[1] {
        [0.0, HALF_WALL_M]
    } else {
        [HALF_WALL_M, 0.0]
    };
    Prism {
        footprint: rectangle(
            [from[0] - thick[0], from[1] - thick[1]],
            [to[0] + thick[0], to[1] + thick[1]],
        ),
        base_m,
        top_m: SIZE_M[2],
        taper: 1.0,
    }
}
