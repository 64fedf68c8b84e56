//! Scenes as a whole: queries against independent answers, built-ins, faults.

mod imports;

use std::path::Path;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::*;

fn quad(vertices: [[f64; 3]; 4]) -> RawFace {
    RawFace {
        vertices: vertices.to_vec(),
        ..RawFace::default()
    }
}

fn random_point(rng: &mut ChaCha8Rng, bounds: Bounds) -> [f64; 3] {
    [0, 1, 2].map(|i| rng.random_range(bounds.min_m[i]..bounds.max_m[i]))
}

/// The reference scene's prisms, as its file lists them beside the faces: an independent account of what is solid.
fn in_a_prism(scene: &serde_json::Value, p: [f64; 3]) -> bool {
    scene["prisms"].as_array().unwrap().iter().any(|prism| {
        let height = |key: &str| prism[key].as_f64().unwrap();
        let corner = |ring: &str, i: usize, k: usize| prism[ring][i][k].as_f64().unwrap();
        let n = prism["base"].as_array().unwrap().len();
        let t = (p[2] - height("z0")) / (height("z1") - height("z0"));
        if !(0.0..=1.0).contains(&t) {
            return false;
        }
        let at = |i: usize, k: usize| (1.0 - t) * corner("base", i, k) + t * corner("top", i, k);
        let mut inside = false;
        for i in 0..n {
            let j = (i + 1) % n;
            let (a, b) = ([at(i, 0), at(i, 1)], [at(j, 0), at(j, 1)]);
            if (a[1] > p[1]) != (b[1] > p[1]) && p[0] < a[0] + (p[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]) {
                inside = !inside;
            }
        }
        inside
    })
}

#[test]
fn solids_agree_with_the_prisms_of_both_reference_scenes() {
    let indoor = include_str!("../../fixtures/indoor_scene.json");
    for text in [REFERENCE_SCENE_JSON, indoor] {
        let scene = json::parse(Path::new("fixture"), text).unwrap();
        let file: serde_json::Value = serde_json::from_str(text).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let mut solid = 0;
        for _ in 0..4000 {
            let [x, y, z] = random_point(&mut rng, scene.bounds());
            // Between floor and ceiling, through which the indoor walls reach.
            let p = [
                x,
                y,
                z.clamp(
                    0.01,
                    if scene.name() == "indoor" {
                        3.99
                    } else {
                        z.max(0.01)
                    },
                ),
            ];
            assert_eq!(
                scene.inside_solid(p),
                in_a_prism(&file, p),
                "{} at {p:?}",
                scene.name()
            );
            solid += usize::from(scene.inside_solid(p));
        }
        assert!(solid > 40, "only {solid} points in solids: the test says little");
        let below = [1.0, 1.0, -0.5];
        assert!(scene.inside_solid(below), "the ground is solid");
    }
}

#[test]
fn the_tree_finds_what_trying_every_face_finds() {
    for name in BUILT_IN_NAMES {
        let scene = Scene::load(name).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let mut blocked = 0;
        for _ in 0..4000 {
            let [a, b] = [0, 1].map(|_| random_point(&mut rng, scene.bounds()));
            let every = scene
                .faces()
                .iter()
                .any(|f| f.crossing(&a.into(), &b.into()).is_some());
            assert_eq!(scene.blocked(a, b), every, "{name}: {a:?} to {b:?}");
            assert_eq!(scene.blocked(b, a), every, "{name}: {b:?} to {a:?}");
            blocked += usize::from(every);
        }
        assert!((400..3990).contains(&blocked), "{name}: {blocked}");
    }
}

#[test]
fn a_point_on_a_surface_sees_only_what_is_in_front() {
    let scene = Scene::load("outdoor").unwrap();
    let roof = scene
        .faces()
        .iter()
        .find(|f| f.is_convex() && f.normal().z > 0.999 && f.object() > 0)
        .unwrap();
    let on: Vec3 = roof.vertices().iter().sum::<Vec3>() / roof.vertices().len() as f64;
    let [front, back] = [0.3, -0.3].map(|d| (on + roof.normal() * d).into());
    assert!(!scene.blocked(on.into(), front) && !scene.blocked(front, on.into()));
    assert!(scene.blocked(front, back));
    // Within the margin of the surface, either side counts as on it.
    for offset_m in [0.5 * SURFACE_MARGIN_M, -0.5 * SURFACE_MARGIN_M] {
        let near = (on + roof.normal() * offset_m).into();
        assert!(!scene.blocked(near, front) && !scene.blocked(front, near));
    }
    let behind = (on - roof.normal() * (2.0 * SURFACE_MARGIN_M)).into();
    assert!(scene.blocked(behind, front) && scene.blocked(front, behind));
    assert!(!scene.inside_solid(on.into()) && !scene.inside_solid(front));
    assert!(scene.inside_solid(back));
}

