//! The tracer against the committed reference lists, closed forms, and reciprocity.

mod batches;
mod pruning;

use std::path::Path;

use super::*;
use crate::paths;
use crate::random::Stream;
use crate::scene::{Bounds, Face, Material, RawFace, Vec3};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

pub(super) fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

fn reference(name: &str) -> (Scene, Vec<paths::Link>) {
    let scene = Scene::read(&fixture(&format!("{name}_scene.json"))).unwrap();
    (scene, paths::read(&fixture(&format!("{name}.jsonl.gz"))).unwrap())
}

#[test]
fn both_reference_lists_are_found_whole_and_nothing_else() {
    for (name, links, confirmed) in [("outdoor_a", 1000, 1697), ("indoor", 40, 212)] {
        let (scene, list) = reference(name);
        let result = Comparison::run(&Tracer::new(&scene, 3).unwrap(), &list);
        assert_eq!(
            (result.links, result.confirmed.total),
            (links, confirmed),
            "{name}"
        );
        assert!(result.passes(), "{name}: {result:?}");
        // Of these lists not even the edge exception is needed, and what differs is their rounding.
        assert_eq!(
            result.confirmed.at_edge + result.unconfirmed.at_edge + result.traced.at_edge,
            0,
            "{name}"
        );
        assert!(
            result.worst_length_m < 1e-9 && result.worst_angle_rad < 1e-9,
            "{name}: {result:?}"
        );
    }
}

#[test]
fn a_comparison_sees_what_is_missing_extra_or_wrong() {
    let (scene, mut list) = reference("indoor");
    let tracer = Tracer::new(&scene, 3).unwrap();
    let whole = Comparison::run(&tracer, &list);
    // Extra: a path is taken from the list.
    let link = list.iter().position(|l| l.paths.len() > 2).unwrap();
    let removed = list[link].paths.remove(1);
    let result = Comparison::run(&tracer, &list);
    assert_eq!((result.traced.unexplained(), result.passes()), (1, false));
    // Missing: one is put there twice.
    list[link].paths.insert(1, removed.clone());
    list[link].paths.insert(1, removed.clone());
    let result = Comparison::run(&tracer, &list);
    assert_eq!((result.confirmed.unexplained(), result.passes()), (1, false));
    list[link].paths.remove(1);
    assert_eq!(Comparison::run(&tracer, &list), whole);
    // Off by a little more than is tolerated.
    type Fault = fn(&mut paths::LinkPath);
    let faults: [Fault; 4] = [
        |p| p.delay_s += 3.1e-3 / SPEED_OF_LIGHT_M_PER_S,
        |p| p.aoa_zenith_rad += 1.1e-6,
        |p| p.aod_zenith_rad = p.aod_zenith_rad.map(|a| a - 1.1e-6),
        |p| p.gain = p.gain.map(|g| g.map(|c| 1.013 * c)),
    ];
    for (i, fault) in faults.iter().enumerate() {
        fault(&mut list[link].paths[0]);
        assert!(!Comparison::run(&tracer, &list).passes(), "fault {i} passed");
        list[link] = reference("indoor").1[link].clone();
    }
    // Fewer orders: every path of order 3 is missing, none is extra.
    let result = Comparison::run(&Tracer::new(&scene, 2).unwrap(), &list);
    let third = list
        .iter()
        .flat_map(|l| &l.paths)
        .filter(|p| p.order == Some(3))
        .count();
    assert_eq!(result.confirmed.total - result.confirmed.matched, third);
    assert_eq!(result.traced.unexplained(), 0);
}

fn rectangle(corner: [f64; 3], u: [f64; 3], v: [f64; 3]) -> RawFace {
    let [a, u, v] = [corner, u, v].map(Vec3::from);
    RawFace {
        vertices: [a, a + u, a + u + v, a + v].map(Into::into).to_vec(),
        ..RawFace::default()
    }
}

fn scene_of(raw: Vec<RawFace>) -> Scene {
    Scene::new("test", Material::PAPER, 30e9, None, raw).unwrap()
}

/// Two parallel walls at y = 0 and y = 10, facing each other.
fn canyon() -> Scene {
    scene_of(vec![
        rectangle([-500.0, 0.0, -500.0], [0.0, 0.0, 1000.0], [1000.0, 0.0, 0.0]),
        rectangle([-500.0, 10.0, -500.0], [1000.0, 0.0, 0.0], [0.0, 0.0, 1000.0]),
    ])
}

