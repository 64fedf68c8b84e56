//! After an outage, and when sweeps contradict: what is believed, and what is fixed anew.

extern crate std;

use nalgebra::Vector3;

use super::super::nominal::rotation;
use super::super::*;
use super::flight::{STEP_NS, SWEEP_NS, error_m, flown, fly, increment, measurement, path, seen_from, truth};

#[test]
fn a_filter_that_is_wrong_is_fixed_anew() {
    let mut seen_lost = false;
    let filter = flown(20_000_000_000, 0, |time_ns, filter, _| {
        if time_ns == 20 * SWEEP_NS {
            // As after a captured fix: far off, and sure of it.
            filter.nominal.position_m += Vector3::new(8.0, -5.0, 3.0);
            filter.nominal.velocity_m_per_s += Vector3::new(1.0, 1.0, 0.0);
        }
        seen_lost |= filter.health().contested;
    });
    assert!(seen_lost);
    assert_eq!(filter.counters().refixes, 1, "{:?}", filter.counters());
    assert_eq!(filter.pose().map(|pose| pose.resets), Some(1));
    assert!(error_m(&filter) < 0.1, "{}", error_m(&filter));
}

/// What a wrong pose has taught of the accelerometer goes with it: a bias that is believed to the last outlives the re-fix otherwise, and
/// leads the next outage astray.
#[test]
fn a_pose_that_is_fixed_anew_learns_the_accelerometer_anew() {
    let mut worst_m = 0.0_f64;
    let filter = flown(45_000_000_000, 0, |time_ns, filter, sweep| {
        if time_ns == 20 * SWEEP_NS {
            filter.nominal.position_m += Vector3::new(8.0, -5.0, 3.0);
            filter.nominal.imu.accel_bias_m_per_s2 += Vector3::new(0.15, -0.1, 0.0);
            for i in 0..3 {
                filter.covariance.reset(ACCEL_BIAS + i, 1e-6);
            }
        }
        if (80..90).contains(&(time_ns / SWEEP_NS)) {
            sweep.line_of_sight = None;
            worst_m = worst_m.max(error_m(filter));
        }
    });
    assert_eq!(filter.counters().refixes, 1, "{:?}", filter.counters());
    let bias = filter.nominal.imu.accel_bias_m_per_s2;
    std::println!("{worst_m:.2} m off in an outage of 5 s, bias {bias:?}");
    assert!(worst_m < 0.4 && bias.norm() < 0.03, "{worst_m} m, {bias:?}");
}

/// Fixes that claim metres of scatter tell the attitude to tens of degrees: no start, and no re-fix.
#[test]
fn a_pose_that_would_be_lost_at_once_is_not_taken() {
    let filter = flown(10_000_000_000, 0, |_, _, sweep| {
        if let Some(departure) = sweep
            .line_of_sight
            .as_mut()
            .and_then(|path| path.departure.as_mut())
        {
            departure.sigma = [0.05; 2];
        }
    });
    assert!(!filter.is_running() && filter.health().starting);
}

/// The window holds no more than six fixes, whatever the patience.
#[test]
fn a_longer_patience_ends_as_well() {
    let mut config = FilterConfig::default();
    config.gates.refix_after = 9;
    let mut filter = Filter49::new(&RadioModel::default(), config, 0);
    fly(&mut filter, 20_000_000_000, 0, |time_ns, filter, _| {
        if time_ns == 20 * SWEEP_NS {
            filter.nominal.position_m += Vector3::new(8.0, -5.0, 3.0);
        }
    });
    let counters = filter.counters();
    assert!(counters.refixes == 1 && counters.rejected >= 8, "{counters:?}");
    assert!(error_m(&filter) < 0.1, "{}", error_m(&filter));
}

/// Sweeps whose departures lie: the place is set anew, if six in a row say so, but the attitude is known to a hundredth of what six fixes
/// tell of it.
#[test]
fn an_attitude_that_does_not_contradict_is_kept() {
    let filter = flown(13_000_000_000, 0, |time_ns, _, sweep| {
        if (20..26).contains(&(time_ns / SWEEP_NS)) {
            sweep.line_of_sight = Some(seen_from(Vector3::new(0.0, 4.0, 3.0), time_ns));
        }
    });
    assert_eq!(filter.counters().refixes, 1, "{:?}", filter.counters());
    assert!(filter.sigma(ATTITUDE) < 0.02, "{}", filter.sigma(ATTITUDE));
}

#[test]
fn an_attitude_that_is_wrong_is_found_anew() {
    let filter = flown(16_000_000_000, 0, |time_ns, filter, _| {
        if time_ns == 20 * SWEEP_NS {
            filter.nominal.attitude = rotation(&Vector3::new(0.2, -0.2, 0.3)) * filter.nominal.attitude;
        }
    });
    let counters = filter.counters();
    assert!(counters.refixes == 1 && counters.rejected >= 5, "{counters:?}");
    let turn = filter.nominal.attitude * truth(filter.nominal.time_ns).attitude.transpose();
    assert!((turn.trace() - 3.0).abs() < 1e-3, "{turn}");
}

/// Fixes of some metres tell an attitude so poorly that they do not contradict one that is wrong by nine degrees; their sights do.
#[test]
fn an_attitude_that_sights_contradict_is_found_anew() {
    let filter = flown(25_000_000_000, 0, |time_ns, filter, sweep| {
        let path = sweep.line_of_sight.as_mut();
        if let Some(departure) = path.and_then(|path| path.departure.as_mut())
            && time_ns >= 20 * SWEEP_NS
        {
            departure.sigma = [0.02; 2];
        }
        if time_ns == 20 * SWEEP_NS {
            filter.nominal.attitude = rotation(&Vector3::new(0.0, 0.0, 0.16)) * filter.nominal.attitude;
        }
    });
    let counters = filter.counters();
    assert!(counters.refixes >= 1 && counters.rejected >= 5, "{counters:?}");
    let turn = filter.nominal.attitude * truth(filter.nominal.time_ns).attitude.transpose();
    assert!((turn.trace() - 3.0).abs() < 1e-3, "{turn}");
}

