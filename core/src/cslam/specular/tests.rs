use super::*;
use crate::path::diagonal_covariance;

fn at(x: f32, y: f32, z: f32) -> Position<World> {
    Position::new(x, y, z).expect("finite")
}

/// A wall that faces west at x = 10, known to 3 cm and 2 mrad, and both ends before it.
fn wall() -> (Ends, Plane) {
    let ends = Ends {
        gmt: at(1.0, 0.0, 1.5),
        uav: at(6.0, 30.0, 9.0),
        uav_covariance: Matrix3::from_diagonal(&Vector3::new(0.01, 0.004, 0.0025)),
    };
    let plane = Plane {
        normal: Direction::from_vector(-Vector3::x()).expect("some"),
        centre: at(10.0, 12.0, 4.0),
        covariance: Matrix3::from_diagonal(&Vector3::new(9e-4, 4e-6, 4e-6)),
    };
    (ends, plane)
}

fn reflected(ends: &Ends, plane: &Plane) -> Option<ReflectionPoint> {
    let [uav, gmt] = both(ends);
    point_on(&uav, &gmt, plane)
}

/// The path that a plane reflects, longer and turned towards north by so much.
fn path(ends: &Ends, plane: &Plane, longer_m: f32, turned_rad: f32) -> Path<World> {
    let towards = plane.image(ends.gmt.vector()) - ends.uav.vector();
    let across = Vector3::z().cross(&towards).normalize() * (towards.norm() * libm::tanf(turned_rad));
    Path {
        c_tau_m: towards.norm() + longer_m,
        aoa: Direction::from_vector(towards + across).expect("some"),
        aod: None,
        covariance: diagonal_covariance(0.04, 0.002),
    }
}

#[test]
fn a_wall_explains_the_path_that_it_reflects_and_no_other() {
    let (ends, plane) = wall();
    let misfit = |longer_m, turned_rad| misfit(&ends, &path(&ends, &plane, longer_m, turned_rad), &plane);
    assert!(misfit(0.0, 0.0).expect("its own") < 0.01);
    // 0.15 m and three times hypot(0.04, 0.07) m; 3 mrad and three times hypot(2, 3.7) mrad.
    assert!(misfit(0.3, 0.0).is_some() && misfit(0.5, 0.0).is_none() && misfit(-0.5, 0.0).is_none());
    assert!(misfit(0.0, 0.012).is_some() && misfit(0.0, 0.018).is_none());
    let mut poor = path(&ends, &plane, 0.0, 0.0);
    poor.c_tau_m = f32::NAN;
    assert_eq!(super::misfit(&ends, &poor, &plane), None);
}

#[test]
fn a_wall_explains_nothing_from_behind_or_to_a_uav_that_is_nowhere() {
    let (ends, plane) = wall();
    let path = path(&ends, &plane, 0.0, 0.0);
    let behind = Ends {
        gmt: at(19.0, 0.0, 1.5),
        ..ends
    };
    let seen = Path {
        c_tau_m: ends.uav.distance_m(&at(1.0, 0.0, 1.5)),
        aoa: Direction::from_vector(at(1.0, 0.0, 1.5).from_origin(&ends.uav)).expect("some"),
        ..path
    };
    assert_eq!(misfit(&behind, &seen, &plane), None);
    assert_eq!(reflected(&behind, &plane), None);
    let unsure = Ends {
        uav_covariance: ends.uav_covariance * 9.0,
        ..ends
    };
    assert_eq!(misfit(&unsure, &path, &plane), None);
}

#[test]
fn the_point_lies_on_the_wall_and_halves_the_way() {
    let (ends, plane) = wall();
    let point = reflected(&ends, &plane).expect("before it");
    // Heights 4 and 9 m: four thirteenths of the way along the wall.
    let expected = Vector3::new(10.0, 30.0 - 30.0 * 4.0 / 13.0, 9.0 - 7.5 * 4.0 / 13.0);
    assert!((point.position.vector() - expected).norm() < 1e-4, "{point:?}");
    let length_m = point.distance_m + point.position.distance_m(&ends.gmt);
    let image_m = (plane.image(ends.gmt.vector()) - ends.uav.vector()).norm();
    assert!((length_m - image_m).abs() < 1e-4);
}

