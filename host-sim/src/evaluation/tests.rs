//! Logs whose figures are known by hand.

use nalgebra::{UnitQuaternion, Vector3};

use super::surface::tests::wall_with_a_door;
use super::*;
use crate::flight_log::{LinkEstimate, MapVoxel, PointRecord, PoseRecord};
use crate::paths::{Interaction, Kind};
use crate::test_flight::{estimate, log_of, measured, sweep, true_path, truth};

pub(super) fn near(value: Option<f64>, expected: f64) -> bool {
    value.is_some_and(|v| (v - expected).abs() < 1e-9)
}

pub(super) fn point(sweep: u32, path: u8, position_m: [f64; 3]) -> PointRecord {
    PointRecord {
        sweep,
        path,
        order: 1,
        reflection: 1,
        surface: None,
        mapped_sweep: None,
        time_s: 0.5,
        gmt_index: 0,
        position_m,
        covariance_trace_m2: 0.01,
        probability: None,
        snr_db: None,
    }
}

/// Two sweeps. The first one heard a first-order path off (3, 10, 1.5), a second-order one and a ghost, and missed a
/// first-order one; the second one heard line of sight alone.
fn two_sweeps() -> FlightLog {
    let (mut rich, mut poor) = (sweep(0, [3.0, 0.0, 1.5]), sweep(1, [3.0, 0.0, 1.5]));
    let mut first = true_path(1, 20.0, [1.5, 1.5]);
    first.last_vertex = Some([3.0, 10.0, 1.5]);
    let mut missed = true_path(1, 40.0, [1.5, -2.0]);
    missed.last_vertex = Some([3.5, 10.0, 1.5]);
    rich.truth.link.as_mut().expect("known").paths = vec![first, true_path(2, 30.0, [1.5, 3.0]), missed];
    rich.estimate.paths = vec![
        measured(20.1, [1.5, 1.5]),
        measured(30.0, [1.5, 3.0]),
        measured(55.0, [1.0, 1.0]),
    ];
    poor.truth.link.as_mut().expect("known").paths = vec![true_path(0, 5.0, [1.5, 0.0])];
    log_of(vec![rich, poor])
}

#[test]
fn wrong_acceptances_ghosts_and_misses_all_count() {
    let mut log = two_sweeps();
    log.points = vec![
        point(0, 0, [3.0, 10.3, 1.1]), // off by 0.3 and 0.4
        point(0, 1, [0.0; 3]),
        point(0, 2, [0.0; 3]),
    ];
    let map = evaluate(&mut log, None).map;
    assert_eq!(log.sweeps[0].truth.matches, [Some(0), Some(1), None]);
    assert_eq!((map.accepted, map.ghosts), (3, 1));
    assert!(near(map.precision_first_order, 1.0 / 3.0));
    assert!(near(map.recall_first_order, 0.5) && near(map.measured_first_order, 0.5));
    assert!(near(map.point_median_m, 0.5) && near(map.point_rmse_m, 0.5));
    // Three points in the one sweep that had a first-order path.
    assert!(near(map.accepted_per_sweep, 3.0));
    assert_eq!(map.surface_median_m, None);
}

#[test]
fn a_point_on_a_mover_is_wrong_and_none_that_could_be_missed() {
    let figures = |kind: Option<&[Interaction]>| {
        let mut log = two_sweeps();
        let paths = &mut log.sweeps[0].truth.link.as_mut().expect("known").paths;
        paths[0].kind = kind.and_then(Kind::of);
        log.points = vec![point(0, 0, [3.0, 10.3, 1.1])];
        evaluate(&mut log, None).map
    };
    let (wall, mover) = (figures(None), figures(Some(&[Interaction::Mover])));
    assert!(near(wall.precision_first_order, 1.0) && near(wall.recall_first_order, 0.5));
    assert!(near(mover.precision_first_order, 0.0) && near(mover.recall_first_order, 0.0));
    assert_eq!((mover.ghosts, mover.point_median_m), (0, None));
    assert_eq!(
        (mover.accepted_kinds.get("M"), wall.accepted_kinds.get("R")),
        (Some(&1), Some(&1))
    );
    assert_eq!([wall, mover].map(|map| map.first_order.paths), [2, 1]);
}

