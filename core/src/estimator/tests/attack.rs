//! Timing and beacons that lie, though their signature is right: they are measurements like others.

extern crate std;

use std::println;

use nalgebra::Vector3;

use super::super::*;
use super::flight::{STEP_NS, SWEEP_NS, error_m, flown, fly, increment, measurement, path, seen_from, truth};
use crate::geometry::{Gmt, World};

const SECOND_NS: u64 = 1_000_000_000;

/// Flies until `end_ns`; `timing` says what an exchange errs by, `sight` whether the GMT is seen.
fn timed(
    end_ns: u64,
    timing: impl Fn(u64) -> f64,
    sight: impl Fn(u64) -> bool,
    seen: impl FnMut(u64, &Filter49),
) -> Filter49 {
    exchanged(end_ns, |now| Some(timing(now)), sight, seen)
}

/// The same; `None` is an exchange that does not arrive.
fn exchanged(
    end_ns: u64,
    timing: impl Fn(u64) -> Option<f64>,
    sight: impl Fn(u64) -> bool,
    mut seen: impl FnMut(u64, &Filter49),
) -> Filter49 {
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    for now in (STEP_NS..=end_ns).step_by(STEP_NS as usize) {
        filter.increment(&increment(now - STEP_NS));
        if now % SWEEP_NS == SWEEP_NS / 2
            && let Some(off_m) = timing(now)
        {
            let _ = filter.two_way(now, truth(now).clock_offset_m + off_m);
        }
        if now.is_multiple_of(SWEEP_NS) {
            let mut sweep = measurement(now, path(now));
            if !sight(now) {
                sweep.line_of_sight = None;
            }
            let _ = filter.sweep(&sweep);
            seen(now, &filter);
        }
    }
    filter
}

/// Error of the clock, m.
fn clock_m(filter: &Filter49) -> f64 {
    let period = filter.nominal().delay_period;
    period.wrap_m(filter.nominal().clock_offset_m - truth(filter.nominal().time_ns).clock_offset_m)
}

#[test]
fn timing_that_lies_is_refused_while_sweeps_agree_with_the_clock() {
    let mut flagged_ns = None;
    let lie = |now: u64| if now > 10 * SECOND_NS { 20.0 } else { 0.0 };
    let filter = timed(
        40 * SECOND_NS,
        lie,
        |_| true,
        |now, filter| {
            if now > 10 * SECOND_NS && filter.health().clock_contested {
                flagged_ns.get_or_insert(now);
            }
        },
    );
    let counters = filter.counters();
    println!(
        "clock {:.2} m, position {:.2} m off, {} steps, {} exchanges refused, flagged at {flagged_ns:?} ns",
        clock_m(&filter),
        error_m(&filter),
        counters.clock_steps,
        counters.timing_rejected
    );
    assert!(clock_m(&filter).abs() < 0.3 && error_m(&filter) < 0.3);
    // Six in agreement, and they are known to be the timing's own error.
    assert_eq!((counters.clock_steps, counters.timing_rejected), (0, 6));
    assert!(
        flagged_ns.is_some_and(|at| at <= 11 * SECOND_NS),
        "{flagged_ns:?}"
    );
    assert!(filter.health().clock_contested);
}

#[test]
fn without_sight_a_lie_shows_in_sigma_and_the_next_sweeps_see_through_it() {
    let lie = |now: u64| if now > 10 * SECOND_NS { 20.0 } else { 0.0 };
    let sight = |now: u64| !(9 * SECOND_NS..20 * SECOND_NS).contains(&now);
    let mut worst: f64 = 0.0;
    let filter = timed(30 * SECOND_NS, lie, sight, |_, filter| {
        if filter.is_running() {
            let pose = filter.pose().expect("running");
            worst = worst.max(clock_m(filter).abs() / f64::from(pose.clock.offset_sigma_m));
        }
    });
    println!(
        "clock {:.2} m, position {:.2} m off, {worst:.1} sigmas of the clock at worst, {} re-fixes",
        clock_m(&filter),
        error_m(&filter),
        filter.counters().refixes
    );
    assert!(worst < 3.5, "{worst}");
    assert!(clock_m(&filter).abs() < 0.5 && error_m(&filter) < 0.5);
}

#[test]
fn a_clock_that_steps_out_of_sight_is_followed_after_six_exchanges() {
    let step = |now: u64| if now > 10 * SECOND_NS { 20.0 } else { 0.0 };
    let mut stepped_ns = None;
    let filter = timed(
        20 * SECOND_NS,
        step,
        |now| now < 9 * SECOND_NS,
        |now, filter| {
            if filter.counters().clock_steps > 0 {
                stepped_ns.get_or_insert(now);
            }
        },
    );
    assert_eq!(stepped_ns, Some(13 * SECOND_NS));
    assert!((clock_m(&filter) - 20.0).abs() < 0.3, "{}", clock_m(&filter));
}

