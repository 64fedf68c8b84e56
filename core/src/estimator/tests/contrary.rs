//! A start that is the image of the true place behind a wall: refused by the magnetic heading, or noticed when the wave that came
//! straight is heard.

use nalgebra::Vector3;

use super::super::nominal::rotation;
use super::super::window::WINDOW;
use super::super::*;
use super::flight::{SWEEP_NS, error_m, fly, fly_from, measurement, path, seen_from, truth};
use super::window::hovering;
use crate::geometry::Body;
use crate::inertial::MagneticField;

/// The wall stands at this y, m.
const WALL_M: f64 = 40.0;
const SECOND_NS: u64 = 1_000_000_000;

fn mirrored(v: Vector3<f64>) -> Vector3<f64> {
    Vector3::new(v.x, 2.0 * WALL_M - v.y, v.z)
}

/// The wave off the wall.
fn off_the_wall(time_ns: u64) -> PathMeasurement {
    let (state, gmt) = (truth(time_ns), measurement(time_ns, path(time_ns)).gmt.position_m);
    let left = mirrored(state.position_m) - gmt;
    let seen = state.attitude.tr_mul(&(mirrored(gmt) - state.position_m));
    let along = left.normalize();
    PathMeasurement {
        c_tau_m: left.norm() + state.clock_offset_m,
        aoa: Direction::<Body, f64>::from_vector(seen).expect("apart"),
        departure: Some(FaceDirection {
            face: 0,
            cosines: [along.y, along.z],
            sigma: [1e-4; 2],
        }),
        ..path(time_ns)
    }
}

fn earth() -> MagneticField {
    MagneticField::new(48.0, 1.1, 0.05)
}

/// Tells the filter the magnetic field as the true body sees it.
fn feel(filter: &mut Filter49, time_ns: u64) {
    let seen = truth(time_ns).attitude.tr_mul(&earth().earth_ut.map(f64::from));
    filter.magnetic(time_ns, &earth(), &seen.map(|c| c as f32));
}

/// A filter that has flown on a path of its own for so long.
fn started(end_ns: u64, mut sight: impl FnMut(u64) -> PathMeasurement) -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    fly(&mut filter, end_ns, 0, |now, _, sweep| {
        sweep.line_of_sight = Some(sight(now));
    });
    assert!(filter.is_running());
    filter
}

/// Flies on to `end_ns` without line of sight, past paths that speak against the pose. The filter is kept so sure of its attitude that it is not
/// given up when it is lost.
fn go_on(filter: &mut Filter49, end_ns: u64, mut contrary: impl FnMut(u64) -> PathMeasurement) {
    let from_ns = filter.nominal().time_ns;
    fly_from(filter, from_ns, end_ns, 0, |now, filter, sweep| {
        for axis in 0..3 {
            filter.covariance.reset(ATTITUDE + axis, 1e-4);
        }
        sweep.line_of_sight = None;
        sweep.contrary = Some(contrary(now));
    });
}

#[test]
fn an_image_is_given_up_when_the_straight_wave_is_heard() {
    let mut filter = started(3 * SECOND_NS, off_the_wall);
    assert!(error_m(&filter) > 40.0 && filter.pose().is_some());
    assert!(!filter.is_confirmed());
    go_on(&mut filter, 6 * SECOND_NS, path);
    assert!(error_m(&filter) < 0.5, "{} m off", error_m(&filter));
    let turned = filter.nominal().attitude - truth(filter.nominal().time_ns).attitude;
    assert!(turned.norm() < 0.05, "{turned}");
    assert_eq!((filter.counters().refixes, filter.counters().contrary), (1, 6));
    assert_eq!(filter.pose().map(|pose| pose.resets), Some(1));
}

#[test]
fn a_wave_off_a_wall_speaks_against_no_pose_that_is_right() {
    let mut filter = started(10 * SECOND_NS, path);
    // Four seconds behind a corner: every sweep shows the same image.
    go_on(&mut filter, 14 * SECOND_NS, off_the_wall);
    assert!(error_m(&filter) < 1.0, "{} m off", error_m(&filter));
    assert_eq!((filter.counters().refixes, filter.counters().contrary), (0, 0));
}

#[test]
fn early_paths_that_do_not_agree_set_no_pose() {
    let mut filter = started(3 * SECOND_NS, off_the_wall);
    let before_m = error_m(&filter);
    go_on(&mut filter, 7 * SECOND_NS, |now| {
        let side = if (now / SWEEP_NS).is_multiple_of(2) {
            6.0
        } else {
            -6.0
        };
        seen_from(Vector3::new(0.0, side, 0.0), now)
    });
    assert_eq!((filter.counters().refixes, filter.counters().contrary), (0, 8));
    assert!((error_m(&filter) - before_m).abs() < 3.0);
}

/// The errors of the inertial sensor that a wrong pose was explained by would bend every window, too.
#[test]
fn a_pose_that_early_paths_contradict_is_given_up_even_where_nothing_tells_the_right_one() {
    let mut filter = started(3 * SECOND_NS, off_the_wall);
    // A sensor that seems to turn by half a radian a second: no window of sights agrees with that.
    filter.nominal.imu.gyro_bias_rad_per_s = Vector3::new(0.0, 0.0, 0.5);
    go_on(&mut filter, 9 * SECOND_NS - 1, path);
    assert!(filter.is_running() && filter.counters().contrary == 11);
    go_on(&mut filter, 9 * SECOND_NS, path);
    assert!(!filter.is_running() && filter.pose().is_none());
    assert_eq!(filter.nominal.imu.gyro_bias_rad_per_s, Vector3::zeros());
}

