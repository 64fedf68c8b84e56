//! The sum of all fields across boundaries, reciprocity, and what the options leave out.

mod search;
mod wedge;

use core::f64::consts::{PI, SQRT_2, TAU};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use nalgebra::Complex;

use super::exact::phasor;
use super::*;
use crate::random::Stream;
use crate::scene::{Material, RawFace};
use crate::tracer::tests::{fixture, free_point};
use crate::tracer::{Propagation, Tracer};

const FREQUENCY_HZ: f64 = 30e9;
const WAVELENGTH_M: f64 = SPEED_OF_LIGHT_M_PER_S / FREQUENCY_HZ;
const K: f64 = TAU / WAVELENGTH_M;

type C64 = Complex<f64>;

/// A place about the vertical axis.
fn about_axis(off_m: f64, angle_rad: f64, z: f64) -> [f64; 3] {
    let (sin, cos) = libm::sincos(angle_rad);
    [off_m * cos, off_m * sin, z]
}

/// A material that reflects as a conductor, to 1e-7.
fn conductor() -> Material {
    Material::new(1.0, 1e15).unwrap()
}

/// Everything that diffracts once, however weak.
fn all() -> Propagation {
    Propagation {
        diffraction: Some(Diffraction {
            least_gain_db: -300.0,
            most_paths: usize::MAX,
            rims: false,
        }),
        ..Propagation::default()
    }
}

fn scene_of(material: Material, faces: Vec<Vec<[f64; 3]>>) -> Scene {
    let raw = faces
        .into_iter()
        .map(|vertices| RawFace {
            vertices,
            object: Some(1),
            ..RawFace::default()
        })
        .collect();
    Scene::new("test", material, FREQUENCY_HZ, None, raw).unwrap()
}

/// Sum of all fields of a link, carrier phase included.
fn total(tracer: &Tracer<'_>, tx: [f64; 3], rx: [f64; 3], diffracted: bool) -> C64 {
    tracer
        .transmitter(tx)
        .trace(rx)
        .iter()
        .filter(|path| diffracted || path.kind().is_specular())
        .map(|path| path.gain * phasor(-K * path.length_m()))
        .sum()
}

/// A house of 10 x 8 m and 12 m on ground, or without any and of endless height.
fn house(ground: bool) -> Scene {
    let (low, high) = if ground { (0.0, 12.0) } else { (-500.0, 500.0) };
    let plan = [[-5.0, -4.0], [5.0, -4.0], [5.0, 4.0], [-5.0, 4.0]];
    let mut faces: Vec<Vec<[f64; 3]>> = (0..4)
        .map(|i| {
            let ([a, b], [c, d]) = (plan[i], plan[(i + 1) % 4]);
            vec![[a, b, low], [c, d, low], [c, d, high], [a, b, high]]
        })
        .collect();
    faces.push(plan.map(|[x, y]| [x, y, high]).to_vec());
    if ground {
        faces.push(vec![
            [-900.0, -900.0, 0.0],
            [900.0, -900.0, 0.0],
            [900.0, 900.0, 0.0],
            [-900.0, 900.0, 0.0],
        ]);
    }
    scene_of(Material::PAPER, faces)
}

/// Half of the gap that a jump is looked for across, as a part of the way: a tenth of a micrometre.
const BESIDE: f64 = 1e-9;