#[test]
fn the_map_is_judged_against_the_surfaces() {
    let scene = wall_with_a_door();
    let mut log = two_sweeps();
    let voxel = |position_m| MapVoxel {
        position_m,
        covariance_trace_m2: 0.01,
        hits: 1,
    };
    // 0.1 m before the wall at the first reflection point, and 0.7 m behind it, far from both.
    log.map = vec![voxel([3.0, 9.9, 1.5]), voxel([0.5, 10.7, 2.5])];
    log.points = vec![point(0, 0, [3.0, 10.3, 1.5])];
    let map = evaluate(&mut log, Some(&scene)).map;
    assert!(near(map.surface_median_m, 0.4) && near(map.surface_rmse_m, 0.5));
    assert!(near(map.accepted_surface_median_m, 0.3));
    assert!(near(map.precision_0p2m, 0.5) && near(map.precision_0p5m, 0.5));
    // Two discs of 0.5 m radius, 0.5 m apart: their union is 2 pi r^2 less the lens r^2 (2 pi/3 - sqrt(3)/2); the disc
    // of sqrt(0.24) m that the map sees at 0.5 m lies in the first one, and a little of it in neither.
    let lit_m2 = map.completeness[1].lit_m2;
    let union_m2 = 0.25 * (std::f64::consts::PI * 4.0 / 3.0 + 0.75_f64.sqrt());
    assert!((lit_m2 / union_m2 - 1.0).abs() < 0.03, "{lit_m2} {union_m2}");
    let seen_m2 = std::f64::consts::PI * 0.24;
    let share = map.completeness_0p5m.expect("lit");
    assert!((share - seen_m2 / union_m2).abs() < 0.02, "{share}");
    assert_eq!(map.completeness_all_0p5m, Some(share));
    assert!(near(map.f_score_0p5m, 2.0 * 0.5 * share / (0.5 + share)));
    let patches: Vec<_> = map
        .completeness
        .iter()
        .map(|c| (c.patch_m, c.threshold_m))
        .collect();
    assert_eq!(patches, [(0.5, 0.2), (0.5, 0.5), (1.0, 0.2), (1.0, 0.5)]);
    assert_eq!(map.completeness[1].ceiling, 1.0);
}

/// A walk of `count` poses a quarter of a second apart along x, a metre a step, estimated by `guess`.
fn walk(count: u32, guess: impl Fn(u32, [f64; 3]) -> crate::flight_log::PoseEstimate) -> FlightLog {
    let mut log = log_of(Vec::new());
    for k in 0..count {
        let position_m = [f64::from(k), 0.1 * f64::from(k * k), 0.0];
        log.poses.push(PoseRecord {
            time_s: 0.25 * f64::from(k),
            estimate: Some(guess(k, position_m)),
            truth: Some(truth(position_m)),
        });
    }
    log
}

#[test]
fn a_rigid_motion_is_an_absolute_error_and_no_relative_one() {
    let turn = UnitQuaternion::from_euler_angles(0.0, 0.0, 0.2);
    let mut log = walk(12, |_, p| {
        let moved = turn * Vector3::from(p) + Vector3::new(3.0, -4.0, 0.0);
        let mut pose = estimate(moved.into());
        pose.quaternion_wb = [turn.w, turn.i, turn.j, turn.k];
        pose
    });
    let flown = evaluate(&mut log, None).trajectory;
    assert!(flown.position_rmse_m.expect("poses") > 3.0);
    assert!(
        near(flown.position_aligned_rmse_m, 0.0)
            && near(flown.rpe_rmse_m, 0.0)
            && near(flown.rpe_1s_rmse_m, 0.0)
    );
    let degrees = 0.2_f64.to_degrees();
    assert!(near(flown.attitude_rmse_deg, degrees) && near(flown.attitude_z_rmse_deg, degrees));
    assert!(near(flown.attitude_x_rmse_deg, 0.0) && near(flown.rpe_rmse_deg, 0.0));
}

#[test]
fn drift_grows_with_the_span_of_the_relative_error() {
    let mut log = walk(9, |k, [x, y, z]| {
        let mut pose = estimate([x, y + 0.02 * f64::from(k), z]);
        pose.velocity_m_per_s = [0.0, 0.3, 0.4];
        pose
    });
    let flown = evaluate(&mut log, None).trajectory;
    assert!(near(flown.rpe_rmse_m, 0.02), "{:?}", flown.rpe_rmse_m);
    assert!(
        near(flown.rpe_1s_rmse_m, 0.08),
        "four steps per second: {:?}",
        flown.rpe_1s_rmse_m
    );
    assert!(near(flown.position_max_m, 0.16) && near(flown.position_median_m, 0.08));
    assert!(near(flown.velocity_rmse_m_per_s, 0.5));
}

