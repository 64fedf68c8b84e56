//! Where movers go over whole flights.

use super::*;
use crate::flight::{FlightConfig, FlightPlan};
use crate::scene::{Scene, Vec3};

fn plan(scene: &Scene, seed: u64) -> FlightPlan {
    FlightPlan::plan(scene, &FlightConfig::default(), seed).expect("room")
}

#[test]
fn a_course_is_gone_back_and_forth_at_its_speed() {
    let (from, along) = (Vec3::new(3.0, 4.0, 0.0), Vec3::new(0.6, 0.8, 0.0));
    for (length_m, share) in [(40.0, 0.3), (5.0, 0.9)] {
        let course = Course::going(from, along, length_m, [10.0, 3.0], share);
        let (mut fastest, mut reach) = (0.0_f64, [f64::INFINITY, 0.0_f64]);
        for step in 0..5000 {
            let time_s = 0.01 * f64::from(step);
            let (place, velocity) = course.at(time_s);
            let [before, after] = [-1e-4, 1e-4].map(|dt| course.at(time_s + dt).0);
            assert!(((after - before) / 2e-4 - velocity).norm() < 1e-3, "{time_s}");
            let gone_m = (place - from).dot(&along);
            assert!((place - from - along * gone_m).norm() < 1e-9);
            reach = [reach[0].min(gone_m), reach[1].max(gone_m)];
            fastest = fastest.max(velocity.norm());
        }
        assert!(
            reach[0] > -1e-9 && reach[0] < 0.01 && (reach[1] - length_m).abs() < 0.01,
            "{reach:?}"
        );
        assert!(
            (fastest - f64::min(10.0, (3.0 * length_m).sqrt())).abs() < 0.05,
            "{fastest}"
        );
    }
}

#[test]
fn a_line_crosses_a_body_where_its_points_are_in_it() {
    let body = Body {
        kind: BodyKind::Car,
        foot_m: Vec3::new(1.0, 2.0, 0.0),
        forward: Vec3::new(0.8, -0.6, 0.0),
        velocity_m_per_s: Vec3::zeros(),
    };
    let mut random = crate::random::Stream::new(3, 0);
    let mut counts = [0; 2];
    for _ in 0..400 {
        let mut end = || {
            let mut c = || 8.0 * random.uniform() - 4.0;
            Vec3::new(1.0 + c(), 2.0 + c(), 0.7 + 0.3 * c())
        };
        let (from, to) = (end(), end());
        let depth = (0..=2000).map(|k| body.distance_m(&(from + (to - from) * (f64::from(k) / 2000.0))));
        let inside = depth.filter(|depth| *depth == 0.0).count() > 0;
        // A corner may be cut between two points.
        assert!(body.crosses(&from, &to) >= inside);
        let expected = body.crosses(&from, &to) == inside;
        counts[usize::from(inside)] += usize::from(expected);
    }
    assert!(
        counts.iter().all(|count| *count > 100) && counts[0] + counts[1] > 395,
        "{counts:?}"
    );
}

/// Points all over a body's box, a little inside of its faces.
fn points_of(body: &Body) -> Vec<Vec3> {
    let (axes, half_m) = (body.axes(), body.half_m());
    let shares = [-0.99, -0.5, 0.0, 0.5, 0.99];
    let mut points = Vec::new();
    for a in shares {
        for b in shares {
            for c in [-0.5, 0.0, 0.99] {
                points.push(
                    body.centre()
                        + axes[0] * (a * half_m[0])
                        + axes[1] * (b * half_m[1])
                        + axes[2] * (c * half_m[2]),
                );
            }
        }
    }
    points
}

#[test]
fn movers_keep_off_walls_off_the_ends_and_off_each_other() {
    for (name, seeds, least) in [("outdoor", 1..3, 24), ("street", 1..3, 8), ("indoor", 1..3, 15)] {
        let scene = Scene::load(name).expect("built in");
        for seed in seeds {
            let plan = plan(&scene, seed);
            let movers = Movers::place(&scene, &MoversConfig::real(), &plan, seed).expect("drawn");
            let (mut moved, mut nearest_m) = (0, f64::INFINITY);
            for step in 0..=240 {
                let time_s = 0.5 * f64::from(step);
                let bodies = movers.at(time_s);
                assert!(bodies.len() >= least, "{name} {seed}: {}", bodies.len());
                for (k, body) in bodies.iter().enumerate() {
                    moved += usize::from(body.velocity_m_per_s.norm() > 0.5);
                    let points = points_of(body);
                    let hit = points.iter().find(|point| scene.inside_solid((**point).into()));
                    assert_eq!(hit, None, "{name} {seed} {time_s}: {body:?}");
                    // Thin walls have no inside to be in.
                    let across = points
                        .iter()
                        .find(|point| scene.blocked(body.centre().into(), (**point).into()));
                    assert_eq!(across, None, "{name} {seed} {time_s}: {body:?}");
                    for end in [plan.gmt().at(time_s).0, plan.uav().place_m(time_s)] {
                        nearest_m = nearest_m.min(body.distance_m(&end));
                    }
                    let touches = bodies[..k].iter().any(|other| other.is_close_to(body, 0.0));
                    assert!(!touches, "{name} {seed} {time_s}: {body:?}");
                }
            }
            println!("{name} {seed}: {} movers, {nearest_m:.2} m", movers.at(0.0).len());
            assert!(
                nearest_m > 0.8 && moved > 240,
                "{name} {seed}: {nearest_m} m, {moved}"
            );
            let again = Movers::place(&scene, &MoversConfig::real(), &plan, seed).expect("drawn");
            assert_eq!(again, movers);
            let other = Movers::place(&scene, &MoversConfig::real(), &plan, seed + 100).expect("drawn");
            assert_ne!(other, movers);
        }
    }
}

#[test]
fn a_given_mover_has_a_free_line_or_is_refused_by_name() {
    let scene = Scene::load("street").expect("built in");
    let plan = plan(&scene, 1);
    let given = |from_m, to_m| {
        let mover = GivenMover {
            kind: BodyKind::Person,
            from_m,
            to_m,
            speed_m_per_s: 1.0,
        };
        let config = MoversConfig {
            given: vec![mover],
            ..MoversConfig::default()
        };
        Movers::place(&scene, &config, &plan, 1).map_err(|error| error.to_string())
    };
    let movers = given([50.0, 20.0], [60.0, 20.0]).expect("the street is free");
    let [start, later] = [0.0, 5.0].map(|time_s| movers.at(time_s)[0].foot_m);
    assert!((start - Vec3::new(50.0, 20.0, 0.0)).norm() < 1e-9 && later.x > 53.0 && later.x < 60.0);
    for (from_m, to_m) in [
        ([50.0, 20.0], [50.0, 38.0]),
        ([50.0, 20.0], [150.0, 20.0]),
        ([20.0, 5.0], [20.0, 5.0]),
    ] {
        let message = given(from_m, to_m).expect_err("a wall");
        assert!(
            message.starts_with("world.propagation.movers.given[0] goes through a wall or out of the scene"),
            "{message}"
        );
        assert_eq!(message.lines().count(), 1);
    }
}
