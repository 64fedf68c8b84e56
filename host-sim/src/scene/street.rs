//! A street canyon: 120 m of houses on both sides of a 14 m wide street, two side streets, boxes the size of vans.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::prism::{Prism, ground, placed, rectangle};
use super::{Bounds, DEFAULT_FREQUENCY_HZ, Material, Scene, SceneError};

const SEED: u64 = 7;
const LENGTH_M: f64 = 120.0;
const WIDTH_M: f64 = 40.0;
/// Facades of the two rows of houses, m.
const FACADES_M: [f64; 2] = [13.0, 27.0];
/// House fronts along the street, start and end, m; the two wide gaps are side streets.
const HOUSES_M: [[f64; 2]; 7] = [
    [0.5, 17.0],
    [17.5, 33.0],
    [40.0, 55.0],
    [55.5, 74.0],
    [74.5, 82.0],
    [90.0, 104.0],
    [104.5, 119.5],
];
const VANS: usize = 8;

pub(super) fn street() -> Result<Scene, SceneError> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let mut faces = vec![ground([0.0, 0.0], [LENGTH_M, WIDTH_M], 0)];
    let mut object = 0;
    for row in 0..2 {
        for [start, end] in HOUSES_M {
            object += 1;
            // Fronts step back by up to a metre: their corners send energy down the street.
            let step = rng.random_range(0.0..1.0);
            let (near, far) = if row == 0 {
                (0.5, FACADES_M[0] - step)
            } else {
                (FACADES_M[1] + step, WIDTH_M - 0.5)
            };
            let house = Prism {
                footprint: rectangle([start, near], [end, far]),
                base_m: 0.0,
                top_m: rng.random_range(9.0..19.0),
                taper: 1.0,
            };
            faces.extend(house.faces(object, false));
        }
    }
    for van in 0..VANS {
        object += 1;
        // One in each eighth of the street, so that none meets another.
        let x = LENGTH_M * (van as f64 + rng.random_range(0.3..0.7)) / VANS as f64;
        let y = if van % 2 == 0 {
            FACADES_M[0] + 2.0
        } else {
            FACADES_M[1] - 2.0
        };
        let van = Prism {
            footprint: placed(
                &rectangle([-2.6, -1.0], [2.6, 1.0]),
                rng.random_range(-0.1..0.1),
                [x, y],
            ),
            base_m: 0.0,
            top_m: rng.random_range(1.9..2.6),
            taper: 1.0,
        };
        faces.extend(van.faces(object, false));
    }
    let bounds = Bounds {
        min_m: [0.0; 3],
        max_m: [LENGTH_M, WIDTH_M, 20.0],
    };
    Scene::new(
        "street",
        Material::PAPER,
        DEFAULT_FREQUENCY_HZ,
        Some(bounds),
        faces,
    )
}
