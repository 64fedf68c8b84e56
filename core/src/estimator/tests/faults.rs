//! The whole filter when something fails: clock, inertial data, beacon, numbers that are none.

use nalgebra::Vector3;

use super::super::*;
use super::flight::*;
use crate::inertial::{ImuStep, Motion};

#[test]
fn a_clock_step_is_taken_over_and_flagged() {
    for late in [0u64, 260_000_000] {
        let mut flagged_ns = None;
        let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
        let stepped = |now: u64| if now > 10_100_000_000 { 29.98 } else { 0.0 };
        for now in (STEP_NS..=14_000_000_000).step_by(STEP_NS as usize) {
            filter.increment(&increment(now - STEP_NS));
            if now % SWEEP_NS == SWEEP_NS / 2 {
                let _ = filter.two_way(now, truth(now).clock_offset_m + stepped(now));
            }
            let sweep_ns = now.saturating_sub(late);
            if sweep_ns > 0 && sweep_ns.is_multiple_of(SWEEP_NS) {
                let mut path = path(sweep_ns);
                path.c_tau_m += stepped(sweep_ns);
                let _ = filter.sweep(&measurement(sweep_ns, path));
                let health = filter.health();
                if sweep_ns > 10_100_000_000 && (health.contested || health.clock_contested) {
                    flagged_ns.get_or_insert(sweep_ns);
                }
            }
        }
        // Either the flag stood, or the step was understood at once; both within a second.
        assert!(flagged_ns.is_none_or(|at| at <= 11_100_000_000), "{flagged_ns:?}");
        assert_eq!(filter.counters().clock_steps, 1);
        assert!(error_m(&filter) < 0.05);
        let clock = filter.nominal().clock_offset_m - truth(filter.nominal().time_ns).clock_offset_m;
        assert!((clock - 29.98).abs() < 0.1, "{clock}");
    }
}

#[test]
fn a_clock_that_runs_at_another_rate_is_caught() {
    // From 10 s on the clock gains 1.5 m/s more, out of sight of the GMT: a change that no ramp explains.
    let gained = |now: u64| 1.5e-9 * now.saturating_sub(10_000_000_000) as f64;
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    for now in (STEP_NS..=16_000_000_000).step_by(STEP_NS as usize) {
        filter.increment(&increment(now - STEP_NS));
        if now % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(now, truth(now).clock_offset_m + gained(now));
        }
        if now.is_multiple_of(SWEEP_NS) {
            let mut sweep = measurement(now, path(now));
            if now > 10_000_000_000 {
                sweep.line_of_sight = None;
            }
            let _ = filter.sweep(&sweep);
        }
    }
    let state = filter.nominal();
    let clock = state.clock_offset_m - truth(state.time_ns).clock_offset_m - gained(state.time_ns);
    assert!(clock.abs() < 0.2, "{clock} m");
    assert!(
        (state.clock_drift_m_per_s - 4.5).abs() < 0.5,
        "{} m/s",
        state.clock_drift_m_per_s
    );
    // Set once, and then it knew better.
    assert_eq!(filter.counters().clock_steps, 1);
}

#[test]
fn missing_inertial_data_are_bridged_and_flagged() {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    let mut flagged = false;
    for now in (STEP_NS..=20_000_000_000).step_by(STEP_NS as usize) {
        let stopped = (10_000_000_000..13_000_000_000).contains(&now);
        if !stopped {
            filter.increment(&increment(now - STEP_NS));
        }
        if now % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(now, truth(now).clock_offset_m);
        }
        if now.is_multiple_of(SWEEP_NS) {
            let _ = filter.sweep(&measurement(now, path(now)));
            if stopped && now > 10_000_000_000 {
                assert!(filter.health().inertial_missing, "{now}");
                flagged = true;
            }
            // Wrong by metres only while it says so.
            let limit = if filter.health().is_degraded() { 2.0 } else { 0.5 };
            assert!(
                !filter.is_running() || error_m(&filter) < limit,
                "{now} {}",
                error_m(&filter)
            );
        }
    }
    assert!(flagged && !filter.health().is_degraded(), "{:?}", filter.health());
    assert!(error_m(&filter) < 0.1);
}

