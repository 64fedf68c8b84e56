//! Points of paths of several reflections, in logs whose figures are known by hand.

use super::tests::{near, point};
use super::*;
use crate::flight_log::PointRecord;
use crate::test_flight::{log_of, measured, sweep, true_path};

/// A point of a path of several reflections.
fn bounce(sweep: u32, path: u8, (reflection, order): (u8, u8), position_m: [f64; 3]) -> PointRecord {
    PointRecord {
        order,
        reflection,
        ..point(sweep, path, position_m)
    }
}

/// Three sweeps. The first one heard a path of one, of two and of three reflections and a ghost, the second one a path of two
/// reflections twice, but none of one; the truth of the third one is not known. Every path of two or three was reflected first
/// at (5, 0, 2) and last at (-5, 8, 4).
fn bounced() -> FlightLog {
    let several = |order: u8, length_m: f64, aoa_rad: [f64; 2]| {
        let mut path = true_path(order, length_m, aoa_rad);
        (path.first_vertex, path.last_vertex) = (Some([5.0, 0.0, 2.0]), Some([-5.0, 8.0, 4.0]));
        path
    };
    let mut log = log_of((0..3).map(|k| sweep(k, [3.0, 0.0, 1.5])).collect());
    let [rich, poor, unknown] = &mut log.sweeps[..] else {
        unreachable!("three sweeps");
    };
    let mut first = true_path(1, 20.0, [1.5, 1.5]);
    first.last_vertex = Some([3.0, 10.0, 1.5]);
    rich.truth.link.as_mut().expect("known").paths =
        vec![first, several(2, 30.0, [1.5, 3.0]), several(3, 40.0, [1.5, -2.0])];
    rich.estimate.paths = vec![
        measured(20.0, [1.5, 1.5]),
        measured(30.0, [1.5, 3.0]),
        measured(40.0, [1.5, -2.0]),
        measured(55.0, [1.0, 1.0]),
    ];
    poor.truth.link.as_mut().expect("known").paths =
        vec![several(2, 30.0, [1.5, 3.0]), several(2, 40.0, [1.5, -2.0])];
    poor.estimate.paths = vec![measured(30.0, [1.5, 3.0]), measured(40.0, [1.5, -2.0])];
    unknown.truth.link = None;
    unknown.estimate.paths = vec![measured(30.0, [1.5, 3.0])];
    log
}

#[test]
fn each_point_of_several_reflections_is_held_against_its_own_vertex() {
    let mut log = bounced();
    log.points = vec![
        bounce(0, 1, (1, 2), [5.0, 0.3, 2.4]),  // off by 0.5
        bounce(0, 1, (2, 2), [-5.0, 8.0, 4.1]), // off by 0.1
        bounce(0, 2, (1, 3), [5.0, 0.2, 2.0]),  // off by 0.2
        bounce(0, 2, (2, 3), [99.0; 3]),        // the truth does not name it
        bounce(0, 2, (3, 3), [-5.3, 8.0, 4.0]), // off by 0.3
    ];
    let found = evaluate(&mut log, None);
    assert_eq!(log.sweeps[0].truth.matches, [Some(0), Some(1), Some(2), None]);
    let errors_m = &found.point_errors.reflection_m;
    let expected_m = [0.5, 0.1, 0.2, 0.3];
    assert_eq!(errors_m.len(), expected_m.len(), "{errors_m:?}");
    assert!(
        errors_m.iter().zip(expected_m).all(|(a, b)| (a - b).abs() < 1e-9),
        "{errors_m:?}"
    );
    assert!(near(found.map.precision_higher_order, 1.0));
    assert_eq!(
        (found.map.precision_first_order, found.map.accepted_higher_order),
        (None, 5)
    );
}

#[test]
fn a_point_of_several_reflections_off_another_mirror_is_wrong() {
    let higher = |points: Vec<PointRecord>| {
        let mut log = bounced();
        log.points = points;
        evaluate(&mut log, None)
            .map
            .precision_higher_order
            .expect("known")
    };
    let last = |off_m: f64| vec![bounce(0, 1, (2, 2), [-5.0 - off_m, 8.0, 4.0])];
    let first = |off_m: f64| vec![bounce(0, 2, (1, 3), [5.0, off_m, 2.0])];
    assert_eq!([higher(last(0.99)), higher(last(1.01))], [1.0, 0.0]);
    assert_eq!([higher(first(0.99)), higher(first(1.01))], [1.0, 0.0]);
    // Where the truth names no vertex, the order alone counts: a path of two that is taken for three.
    assert_eq!(higher(vec![bounce(0, 2, (2, 3), [0.0; 3])]), 1.0);
    assert_eq!(higher(vec![bounce(0, 1, (2, 3), [0.0; 3])]), 0.0);
    // A path of one reflection that is taken for two, and a ghost.
    assert_eq!(higher(vec![bounce(0, 0, (2, 2), [3.0, 10.0, 1.5])]), 0.0);
    assert_eq!(higher(vec![bounce(0, 3, (1, 2), [5.0, 0.0, 2.0])]), 0.0);
}

#[test]
fn points_of_one_and_of_several_reflections_are_counted_apart() {
    let mut log = bounced();
    log.points = vec![
        point(0, 0, [3.0, 10.0, 1.5]),
        point(0, 1, [-5.0, 8.0, 4.0]), // truly of two reflections
        point(0, 3, [0.0; 3]),         // a ghost
        bounce(0, 2, (1, 3), [5.0, 0.0, 2.0]),
        bounce(0, 2, (2, 3), [0.0; 3]),
        bounce(0, 2, (3, 3), [-5.0, 18.0, 4.0]), // another mirror
        bounce(1, 0, (1, 2), [5.0, 0.0, 2.0]),
        bounce(1, 0, (2, 2), [-5.0, 8.0, 4.0]),
        bounce(2, 0, (1, 2), [5.0, 0.0, 2.0]), // of a sweep whose truth is not known
        bounce(2, 0, (2, 2), [5.0, 0.0, 2.0]),
    ];
    let map = evaluate(&mut log, None).map;
    assert_eq!((map.accepted, map.accepted_higher_order, map.ghosts), (10, 7, 1));
    assert!(near(map.precision_first_order, 1.0 / 3.0));
    assert!(
        near(map.precision_higher_order, 4.0 / 5.0),
        "{:?}",
        map.precision_higher_order
    );
    assert!(near(map.precision, 5.0 / 8.0));
    assert!(near(map.recall_first_order, 1.0));
    // The one sweep that had a true path of one reflection: six points, three of which presume one.
    assert!(near(map.accepted_per_sweep, 6.0) && near(map.accepted_first_order_per_sweep, 3.0));
}
