//! Paths over uneven surfaces: Fermat's principle, what the panels of a facade do to a mirror, and what stays that of the flat faces.

mod panels;

use super::*;
use crate::paths::Interaction;
use crate::random::Stream;
use crate::scene::{Material, Placement, RawFace, Unevenness};
use crate::tracer::{Diffraction, Diffuse, Propagation, Tracer};

fn diffracting() -> Propagation {
    Propagation {
        diffraction: Some(Diffraction::default()),
        ..Propagation::default()
    }
}

/// Free places in a scene.
fn places<const N: usize>(scene: &Scene, stream: u64) -> [[f64; 3]; N] {
    let (bounds, mut random) = (scene.bounds(), Stream::new(11, stream));
    core::array::from_fn(|_| {
        loop {
            let at = core::array::from_fn(|i| {
                bounds.min_m[i] + (bounds.max_m[i] - bounds.min_m[i]) * (0.05 + 0.9 * random.uniform())
            });
            if scene.is_free(at) {
                return at;
            }
        }
    })
}

/// Paths of all pairs of places.
fn traced(scene: &Scene, propagation: Propagation) -> Vec<([Vec3; 2], Vec<TracedPath>)> {
    let tracer = Tracer::with(scene, 3, propagation).expect("few reflections");
    let (from, to) = (places::<6>(scene, 1), places::<25>(scene, 2));
    let link = |tx: [f64; 3]| {
        let tree = tracer.transmitter(tx);
        to.map(|rx| ([tx.into(), rx.into()], tree.trace(rx)))
    };
    from.into_iter().flat_map(link).collect()
}

/// What tells a path of another: kind, faces and edge.
fn identity(path: &TracedPath) -> (String, Vec<u32>, Option<u32>) {
    (path.kind().to_string(), path.faces().to_vec(), path.wedge)
}

fn length_m(points: &[Vec3]) -> f64 {
    points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum()
}

#[test]
fn nothing_uneven_is_the_same_bit_for_bit() {
    let flat = Scene::load("outdoor").expect("built in");
    let level = Scene::load("outdoor")
        .expect("built in")
        .with_unevenness(Unevenness::default());
    assert_eq!(traced(&flat, diffracting()), traced(&level, diffracting()));
    // Under a roof everything is level.
    let room = Scene::load("indoor").expect("built in");
    assert!(room.with_unevenness(Unevenness::real()).uneven().is_none());
    // What hardly leaves the faces hardly leaves the paths.
    let hardly = Unevenness {
        ground_relief_rms_m: 1e-9,
        ..Unevenness::default()
    };
    let hardly = Scene::load("outdoor").expect("built in").with_unevenness(hardly);
    let pairs = traced(&flat, diffracting())
        .into_iter()
        .zip(traced(&hardly, diffracting()));
    for ((_, flat), (_, hardly)) in pairs {
        for path in &flat {
            let same = |other: &&TracedPath| identity(other) == identity(path);
            let other = hardly.iter().find(same).expect("the same path");
            assert!((other.length_m() - path.length_m()).abs() < 1e-7);
            assert!((other.gain - path.gain).norm() < 1e-4 * path.gain.norm());
        }
    }
}

