use super::*;
use crate::cslam::known::proving;
use crate::cslam::mirrors::{Mirrors, PLACED_M};
use crate::cslam::routes::{Route, across, at, left_turned, turned, within_a_metre};
use crate::cslam::specular::ground;
use crate::geometry::Matrix3;

/// Off two walls that are not parallel.
fn two() -> Route {
    Route::upright(&[[0.0, 0.0], [10.0, 12.0], [-8.0, 25.0], [4.0, 40.0]], 1.5, 9.0)
}

/// Off three.
fn three() -> Route {
    let plan = [[0.0, 0.0], [10.0, 12.0], [-8.0, 25.0], [12.0, 38.0], [0.0, 55.0]];
    Route::upright(&plan, 1.5, 9.0)
}

/// Off the ground, then off the wall x = 10: unfolded it goes straight from -1.5 m up to 9 and from x = 0 to 16.
fn ground_and_wall() -> Route {
    let after = |share: f32, x_m: f32| [x_m, 30.0 * share, (10.5 * share - 1.5).abs()];
    Route::over(&[
        after(0.0, 0.0),
        after(1.0 / 7.0, 16.0 / 7.0),
        after(10.0 / 16.0, 10.0),
        after(1.0, 4.0),
    ])
}

/// The mirrors of a way, in its order.
fn mirrors(route: &Route) -> Vec<Known, KNOWN> {
    (0..route.reflections().len())
        .map(|index| route.mirror(index))
        .collect()
}

fn explained(route: &Route, path: &Path<World>, known: &[Known]) -> Option<Reflections> {
    explain(&route.ends(), path, known, &mut { EFFORT })
}

/// How far the points of an explanation are off those of the way, at most, m; in their order.
fn off_m(route: &Route, found: &Reflections) -> f32 {
    assert_eq!(found.len(), route.reflections().len());
    let pairs = found.iter().zip(route.reflections());
    pairs
        .map(|(point, vertex)| (point.position.vector() - vertex).norm())
        .fold(0.0, f32::max)
}

#[test]
fn two_walls_explain_the_path_off_both() {
    let route = two();
    let mut known = mirrors(&route);
    for route in [two(), two().back()] {
        // Of two reflections no departure is asked.
        let path = Path {
            aod: None,
            ..route.path()
        };
        for _either_order in 0..2 {
            let found = explained(&route, &path, &known).expect("both are known");
            assert!(off_m(&route, &found) < 1e-3, "{found:?}");
            let (last, uav) = route.legs().last().expect("three legs");
            assert!((found[1].distance_m - (uav - last).norm()).abs() < 1e-3);
            known.reverse();
        }
    }
    assert!(
        known
            .iter()
            .all(|wall| explained(&route, &route.path(), &[*wall]).is_none()),
        "one wall alone"
    );
}

#[test]
fn the_ground_and_a_wall_explain_it_in_whatever_order_they_were_met() {
    for route in [ground_and_wall(), ground_and_wall().back()] {
        let mut wall = if route.reflections()[0].z < 1e-6 {
            route.mirror(1)
        } else {
            route.mirror(0)
        };
        let mut known = proving(
            ground(&route.ends(), 0.0),
            &[],
            &Mirrors::single(),
            &Mirrors::supposed(),
        );
        assert!(known[0].is_ground());
        // Off both in the wrong order the same image is seen: but that way comes to one of them from behind, a wall that is known
        // far and wide.
        for away_m in [-30.0, 30.0] {
            let point = *wall.plane.centre.vector();
            wall.bounds_m.take_in(&(point + Vector3::repeat(away_m)));
        }
        known.push(wall).expect("room");
        for _either_order in 0..2 {
            let found = explained(&route, &route.path(), &known).expect("both are known");
            assert!(off_m(&route, &found) < 1e-3, "{found:?}");
            known.reverse();
        }
    }
}

#[test]
fn three_mirrors_explain_only_what_left_towards_the_first() {
    let (route, known) = (three(), mirrors(&three()));
    let by = |share: f32| explained(&route, &left_turned(&route.path(), share * DEPARTURE_RAD), &known);
    for share in [-0.9, 0.0, 0.9] {
        let found = by(share).expect("a departure that agrees");
        assert!(off_m(&route, &found) < 2e-3, "{found:?}");
    }
    assert!(by(1.1).is_none() && by(-1.1).is_none());
    let unknown = Path {
        aod: None,
        ..route.path()
    };
    assert!(explained(&route, &unknown, &known).is_none());
}

#[test]
fn a_path_of_another_length_or_direction_is_not_theirs() {
    let (route, known) = (two(), mirrors(&two()));
    let path = route.path();
    // 0.15 m and three times hypot(0.04, 0.05) m; 3 mrad and three times hypot(2, 1.5) mrad.
    let longer = |by_m: f32| {
        explained(
            &route,
            &Path {
                c_tau_m: path.c_tau_m + by_m,
                ..path
            },
            &known,
        )
    };
    assert!(longer(0.25).is_some() && longer(-0.25).is_some());
    assert!(longer(0.5).is_none() && longer(-0.5).is_none());
    let left = |by_rad: f32| {
        explained(
            &route,
            &Path {
                aoa: turned(&path.aoa, by_rad),
                ..path
            },
            &known,
        )
    };
    assert!(left(0.008).is_some() && left(-0.008).is_some());
    assert!(left(0.016).is_none() && left(-0.016).is_none());
}

