//! Planes from the maps of flights through the outdoor scene, with points as noisy as the budget makes them.

use cslam_core::localization::planes::{PlaneConfig, PlaneMap, Surface};
use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, Gates, Verdict, solve};
use cslam_host_sim::flight::{FlightConfig, FlightPlan};
use cslam_host_sim::measurement::Sigmas;
use cslam_host_sim::path_flight::measure;
use cslam_host_sim::scene::{Face, Scene};
use cslam_host_sim::tracer::Tracer;
use nalgebra::Vector3;

/// Sweeps of a flight, two a second.
const SWEEPS: u32 = 240;
/// A plane is a face's when it is this near to it at the plane's centre and this parallel.
const SAME_M: f64 = 0.5;
const SAME_RAD: f64 = 0.052;

/// What came of the flights.
#[derive(Debug, Default)]
struct Tally {
    /// Faces with ten true reflections over three metres, and those of them that became planes.
    illuminated: usize,
    found: usize,
    /// Planes, and those that lie on no face.
    planes: usize,
    wrong: usize,
    /// Squared error over claimed variance: offset at the centre, tilts along t1 and t2.
    normalised: [Vec<f64>; 3],
    offset_m: Vec<f64>,
    tilt_deg: Vec<f64>,
}

/// The face on which a plane lies.
fn face_of(scene: &Scene, surface: &Surface) -> Option<usize> {
    let centre = surface.plane.centre.vector().map(f64::from);
    let normal = surface.plane.normal.vector().map(f64::from);
    scene.faces().iter().position(|face| {
        let n: &Vector3<f64> = face.normal();
        let foot = centre - n * face.height_m(&centre);
        normal.cross(n).norm() < SAME_RAD
            && face.height_m(&centre).abs() < SAME_M
            && (face.contains(&foot) || face.edge_distance_m(&foot) < 2.0)
    })
}

/// Whether two faces are parts of one plane.
fn coplanar(a: &Face, b: &Face) -> bool {
    a.normal().cross(b.normal()).norm() < 1e-3 && a.height_m(&b.vertices()[0]).abs() < 0.05
}

fn fly(scene: &Scene, seed: u64, tally: &mut Tally) {
    let config = FlightConfig {
        duration_s: f64::from(SWEEPS) / 2.0,
        ..FlightConfig::default()
    };
    let plan = FlightPlan::plan(scene, &config, seed).expect("a flight");
    let tracer = Tracer::new(scene, 2).expect("two reflections");
    let errors = Sigmas {
        aod_deg: 0.3,
        ..Sigmas::default()
    };
    let mut cloud = Box::new(PointCloud::<4096>::new());
    let mut planes = PlaneMap::<24>::new(PlaneConfig::default());
    let mut hits: Vec<Vec<Vector3<f64>>> = vec![Vec::new(); scene.faces().len()];
    for sweep in 0..plan.sweeps() {
        let time_s = plan.schedule().sweep_time_s(sweep);
        let uav = plan.uav().at(time_s).position_m;
        let tree = tracer.transmitter(plan.gmt().at(time_s).0.into());
        let traced = tree.trace(uav.into());
        let link = tree.to_link(uav.into(), &traced);
        let heard = measure(sweep, &link, &errors, seed).expect("sound");
        for (truth, path) in traced.iter().zip(&heard.paths) {
            let Ok(Verdict::Accepted(point)) = solve(&heard.ends, path, Form::Vector, &Gates::default())
            else {
                continue;
            };
            if point.sigma_m() < 0.7 {
                cloud.insert(&point).expect("near the origin");
                if truth.order() == 1 {
                    hits[truth.faces()[0] as usize].push(truth.vertices()[0].into());
                }
            }
        }
        planes.update(&cloud, &heard.ends.uav);
    }
    judge(scene, &hits, &planes, tally);
}

fn judge(scene: &Scene, hits: &[Vec<Vector3<f64>>], planes: &PlaneMap<24>, tally: &mut Tally) {
    let matched: Vec<Option<usize>> = planes.surfaces().iter().map(|s| face_of(scene, s)).collect();
    for (index, points) in hits.iter().enumerate() {
        let span = points.iter().map(|p| (p - points[0]).norm()).fold(0.0, f64::max);
        if points.len() >= 10 && span > 3.0 {
            tally.illuminated += 1;
            let faces = scene.faces();
            let found = matched
                .iter()
                .flatten()
                .any(|g| coplanar(&faces[index], &faces[*g]));
            tally.found += usize::from(found);
        }
    }
    for (surface, face) in planes.surfaces().iter().zip(&matched) {
        tally.planes += 1;
        let Some(face) = face.map(|f| &scene.faces()[f]) else {
            tally.wrong += 1;
            continue;
        };
        let plane = &surface.plane;
        let n = plane.normal.vector().map(f64::from);
        let truth = face.normal() * face.normal().dot(&n).signum();
        let offset = -face.height_m(&plane.centre.vector().map(f64::from)) * face.normal().dot(&n).signum();
        let (t1, t2) = plane.tangents();
        let tilts = [t1, t2].map(|t| t.map(f64::from).dot(&truth));
        for (i, error) in [offset, tilts[0], tilts[1]].into_iter().enumerate() {
            tally.normalised[i].push(error * error / f64::from(plane.covariance[(i, i)]));
        }
        tally.offset_m.push(offset.abs());
        tally.tilt_deg.push(tilts[0].abs().to_degrees());
    }
}

#[test]
fn illuminated_walls_become_planes_with_honest_covariance() {
    let scene = Scene::load("outdoor").expect("built in");
    let mut tally = Tally::default();
    for seed in 1..=8 {
        fly(&scene, seed, &mut tally);
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let nees = [0, 1, 2].map(|i| mean(&tally.normalised[i]));
    let (offset_m, tilt_deg) = (mean(&tally.offset_m), mean(&tally.tilt_deg));
    println!(
        "walls lit {} found {}; planes {} on no face {}; offset {offset_m:.3} m, heading {tilt_deg:.2} deg, NEES {nees:.2?}",
        tally.illuminated, tally.found, tally.planes, tally.wrong
    );
    assert!(4 * tally.found > 3 * tally.illuminated, "{tally:?}");
    assert!(10 * tally.wrong < tally.planes, "{tally:?}");
    assert!(nees.iter().all(|n| *n < 1.7) && offset_m < 0.02, "{tally:?}");
}