#[test]
fn a_first_exchange_that_lies_starts_nothing() {
    for lies in [1, 2] {
        let lie = |now: u64| if now < lies * SECOND_NS / 2 { 20.0 } else { 0.0 };
        let mut worst: f64 = 0.0;
        let filter = timed(
            10 * SECOND_NS,
            lie,
            |_| true,
            |_, filter| {
                if filter.is_running() {
                    worst = worst.max(error_m(filter));
                }
            },
        );
        println!("{lies} lies: position {worst:.2} m off at worst");
        assert!(filter.is_running() && worst < 0.3, "{lies} lies: {worst} m");
    }
}

/// Position error in standard deviations.
fn sigmas(filter: &Filter49) -> f64 {
    let pose = filter.pose().expect("running");
    let error = filter.nominal().position_m - truth(filter.nominal().time_ns).position_m;
    let inverse = pose
        .position_covariance_m2
        .map(f64::from)
        .try_inverse()
        .expect("a covariance");
    libm::sqrt((inverse * error).dot(&error))
}

#[test]
fn a_beacon_that_steps_by_20_m_is_refused_for_as_long_as_it_lies() {
    let (mut worst_m, mut worst, mut flagged) = (0.0_f64, 0.0_f64, 0);
    let filter = flown(90 * SECOND_NS, 0, |now, filter, sweep| {
        if now > 10 * SECOND_NS {
            sweep.gmt.position_m += Vector3::new(12.0, 16.0, 0.0);
            worst_m = worst_m.max(error_m(filter));
            worst = worst.max(sigmas(filter));
            flagged += u32::from(filter.health().beacon_implausible);
        }
    });
    println!("{worst_m:.2} m and {worst:.1} sigmas off at worst, flagged in {flagged} of 160 sweeps");
    assert!(worst_m < 3.0 && worst < 3.5, "{worst_m} m, {worst} sigmas");
    assert!(flagged >= 158 && filter.health().beacon_implausible, "{flagged}");
}

#[test]
fn a_mast_that_is_said_to_turn_is_refused() {
    let (mut worst_m, mut flagged) = (0.0_f64, 0);
    let _ = flown(30 * SECOND_NS, 0, |now, filter, sweep| {
        if now > 10 * SECOND_NS {
            sweep.gmt.attitude =
                Rotation::<Gmt, World, f64>::from_yaw_pitch_roll(0.3, 0.0, 0.0).expect("finite");
            worst_m = worst_m.max(error_m(filter));
            flagged += u32::from(filter.health().beacon_implausible);
        }
    });
    println!("{worst_m:.2} m off at worst, flagged in {flagged} of 40 sweeps");
    assert!(
        worst_m < 1.0 && flagged >= 38,
        "{worst_m} m, flagged in {flagged}"
    );
}

#[test]
fn a_gmt_that_was_carried_is_found_by_the_first_line_of_sight() {
    // Without anybody telling the UAV, 20 m away: the beacon and the line of sight agree.
    let carried = Vector3::new(-12.0, -16.0, 0.0);
    let filter = flown(20 * SECOND_NS, 0, |now, filter, sweep| {
        if now > 10 * SECOND_NS {
            sweep.gmt.position_m += carried;
            sweep.line_of_sight = Some(seen_from(-carried, now));
            assert!(now == 21 * SWEEP_NS || !filter.health().is_degraded(), "{now}");
        }
    });
    assert_eq!(filter.counters().beacons_refused, 0);
    assert!(error_m(&filter) < 0.1, "{}", error_m(&filter));
}

#[test]
fn a_beacon_that_is_wrong_from_the_start_is_seen_by_whoever_set_the_gmt_up() {
    let lie = Vector3::new(12.0, 16.0, 0.0);
    for setup in [None, Some(1.0)] {
        let mut config = FilterConfig::default();
        config.beacon.setup = setup.map(|within_m| Setup {
            position_m: Vector3::new(1.3, -2.2, 1.5),
            within_m,
        });
        let mut filter = Filter49::new(&RadioModel::default(), config, 0);
        let (mut worst, mut flagged) = (0.0_f64, 0);
        fly(&mut filter, 60 * SECOND_NS, 0, |_, filter, sweep| {
            sweep.gmt.position_m += lie;
            flagged += u32::from(filter.health().beacon_implausible);
            if filter.is_running() {
                worst = worst.max(sigmas(filter));
            }
        });
        println!("set up within {setup:?} m: {worst:.1} sigmas off, flagged in {flagged} of 119 sweeps");
        if setup.is_some() {
            assert!(worst < 3.5 && flagged == 119, "{worst} sigmas, {flagged}");
        } else {
            // Everything is as it would be if all of it were moved.
            assert!(
                (error_m(&filter) - 20.0).abs() < 0.1 && flagged == 0,
                "{}",
                error_m(&filter)
            );
        }
    }
}