#[test]
fn a_canyon_has_its_images_at_every_order() {
    let scene = canyon();
    for order in 0..=MAX_ORDER {
        let tracer = Tracer::new(&scene, order).unwrap();
        let paths = tracer.transmitter([0.0, 3.0, 1.0]).trace([40.0, 8.0, 4.0]);
        assert_eq!(paths.len(), 1 + 2 * order);
        // Images of y = 3 at walls 0 and 10: 20 k + 3 (even orders) and 20 k - 3 (odd orders).
        let mut expected: Vec<f64> = (0..=order as i32)
            .flat_map(|n| {
                if n == 0 {
                    vec![(0, 3.0)]
                } else {
                    vec![(n, 1.0), (n, -1.0)]
                }
            })
            .map(|(n, up)| {
                let n = f64::from(n);
                let image = if n == 0.0 {
                    3.0
                } else if n % 2.0 == 0.0 {
                    up * 10.0 * n + 3.0
                } else {
                    10.0 + up * 10.0 * n - 3.0
                };
                (40.0_f64.powi(2) + (image - 8.0).powi(2) + 9.0).sqrt()
            })
            .collect();
        let mut lengths: Vec<f64> = paths.iter().map(TracedPath::length_m).collect();
        expected.sort_by(f64::total_cmp);
        lengths.sort_by(f64::total_cmp);
        assert!(
            lengths.iter().zip(&expected).all(|(a, b)| (a - b).abs() < 1e-11),
            "{lengths:?} {expected:?}"
        );
        for path in &paths {
            assert_eq!(path.faces().windows(2).filter(|f| f[0] == f[1]).count(), 0);
            assert_eq!(path.vertices().len(), path.order());
        }
    }
}

#[test]
fn every_face_reflects_by_its_own_material() {
    let walls = || {
        vec![
            rectangle([-500.0, 0.0, -500.0], [0.0, 0.0, 1000.0], [1000.0, 0.0, 0.0]),
            rectangle([-500.0, 10.0, -500.0], [1000.0, 0.0, 0.0], [0.0, 0.0, 1000.0]),
        ]
    };
    let brick = Material::named("brick").unwrap();
    let gains = |scene: &Scene| -> Vec<(Vec<u32>, [f64; 2])> {
        let tracer = Tracer::new(scene, 2).unwrap();
        let paths = tracer.transmitter([0.0, 3.0, 1.0]).trace([40.0, 8.0, 4.0]);
        let mut gains: Vec<_> = paths.iter().map(|p| (p.faces().to_vec(), p.gain())).collect();
        gains.sort_by(|a, b| a.0.cmp(&b.0));
        gains
    };
    let plain = gains(&scene_of(walls()));
    let of_brick = gains(&Scene::new("test", brick, 30e9, None, walls()).unwrap());
    let mixed = gains(&scene_of(walls()).with_materials(&[brick], &[None, Some(0)]));
    for ((faces, gain), (plain, brick)) in mixed.iter().zip(plain.iter().zip(&of_brick)) {
        let [gain, plain, brick] = [*gain, plain.1, brick.1];
        match faces.as_slice() {
            [] | [0] => assert_eq!(gain, plain),
            [1] => assert_eq!(gain, brick),
            _ => assert!(gain != plain && gain != brick, "{faces:?}"),
        }
    }
    // One material for all counts before those of the faces.
    let scene = scene_of(walls()).with_materials(&[brick], &[None, Some(0)]);
    let tracer = Tracer::new(&scene, 2).unwrap();
    let same = tracer
        .transmitter([0.0, 3.0, 1.0])
        .trace_with([40.0, 8.0, 4.0], &brick);
    assert!(
        same.iter()
            .all(|path| of_brick.contains(&(path.faces().to_vec(), path.gain())))
    );
}

#[test]
fn walls_reflect_on_their_front_only() {
    let wall = rectangle([-5.0, 0.0, -5.0], [0.0, 0.0, 10.0], [10.0, 0.0, 0.0]);
    let scene = scene_of(vec![wall]);
    let tracer = Tracer::new(&scene, 1).unwrap();
    let orders = |y: f64| -> Vec<usize> {
        tracer
            .transmitter([-1.0, y, 0.0])
            .trace([1.0, y, 0.0])
            .iter()
            .map(TracedPath::order)
            .collect()
    };
    assert_eq!(orders(2.0), [0, 1]);
    assert_eq!(orders(-2.0), [0]);
    // From behind: past the edge by line of sight alone; from straight behind not at all, although the line from the
    // receiver through the image meets the wall.
    let across = tracer.transmitter([5.5, -1.0, 0.0]).trace([6.0, 3.0, 0.0]);
    assert_eq!(across.iter().map(TracedPath::order).collect::<Vec<_>>(), [0]);
    assert!(
        tracer
            .transmitter([-1.0, -2.0, 0.0])
            .trace([-2.0, 4.0, 0.0])
            .is_empty()
    );
}

#[test]
fn two_coplanar_halves_reflect_once_at_their_common_edge() {
    let left = rectangle([-5.0, -5.0, 0.0], [5.0, 0.0, 0.0], [0.0, 10.0, 0.0]);
    let right = rectangle([0.0, -5.0, 0.0], [5.0, 0.0, 0.0], [0.0, 10.0, 0.0]);
    let scene = scene_of(vec![left, right]);
    let paths = Tracer::new(&scene, 2)
        .unwrap()
        .transmitter([-2.0, 0.0, 2.0])
        .trace([2.0, 0.0, 2.0]);
    assert_eq!(paths.iter().map(TracedPath::order).collect::<Vec<_>>(), [0, 1]);
}