#[test]
fn its_covariance_is_that_of_difference_quotients() {
    let (ends, plane) = wall();
    let here = *reflected(&ends, &plane).expect("before it").position.vector();
    let step = 0.02;
    let by = |ends: &Ends, plane: &Plane| {
        (reflected(ends, plane).expect("before it").position.vector() - here) / step
    };
    let mut expected = Matrix3::zeros();
    for axis in 0..3 {
        let mut away = Vector3::zeros();
        away[axis] = step;
        let moved = Ends {
            uav: Position::from_vector(ends.uav.vector() + away).expect("finite"),
            ..ends
        };
        let column = by(&moved, &plane);
        expected += column * column.transpose() * ends.uav_covariance[(axis, axis)];
        let mut change = [0.0; 3];
        change[axis] = step;
        let moved = plane.corrected(change, plane.covariance).expect("finite");
        let column = by(&ends, &moved);
        expected += column * column.transpose() * plane.covariance[(axis, axis)];
    }
    let found = reflected(&ends, &plane).expect("before it").covariance;
    assert!(
        (found - expected).norm() < 0.02 * expected.norm(),
        "{found} {expected}"
    );
}

#[test]
fn a_mirror_asks_less_of_the_network() {
    let of = |los, first_order| Probabilities {
        los,
        first_order,
        higher_order: 1.0 - los - first_order,
    };
    let cases = [
        (of(0.0, 0.85), true, true),
        (of(0.0, 0.4), false, true),
        (of(0.0, 0.2), false, false),
    ];
    for (probabilities, alone, mirrored) in cases {
        assert_eq!(
            Least::Alone(0.8).is_reached(&probabilities),
            alone,
            "{probabilities:?}"
        );
        assert_eq!(
            Least::Mirrored(0.3).is_reached(&probabilities),
            mirrored,
            "{probabilities:?}"
        );
    }
    // However little is asked, alone the state must be first order, and a number.
    assert!(!Least::Alone(0.0).is_reached(&of(0.5, 0.4)));
    assert!(!Least::Alone(0.0).is_reached(&of(0.0, f32::NAN)));
}

#[test]
fn the_better_known_point_is_taken_if_it_is_known_well_enough() {
    let known_to = |sigma_m: f32, x: f32| ReflectionPoint {
        position: at(x, 0.0, 0.0),
        covariance: Matrix3::from_diagonal(&Vector3::new(sigma_m * sigma_m, 0.0, 0.0)),
        distance_m: 1.0,
    };
    let asked = Mirrored {
        max_sigma_m: 1.5,
        ..Mirrored::default()
    };
    let x_of = |solved_m, mirror_m: Option<f32>| {
        let on_mirror = mirror_m.map(|sigma_m| (asked, known_to(sigma_m, 2.0)));
        better(&known_to(solved_m, 1.0), 0.5, on_mirror.as_ref()).map(|point| point.position.vector().x)
    };
    assert_eq!([x_of(0.4, None), x_of(0.6, None)], [Some(1.0), None]);
    assert_eq!(
        [x_of(0.4, Some(0.45)), x_of(0.4, Some(0.1))],
        [Some(1.0), Some(2.0)]
    );
    assert_eq!([x_of(9.0, Some(1.4)), x_of(9.0, Some(1.6))], [Some(2.0), None]);
    // A poor mirror does not excuse a poor path.
    assert_eq!(x_of(0.6, Some(0.7)), None);
}

#[test]
fn the_ground_lies_level_at_its_height() {
    let (ends, _) = wall();
    let plane = ground(&ends, -0.5).expect("a number");
    assert_eq!(plane.height_m(&Vector3::new(40.0, -7.0, -0.5)), 0.0);
    let point = reflected(&ends, &plane).expect("above it");
    assert!((point.position.vector().z + 0.5).abs() < 1e-5);
    assert!(point.covariance.m33 < 1.1 * (GROUND_SHIFT_M * GROUND_SHIFT_M) + 1e-3);
    assert_eq!(ground(&ends, f32::NAN), None);
}