#[test]
fn a_filter_that_is_not_sure_believes_a_path_that_proves_itself() {
    let mut verdicts = [SweepVerdict::NoSight; 2];
    for (verdict, self_consistent) in verdicts.iter_mut().zip([false, true]) {
        let mut filter = flown(12_000_000_000, 0, |time_ns, _, sweep| {
            if time_ns > 8_000_000_000 {
                sweep.line_of_sight = None;
            }
        });
        // An outage so long that a second sweep would have to agree.
        (0..3).for_each(|i| filter.covariance.add(POSITION + i, 0.3));
        filter.increment(&increment(12_000_000_000));
        let now = 12_000_000_000 + STEP_NS;
        let mut sweep = measurement(now, seen_from(Vector3::new(0.5, 0.0, 0.0), now));
        sweep.self_consistent = self_consistent;
        *verdict = filter.sweep(&sweep);
    }
    assert_eq!(verdicts, [SweepVerdict::Held, SweepVerdict::Accepted]);
}

#[test]
fn after_an_outage_one_sweep_is_no_proof() {
    // Blind from 10 s to 20 s; the first sweep after that sees the GMT from 3 m above, and nothing in it contradicts.
    let mut verdicts = heapless::Vec::<SweepVerdict, 4>::new();
    let mut filter = Filter49::new(&RadioModel::default(), FilterConfig::default(), 0);
    let aside = Vector3::new(0.0, 0.0, 3.0);
    for now in (STEP_NS..=22_000_000_000).step_by(STEP_NS as usize) {
        filter.increment(&increment(now - STEP_NS));
        if now % SWEEP_NS == SWEEP_NS / 2 {
            let _ = filter.two_way(now, truth(now).clock_offset_m);
        }
        if !now.is_multiple_of(SWEEP_NS) {
            continue;
        }
        let mut sweep = measurement(now, path(now));
        if (10_000_000_001..20_000_000_000).contains(&now) {
            sweep.line_of_sight = None;
        }
        if now == 20_000_000_000 {
            filter.covariance.add(POSITION, 20.0);
            filter.covariance.add(POSITION + 1, 20.0);
            filter.covariance.add(POSITION + 2, 20.0);
            sweep.line_of_sight = Some(seen_from(aside, now));
        }
        let verdict = filter.sweep(&sweep);
        if now >= 20_000_000_000 && verdicts.push(verdict).is_err() {
            break;
        }
    }
    assert_eq!(
        verdicts[..3],
        [SweepVerdict::Held, SweepVerdict::Held, SweepVerdict::Accepted],
        "{verdicts:?}"
    );
    assert!(error_m(&filter) < 0.2, "{}", error_m(&filter));
    assert_eq!(filter.counters().held, 2);
}

#[test]
fn after_an_outage_a_run_of_five_is_ridden_out_and_six_are_believed() {
    for run in [5, 6] {
        let (mut moved, mut worst) = (false, 0.0_f64);
        let filter = flown(22_000_000_000, 0, |time_ns, filter, sweep| {
            let sweep_number = time_ns / SWEEP_NS;
            if (20..30).contains(&sweep_number) {
                sweep.line_of_sight = None;
            }
            if sweep_number == 30 {
                (0..3).for_each(|axis| filter.covariance.add(POSITION + axis, 1.0));
            }
            if (30..30 + run).contains(&sweep_number) {
                sweep.line_of_sight = Some(seen_from(Vector3::new(0.0, 12.0, 9.0), time_ns));
            }
            moved |= filter.counters().refixes > 0;
            if sweep_number > 30 {
                worst = worst.max(error_m(filter));
            }
        });
        assert_eq!(moved, run == 6, "{:?}", filter.counters());
        // Moved, it takes as many to come back.
        assert!(
            (worst > 10.0) == moved && error_m(&filter) < 0.3,
            "{run}: {worst}"
        );
    }
}

#[test]
fn sights_after_an_outage_move_a_filter_that_seems_sure_the_sooner_the_less_they_contradict() {
    for (aside_m, refixed_at) in [(1.3, 3), (3.0, 6)] {
        let mut verdicts = heapless::Vec::<SweepVerdict, 8>::new();
        let mut filter = flown(12_000_000_000 - SWEEP_NS, 0, |time_ns, _, sweep| {
            if time_ns > 10_000_000_000 {
                sweep.line_of_sight = None;
            }
        });
        filter.nominal.position_m += Vector3::new(aside_m, 0.0, 0.0);
        for now in (12_000_000_000 - SWEEP_NS + STEP_NS..=14_500_000_000).step_by(STEP_NS as usize) {
            filter.increment(&increment(now - STEP_NS));
            if now.is_multiple_of(SWEEP_NS) {
                let mut sweep = measurement(now, path(now));
                // Proving itself does not help: a wrong path may.
                sweep.self_consistent = true;
                let _ = verdicts.push(filter.sweep(&sweep));
            }
        }
        let rejected = verdicts
            .iter()
            .take_while(|verdict| **verdict == SweepVerdict::Rejected);
        assert_eq!(rejected.count(), refixed_at - 1, "{verdicts:?}");
        assert_eq!(verdicts[refixed_at - 1], SweepVerdict::Refixed);
        assert!(error_m(&filter) < 0.3, "{aside_m}: {}", error_m(&filter));
    }
}
