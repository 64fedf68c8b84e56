//! Bodies in a link against hand-made figures, and against how lengths change as they move.

use super::*;
use crate::scene::{Bounds, RawFace};
use crate::tracer::Tracer;

/// Ground of 100 x 100 m.
fn plain() -> Scene {
    let ground = RawFace {
        vertices: vec![
            [-50.0, -50.0, 0.0],
            [50.0, -50.0, 0.0],
            [50.0, 50.0, 0.0],
            [-50.0, 50.0, 0.0],
        ],
        ..RawFace::default()
    };
    let bounds = Bounds {
        min_m: [-50.0, -50.0, 0.0],
        max_m: [50.0, 50.0, 20.0],
    };
    Scene::new("plain", Material::PAPER, 30e9, Some(bounds), vec![ground]).unwrap()
}

fn body(kind: BodyKind, foot_m: [f64; 2], velocity: [f64; 2]) -> Body {
    Body {
        kind,
        foot_m: Vec3::new(foot_m[0], foot_m[1], 0.0),
        forward: Vec3::x(),
        velocity_m_per_s: Vec3::new(velocity[0], velocity[1], 0.0),
    }
}

/// Paths of a link among bodies, by kind.
fn trace(tx_m: [f64; 3], rx_m: [f64; 3], bodies: &[Body]) -> Vec<TracedPath> {
    let scene = plain();
    let tracer = Tracer::new(&scene, 2).unwrap();
    let tree = tracer.transmitter(tx_m);
    let bodies = Bodies::new(bodies, &scene, tracer.propagation());
    bodies.among(&tree, rx_m, tree.trace(rx_m))
}

fn of_kind<'p>(paths: &'p [TracedPath], kind: &str) -> Option<&'p TracedPath> {
    paths.iter().find(|path| path.kind().to_string() == kind)
}

const TX: [f64; 3] = [0.0, 0.0, 1.5];
const RX: [f64; 3] = [20.0, 0.0, 1.5];

fn loss_db(paths: &[TracedPath], bare: &[TracedPath], kind: &str) -> f64 {
    let [left, whole] = [paths, bare].map(|paths| of_kind(paths, kind).expect("there").gain.norm());
    -20.0 * libm::log10(left / whole)
}

#[test]
fn a_person_across_a_link_weakens_it_by_its_knife_edges() {
    let bare = trace(TX, RX, &[]);
    // Worked out by hand for 20 m: F of edges 0.25 m off 0.36430, 0.5 m 0.44067, 1 m 0.46998, 1.5 m 0.47589.
    let across = trace(TX, RX, &[body(BodyKind::Person, [10.0, 0.0], [0.0; 2])]);
    assert!((loss_db(&across, &bare, "LOS") - 8.2264).abs() < 1e-3);
    let beside = trace(TX, RX, &[body(BodyKind::Person, [10.0, 0.75], [0.0; 2])]);
    assert!((loss_db(&beside, &bare, "LOS") - 0.2598).abs() < 1e-3);
    let far = trace(TX, RX, &[body(BodyKind::Person, [10.0, 5.0], [0.0; 2])]);
    assert_eq!(of_kind(&far, "LOS"), of_kind(&bare, "LOS"));
    let behind = trace(TX, RX, &[body(BodyKind::Person, [20.5, 0.0], [0.0; 2])]);
    assert_eq!(of_kind(&behind, "LOS"), of_kind(&bare, "LOS"));
    // Just over the head, and rising.
    let (tx, rx) = ([0.0, 0.0, 1.0], [20.0, 0.0, 2.0]);
    let low = trace(tx, rx, &[body(BodyKind::Person, [10.0, 0.0], [0.0; 2])]);
    assert!((loss_db(&low, &trace(tx, rx, &[]), "LOS") - 8.2220).abs() < 1e-3);
}

#[test]
fn a_car_blocks_what_goes_through_it_and_nothing_else() {
    let bare = trace(TX, RX, &[]);
    let parked = body(BodyKind::Car, [10.0, 0.0], [0.0; 2]);
    // Over the roof and under it; where the ground reflects the car stands.
    for (z, passes) in [(1.51, true), (1.49, false)] {
        let [tx, rx] = [TX, RX].map(|[x, y, _]| [x, y, z]);
        let paths = trace(tx, rx, &[parked]);
        assert_eq!(of_kind(&paths, "LOS").is_some(), passes, "{z}");
        assert!(of_kind(&paths, "R").is_none() && of_kind(&bare, "R").is_some());
    }
    let aside = trace(TX, RX, &[body(BodyKind::Car, [10.0, 3.0], [0.0; 2])]);
    for kind in ["LOS", "R"] {
        assert_eq!(of_kind(&aside, kind), of_kind(&bare, kind));
    }
}