#[test]
fn what_is_guessed_since_the_horizon_is_in_the_doubt_of_the_present() {
    let mut filter = flown(6_000_000_000, 0, |_, _, _| ());
    let known = filter.present().expect("running");
    let (angle_variance_rad2, velocity_variance_m2_per_s2) = (0.01, 0.04);
    let guessed = ImuStep {
        increment: increment(6_000_000_000),
        motion: Motion::Coasting,
        angle_variance_rad2,
        velocity_variance_m2_per_s2,
    };
    filter.step(&guessed);
    let present = filter.present().expect("running");
    let grown = [
        present.attitude_covariance_rad2 - known.attitude_covariance_rad2,
        present.velocity_covariance_m2_per_s2 - known.velocity_covariance_m2_per_s2,
    ];
    for (grown, each) in grown
        .iter()
        .zip([angle_variance_rad2, velocity_variance_m2_per_s2])
    {
        assert!(
            (grown - Matrix3::identity() * each).norm() < 1e-3 * each,
            "{grown}"
        );
    }
    // Once the horizon has come this far, it says the same.
    let time_ns = guessed.increment.end_ns;
    let mut silent = measurement(time_ns, path(time_ns));
    silent.line_of_sight = None;
    let _ = filter.sweep(&silent);
    let reached = filter.pose().expect("running");
    assert_eq!(reached.time_ns, present.time_ns);
    let traces = [&present, &reached].map(|pose| {
        let (attitude, velocity) = (pose.attitude_covariance_rad2, pose.velocity_covariance_m2_per_s2);
        [attitude.trace(), velocity.trace()]
    });
    for (early, late) in traces[0].iter().zip(traces[1]) {
        assert!((early / late - 1.0).abs() < 0.1, "{traces:?}");
    }
}

#[test]
fn a_sensor_at_the_end_of_its_range_is_flagged_until_a_second_later() {
    for (angle_variance_rad2, velocity_variance_m2_per_s2, trouble) in [
        (0.0, 0.0, false),
        (1e-10, 1e-9, false),
        (1e-3, 0.0, true),
        (0.0, 0.1, true),
    ] {
        let mut filter = flown(6_000_000_000, 0, |_, _, _| ());
        filter.step(&ImuStep {
            increment: increment(6_000_000_000),
            motion: Motion::Measured,
            angle_variance_rad2,
            velocity_variance_m2_per_s2,
        });
        let mut flagged = heapless::Vec::<_, 8>::new();
        fly_from(
            &mut filter,
            6_000_000_000 + STEP_NS,
            8_000_000_000,
            0,
            |now, filter, _| {
                flagged
                    .push((now, filter.health().inertial_missing))
                    .expect("four sweeps");
            },
        );
        let ended = filter.health().inertial_missing;
        // The first of them sees the horizon before the step.
        let expected = [(6_500_000_000, false), (7_000_000_000, trouble)];
        assert_eq!(flagged[..2], expected);
        assert!(!ended);
    }
}

#[test]
fn a_lying_beacon_is_flagged_and_a_jump_not_followed() {
    // 5 m from one beacon to the next: the last possible place is kept.
    let mut flagged_at = None;
    let filter = flown(20_000_000_000, 0, |time_ns, filter, sweep| {
        if time_ns > 10_000_000_000 {
            sweep.gmt.position_m += Vector3::new(3.0, 4.0, 0.0);
        }
        if filter.health().beacon_implausible {
            flagged_at.get_or_insert(time_ns);
        }
        assert!(
            !filter.is_running() || error_m(filter) < 1.5,
            "{time_ns}: {}",
            error_m(filter)
        );
    });
    assert!(
        flagged_at.is_some_and(|at| at <= 11_000_000_000),
        "{flagged_at:?}"
    );
    assert!(filter.health().beacon_implausible);
    // 0.1 m/s: flagged before the pose has moved by 1.5 m.
    let mut moved_m = None;
    let filter = flown(40_000_000_000, 0, |time_ns, filter, sweep| {
        let drift_s = (time_ns.saturating_sub(10_000_000_000)) as f64 * 1e-9;
        sweep.gmt.position_m += Vector3::new(0.06, -0.08, 0.0) * drift_s;
        if filter.health().beacon_implausible {
            moved_m.get_or_insert(error_m(filter));
        }
    });
    assert!(moved_m.is_some_and(|moved| moved < 1.5), "{moved_m:?}");
    assert!(error_m(&filter) > 1.5, "the drift cannot be told from flight");
}

#[test]
fn numbers_that_are_none_are_refused() {
    let mut filter = flown(6_000_000_000, 0, |_, _, _| ());
    let before = *filter.nominal();
    let now = before.time_ns;
    let mut bad = increment(now);
    bad.delta_velocity_m_per_s.x = f32::NAN;
    filter.increment(&bad);
    assert_eq!(filter.two_way(now + 1, f64::INFINITY), TimingVerdict::NotFinite);
    let mut path = path(now);
    path.c_tau_m = f64::NAN;
    assert_eq!(filter.sweep(&measurement(now, path)), SweepVerdict::Rejected);
    let mut sweep = measurement(now, self::path(now));
    sweep.gmt.position_m.x = f64::NAN;
    let _ = filter.sweep(&sweep);
    assert!(filter.nominal().is_finite() && filter.covariance().is_sound());
    assert!(error_m(&filter) < 0.1);
}
