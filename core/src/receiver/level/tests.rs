use super::*;

const YAW_RAD: f64 = -2.1;

fn gmt() -> Vector3<f64> {
    Vector3::new(0.0, 0.0, 1.5)
}

fn uav() -> Vector3<f64> {
    Vector3::new(6.0, 3.0, 9.0)
}

/// To level axes.
fn levelled(v: &Vector3<f64>) -> Vector3<f64> {
    rotation(&Vector3::new(0.0, 0.0, -YAW_RAD)) * v
}

/// What a path over these points says, with `first` for the line of sight: its last point before the UAV.
fn over(points: &[Vector3<f64>], first: &[Vector3<f64>]) -> Option<Way> {
    let length_m = |points: &[Vector3<f64>]| {
        let ends = [points, &[uav()]].concat();
        ends.iter()
            .fold((0.0, gmt()), |(sum, from), to| (sum + (to - from).norm(), *to))
            .0
    };
    let seen =
        |points: &[Vector3<f64>]| levelled(&(points.last().copied().unwrap_or(gmt()) - uav()).normalize());
    let left = (points.first().copied().unwrap_or(uav()) - gmt()).normalize();
    way(
        &seen(first),
        length_m(first),
        &seen(points),
        length_m(points),
        &left,
    )
}

fn walls() -> [Vector3<f64>; 3] {
    [
        Vector3::new(15.0, 4.0, 6.0),
        Vector3::new(-8.0, 12.0, 5.0),
        Vector3::new(3.0, -20.0, 4.0),
    ]
}

#[test]
fn a_single_reflection_tells_the_yaw() {
    for wall in walls() {
        let way = over(&[wall], &[]).expect("a triangle");
        assert!(wrapped(way.yaw_rad - YAW_RAD).abs() < 1e-9, "{way:?}");
    }
    // The ground's reflection has an elevation, but hardly an azimuth; here it left by a beam's sidelobe.
    let below = Vector3::new(1.0, 0.5, 0.0);
    let seen = levelled(&(below - uav()).normalize());
    let length_m = (below - gmt()).norm() + (uav() - below).norm();
    let sight = levelled(&(gmt() - uav()).normalize());
    let range_m = (gmt() - uav()).norm();
    let ahead = Vector3::new(1.0, 0.0, 0.2).normalize();
    assert!(way(&sight, range_m, &seen, length_m, &ahead).is_none());
}

#[test]
fn three_different_ways_must_agree() {
    let ways: Vec<Way, PATHS> = walls().iter().filter_map(|wall| over(&[*wall], &[])).collect();
    let yaw_rad = agreed_yaw(&ways).expect("three");
    assert!(wrapped(yaw_rad - YAW_RAD).abs() < 1e-9);
    assert!(agreed_yaw(&ways[..2]).is_none());
    // Another image in the same wall is no third way, and a way of its own mind no help.
    let image = over(&[walls()[1] + Vector3::new(0.3, 0.3, 0.0)], &[]).expect("a triangle");
    assert!(agreed_yaw(&[ways[0], ways[1], image]).is_none());
    let double = Way {
        yaw_rad: YAW_RAD + 0.05,
        left_rad: 1.0,
    };
    assert!(agreed_yaw(&[ways[0], ways[1], double]).is_none());
    let yaw_rad = agreed_yaw(&[double, ways[0], ways[1], ways[2]]).expect("three");
    assert!(wrapped(yaw_rad - YAW_RAD).abs() < 1e-9);
}

#[test]
fn a_reflection_taken_for_the_line_of_sight_proves_nothing() {
    let first = [Vector3::new(3.0, 8.0, 5.0)];
    let ways: Vec<Way, PATHS> = walls().iter().filter_map(|wall| over(&[*wall], &first)).collect();
    assert!(agreed_yaw(&ways).is_none(), "{ways:?}");
}

#[test]
fn sweeps_agree_while_the_uav_stands() {
    let fix = |time_ns: u64, x_m: f64, yaw_rad: f64| LevelFix {
        time_ns,
        place_m: Vector3::new(x_m, 0.0, 5.0),
        yaw_rad,
        sweeps: 1,
    };
    let half = 500_000_000;
    // The yaw's turn to -pi is no difference.
    let first = fix(0, 2.0, 3.138).after(None);
    let second = fix(half, 2.1, -3.138).after(Some(&first));
    let third = fix(2 * half, 2.1, 3.138).after(Some(&second));
    assert_eq!([first, second, third].map(|fix| fix.sweeps), [1, 2, SWEEPS]);
    assert_eq!(
        fix(3 * half, 2.4, 3.138).after(Some(&third)).sweeps,
        1,
        "it has moved"
    );
    assert_eq!(
        fix(3 * half, 2.1, 3.1).after(Some(&third)).sweeps,
        1,
        "it has turned"
    );
    assert_eq!(
        fix(5 * half, 2.1, 3.138).after(Some(&third)).sweeps,
        1,
        "too long ago"
    );
}

/// What the line of sight says of the yaw when its departure is raised by so much.
fn seen_straight(raised: f64) -> Option<f64> {
    let sight = levelled(&(gmt() - uav()).normalize());
    let mut left = (uav() - gmt()).normalize();
    left.z += raised;
    straight_yaw(&sight, &left)
}

#[test]
fn a_line_of_sight_with_a_departure_tells_the_yaw() {
    let yaw_rad = seen_straight(0.0).expect("straight");
    assert!(wrapped(yaw_rad - YAW_RAD).abs() < 1e-9, "{yaw_rad}");
    // From behind, where the azimuths' difference turns past pi.
    let left = Vector3::new(-0.9, 0.05, 0.3);
    let turn = rotation(&Vector3::new(0.0, 0.0, -3.0));
    let yaw_rad = straight_yaw(&(turn * -left), &left).expect("straight");
    assert!((yaw_rad - 3.0).abs() < 1e-9, "{yaw_rad}");
}

#[test]
fn elevations_that_contradict_are_of_no_line_of_sight() {
    for side in [-1.0, 1.0] {
        assert!(seen_straight(side * 0.9 * ELEVATION).is_some());
        assert!(seen_straight(side * 1.1 * ELEVATION).is_none());
    }
    // Nearly overhead there is no azimuth to tell.
    let up = |slope: f64| Vector3::new(slope, 0.0, libm::sqrt(1.0 - slope * slope));
    let overhead = |slope: f64| straight_yaw(&-up(slope), &up(slope));
    assert!(overhead(1.1 * LEAST_LEVEL).is_some() && overhead(0.9 * LEAST_LEVEL).is_none());
}

#[test]
fn triangles_and_the_line_of_sight_must_not_contradict() {
    let apart = |share: f64| told_yaw(Some(3.138), Some(wrapped(3.138 + share * SAME_YAW_RAD)));
    assert_eq!(apart(0.9), Some(3.138));
    assert_eq!(apart(-0.9), Some(3.138));
    assert_eq!(apart(1.1), None);
    assert_eq!(apart(-1.1), None);
    assert_eq!(
        [told_yaw(Some(1.0), None), told_yaw(None, Some(2.0))],
        [Some(1.0), Some(2.0)]
    );
    assert_eq!(told_yaw(None, None), None);
}