#[test]
fn the_side_of_a_car_reflects_as_a_mirror_of_its_size() {
    let car = body(BodyKind::Car, [10.0, 3.0], [0.0; 2]);
    let paths = trace(TX, RX, &[car]);
    let path = of_kind(&paths, "M").expect("a reflection");
    // The nearer side is 2.1 m away: 10 m there, 10 m on.
    let length_m = 2.0 * (100.0_f64 + 2.1 * 2.1).sqrt();
    assert!((path.length_m() - length_m).abs() < 1e-9, "{}", path.length_m());
    assert!((Vec3::from(path.vertices()[0]) - Vec3::new(10.0, 2.1, 1.5)).norm() < 1e-9);
    assert_eq!((path.order(), path.faces()), (1, &[][..]));
    // At 1.4 m the pane reflects, at 0.4 m the metal: a perfect mirror of 4.4 x 0.75 m.
    let at = |z: f64| {
        let [tx, rx] = [TX, RX].map(|[x, y, _]| [x, y, z]);
        let paths = trace(tx, rx, &[car]);
        let path = of_kind(&paths, "M").expect("a reflection");
        // Level polarisation across the side, free space and dipoles taken off.
        let free = SPEED_OF_LIGHT_M_PER_S / 30e9 / (4.0 * core::f64::consts::PI * length_m) * 1.643;
        path.gain.norm() / free
    };
    let opening = |edges_m: [f64; 2], foreshortened: f64| {
        let half_m = 0.5 * length_m;
        strip(
            edges_m.map(|m| m * foreshortened),
            [half_m; 2],
            SPEED_OF_LIGHT_M_PER_S / 30e9,
        )
    };
    let wide = opening([-2.2, 2.2], 2.1 / (0.5 * length_m));
    let metal = wide * opening([-0.4, 0.35], 1.0);
    assert!((at(0.4) - metal).abs() < 1e-3, "{} {metal}", at(0.4));
    let [pane, mirror] = [at(1.1), metal].map(|gain| 20.0 * libm::log10(gain));
    assert!((0.3..12.0).contains(&(mirror - pane)), "{mirror} {pane}");
}

#[test]
fn no_reflection_comes_through_a_wall_or_another_car() {
    let car = body(BodyKind::Car, [10.0, 3.0], [0.0; 2]);
    let [tx, rx] = [TX, RX].map(|[x, y, _]| [x, y, 1.0]);
    assert!(of_kind(&trace(tx, rx, &[car]), "M").is_some());
    let between = body(BodyKind::Car, [5.0, 1.0], [0.0; 2]);
    let paths = trace(tx, rx, &[car, between]);
    let sees_far = |path: &TracedPath| (path.length_m() - 2.0 * (100.0_f64 + 2.1 * 2.1).sqrt()).abs() < 1e-6;
    assert!(!paths.iter().any(sees_far), "{paths:?}");
}

#[test]
fn what_a_mover_does_to_a_length_is_its_doppler() {
    let (tx, rx) = ([-6.0, -3.0, 0.9], [5.0, -6.0, 1.2]);
    let kinds = ["M", "MR", "RM"];
    let mut seen = [0; 3];
    for (kind, speed) in [(BodyKind::Car, 14.0), (BodyKind::Person, 1.4)] {
        for step in 0..400 {
            let place = [0.6 * f64::from(step % 20) - 6.0, 0.3 * f64::from(step / 20) - 1.0];
            let angle = 0.37 * f64::from(step);
            let velocity = [speed * libm::cos(angle), speed * libm::sin(angle)];
            let at = |time_s: f64| {
                let place = [0, 1].map(|i| place[i] + velocity[i] * time_s);
                let mut body = body(kind, place, velocity);
                body.forward = Vec3::new(libm::cos(angle), libm::sin(angle), 0.0);
                trace(tx, rx, &[body])
            };
            let [before, now, after] = [-0.5e-3, 0.0, 0.5e-3].map(at);
            for (k, name) in kinds.into_iter().enumerate() {
                let found = [&before, &now, &after].map(|paths| of_kind(paths, name));
                let [Some(before), Some(now), Some(after)] = found else {
                    continue;
                };
                // Another side may have come into view.
                let shortens_m_per_s = (before.length_m() - after.length_m()) / 1e-3;
                if (now.length_m() - before.length_m()).abs() > 0.1 {
                    continue;
                }
                assert!(
                    (now.closing_m_per_s() - shortens_m_per_s).abs() < 1e-3,
                    "{name}: {} {shortens_m_per_s}",
                    now.closing_m_per_s()
                );
                seen[k] += usize::from(shortens_m_per_s.abs() > 0.5);
            }
        }
    }
    assert!(seen.iter().all(|count| *count > 10), "{seen:?}");
}

#[test]
fn without_bodies_every_path_is_as_it_was() {
    let scene = Scene::load("outdoor").unwrap();
    let tracer = Tracer::new(&scene, 3).unwrap();
    let tree = tracer.transmitter([60.0, 3.0, 1.5]);
    for step in 0..20 {
        let rx_m = [6.0 * f64::from(step) + 1.0, 61.0, 12.0];
        let paths = tree.trace(rx_m);
        let laid = Bodies::new(&[], &scene, tracer.propagation()).among(&tree, rx_m, paths.clone());
        assert_eq!(laid, paths);
    }
}