#[test]
fn built_in_outdoor_is_the_town_that_was_asked_for() {
    let scene = Scene::load("outdoor").unwrap();
    let buildings = scene.faces().iter().map(Face::object).max().unwrap();
    assert!((18..=24).contains(&buildings), "{buildings} buildings");
    let roofs: Vec<&Face> = scene
        .faces()
        .iter()
        .filter(|f| f.normal().z > 0.999 && f.object() > 0)
        .collect();
    for corners in [4, 6, 8] {
        assert!(
            roofs.iter().any(|f| f.vertices().len() == corners),
            "no roof with {corners} corners"
        );
    }
    assert!(roofs.iter().any(|f| !f.is_convex()));
    assert!(
        scene.faces().iter().any(|f| (0.02..0.9).contains(&f.normal().z)),
        "no sloping wall"
    );
    assert_eq!(scene.bounds().max_m, [120.0, 120.0, 20.0]);
    // A vehicle and a drone have room: most of the ground is free.
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let free = (0..2000)
        .filter(|_| {
            let [x, y, _] = random_point(&mut rng, scene.bounds());
            scene.is_free([x, y, 2.0])
        })
        .count();
    assert!(
        (1000..1600).contains(&free),
        "{free} of 2000 free at street level"
    );
}

#[test]
fn every_seed_gives_a_valid_city_and_the_same_each_time() {
    for seed in 0..200 {
        let name = format!("city:{seed}");
        let (a, b) = (Scene::load(&name).unwrap(), Scene::load(&name).unwrap());
        assert!(
            a.faces()
                .iter()
                .zip(b.faces())
                .all(|(f, g)| f.vertices() == g.vertices())
        );
        let stray = a
            .faces()
            .iter()
            .flat_map(Face::vertices)
            .find(|v| !a.bounds().contains((**v).into()));
        assert_eq!(stray, None, "seed {seed}");
        // Streets between all buildings: as boxes they stand 5 m apart along one axis.
        let footprints: Vec<Bounds> = (1..=a.faces().iter().map(Face::object).max().unwrap())
            .map(|object| {
                let faces: Vec<Face> = a
                    .faces()
                    .iter()
                    .filter(|f| f.object() == object)
                    .cloned()
                    .collect();
                Bounds::of(&faces).unwrap()
            })
            .collect();
        for (i, p) in footprints.iter().enumerate() {
            for q in &footprints[i + 1..] {
                let gap = |k: usize| (p.min_m[k] - q.max_m[k]).max(q.min_m[k] - p.max_m[k]);
                assert!(
                    gap(0).max(gap(1)) > 4.999,
                    "seed {seed}: buildings {p:?} and {q:?}"
                );
            }
        }
    }
}

#[test]
fn built_in_rooms_are_open_to_each_other_by_doors_only() {
    let scene = Scene::load("indoor").unwrap();
    // Every room and the corridor are free; walls between them are solid up to the ceiling.
    for p in [[1.0, 1.0, 3.9], [29.0, 19.0, 1.0], [15.0, 10.0, 2.0]] {
        assert!(scene.is_free(p), "{p:?}");
    }
    assert!(scene.inside_solid([9.0, 4.0, 3.99]));
    assert!(
        scene.blocked([1.0, 1.0, 3.0], [1.0, 10.0, 3.0]),
        "the corridor wall is closed above the doors"
    );
    let doors = (0..300)
        .filter(|i| !scene.blocked([f64::from(*i) * 0.1, 7.0, 1.0], [f64::from(*i) * 0.1, 10.0, 1.0]))
        .count();
    assert!((15..60).contains(&doors), "{doors} of 300 rays find a door");
}

