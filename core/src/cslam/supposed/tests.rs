use heapless::Vec;

use super::*;
use crate::cslam::mirrors::PLACED_M;
use crate::cslam::routes::{Route, across, left_turned, within_a_metre};
use crate::geometry::Matrix3;

/// Off two upright walls that are not parallel.
fn two() -> Route {
    Route::upright(&[[0.0, 0.0], [10.0, 12.0], [-8.0, 25.0], [4.0, 40.0]], 1.5, 9.0)
}

type Planes = Vec<Plane, 8>;

fn supposed(ends: &Ends, path: &Path<World>, known: &[Known], ground_z_m: Option<f32>) -> Planes {
    let mut planes = Planes::new();
    suppose(ends, path, known, ground_z_m, |plane| {
        planes.push(*plane).expect("few")
    });
    planes
}

/// Of a way without error, its first or its last mirror known.
fn beside(route: &Route, index: usize) -> Planes {
    supposed(&route.ends(), &route.path(), &[route.mirror(index)], Some(0.0))
}

/// Whether this is the mirror of a reflection, and seen there.
fn is_mirror(route: &Route, index: usize, plane: &Plane) -> bool {
    let expected = route.mirror(index).plane;
    let seen_m = (plane.centre.vector() - route.reflections()[index]).norm();
    plane.normal.angle_to_rad(&expected.normal) < 1e-4
        && plane.height_m(expected.centre.vector()).abs() < 1e-3
        && seen_m < 1e-3
}

#[test]
fn beside_one_known_mirror_a_path_shows_the_other() {
    for route in [two(), two().back()] {
        for (known, other) in [(0, 1), (1, 0)] {
            let found = beside(&route, known);
            assert_eq!(found.len(), 1, "{known} is known");
            assert!(is_mirror(&route, other, &found[0]), "{known} is known: {found:?}");
        }
    }
    let route = two();
    let none = supposed(&route.ends(), &route.path(), &[], Some(0.0));
    assert!(none.is_empty());
}

#[test]
fn the_path_must_have_left_for_its_first_point() {
    let route = two();
    for known in [0, 1] {
        let by = |path: &Path<World>| supposed(&route.ends(), path, &[route.mirror(known)], None).len();
        for side in [-1.0, 1.0] {
            let left = |share: f32| left_turned(&route.path(), side * share * DEPARTURE_RAD);
            assert_eq!([by(&left(0.9)), by(&left(1.1))], [1, 0], "{known} is known");
        }
        assert!(DEPARTURE_RAD < 1_f32.to_radians());
        assert_eq!(
            by(&Path {
                aod: None,
                ..route.path()
            }),
            0
        );
    }
}

#[test]
fn walls_stand_upright() {
    // The last reflection so much higher than between upright walls.
    let leaning = |by_m: f32| {
        let mut points: Vec<[f32; 3], 4> = Vec::new();
        for (from, _) in two().legs() {
            points.push(from.into()).expect("room");
        }
        points[2][2] += by_m;
        points.push((*two().ends().uav.vector()).into()).expect("room");
        Route::over(&points)
    };
    let lean = |route: &Route| route.mirror(1).plane.normal.vector().z.abs();
    let (little, much) = (leaning(0.4), leaning(1.2));
    assert!(
        0.3 * MOST_LEAN < lean(&little) && lean(&little) < MOST_LEAN,
        "{}",
        lean(&little)
    );
    assert!(
        MOST_LEAN < lean(&much) && lean(&much) < 3.0 * MOST_LEAN,
        "{}",
        lean(&much)
    );
    assert!(
        beside(&little, 0)
            .iter()
            .any(|plane| is_mirror(&little, 1, plane))
    );
    assert!(beside(&much, 0).is_empty());
}

#[test]
fn nothing_is_reflected_underground() {
    for route in [two(), two().back()] {
        let heights = [0, 1].map(|index| route.reflections()[index].z);
        let lowest = heights[0].min(heights[1]);
        for known in [0, 1] {
            let over = |ground_z_m: f32| {
                supposed(
                    &route.ends(),
                    &route.path(),
                    &[route.mirror(known)],
                    Some(ground_z_m),
                )
                .len()
            };
            assert_eq!(
                [over(lowest - 0.05), over(lowest + 0.05)],
                [1, 0],
                "{known} is known"
            );
        }
    }
}

#[test]
fn a_known_wall_in_the_way_rules_it_out() {
    let route = two();
    for known in [0, 1] {
        for leg in route.legs() {
            let beside = |aside_m: f32| {
                let known = [route.mirror(known), across(leg, aside_m)];
                supposed(&route.ends(), &route.path(), &known, None)
            };
            let other = |plane: &Plane| is_mirror(&route, 1 - known, plane);
            assert!(beside(30.0).iter().any(other), "aside of {leg:?}");
            assert!(!beside(0.0).iter().any(other), "across {leg:?}");
        }
    }
}

#[test]
fn the_known_mirror_reflects_near_where_it_was_seen_and_to_its_front() {
    let route = two();
    for index in [0, 1] {
        let mut known = route.mirror(index);
        let (along, _) = known.plane.tangents();
        known.bounds_m = within_a_metre(&(route.reflections()[index] + along * 100.0));
        assert!(supposed(&route.ends(), &route.path(), &[known], None).is_empty());
        let mut known = route.mirror(index);
        known.plane.normal = Direction::from_vector(-known.plane.normal.vector()).expect("not zero");
        assert!(supposed(&route.ends(), &route.path(), &[known], None).is_empty());
    }
}

#[test]
fn a_uav_that_is_placed_too_poorly_supposes_nothing() {
    let route = two();
    let known_to = |sigma_m: f32| {
        let ends = Ends {
            uav_covariance: Matrix3::identity() * (sigma_m * sigma_m / 3.0),
            ..route.ends()
        };
        supposed(&ends, &route.path(), &[route.mirror(0)], None).len()
    };
    assert_eq!([known_to(0.99 * PLACED_M), known_to(1.01 * PLACED_M)], [1, 0]);
}
