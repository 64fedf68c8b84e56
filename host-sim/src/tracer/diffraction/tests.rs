//! The diffracted field against exact solutions, the sum of all fields across boundaries, the search against one without
//! pruning, and all of it against the committed reference list.

use core::f64::consts::{FRAC_PI_2, SQRT_2, TAU};
use std::path::Path;

use super::exact::{conducting_wedge, impedance_wedge, knife_edge, phasor};
use super::*;
use crate::paths;
use crate::random::Stream;
use crate::scene::{Material, RawFace};
use crate::tracer::{DiffractionComparison, Propagation, Tracer};

const FREQUENCY_HZ: f64 = 30e9;
const WAVELENGTH_M: f64 = SPEED_OF_LIGHT_M_PER_S / FREQUENCY_HZ;
const K: f64 = TAU / WAVELENGTH_M;

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

/// A wedge about the vertical axis of so much free space (over pi), its first face along +x, free space at +y.
fn wedge_scene(material: Material, n: f64) -> Scene {
    let reach = 1e3;
    let (y, x) = libm::sincos(n * PI);
    scene_of(
        material,
        vec![
            vec![
                [0.0, 0.0, -reach],
                [0.0, 0.0, reach],
                [reach, 0.0, reach],
                [reach, 0.0, -reach],
            ],
            vec![
                [0.0, 0.0, reach],
                [0.0, 0.0, -reach],
                [x * reach, y * reach, -reach],
                [x * reach, y * reach, reach],
            ],
        ],
    )
}

/// A place about the vertical axis.
fn about_axis(off_m: f64, angle_rad: f64, z: f64) -> [f64; 3] {
    let (sin, cos) = libm::sincos(angle_rad);
    [off_m * cos, off_m * sin, z]
}

/// Diffracted over incoming field, along the edge and across it, of a plane wave at level incidence, times sqrt(r) e^{jkr},
/// behind the first edge of a scene. For the second, magnetic fields are compared.
fn coefficients(scene: &Scene, behind_m: f64, phi_in: f64, phi_out: f64) -> [C64; 2] {
    let edges = Edges::of(scene, false);
    let wedge = &edges.wedges[0];
    let incidence = Incidence {
        n: wedge.exterior_rad / PI,
        k_rad_per_m: K,
        sin_beta: 1.0,
        before_m: 1e12,
        behind_m,
        phi_in_rad: phi_in,
        phi_out_rad: phi_out,
    };
    let ray = |angle: f64| Vec3::from(about_axis(1.0, angle, 0.0));
    let (incoming, outgoing) = (-ray(phi_in), ray(phi_out));
    let (before, behind) = (
        frame_before(&wedge.along, &incoming),
        frame_behind(&wedge.along, &outgoing),
    );
    [0, 1].map(|i| {
        let field = before[i].map(|c| Complex::new(c, 0.0));
        let surfaces = Surfaces::of_scene(scene, &Propagation::default());
        // b' and b, and what goes with phi' and phi, point against each other.
        -along(
            &diffract(&field, wedge, &incidence, &incoming, &outgoing, &surfaces),
            &behind[i],
        )
    })
}

type C64 = Complex<f64>;