#[test]
fn a_step_of_timing_that_an_unsure_clock_lets_pass_shows_in_sigma() {
    let lie = |now: u64| if now > 14 * SECOND_NS { 1.0 } else { 0.0 };
    let sight = |now: u64| !(10 * SECOND_NS..20 * SECOND_NS).contains(&now);
    let mut worst: f64 = 0.0;
    let filter = timed(40 * SECOND_NS, lie, sight, |now, filter| {
        if now >= 14 * SECOND_NS {
            worst = worst.max(sigmas(filter));
        }
    });
    println!(
        "{worst:.1} sigmas at worst, position {:.2} m off",
        error_m(&filter)
    );
    assert!(worst < 3.5, "{worst}");
}

#[test]
fn a_beacon_that_creeps_by_2_cm_a_second_is_flagged_and_shows_in_sigma() {
    let (mut flagged_ns, mut worst) = (None, 0.0_f64);
    let _ = flown(60 * SECOND_NS, 0, |now, filter, sweep| {
        let since_s = now.saturating_sub(10 * SECOND_NS) as f64 * 1e-9;
        sweep.gmt.position_m += Vector3::new(0.012, 0.016, 0.0) * since_s;
        if filter.health().beacon_implausible {
            flagged_ns.get_or_insert(now);
        }
        if filter.is_running() {
            worst = worst.max(sigmas(filter));
        }
    });
    println!("flagged at {flagged_ns:?} ns, {worst:.1} sigmas at worst");
    assert!(flagged_ns.is_some_and(|at| at < 22 * SECOND_NS), "{flagged_ns:?}");
    assert!(worst < 3.5, "{worst}");
}

#[test]
fn one_wrong_exchange_after_a_silence_does_not_make_timing_doubted() {
    // Out of sight, after a silence, a wrong exchange passes: the clock is unsure, and stays unsure enough for the next, which is right.
    let silent = 12 * SECOND_NS..15 * SECOND_NS;
    let timing = |now: u64| {
        let wrong = (15 * SECOND_NS..15 * SECOND_NS + SWEEP_NS).contains(&now);
        (!silent.contains(&now)).then_some(if wrong { 0.6 } else { 0.0 })
    };
    let sight = |now: u64| !(9 * SECOND_NS..20 * SECOND_NS).contains(&now);
    let filter = exchanged(22 * SECOND_NS, timing, sight, |now, filter| {
        println!(
            "{:.1} s clock {:.2} m, timing {:.2} m off, sigma {:.2} m, {} refused",
            now as f64 * 1e-9,
            clock_m(filter),
            filter.nominal().two_way_bias_m,
            filter.sigma(TWO_WAY_BIAS),
            filter.counters().timing_rejected
        );
    });
    assert_eq!(filter.counters().timing_rejected, 0);
    assert!(!filter.health().clock_contested);
    assert!(clock_m(&filter).abs() < 0.1, "{:.2} m", clock_m(&filter));
}

#[test]
fn timing_that_runs_off_faster_than_an_oscillator_shows_in_sigma_where_exchanges_stray() {
    // A stray one in sight, then out of sight the lie: 1.6 m/s, which no ramp comes to within seconds.
    let lie = |now: u64| match now {
        now if now < 12 * SECOND_NS => 0.0,
        now if now < 12 * SECOND_NS + SWEEP_NS => 2.0,
        now => 1.6 * now.saturating_sub(13 * SECOND_NS) as f64 * 1e-9,
    };
    let sight = |now: u64| now < 14 * SECOND_NS;
    let (mut worst, mut flagged) = (0.0_f64, false);
    let filter = timed(25 * SECOND_NS, lie, sight, |now, filter| {
        if now > 17 * SECOND_NS {
            let pose = filter.pose().expect("running");
            worst = worst.max(clock_m(filter).abs() / f64::from(pose.clock.offset_sigma_m));
            flagged |= filter.health().clock_contested;
        }
    });
    println!(
        "clock {:.2} m off, {worst:.1} sigmas at worst, flagged {flagged}, {:?}",
        clock_m(&filter),
        filter.counters()
    );
    assert!(worst < 4.5 && flagged, "{worst}, flagged {flagged}");
}

#[test]
fn strays_that_the_gate_lets_pass_do_not_run_the_clock_off() {
    // Out of sight two exchanges in a row are of a longer path; the next ones are right.
    let timing = |now: u64| {
        let stray = match now / SWEEP_NS {
            24 => 0.36,
            25 => 0.56,
            _ => 0.0,
        };
        Some(stray)
    };
    let sight = |now: u64| !(9 * SECOND_NS..18 * SECOND_NS).contains(&now);
    let mut worst_m = 0.0f64;
    let filter = exchanged(17 * SECOND_NS, timing, sight, |now, filter| {
        if now > 14 * SECOND_NS {
            worst_m = worst_m.max(clock_m(filter).abs());
        }
    });
    assert!(worst_m < 0.4, "{worst_m:.2} m");
    assert!(
        filter.nominal().two_way_bias_m.abs() < 0.05,
        "{:.2} m",
        filter.nominal().two_way_bias_m
    );
    assert!(clock_m(&filter).abs() < 0.15, "{:.2} m", clock_m(&filter));
}