#[test]
fn a_path_and_its_reverse_are_one() {
    let scene = Scene::load("street").unwrap();
    let tracer = Tracer::new(&scene, 3).unwrap();
    let mut random = Stream::new(8, 0);
    let mut seen = 0;
    for _ in 0..40 {
        let [a, b] = [0, 1].map(|_| free_point(&scene, &mut random));
        let there = tracer.transmitter(a).trace(b);
        let back = tracer.transmitter(b).trace(a);
        assert_eq!(there.len(), back.len(), "{a:?} {b:?}");
        for path in &there {
            let reversed: Vec<u32> = path.faces().iter().rev().copied().collect();
            let twin = back
                .iter()
                .find(|p| p.faces() == reversed)
                .expect("the reverse path");
            assert!((twin.length_m() - path.length_m()).abs() < 1e-9);
            assert_eq!(
                twin.arrival_rad().map(|a| (a * 1e9).round()),
                path.departure_rad().map(|a| (a * 1e9).round())
            );
            let [p, q] = [path, twin].map(|p| nalgebra::Complex::new(p.gain()[0], p.gain()[1]));
            assert!((p - q).norm() < 1e-9 * p.norm(), "{p} {q}");
            seen += 1;
        }
    }
    assert!(seen > 100, "{seen} paths");
}

pub(super) fn free_point(scene: &Scene, random: &mut Stream) -> [f64; 3] {
    let Bounds { min_m, max_m } = scene.bounds();
    loop {
        let point = [0, 1, 2].map(|i| min_m[i] + (max_m[i] - min_m[i]) * random.uniform());
        if scene.is_free(point) {
            return point;
        }
    }
}

#[test]
fn links_tell_the_horizontal_component_when_asked_and_change_in_nothing_else() {
    let (scene, list) = reference("outdoor_a");
    let told = |cross_polarisation, scene: &Scene| {
        let propagation = Propagation {
            cross_polarisation,
            ..Propagation::default()
        };
        let tracer = Tracer::with(scene, 2, propagation).unwrap();
        let ends = list[..200].iter().map(|link| (link.tx, link.rx));
        ends.map(|(tx, rx)| {
            let tree = tracer.transmitter(tx);
            tree.to_link(rx, &tree.trace(rx))
        })
        .collect::<Vec<_>>()
    };
    let told_uneven = crate::scene::Unevenness {
        ground_relief_rms_m: 0.15,
        panels: true,
        ..crate::scene::Unevenness::default()
    };
    let uneven = reference("outdoor_a").0.with_unevenness(told_uneven);
    for scene in [&scene, &uneven] {
        let (without, mut with) = (told(false, scene), told(true, scene));
        let size = |component: Option<[f64; 2]>| component.map_or(0.0, |[re, im]| libm::hypot(re, im));
        let mut shares = Vec::new();
        for path in with.iter_mut().flat_map(|link| &mut link.paths) {
            let across = path.cross_gain.take();
            if path.order == Some(0) {
                assert!(size(across) < 1e-15 * size(path.gain), "line of sight");
            } else {
                shares.push(size(across) / size(path.gain));
            }
        }
        assert_eq!(with, without);
        shares.sort_by(f64::total_cmp);
        let [median, high] =
            [shares.len() / 2, shares.len() * 9 / 10].map(|at| 20.0 * libm::log10(shares[at]));
        println!(
            "{} reflected paths: horizontal component at {median:.1} dB in the median, {high:.1} dB at 90 %",
            shares.len()
        );
        assert!((-60.0..-5.0).contains(&median) && high > -20.0, "{median} {high}");
    }
    // What takes a part of a path takes it of both.
    let tracer = Tracer::new(&scene, 2).unwrap();
    let mut path = tracer.transmitter(list[0].tx).trace(list[0].rx).pop().unwrap();
    path.across = path.gain * 0.25;
    path.weaken(nalgebra::Complex::new(0.0, 0.5));
    assert!((path.across - path.gain * 0.25).norm() < 1e-18);
}

#[test]
fn paths_come_strongest_first_and_order_has_its_limit() {
    let (scene, list) = reference("indoor");
    let tree_of = Tracer::new(&scene, 3).unwrap();
    let tree = tree_of.transmitter(list[0].tx);
    for link in &list {
        let gains: Vec<f64> = tree
            .trace(link.rx)
            .iter()
            .map(|p| p.gain()[0].hypot(p.gain()[1]))
            .collect();
        assert!(gains.is_sorted_by(|a, b| a >= b));
    }
    assert!(Tracer::new(&scene, MAX_ORDER + 1).is_none());
}