#[test]
fn a_conducting_wedge_has_its_exact_field() {
    let kr = 60.0;
    let behind_m = kr / K;
    let mut worst: f64 = 0.0;
    for n in [1.5, 2.0] {
        // A screen has two faces: one of 0.001 degrees more than none.
        let scene = wedge_scene(conductor(), if n == 2.0 { n - 1e-5 } else { n });
        for (i, j) in (1..12).flat_map(|i| (1..24).map(move |j| (i, j))) {
            let phi_in = 0.5 * n * PI * (f64::from(i) + 0.13) / 12.0;
            let phi_out = n * PI * (f64::from(j) + 0.29) / 24.0;
            let [soft, hard] = coefficients(&scene, behind_m, phi_in, phi_out);
            let (difference, sum) = (phi_out - phi_in, phi_out + phi_in);
            let direct = if difference.abs() < PI {
                phasor(kr * difference.cos())
            } else {
                0.0.into()
            };
            // Off either face, where it lights.
            let mirrored =
                [sum, 2.0 * n * PI - sum].map(|x| if x < PI { phasor(kr * x.cos()) } else { 0.0.into() });
            for (coefficient, sign, is_soft) in [(soft, -1.0, true), (hard, 1.0, false)] {
                let ours =
                    direct + (mirrored[0] + mirrored[1]) * sign + coefficient * phasor(-kr) / behind_m.sqrt();
                let exact = conducting_wedge(n, kr, phi_in, phi_out, is_soft);
                worst = worst.max((ours - exact).norm());
            }
        }
    }
    println!("conducting wedge, kr = {kr}: field within {worst:.1e} of the incident one");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn a_right_angle_has_the_field_of_the_impedance_wedge_in_shadow() {
    let scene = wedge_scene(Material::PAPER, 1.5);
    let [re, im] = Material::PAPER.complex_permittivity(FREQUENCY_HZ);
    let index = super::super::surface::sqrt(Complex::new(re, im));
    // From the shadow boundary, and from the faces: closer to grazing on both, a constant impedance is no half-space.
    let [clear, off_faces] = [6.0_f64, 10.0].map(f64::to_radians);
    let (mut worst, mut compared) = ([0.0_f64; 2], 0);
    for (i, j) in (0..30).flat_map(|i| (0..45).map(move |j| (i, j))) {
        let phi_in = off_faces + 1.5 * f64::from(i).to_radians();
        let phi_out = 1.5 * PI - off_faces - 2.0 * f64::from(j).to_radians();
        if phi_out - phi_in < PI + clear {
            continue;
        }
        // Far behind, where the transition functions are 1.
        let ours = coefficients(&scene, 1e9, phi_in, phi_out);
        for (which, sine) in [index, index.inv()].into_iter().enumerate() {
            let ratio = ours[which] / impedance_wedge(K, sine, phi_in, phi_out);
            worst[which] = worst[which].max((20.0 * libm::log10(ratio.norm())).abs());
            assert!(
                ratio.re > 0.9 && ratio.im.abs() < 0.1,
                "{phi_in} {phi_out}: {ratio}"
            );
        }
        compared += 1;
    }
    println!(
        "impedance wedge, {compared} pairs of angles in shadow: within {:.3} dB along the edge, {:.3} dB across",
        worst[0], worst[1]
    );
    assert!(
        compared > 500 && worst.iter().all(|&db| db < 0.15),
        "{compared} {worst:?}"
    );
}

#[test]
fn a_thin_wedge_is_a_knife_edge() {
    let scene = wedge_scene(Material::PAPER, 2.0 - 0.02 / 180.0);
    let tracer = Tracer::with(&scene, 0, all()).unwrap();
    let off_m = 30.0;
    let mut report = Vec::new();
    for (depth_rad, within_db) in [(1e-6, 0.03), (0.01, 0.1), (0.05, 0.25), (0.13, 0.5)] {
        // The screen stands along +x; both ends beside it, symmetric, the receiver in shadow.
        let angle = FRAC_PI_2 + 0.5 * depth_rad;
        let angle = PI - angle;
        let [tx, rx] = [angle, TAU - angle].map(|at| about_axis(off_m, at, 0.0));
        let paths = tracer.transmitter(tx).trace(rx);
        assert_eq!(paths.len(), 1, "{paths:?}");
        let straight_m = (Vec3::from(tx) - Vec3::from(rx)).norm();
        let free = WAVELENGTH_M / (4.0 * PI * straight_m) * DIPOLES;
        // Fresnel number of the detour.
        let nu = 2.0 * ((2.0 * off_m - straight_m) / WAVELENGTH_M).sqrt();
        let loss_db = 20.0 * libm::log10(paths[0].gain.norm() / free);
        let exact_db = 20.0 * libm::log10(knife_edge(nu).norm());
        report.push(format!("{:.3} dB at {exact_db:.1} dB", loss_db - exact_db));
        assert!(
            (loss_db - exact_db).abs() < within_db,
            "{depth_rad}: {loss_db} {exact_db}"
        );
    }
    println!("thin wedge against the knife edge: {}", report.join(", "));
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

fn free_point(scene: &Scene, random: &mut Stream) -> [f64; 3] {
    let bounds = scene.bounds();
    loop {
        let point =
            [0, 1, 2].map(|i| bounds.min_m[i] + (bounds.max_m[i] - bounds.min_m[i]) * random.uniform());
        if scene.is_free(point) {
            return point;
        }
    }
}

#[test]
fn pruning_loses_no_diffracted_path() {
    let mut by_kind = [0; 3];
    for (stream, name) in ["outdoor", "indoor", "street", "city:4"].into_iter().enumerate() {
        let scene = Scene::load(name).unwrap();
        let propagation = all();
        let tracer = Tracer::with(&scene, 1, propagation).unwrap();
        let faces: Vec<u32> = (0..scene.faces().len() as u32).collect();
        // Every source with the whole of every edge, every face behind it, no bound.
        let edges = Edges::of(&scene, false);
        for wedge in 0..edges.wedges.len() {
            edges.light_all(wedge, faces.clone());
        }
        let mut random = Stream::new(4, stream as u64);
        for _ in 0..6 {
            let [tx, rx] = [0, 1].map(|_| free_point(&scene, &mut random));
            let tree = tracer.transmitter(tx);
            let sources = core::iter::once((None, Vec3::from(tx))).chain(faces.iter().filter_map(|&face| {
                let mirror = &scene.faces()[face as usize];
                (mirror.height_m(&tx.into()) > 0.0).then(|| (Some(face), mirror.mirror(&tx.into())))
            }));
            let mut lit = Vec::new();
            for (face, source) in sources {
                for (index, wedge) in edges.wedges.iter().enumerate() {
                    if let Some(about) = wedge.about(&source) {
                        lit.push(LitEdge {
                            wedge: index as u32,
                            face,
                            source,
                            about,
                            phi_rad: about.angle_rad(),
                            part_m: [0.0, wedge.length_m],
                        });
                    }
                }
            }
            let unpruned = LitEdges {
                scene: &scene,
                tx: tx.into(),
                edges: &edges,
                options: propagation.diffraction.unwrap(),
                lit,
            };
            let surfaces = Surfaces::of_scene(&scene, &Propagation::default());
            let expected = unpruned.trace(&rx.into(), &surfaces, true);
            let mut found = tree.trace(rx);
            found.retain(|path| path.kind().edge().is_some());
            assert_eq!(found, expected, "{name}: {tx:?} to {rx:?}");
            for path in &found {
                let at = match (path.kind().edge(), path.order()) {
                    (_, 1) => 0,
                    (Some(1), _) => 1,
                    _ => 2,
                };
                by_kind[at] += 1;
            }
        }
    }
    println!("compared: {} D, {} RD, {} DR", by_kind[0], by_kind[1], by_kind[2]);
    assert!(by_kind.iter().all(|&n| n > 60), "{by_kind:?}");
}

fn fixture(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures").join(name)
}

#[test]
fn the_reference_list_is_found_whole_and_nothing_strong_besides() {
    let scene = Scene::read(&fixture("outdoor_a_scene.json")).unwrap();
    let list = paths::read(&fixture("outdoor_a_diffraction.jsonl.gz")).unwrap();
    let compare =
        |propagation| DiffractionComparison::run(&Tracer::with(&scene, 1, propagation).unwrap(), &list);
    let result = compare(all());
    println!("{result:?}");
    assert!(result.passes(), "{result:?}");
    let at_edge = [result.confirmed, result.unconfirmed, result.traced].map(|tally| tally.at_edge);
    assert_eq!((result.links, at_edge), (REFERENCE_LINKS, [0; 3]));
    assert_eq!(result.confirmed.total, REFERENCE_CONFIRMED);
    // What differs is how many digits the list has.
    assert!(
        result.worst_length_m < 1e-9 && result.worst_angle_rad < 1e-8,
        "{result:?}"
    );
    assert!(
        result.worst_point_m < 2e-5 && result.worst_gain_db < 2e-3,
        "{result:?}"
    );
    // What is missing or extra is seen.
    let mut fewer = list.clone();
    let link = fewer.iter().position(|link| link.paths.len() > 20).unwrap();
    fewer[link].paths.remove(0);
    let tracer = Tracer::with(&scene, 1, all()).unwrap();
    assert_eq!(
        DiffractionComparison::run(&tracer, &fewer).traced.unexplained(),
        1
    );
    let mut few = all();
    few.diffraction.as_mut().unwrap().most_paths = 2;
    assert!(!compare(few).passes());
}

/// Links and strong confirmed paths of the committed list.
const REFERENCE_LINKS: usize = 22;
const REFERENCE_CONFIRMED: usize = 159;

#[test]
fn the_options_cut_and_without_them_nothing_changes() {
    let scene = Scene::load("outdoor_a").unwrap();
    let list = paths::read(&fixture("outdoor_a_diffraction.jsonl.gz")).unwrap();
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
