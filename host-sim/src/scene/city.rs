//! Seeded cities: a 120 x 120 m ground cut into lots by streets, an irregular building on most lots.

use core::f64::consts::{PI, TAU};

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::prism::{Prism, ground, placed};
use super::{Bounds, DEFAULT_FREQUENCY_HZ, Material, RawFace, Scene, SceneError};

/// Seed of the built-in `outdoor`.
pub(super) const OUTDOOR_SEED: u64 = 30;

const SIZE_M: f64 = 120.0;
const HEIGHT_M: f64 = 20.0;
const LOTS_PER_SIDE: usize = 5;
/// Lots left open as squares.
const OPEN_LOTS: usize = 4;
/// Clear ground on each side of a building within its lot, m: streets are at least twice this wide.
const SETBACK_M: f64 = 2.5;
/// Share of buildings with sloping walls.
const SLOPING: f64 = 0.3;

/// The city of a seed. The same seed gives the same city on every machine.
pub(super) fn city(name: &str, seed: u64) -> Result<Scene, SceneError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut faces = vec![ground([0.0, 0.0], [SIZE_M, SIZE_M], 0)];
    let columns = streets(&mut rng);
    let rows = streets(&mut rng);
    let mut lots: Vec<usize> = (0..LOTS_PER_SIDE * LOTS_PER_SIDE).collect();
    for _ in 0..OPEN_LOTS {
        let open = rng.random_range(0..lots.len());
        lots.remove(open);
    }
    for (building, lot) in lots.into_iter().enumerate() {
        let (i, j) = (lot % LOTS_PER_SIDE, lot / LOTS_PER_SIDE);
        let min = [columns[i] + SETBACK_M, rows[j] + SETBACK_M];
        let max = [columns[i + 1] - SETBACK_M, rows[j + 1] - SETBACK_M];
        faces.extend(building_in(&mut rng, building, min, max));
    }
    let bounds = Bounds {
        min_m: [0.0; 3],
        max_m: [SIZE_M, SIZE_M, HEIGHT_M],
    };
    Scene::new(name, Material::PAPER, DEFAULT_FREQUENCY_HZ, Some(bounds), faces)
}

/// Lot boundaries along one side, m: evenly spaced, each moved by up to 3.5 m.
fn streets(rng: &mut ChaCha8Rng) -> [f64; LOTS_PER_SIDE + 1] {
    let mut at = [0.0; LOTS_PER_SIDE + 1];
    for (i, street) in at.iter_mut().enumerate() {
        *street = SIZE_M * i as f64 / LOTS_PER_SIDE as f64;
        if i != 0 && i != LOTS_PER_SIDE {
            *street += rng.random_range(-3.5..3.5);
        }
    }
    at
}

/// A building of the shape whose turn it is, turned at random and as large as the rectangle allows, less a little.
fn building_in(rng: &mut ChaCha8Rng, building: usize, min: [f64; 2], max: [f64; 2]) -> Vec<RawFace> {
    let shape = match building % 4 {
        0 => quadrilateral(rng),
        1 => l_shape(rng),
        2 => u_shape(rng),
        _ => polygon(rng),
    };
    let turned = placed(&shape, rng.random_range(-PI..PI), [0.0, 0.0]);
    let low = [0, 1].map(|k| turned.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min));
    let high = [0, 1].map(|k| turned.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max));
    let room = [0, 1].map(|k| (max[k] - min[k]) / (high[k] - low[k]));
    let scale = room[0].min(room[1]) * rng.random_range(0.85..1.0);
    // Anywhere in the rectangle where it fits.
    let shift = [0, 1].map(|k| {
        let slack = (max[k] - min[k]) - scale * (high[k] - low[k]);
        min[k] + slack * rng.random::<f64>() - scale * low[k]
    });
    let sloping = rng.random::<f64>() < SLOPING;
    let prism = Prism {
        footprint: turned
            .iter()
            .map(|p| [0, 1].map(|k| scale * p[k] + shift[k]))
            .collect(),
        base_m: 0.0,
        top_m: rng.random_range(6.0..HEIGHT_M - 1.0),
        taper: if sloping { rng.random_range(0.7..0.95) } else { 1.0 },
    };
    prism.faces(building as u32 + 1, false)
}

/// Four corners, each moved within a quarter of the unit square.
fn quadrilateral(rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]
        .iter()
        .map(|c: &[f64; 2]| {
            [
                c[0] + rng.random_range(-0.12..0.12),
                c[1] + rng.random_range(-0.12..0.12),
            ]
        })
        .collect()
}

fn l_shape(rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let [a, b] = [rng.random_range(0.35..0.65), rng.random_range(0.35..0.65)];
    vec![[0.0, 0.0], [1.0, 0.0], [1.0, b], [a, b], [a, 1.0], [0.0, 1.0]]
}

fn u_shape(rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let [left, right] = [rng.random_range(0.25..0.38), rng.random_range(0.62..0.75)];
    let depth = rng.random_range(0.3..0.6);
    vec![
        [0.0, 0.0],
        [1.0, 0.0],
        [1.0, 1.0],
        [right, 1.0],
        [right, depth],
        [left, depth],
        [left, 1.0],
        [0.0, 1.0],
    ]
}

/// Five to eight corners around a centre, at uneven angles and distances.
fn polygon(rng: &mut ChaCha8Rng) -> Vec<[f64; 2]> {
    let corners = rng.random_range(5..9_usize);
    (0..corners)
        .map(|i| {
            let angle = (i as f64 + rng.random_range(-0.3..0.3)) * TAU / corners as f64;
            let radius = rng.random_range(0.75..1.0);
            let (sin, cos) = libm::sincos(angle);
            [radius * cos, radius * sin]
        })
        .collect()
}