/// A wall across the street, so that the GMT seen in it is uncertain as an end is.
fn across_the_street() -> Plane {
    Plane {
        normal: Direction::from_vector(Vector3::new(1.0, -0.4, 0.02)).expect("not zero"),
        centre: at(-14.0, 8.0, 4.0),
        covariance: Matrix3::from_diagonal(&Vector3::new(2.5e-3, 1e-5, 2e-5)),
    }
}

/// An end whose error has a direction of its own.
fn uncertain() -> End {
    End {
        at: Vector3::new(1.0, 0.0, 1.5),
        covariance: Matrix3::new(0.02, 0.006, -0.003, 0.006, 0.01, 0.002, -0.003, 0.002, 0.006),
    }
}

/// Covariance of a point that changes with an end and a plane, by difference quotients.
fn differences(
    end: &End,
    plane: &Plane,
    point: impl Fn(&Vector3<f32>, &Plane) -> Vector3<f32>,
) -> Matrix3<f32> {
    let step = 0.01;
    let column = |axis: usize, by: &dyn Fn(Vector3<f32>) -> Vector3<f32>| {
        let mut change = Vector3::zeros();
        change[axis] = step;
        (by(change) - by(-change)) / (2.0 * step)
    };
    let columns = |by: &dyn Fn(Vector3<f32>) -> Vector3<f32>| {
        Matrix3::from_columns(&[column(0, by), column(1, by), column(2, by)])
    };
    let of_end = columns(&|change| point(&(end.at + change), plane));
    let of_plane = columns(&|change| {
        let moved = plane.corrected(change.into(), plane.covariance).expect("finite");
        point(&end.at, &moved)
    });
    of_end * end.covariance * of_end.transpose() + of_plane * plane.covariance * of_plane.transpose()
}

#[test]
fn an_end_seen_in_a_plane_is_as_uncertain_as_difference_quotients_say() {
    let (end, plane) = (uncertain(), across_the_street());
    let seen = end.mirrored(&plane);
    assert_eq!(seen.at, plane.image(&end.at));
    let expected = differences(&end, &plane, |end, plane| plane.image(end));
    assert!(
        (seen.covariance - expected).norm() < 1e-2 * expected.norm(),
        "{} {expected}",
        seen.covariance
    );
    // Of a plane without error it is the same, mirrored; and so it is again when seen twice.
    let exact = Plane {
        covariance: Matrix3::zeros(),
        ..plane
    };
    let twice = end.mirrored(&exact).mirrored(&exact);
    assert!((twice.at - end.at).norm() < 1e-5);
    assert!((twice.covariance - end.covariance).norm() < 1e-7);
    assert!((end.mirrored(&exact).covariance - end.covariance).norm() > 1e-3);
}

#[test]
fn a_point_is_as_uncertain_as_both_ends_and_the_plane_make_it() {
    let (ends, plane) = wall();
    let [uav, _] = both(&ends);
    let gmt = uncertain();
    let point = |uav: &End, gmt: &End, plane: &Plane| point_on(uav, gmt, plane).expect("before it");
    let found = point(&uav, &gmt, &plane);
    // The plane and the GMT, then the UAV alone.
    let still = Plane {
        covariance: Matrix3::zeros(),
        ..plane
    };
    let expected = differences(&gmt, &plane, |at, plane| {
        *point(&uav, &End { at: *at, ..gmt }, plane).position.vector()
    }) + differences(&uav, &still, |at, plane| {
        *point(&End { at: *at, ..uav }, &gmt, plane).position.vector()
    });
    assert!(
        (found.covariance - expected).norm() < 1e-2 * expected.norm(),
        "{} {expected}",
        found.covariance
    );
    // The GMT's own share is not small, and either end may be the uncertain one.
    let of_sure_gmt = reflected(&ends, &plane).expect("before it").covariance;
    assert!((found.covariance - of_sure_gmt).norm() > 0.1 * expected.norm());
    let back = point(&gmt, &uav, &plane);
    assert!((back.position.vector() - found.position.vector()).norm() < 1e-5);
    assert!((back.covariance - found.covariance).norm() < 1e-5);
}