#[test]
fn the_length_is_stationary_over_the_true_surface() {
    for (name, unevenness) in [
        ("outdoor", Unevenness::real()),
        (
            "street",
            Unevenness {
                surface_seed: 5,
                ..Unevenness::real()
            },
        ),
    ] {
        let flat = traced(&Scene::load(name).expect("built in"), diffracting());
        let scene = Scene::load(name).expect("built in").with_unevenness(unevenness);
        let uneven = scene.uneven().expect("outdoors");
        let (mut points_met, mut on_surface, mut stayed) = (0, 0, 0);
        let mut led = std::collections::BTreeMap::<String, usize>::new();
        for ((ends, paths), (_, flat)) in traced(&scene, diffracting()).iter().zip(&flat) {
            assert_eq!(paths.len(), flat.len(), "none is dropped, none is added");
            for path in paths
                .iter()
                .filter(|path| path.faces().iter().any(|&f| uneven.is_off(f)))
            {
                let was = flat.iter().find(|other| identity(other) == identity(path));
                let was = was.expect("a path over the flat faces");
                if was.vertices() == path.vertices() {
                    stayed += 1;
                    continue;
                }
                *led.entry(path.kind().to_string()).or_default() += 1;
                let mut points = vec![ends[0]];
                points.extend(path.vertices().iter().map(|v| Vec3::from(*v)));
                points.push(ends[1]);
                assert!((length_m(&points) - path.length_m()).abs() < 1e-12);
                let mut faces = path.faces().iter();
                for place in 1..=path.order() {
                    let here = points[place];
                    let moved: Vec<Box<dyn Fn(f64) -> Vec3 + '_>> = if path.kind().edge() == Some(place - 1) {
                        let tracer_edge = places_on_edge(&scene, path);
                        vec![Box::new(move |step| here + tracer_edge * step)]
                    } else {
                        let number = *faces.next().expect("a face");
                        let face = &scene.faces()[number as usize];
                        let height_m = face.height_m(&here);
                        let foot = here - face.normal() * height_m;
                        points_met += 1;
                        if (uneven.height_m(number, &foot) - height_m).abs() > 1e-9 {
                            // Beyond the rim of its panel.
                            continue;
                        }
                        on_surface += 1;
                        let patch = uneven.patch(number, &foot);
                        let along = |axis: Vec3| -> Box<dyn Fn(f64) -> Vec3 + '_> {
                            Box::new(move |step| {
                                let foot = foot + axis * step;
                                foot + face.normal() * patch.shape(&foot, &face.axes()).height_m
                            })
                        };
                        face.axes().map(along).into_iter().collect()
                    };
                    for at in moved {
                        let length = |step: f64| {
                            let mut points = points.clone();
                            points[place] = at(step);
                            length_m(&points)
                        };
                        let (back, there, on) = (length(-1e-4), length(0.0), length(1e-4));
                        assert!(
                            (on - back).abs() < 1e-9,
                            "{name}: {} {place}: {}",
                            path.kind(),
                            on - back
                        );
                        assert!(on + back >= 2.0 * there - 1e-12, "the shortest nearby");
                    }
                }
            }
        }
        let all: usize = led.values().sum();
        println!("{name}: led {led:?}, stayed {stayed}, {on_surface} of {points_met} points on the surface");
        for kind in ["R", "RR", "RRR", "RD", "DR"] {
            assert!(led.get(kind).is_some_and(|&n| n > 10), "{name}: {kind}: {led:?}");
        }
        assert!(stayed * 10 < all, "{name}: {stayed} of {all} stayed");
        assert!(
            points_met - on_surface < points_met / 25,
            "{name}: {on_surface} of {points_met}"
        );
    }
}

/// Unit vector along the edge of a diffracted path.
fn places_on_edge(scene: &Scene, path: &TracedPath) -> Vec3 {
    let edges = super::super::edges::Edges::of(scene, false);
    edges.wedges[path.wedge.expect("diffracted") as usize].along
}

#[test]
fn where_no_way_over_the_surface_is_the_shortest_the_flat_path_stays() {
    // Waves of a metre: tens of specular points about each flat one.
    let rough = Unevenness {
        ground_relief_rms_m: 1.0,
        ground_relief_length_m: 5.0,
        ..Unevenness::default()
    };
    let flat = traced(&Scene::load("outdoor").expect("built in"), diffracting());
    let scene = Scene::load("outdoor").expect("built in").with_unevenness(rough);
    let uneven = scene.uneven().expect("outdoors");
    let (mut stayed, mut led) = (0, 0);
    for ((_, paths), (_, flat)) in traced(&scene, diffracting()).iter().zip(&flat) {
        assert_eq!(paths.len(), flat.len());
        for path in paths {
            let was = flat.iter().find(|other| identity(other) == identity(path));
            let was = was.expect("a path over the flat faces");
            if !path.faces().iter().any(|&f| uneven.is_off(f)) {
                assert_eq!(path, was);
            } else if path.vertices() == was.vertices() {
                assert_eq!(path, was);
                stayed += 1;
            } else {
                led += 1;
            }
        }
    }
    println!("stayed {stayed}, led {led}");
    assert!(stayed > led && led > 10, "{stayed} {led}");
}