#[test]
fn a_uav_that_is_placed_too_poorly_proves_nothing() {
    let (route, known) = (two(), mirrors(&two()));
    let known_to = |sigma_m: f32| {
        let ends = Ends {
            uav_covariance: Matrix3::identity() * (sigma_m * sigma_m / 3.0),
            ..route.ends()
        };
        explain(&ends, &route.path(), &known, &mut { EFFORT })
    };
    assert!(known_to(0.99 * PLACED_M).is_some());
    assert!(known_to(1.01 * PLACED_M).is_none());
}

#[test]
fn mirrors_reflect_to_their_front_and_near_where_they_were_seen() {
    for (route, reflections) in [(two(), 2), (three(), 3)] {
        for index in 0..reflections {
            let mut known = mirrors(&route);
            let (along, _) = known[index].plane.tangents();
            known[index].bounds_m = within_a_metre(&(route.reflections()[index] + along * 100.0));
            assert!(
                explained(&route, &route.path(), &known).is_none(),
                "{index} of {reflections} is elsewhere"
            );
            let mut known = mirrors(&route);
            let plane = &mut known[index].plane;
            plane.normal = Direction::from_vector(-plane.normal.vector()).expect("not zero");
            assert!(
                explained(&route, &route.path(), &known).is_none(),
                "{index} of {reflections} looks away"
            );
        }
    }
}

#[test]
fn a_known_wall_in_the_way_rules_it_out() {
    for route in [two(), three()] {
        for leg in route.legs() {
            let mut known = mirrors(&route);
            known.push(across(leg, 30.0)).expect("room");
            assert!(
                explained(&route, &route.path(), &known).is_some(),
                "aside of {leg:?}"
            );
            known.pop();
            known.push(across(leg, 0.0)).expect("room");
            assert!(
                explained(&route, &route.path(), &known).is_none(),
                "across {leg:?}"
            );
        }
    }
}

#[test]
fn of_several_explanations_the_best_is_taken() {
    let route = two();
    let near = |east_m: f32| {
        let mut wall = route.mirror(1);
        wall.plane.centre = at(wall.plane.centre.vector() + wall.plane.normal.vector() * east_m);
        wall
    };
    assert!(
        explained(&route, &route.path(), &[route.mirror(0), near(0.1)]).is_some(),
        "it is allowed"
    );
    let known = [near(-0.1), route.mirror(0), route.mirror(1), near(0.1)];
    let found = explained(&route, &route.path(), &known).expect("three explain it");
    assert!(off_m(&route, &found) < 1e-3, "{found:?}");
}

#[test]
fn effort_that_runs_out_explains_nothing() {
    let (route, known) = (three(), mirrors(&three()));
    let with = |mut effort: u32| {
        let found = explain(&route.ends(), &route.path(), &known, &mut effort);
        (found.is_some(), effort)
    };
    let (found, left) = with(EFFORT);
    let asked = EFFORT - left;
    assert!(found && asked > 0, "{asked}");
    assert_eq!(with(asked + 1), (true, 1));
    assert_eq!(with(asked), (false, 0));
    assert_eq!(with(1), (false, 0));
    assert_eq!(with(0), (false, 0));
}

/// Where two walls reflect, with covariance.
fn both_points(ends: &Ends, walls: &[Known; 2]) -> [ReflectionPoint; 2] {
    let [uav, gmt] = both(ends);
    let sources = [gmt, gmt.mirrored(&walls[0].plane)];
    let found = reflections(uav, &sources, &[&walls[0], &walls[1]]).expect("before both");
    [found[0], found[1]]
}

/// Covariances of both points by difference quotients, over the UAV's place and the shift and tilts of each wall.
fn differences(ends: &Ends, walls: &[Known; 2]) -> [Matrix3<f32>; 2] {
    let step = 0.01;
    let mut covariances = [Matrix3::zeros(); 2];
    let mut enter = |variance: f32, moved: &dyn Fn(f32) -> [ReflectionPoint; 2]| {
        for ((covariance, there), back) in covariances.iter_mut().zip(moved(step)).zip(moved(-step)) {
            let column = (there.position.vector() - back.position.vector()) / (2.0 * step);
            *covariance += column * column.transpose() * variance;
        }
    };
    for axis in 0..3 {
        enter(ends.uav_covariance[(axis, axis)], &|by| {
            let mut uav = *ends.uav.vector();
            uav[axis] += by;
            both_points(
                &Ends {
                    uav: at(uav),
                    ..*ends
                },
                walls,
            )
        });
        for wall in 0..2 {
            enter(walls[wall].plane.covariance[(axis, axis)], &|by| {
                let mut change = [0.0; 3];
                change[axis] = by;
                let mut walls = *walls;
                let plane = &mut walls[wall].plane;
                *plane = plane.corrected(change, plane.covariance).expect("finite");
                both_points(ends, &walls)
            });
        }
    }
    covariances
}

#[test]
fn covariances_of_both_points_are_those_of_difference_quotients() {
    let (route, ends) = (two(), two().ends());
    let sure = |mut known: Known| {
        known.plane.covariance = Matrix3::zeros();
        known
    };
    let [first, last] = [0, 1].map(|index| route.mirror(index));
    let cases = [
        [sure(first), sure(last)],
        [sure(first), last],
        [first, sure(last)],
        [first, last],
    ];
    for walls in cases {
        let expected = differences(&ends, &walls);
        let found = both_points(&ends, &walls).map(|point| point.covariance);
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).norm() < 2e-3 * expected.norm(),
                "{found} {expected}"
            );
        }
    }
}