#[test]
fn a_start_that_the_heading_contradicts_once_it_is_better_known_is_given_up() {
    // Whether a pose outlives so many questions.
    let stands = |sigma_rad: f32, questions: usize, confirmed: bool| {
        let mut filter = started(3 * SECOND_NS, off_the_wall);
        let now = filter.nominal().time_ns;
        feel(&mut filter, now);
        filter.doubt.confirmed = confirmed;
        for axis in 0..3 {
            filter.covariance.reset(ATTITUDE + axis, sigma_rad * sigma_rad);
        }
        (0..questions).for_each(|_| filter.question_start());
        filter.is_running()
    };
    // The image is turned by more than a radian; the heading tells it to four times 0.14 and what the attitude claims.
    assert!(
        stands(1.0, 6, false),
        "an attitude that is hardly known is not contradicted"
    );
    assert!(stands(0.05, 5, false), "a field may be disturbed in passing");
    assert!(!stands(0.05, 6, false));
    assert!(
        stands(0.05, 6, true),
        "sights that turn as the gyroscope says are of no image"
    );
}

#[test]
fn the_magnetic_heading_refuses_an_image_and_lets_the_true_place_pass() {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    fly(&mut filter, 4 * SECOND_NS, 0, |now, filter, sweep| {
        feel(filter, now);
        sweep.line_of_sight = Some(off_the_wall(now));
    });
    assert!(!filter.is_running() && filter.pose().is_none());
    assert!(filter.counters().starts_refused >= 3);
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    fly(&mut filter, 4 * SECOND_NS, 0, |now, filter, _| feel(filter, now));
    assert!(filter.is_running() && error_m(&filter) < 0.1);
    assert_eq!(filter.counters().starts_refused, 0);
}

/// Whether a start by a window in which nothing turns is acceptable with a heading that is off by so much.
fn hovering_start_is_acceptable(off_rad: f64, is_no_image: bool) -> bool {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    let seen = rotation(&Vector3::new(0.0, 0.0, off_rad)) * earth().earth_ut.map(f64::from);
    filter.magnetic(0, &earth(), &seen.map(|c| c as f32));
    let mut solution = hovering().solve(WINDOW, None).expect("consistent");
    solution.is_no_image |= is_no_image;
    let acceptable = filter.is_acceptable(&solution);
    assert_eq!(filter.counters().starts_refused == 0, acceptable);
    acceptable
}

#[test]
fn where_no_sight_turns_a_heading_that_is_usual_is_asked_for() {
    // The heading is known to 4 and 4.5 degrees, and to what the window's attitude is: 6 or 7 together.
    assert!(hovering_start_is_acceptable(0.15, false));
    assert!(!hovering_start_is_acceptable(0.35, false));
    assert!(hovering_start_is_acceptable(0.35, true));
    assert!(!hovering_start_is_acceptable(0.6, true));
}

#[test]
fn an_attitude_is_not_given_up_for_what_may_be_an_image() {
    let refixed_from = |axis: Vector3<f64>, turned_rad: f64, confirmed: bool, longer_m: f64| {
        let mut filter = started(3 * SECOND_NS, path);
        let mut heard = path(filter.nominal().time_ns);
        heard.c_tau_m += longer_m;
        let gmt = measurement(0, path(0)).gmt;
        filter.doubt.confirmed = confirmed;
        filter.window = hovering();
        let solution = filter.window.solve(WINDOW, None).expect("consistent");
        filter.nominal.attitude = rotation(&(axis * turned_rad)) * solution.attitude;
        filter.try_refix_contested(&gmt, &heard, WINDOW)
    };
    let refixed = |turned_rad: f64, confirmed: bool, longer_m: f64| {
        refixed_from(Vector3::z(), turned_rad, confirmed, longer_m)
    };
    // What turns it by less than an image is turned sets it anew, but not one that sights have confirmed.
    assert!(refixed(0.28, false, 0.0) && !refixed(0.28, true, 0.0));
    // Neither is one that nothing has confirmed, where the path is longer than the straight way: it proves nothing. A shorter one does.
    assert!(!refixed(0.28, false, 10.0) && refixed(0.28, false, -10.0));
    // Turned as an image is, the window's place may be the image as well as the pose: only a shorter path tells which.
    for longer_m in [0.0, 10.0] {
        assert!(!refixed(0.35, false, longer_m));
    }
    assert!(refixed(0.35, false, -10.0) && !refixed(0.35, true, -10.0));
    // An image in an upright wall is turned about the vertical.
    assert!(refixed_from(Vector3::new(1.0, 0.0, 0.0), 0.35, false, 0.0));
}

#[test]
fn a_pose_that_is_lost_before_it_was_confirmed_is_given_up() {
    let runs = |confirmed: bool, sigma_m: f32, sigma_rad: f32| {
        let mut filter = started(3 * SECOND_NS, path);
        filter.doubt.confirmed = confirmed;
        for axis in 0..3 {
            filter.covariance.reset(POSITION + axis, sigma_m * sigma_m);
            filter.covariance.reset(ATTITUDE + axis, sigma_rad * sigma_rad);
        }
        filter.give_up_lost();
        filter.is_running()
    };
    assert!(!runs(false, 2.0, 0.04));
    // One that sights have confirmed, one that is not lost, and one whose attitude tells an image.
    assert!(runs(true, 2.0, 0.04) && runs(false, 1.0, 0.04) && runs(false, 2.0, 0.02));
}

#[test]
fn a_magnetic_field_of_long_ago_says_nothing() {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    feel(&mut filter, SECOND_NS);
    fly(&mut filter, 4 * SECOND_NS, 0, |now, _, sweep| {
        sweep.line_of_sight = Some(off_the_wall(now));
    });
    assert!(filter.is_running() && filter.counters().starts_refused == 0);
}
