//! The whole filter on a made-up flight: start, lateness, wrong paths, the heading.

use nalgebra::Vector3;

use super::super::nominal::rotation;
use super::super::*;
use crate::constants::STANDARD_GRAVITY_M_PER_S2;
use crate::geometry::{Gmt, World};
use crate::inertial::ImuIncrement;

pub(super) const STEP_NS: u64 = 10_000_000;
pub(super) const SWEEP_NS: u64 = 500_000_000;

/// A hovering UAV that turns, 30 m from the GMT, its clock 40 m off and running off at 3 m/s.
pub(super) fn truth(time_ns: u64) -> Nominal {
    let t = time_ns as f64 * 1e-9;
    let mut state = Nominal::origin(time_ns, RadioModel::default().waveform.delay_period());
    state.position_m = Vector3::new(20.0, 18.0, 11.0);
    state.attitude = rotation(&Vector3::new(0.0, 0.0, 0.5 * t));
    state.clock_offset_m = state.delay_period.wrap_m(40.0 + 3.0 * t);
    state
}

fn gmt() -> Transmitter {
    Transmitter {
        position_m: Vector3::new(1.0, -2.0, 1.5),
        sigma_m: 0.02,
        attitude: Rotation::<Gmt, World, f64>::identity(),
        reach: crate::array::BeamReach::default(),
    }
}

pub(super) fn increment(start_ns: u64) -> ImuIncrement {
    let up = Vector3::new(0.0, 0.0, STANDARD_GRAVITY_M_PER_S2 as f32);
    ImuIncrement {
        start_ns,
        end_ns: start_ns + STEP_NS,
        delta_angle_rad: Vector3::new(0.0, 0.0, 0.005),
        delta_velocity_m_per_s: up * 0.01,
        delta_position_m: up * 0.5e-4,
        removed: ImuErrors::default(),
    }
}

pub(super) fn path(time_ns: u64) -> PathMeasurement {
    let (state, gmt) = (truth(time_ns), gmt());
    let way = gmt.position_m - state.position_m;
    let leaving = -way.normalize();
    PathMeasurement {
        c_tau_m: way.norm() + state.clock_offset_m,
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_vector(state.attitude.tr_mul(&way)).expect("apart"),
        aoa_sigma_rad: 1e-4,
        range_rate: None,
        departure: Some(FaceDirection {
            face: 0,
            cosines: [leaving.y, leaving.z],
            sigma: [1e-4; 2],
        }),
    }
}

pub(super) fn measurement(time_ns: u64, path: PathMeasurement) -> SweepMeasurement<'static> {
    SweepMeasurement {
        time_ns,
        gmt: gmt(),
        stop: (time_ns / SWEEP_NS / 2) as u32,
        line_of_sight: Some(path),
        self_consistent: false,
        contrary: None,
        reflections: &[],
        paths: &[],
        delta_ranges: true,
    }
}

/// Flies until `end_ns`; `change` may alter sweeps, `late_ns` is their processing time.
pub(super) fn flown(
    end_ns: u64,
    late_ns: u64,
    change: impl FnMut(u64, &mut Filter49, &mut SweepMeasurement<'static>),
) -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    fly(&mut filter, end_ns, late_ns, change);
    filter
}

/// The same with a filter that is given.
pub(super) fn fly(
    filter: &mut Filter49,
    end_ns: u64,
    late_ns: u64,
    change: impl FnMut(u64, &mut Filter49, &mut SweepMeasurement<'static>),
) {
    fly_from(filter, 0, end_ns, late_ns, change);
}

/// The same from a time on.
pub(super) fn fly_from(
    filter: &mut Filter49,
    start_ns: u64,
    end_ns: u64,
    late_ns: u64,
    mut change: impl FnMut(u64, &mut Filter49, &mut SweepMeasurement<'static>),
) {
    for now in (start_ns + STEP_NS..=end_ns).step_by(STEP_NS as usize) {
        filter.increment(&increment(now - STEP_NS));
        if now % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(now, truth(now).clock_offset_m);
        }
        let sweep_ns = now.saturating_sub(late_ns);
        if sweep_ns > 0 && sweep_ns.is_multiple_of(SWEEP_NS) {
            let mut sweep = measurement(sweep_ns, path(sweep_ns));
            change(sweep_ns, filter, &mut sweep);
            let _ = filter.sweep(&sweep);
        }
    }
}

pub(super) fn error_m(filter: &Filter49) -> f64 {
    (filter.nominal().position_m - truth(filter.nominal().time_ns).position_m).norm()
}

/// The line of sight as if the UAV were elsewhere: every number agrees but the place.
pub(super) fn seen_from(aside: Vector3<f64>, time_ns: u64) -> PathMeasurement {
    let state = truth(time_ns);
    let way = gmt().position_m - state.position_m - aside;
    let leaving = -way.normalize();
    PathMeasurement {
        c_tau_m: way.norm() + state.clock_offset_m,
        aoa: Direction::from_vector(state.attitude.tr_mul(&way)).expect("apart"),
        departure: Some(FaceDirection {
            face: 0,
            cosines: [leaving.y, leaving.z],
            sigma: [1e-4; 2],
        }),
        ..path(time_ns)
    }
}

#[test]
fn it_starts_from_nothing_within_five_sweeps() {
    let mut verdicts = heapless::Vec::<SweepVerdict, 8>::new();
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    assert!(filter.pose().is_none() && filter.health().starting);
    for now in (STEP_NS..=4_000_000_000).step_by(STEP_NS as usize) {
        filter.increment(&increment(now - STEP_NS));
        if now % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(now, truth(now).clock_offset_m);
        }
        if now.is_multiple_of(SWEEP_NS) {
            let _ = verdicts.push(filter.sweep(&measurement(now, path(now))));
        }
    }
    assert_eq!(verdicts[..4], [SweepVerdict::Waiting; 4]);
    assert_eq!(verdicts[4], SweepVerdict::Started);
    assert_eq!(verdicts[5..], [SweepVerdict::Accepted; 3]);
    let pose = filter.pose().expect("running");
    assert!(error_m(&filter) < 0.1, "{}", error_m(&filter));
    assert!((pose.attitude.matrix().map(f64::from) - truth(4_000_000_000).attitude).norm() < 5e-3);
    assert!(!filter.health().is_degraded());
    assert_eq!(pose.resets, 0);
}