#[test]
fn alignment_takes_no_mirror_image() {
    // A mirrored track is no rigid motion of the true one, though a reflection would fit it exactly.
    let mut log = walk(12, |k, [x, y, _]| estimate([x, -y, 0.1 * f64::from(k % 3)]));
    for (k, record) in log.poses.iter_mut().enumerate() {
        record.truth.as_mut().expect("made with one").position_m[2] = 0.1 * (k % 3) as f64;
    }
    let aligned_m = evaluate(&mut log, None)
        .trajectory
        .position_aligned_rmse_m
        .expect("poses");
    assert!(aligned_m > 0.05, "{aligned_m}");
}

#[test]
fn clock_and_covariances() {
    let mut log = walk(4, |k, [x, y, z]| {
        let mut pose = estimate([x + 0.3, y, z + 0.4]);
        pose.position_covariance_m2 = [[0.25, 0.0, 0.0], [0.0, 0.25, 0.0], [0.0, 0.0, 0.25]];
        // Not positive definite: says nothing.
        pose.velocity_covariance_m2_per_s2 = [[0.0; 3]; 3];
        pose.clock_offset_s = Some(if k % 2 == 0 { 2e-9 } else { -2e-9 });
        pose
    });
    let found = evaluate(&mut log, None);
    assert!(near(found.clock.rmse_ns, 2.0) && near(found.clock.median_ns, 2.0));
    assert!(near(found.consistency.position_nees, 1.0 / 3.0));
    assert!(near(found.consistency.clock_nees, 4.0));
    assert!(near(found.consistency.attitude_nees, 0.0));
    assert_eq!(found.consistency.velocity_nees, None);
}

#[test]
fn settled_is_one_and_a_half_seconds_after_sight_came_back() {
    // Line of sight in sweeps 0..=1 and 4..=9, half a second apart from 0.5 s on.
    let mut log = log_of((0..12).map(|k| sweep(k, [0.0; 3])).collect());
    for sweep in &mut log.sweeps {
        if [0, 1, 4, 5, 6, 7, 8, 9].contains(&sweep.sweep) {
            sweep.truth.link.as_mut().expect("known").paths = vec![true_path(0, 5.0, [1.5, 0.0])];
        }
    }
    assert_eq!(visible_spans(&log), [(0.5, 1.0), (2.5, 5.0)]);
    let settled: Vec<f64> = evaluate(&mut log, None)
        .pose_errors
        .iter()
        .filter(|e| e.settled)
        .map(|e| e.time_s)
        .collect();
    // The sweep at 5.5 s has none, but that at 5 s still counts.
    assert_eq!(settled, [4.0, 4.5, 5.0, 5.5]);
}

#[test]
fn link_states_are_counted_where_both_are_known() {
    let mut log = log_of((0..4).map(|k| sweep(k, [0.0; 3])).collect());
    let state = |state| {
        Some(LinkEstimate {
            state,
            probabilities: None,
        })
    };
    // True: outage, LOS, LOS, unknown. Estimated: outage, LOS, first-order, LOS.
    for (k, told) in [0, 1, 2, 1].into_iter().enumerate() {
        log.sweeps[k].estimate.link = state(told);
        log.sweeps[k].estimate.los_used = k != 2;
        log.sweeps[k].truth.link.as_mut().expect("known").paths = match k {
            1 | 2 => vec![true_path(0, 5.0, [1.5, 0.0])],
            _ => Vec::new(),
        };
    }
    log.sweeps[3].truth.link = None;
    let states = evaluate(&mut log, None).link_state;
    assert!(near(states.accuracy, 2.0 / 3.0));
    assert_eq!(
        (
            states.confusion[0][0],
            states.confusion[1][1],
            states.confusion[1][2]
        ),
        (1, 1, 1)
    );
    assert_eq!(
        (states.los_used, states.los_used_wrongly, states.los_visible),
        (3, 1, 2)
    );
    assert_eq!(states.true_sweeps, [1, 2, 0, 0]);
}

#[test]
fn an_empty_log_has_no_figures() {
    let scene = wall_with_a_door();
    let found = evaluate(&mut log_of(Vec::new()), Some(&scene));
    assert_eq!(found, Evaluation::default());
}