#[test]
fn every_seed_gives_a_valid_floor_of_its_own_with_all_its_solids_apart() {
    for seed in 0..100 {
        let scene = Scene::load(&format!("indoor:{seed}")).unwrap();
        let other = Scene::load(&format!("indoor:{}", seed + 1)).unwrap();
        let vertices =
            |scene: &Scene| -> Vec<Vec3> { scene.faces().iter().flat_map(Face::vertices).copied().collect() };
        assert_ne!(vertices(&scene), vertices(&other), "seed {seed}");
        let stray = vertices(&scene)
            .into_iter()
            .find(|v| !scene.bounds().contains((*v).into()));
        assert_eq!(stray, None, "seed {seed}");
        // Furniture, the solids lower than the ceiling, stands in a room: nothing of it in a wall.
        let mut furniture: Vec<&Face> = scene.faces().iter().collect();
        furniture.retain(|f| f.vertices().iter().all(|v| v.z < 2.1) && f.object() != 0);
        let mut corners = furniture.iter().flat_map(|f| f.vertices()).filter(|v| v.z > 0.5);
        let buried = corners.find(|v| {
            let out = **v + Vec3::z() * 0.05;
            scene.inside_solid(out.into())
        });
        assert_eq!(buried, None, "seed {seed}");
    }
    assert!(
        Scene::load("indoor:-1")
            .unwrap_err()
            .to_string()
            .contains("expected indoor:SEED")
    );
}

#[test]
fn faults_name_the_face_and_the_reason() {
    let good = quad([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
    let bad = [
        (
            quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.1], [0.0, 1.0, 0.0]]),
            "face 1: is not planar",
        ),
        (
            quad([[0.0; 3], [1.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.5, 0.0]]),
            "face 1: intersects itself: edges 0 and 2",
        ),
        (
            quad([[0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [3.0, 0.0, 0.0]]),
            "face 1: is degenerate",
        ),
        (
            quad([[0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            "face 1: intersects itself: edges 0 and 1",
        ),
        (
            quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
            "face 1: vertex 2 repeats",
        ),
        (
            quad([[0.0; 3], [1.0, f64::NAN, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]),
            "face 1: vertex 1 is not finite",
        ),
        (
            quad([[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1e300, 0.0], [0.0, 1e300, 0.0]]),
            "face 1: vertex 2 is not finite or beyond 1e7 m",
        ),
        (
            RawFace {
                vertices: vec![[0.0; 3], [1.0; 3]],
                ..RawFace::default()
            },
            "face 1: has 2 vertices",
        ),
        (
            RawFace {
                normal: Some([0.0, 0.0, -1.0]),
                ..good.clone()
            },
            "face 1: its normal should be [0.000, 0.000, 1.000]",
        ),
        (
            RawFace {
                normal: Some([0.0, 0.1, 1.0]),
                ..good.clone()
            },
            "face 1: its normal should be [0.000, 0.000, 1.000]",
        ),
    ];
    for (face, message) in bad {
        let error = Scene::new("bad", Material::PAPER, 30e9, None, vec![good.clone(), face])
            .unwrap_err()
            .to_string();
        assert!(error.starts_with(message), "{error}");
    }
    let none = Scene::new("empty", Material::PAPER, 30e9, None, vec![])
        .unwrap_err()
        .to_string();
    assert!(none.contains("at least one face"), "{none}");
}

#[test]
fn json_faults_name_file_and_line_or_key() {
    let text = |extra: &str, units: &str, conductivity: &str| {
        format!(
            "{{\"name\":\"t\",\"units\":\"{units}\",\"frequency_hz\":3e10,\n\"material\":{{\"relative_permittivity\":15,\
             \"conductivity_S_per_m\":{conductivity},\"model\":\"half-space\"}},\n\"faces\":[{{\"vertices\":[[0,0,0],[1,0,0],[0,1,0]]}}]{extra}}}"
        )
    };
    let parse = |text: &str| {
        json::parse(Path::new("t.json"), text)
            .map(|_| ())
            .map_err(|e| e.to_string())
    };
    assert_eq!(parse(&text("", "metre", "0.015")), Ok(()));
    let wrong = [
        (text("", "feet", "0.1"), "t.json: units: expected \"metre\""),
        (text("", "metre", "-1"), "t.json: material: expected"),
        (
            text(",\"bounds\":[[0,0,0],[1,1,0]]", "metre", "0"),
            "t.json: bounds: expected",
        ),
        (text(",\"bounds\":3", "metre", "0"), "t.json:3: not a scene"),
        (text("", "metre", "NaN"), "t.json:2: not a scene"),
    ];
    for (text, message) in wrong {
        let error = parse(&text).unwrap_err();
        assert!(error.starts_with(message), "{error}");
    }
}