#[test]
fn what_is_scattered_stays_on_the_flat_faces() {
    let scattering = Propagation {
        diffuse: Some(Diffuse::default()),
        ..Propagation::default()
    };
    let scene = Scene::load("outdoor")
        .expect("built in")
        .with_unevenness(Unevenness::real());
    let tracer = Tracer::with(&scene, 1, scattering).expect("few reflections");
    let [tx, rx] = places::<2>(&scene, 7);
    let paths = tracer.transmitter(tx).trace(rx);
    let scattered = paths
        .iter()
        .filter(|path| path.kind().interactions() == [Interaction::Scattering]);
    let off =
        |path: &TracedPath| scene.faces()[path.faces()[0] as usize].height_m(&path.vertices()[0].into());
    let all: Vec<f64> = scattered.map(off).collect();
    assert!(all.len() > 20 && all.iter().all(|off| off.abs() < 1e-9));
}

#[test]
fn a_moved_scene_has_the_moved_paths() {
    let everything = Propagation {
        diffuse: Some(Diffuse::default()),
        roughness: true,
        ..diffracting()
    };
    for (name, turned_deg) in [("outdoor", 33.0), ("street", -90.0), ("indoor", 141.7)] {
        let make = || {
            let scene = Scene::load(name).expect("built in").with_drawn_materials();
            scene.with_unevenness(Unevenness::real())
        };
        let placement = Placement {
            moved_m: [310.0, -75.0, 42.0],
            turned_deg,
        };
        let (scene, moved) = (make(), make().placed(placement).expect("near"));
        let [tracer, moved_tracer] =
            [&scene, &moved].map(|scene| Tracer::with(scene, 2, everything).expect("few reflections"));
        let mut compared = 0;
        for link in 0..6 {
            let [tx, rx] = places::<2>(&scene, 20 + link);
            let there = |p: [f64; 3]| -> [f64; 3] { placement.place(&p.into()).into() };
            let here = tracer.transmitter(tx).trace(rx);
            let elsewhere = moved_tracer.transmitter(there(tx)).trace(there(rx));
            assert_eq!(here.len(), elsewhere.len(), "{name} {link}");
            for path in &here {
                let twin = elsewhere
                    .iter()
                    .filter(|other| identity(other) == identity(path))
                    .min_by(|a, b| {
                        let off = |p: &TracedPath| (p.length_m() - path.length_m()).abs();
                        off(a).total_cmp(&off(b))
                    })
                    .unwrap_or_else(|| panic!("{name}: no {}", path.kind()));
                let relative = (twin.length_m() - path.length_m()).abs() / path.length_m();
                assert!(relative < 1e-12, "{name} {}: {relative:e}", path.kind());
                for (of_twin, of_path) in [
                    (twin.departure_rad(), path.departure_rad()),
                    (twin.arrival_rad(), path.arrival_rad()),
                ] {
                    let turn = of_twin[1] - of_path[1] - placement.turned_rad();
                    assert!((of_twin[0] - of_path[0]).abs() < 1e-9);
                    assert!(libm::sin(0.5 * turn).abs() < 1e-9, "{turn}");
                }
                for (there, here) in twin.vertices().iter().zip(path.vertices()) {
                    assert!((placement.place(&Vec3::from(*here)) - Vec3::from(*there)).norm() < 1e-8);
                }
                assert!(
                    (twin.gain - path.gain).norm() < 1e-7 * path.gain.norm(),
                    "{name} {}",
                    path.kind()
                );
                compared += 1;
            }
        }
        assert!(compared > 100, "{name}: {compared}");
    }
}