#[test]
fn its_clock_tells_the_offset_of_the_sweep_in_hand_and_the_next_and_before_the_start_nothing() {
    let stray_m = 0.9;
    let mut filter = flown(2_000_000_000, 0, |_, _, _| {});
    assert_eq!(filter.clock_offset_m(2_000_000_000), None);
    fly_from(&mut filter, 2_000_000_000, 9_000_000_000, 0, |_, _, _| {});
    // The last exchange is a stray: two-way timing alone would have it.
    let _ = filter.two_way(9_000_000_000, truth(9_000_000_000).clock_offset_m + stray_m);
    for at_ns in [8_500_000_000, 9_000_000_000, 9_500_000_000] {
        let off_m = filter.clock_offset_m(at_ns).expect("running") - truth(at_ns).clock_offset_m;
        assert!(off_m.abs() < 0.1 * stray_m, "{at_ns}: {off_m} m");
    }
}

#[test]
fn lateness_changes_nothing() {
    let (prompt, late) = (
        flown(6_000_000_000, 0, |_, _, _| ()),
        flown(6_300_000_000, 300_000_000, |_, _, _| ()),
    );
    assert_eq!(prompt.nominal().time_ns, late.nominal().time_ns);
    // Bit for bit: the same steps at the same times.
    assert_eq!(prompt.nominal(), late.nominal());
    assert_eq!(prompt.covariance(), late.covariance());
    // The present is ahead of the horizon.
    let present = late.present().expect("running");
    assert_eq!(present.time_ns, 6_300_000_000);
    let turned = truth(present.time_ns).attitude;
    assert!((present.attitude.matrix().map(f64::from) - turned).norm() < 1e-2);
    // What comes from before the horizon is refused and counted.
    let mut late = late;
    assert_eq!(
        late.sweep(&measurement(5_500_000_000, path(5_500_000_000))),
        SweepVerdict::TooLate
    );
    assert_eq!(late.two_way(5_500_000_000, 0.0), TimingVerdict::TooLate);
    assert_eq!(late.counters().too_late, 2);
}

#[test]
fn a_single_wrong_path_is_rejected_and_a_run_of_five_is_ridden_out() {
    for run in [1, 5] {
        let mut worst: f64 = 0.0;
        let filter = flown(15_000_000_000, 0, |time_ns, filter, sweep| {
            if filter.is_running() {
                worst = worst.max(error_m(filter));
            }
            let sweep_number = time_ns / SWEEP_NS;
            if (20..20 + run).contains(&sweep_number)
                && let Some(path) = &mut sweep.line_of_sight
            {
                path.c_tau_m += 10.0;
            }
            if (21..21 + run).contains(&sweep_number) {
                assert!(filter.health().contested, "{time_ns}");
            }
        });
        assert!(worst < 0.2, "{run}: {worst}");
        assert_eq!(
            (filter.counters().rejected, filter.counters().refixes),
            (run as u32, 0)
        );
        assert!(!filter.health().is_degraded());
    }
}

#[test]
fn what_the_sensor_is_turned_by_is_taken_out() {
    // Half a degree: 85 mm/s^2 of gravity, and 4 mrad/s of the turn, about the wrong axes.
    let mounting = Vector3::new(0.008, -0.006, 0.007);
    let to_sensor = rotation(&mounting).transpose().map(|c| c as f32);
    let flown = |known: bool| {
        let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
        for now in (STEP_NS..=15_000_000_000).step_by(STEP_NS as usize) {
            let mut step = increment(now - STEP_NS);
            step.delta_angle_rad = to_sensor * step.delta_angle_rad;
            step.delta_velocity_m_per_s = to_sensor * step.delta_velocity_m_per_s;
            step.delta_position_m = to_sensor * step.delta_position_m;
            if known {
                filter.nominal.imu.mounting_rad = mounting.map(|c| c as f32);
            }
            filter.increment(&step);
            if now % SWEEP_NS == SWEEP_NS / 2 {
                let _ = filter.two_way(now, truth(now).clock_offset_m);
            }
            // Ten seconds in sight, five without.
            if now.is_multiple_of(SWEEP_NS) {
                let mut sweep = measurement(now, path(now));
                sweep.line_of_sight = sweep.line_of_sight.filter(|_| now <= 10_000_000_000);
                let _ = filter.sweep(&sweep);
            }
        }
        filter
    };
    let (known, learnt) = (flown(true), flown(false));
    assert!(error_m(&known) < 0.05, "{}", error_m(&known));
    // What is not known is a bias of force and rate until the motion changes, or the mounting: the covariance holds either.
    let (error, sigma) = (error_m(&learnt), learnt.sigma(POSITION));
    assert!(error < 3.0 * sigma, "{error} {sigma}");
}