/// Greatest jumps of the field, with and without diffraction, over all changes of the specular paths on a way, and their
/// number. In units of the line of sight's field at that distance.
fn jumps(scene: &Scene, tx: [f64; 3], way: impl Fn(f64) -> [f64; 3]) -> ([f64; 2], usize) {
    let tracer = Tracer::with(scene, 2, all()).unwrap();
    let specular = |at: f64| -> Vec<Vec<u32>> {
        let mut faces: Vec<Vec<u32>> = tracer
            .transmitter(tx)
            .trace(way(at))
            .iter()
            .filter(|path| path.kind().is_specular())
            .map(|path| path.faces().to_vec())
            .collect();
        faces.sort();
        faces
    };
    let (mut worst, mut boundaries) = ([0.0_f64; 2], 0);
    let steps = 720;
    let mut before = specular(0.0);
    for step in 1..=steps {
        let here = specular(f64::from(step) / f64::from(steps));
        if here != before {
            let [mut low, mut high] = [step - 1, step].map(|s| f64::from(s) / f64::from(steps));
            while high - low > 1e-12 {
                let middle = 0.5 * (low + high);
                if specular(middle) == before {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            // Faces reach a nanometre over their edges, so that neighbours leave no slit.
            (low, high) = (low - BESIDE, high + BESIDE);
            let distance_m = (Vec3::from(tx) - Vec3::from(way(low))).norm();
            let unit = WAVELENGTH_M / (4.0 * PI * distance_m) * DIPOLES;
            for (i, diffracted) in [true, false].into_iter().enumerate() {
                let [one, other] = [low, high].map(|at| total(&tracer, tx, way(at), diffracted));
                worst[i] = worst[i].max((one - other).norm() / unit);
            }
            boundaries += 1;
        }
        before = here;
    }
    (worst, boundaries)
}

#[test]
fn the_field_is_continuous_across_every_boundary() {
    // About an upright corner at three obliquities, and over roof and ground.
    let tower = house(false);
    for height_m in [0.0, 12.0, 40.0] {
        let circle = |at: f64| {
            let [x, y, _] = about_axis(22.0, TAU * at + 0.01, 0.0);
            [x, y, height_m]
        };
        let (worst, boundaries) = jumps(&tower, [17.0, 11.0, 0.0], circle);
        println!(
            "corner, {height_m} m above: {boundaries} boundaries, jump {:.1e} of the field, {:.2} without diffraction",
            worst[0], worst[1]
        );
        assert!(boundaries >= 4 && worst[0] < 1e-3 && worst[1] > 0.2, "{worst:?}");
    }
    let house = house(true);
    for turn in [0.2, 1.1] {
        let (sin, cos) = libm::sincos(turn);
        // Up on one side, over the roof, and down on the other.
        let arc = |at: f64| {
            let (up, across) = libm::sincos(PI * (0.02 + 0.96 * at));
            [25.0 * across * cos, 25.0 * across * sin, 25.0 * up]
        };
        let (worst, boundaries) = jumps(&house, [16.0, 9.0, 5.0], arc);
        println!(
            "over the roof, turned by {turn} rad: {boundaries} boundaries, jump {:.1e}, {:.2} without diffraction",
            worst[0], worst[1]
        );
        assert!(boundaries >= 2 && worst[0] < 1e-3 && worst[1] > 0.2, "{worst:?}");
    }
}

#[test]
fn ways_are_the_same_in_both_directions_and_levels_in_shadow() {
    let scene = Scene::load("outdoor_a").unwrap();
    let tracer = Tracer::with(&scene, 1, all()).unwrap();
    let edges = Edges::of(&scene, false);
    let mut random = Stream::new(11, 0);
    let (mut ways, mut shadowed) = (0, 0);
    for _ in 0..100 {
        let [a, b] = [0, 1].map(|_| free_point(&scene, &mut random));
        let there = tracer.transmitter(a).trace(b);
        let back = tracer.transmitter(b).trace(a);
        assert_eq!(there.len(), back.len(), "{a:?} {b:?}");
        for path in there.iter().filter(|path| path.kind().edge().is_some()) {
            let twin = back
                .iter()
                .find(|twin| {
                    let mut points = twin.vertices().to_vec();
                    points.reverse();
                    twin.kind()
                        .interactions()
                        .iter()
                        .rev()
                        .eq(path.kind().interactions())
                        && points
                            .iter()
                            .zip(path.vertices())
                            .all(|(p, q)| (Vec3::from(*p) - Vec3::from(*q)).norm() < 1e-6)
                })
                .expect("the reverse path");
            assert!((twin.length_m() - path.length_m()).abs() < 1e-9);
            ways += 1;
            if path.order() == 1 && is_shadowed(&edges, path, a, b) {
                let error = (twin.gain - path.gain).norm() / path.gain.norm();
                assert!(error < 1e-9, "{error}");
                shadowed += 1;
            }
        }
    }
    println!("{ways} ways, {shadowed} levels in shadow");
    assert!(ways > 200 && shadowed > 20, "{ways} {shadowed}");
}

/// Whether each end lies behind the face of the wedge that the other one lies before.
fn is_shadowed(edges: &Edges, path: &TracedPath, tx: [f64; 3], rx: [f64; 3]) -> bool {
    let point = Vec3::from(path.edge_point().unwrap());
    edges.wedges.iter().any(|wedge| {
        let way = point - wedge.from;
        if (way - wedge.along * way.dot(&wedge.along)).norm() > 1e-6 {
            return false;
        }
        let angles = [tx, rx].map(|end| wedge.about(&end.into()).map(|at| at.angle_rad()));
        matches!(angles, [Some(a), Some(b)] if (a - b).abs() > PI)
    })
}

#[test]
fn the_options_cut_and_without_them_nothing_changes() {
    let scene = Scene::load("outdoor_a").unwrap();
    let list = crate::paths::read(&fixture("outdoor_a_diffraction.jsonl.gz")).unwrap();
    let tracer = |propagation| Tracer::with(&scene, 3, propagation).unwrap();
    let (plain, every) = (tracer(Propagation::default()), tracer(all()));
    let cut = tracer(Propagation {
        diffraction: Some(Diffraction::default()),
        ..Propagation::default()
    });
    let level_only = Tracer::with(&scene, 0, all()).unwrap();
    let mut most = 0;
    for link in &list {
        let paths = |tracer: &Tracer<'_>| tracer.transmitter(link.tx).trace(link.rx);
        let (specular, diffracted): (Vec<TracedPath>, Vec<TracedPath>) = paths(&every)
            .into_iter()
            .partition(|path| path.kind().is_specular());
        assert_eq!(specular, paths(&plain));
        let gains_db = |paths: &[TracedPath]| -> Vec<f64> {
            paths
                .iter()
                .map(|path| 10.0 * libm::log10(path.gain.norm_sqr()))
                .collect()
        };
        let mut expected = gains_db(&diffracted);
        expected.retain(|&gain_db| gain_db >= -165.0);
        most = most.max(expected.len());
        expected.truncate(24);
        let mut kept = paths(&cut);
        kept.retain(|path| !path.kind().is_specular());
        assert_eq!(gains_db(&kept), expected);
        assert!(paths(&level_only).iter().all(|path| path.order() <= 1));
    }
    assert!(most > 24, "{most}: the limit is not met");
}

#[test]
fn a_screen_diffracts_only_when_asked_and_its_back_is_black() {
    let screen = vec![
        [0.0, -200.0, -200.0],
        [0.0, -200.0, 200.0],
        [0.0, 0.0, 200.0],
        [0.0, 0.0, -200.0],
    ];
    let scene = scene_of(Material::PAPER, vec![screen]);
    let mut with_rims = all();
    with_rims.diffraction.as_mut().unwrap().rims = true;
    let tracer = |propagation| Tracer::with(&scene, 1, propagation).unwrap();
    let [front, back] = [1.0, -1.0].map(|side| [side * 20.0 * scene.faces()[0].normal().x, -3.0, 0.0]);
    assert!(tracer(all()).transmitter(front).trace(back).is_empty());
    let tracer = tracer(with_rims);
    let mut worst: f64 = 0.0;
    // Across the shadow and the front's reflection boundary, from either side.
    for tx in [front, back] {
        let paths = |rx: [f64; 3]| tracer.transmitter(tx).trace(rx);
        let has = |rx: [f64; 3]| {
            let paths = paths(rx);
            [0, 1].map(|order| paths.iter().any(|p| p.order() == order && p.kind().is_specular()))
        };
        let circle = |at: f64| about_axis(25.0, at, 1.0);
        let mut boundaries = 0;
        for step in 0..720 {
            let [mut low, mut high] = [step, step + 1].map(|s| TAU * (f64::from(s) + 0.37) / 720.0);
            let before = has(circle(low));
            // Through the screen itself there is no continuity.
            let [x, y, _] = circle(low);
            if has(circle(high)) == before || (y < 0.0 && x.abs() < 0.5) {
                continue;
            }
            while high - low > 1e-11 {
                let middle = 0.5 * (low + high);
                if has(circle(middle)) == before {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            boundaries += 1;
            let [one, other] =
                [low - TAU * BESIDE, high + TAU * BESIDE].map(|at| total(&tracer, tx, circle(at), true));
            let unit = WAVELENGTH_M / (4.0 * PI * 25.0 * SQRT_2) * DIPOLES;
            worst = worst.max((one - other).norm() / unit);
        }
        assert!(boundaries >= 1, "{boundaries}");
        // Where a reflection off the side of the transmitter would end: off the back there is none.
        let ends = libm::atan2(-tx[1], tx[0]);
        let [one, other] = [-BESIDE, BESIDE].map(|off| total(&tracer, tx, circle(ends + TAU * off), true));
        let unit = WAVELENGTH_M / (4.0 * PI * 25.0 * SQRT_2) * DIPOLES;
        worst = worst.max((one - other).norm() / unit);
    }
    println!("screen with a black back: jump {worst:.1e}");
    assert!(worst < 1e-3, "{worst}");
}
