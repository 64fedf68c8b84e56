//! Faults of sensors, beacon and transport through the receiver that flies: rejected or ridden out, no number that is
//! none, and flagged within a second.
//!
//! Every flight is the same one outdoors at the error budget, made from samples once; faults begin when the pose has settled and line of sight
//! lasts. What is asserted is stated beside each fault; what was measured is printed.

mod flown;

use cslam_core::estimator::Health;

use flown::{Flown, fly, fly_wrong_fixes};

/// Checks what holds for every fault; prints the figures.
fn ridden(name: &str, flown: Flown) -> Flown {
    println!(
        "{name}: flagged after {:?} s; position before {:.2} m, worst {:.2} m, at the end {:.2} m; attitude {:.2}, {:.2}, \
         {:.2} deg; clock {:.2}, {:.2}, {:.2} ns",
        flown.flagged_after_s,
        flown.before.position_m,
        flown.worst.position_m,
        flown.end.position_m,
        flown.before.attitude_deg,
        flown.worst.attitude_deg,
        flown.end.attitude_deg,
        flown.before.clock_ns,
        flown.worst.clock_ns,
        flown.end.clock_ns,
    );
    assert!(flown.finite, "{name}: a number is not finite");
    assert!(
        flown.before.position_m < 0.5,
        "{name}: not settled before the fault"
    );
    flown
}

/// Flies with a fault and checks what holds for every fault.
fn ride(name: &str, faults: &str, flagged: impl Fn(&Health) -> bool) -> Flown {
    ridden(name, fly(faults, flagged))
}

/// The fault was flagged within a second, and ten seconds later the pose is as good as it was.
fn ridden_out(flown: &Flown, worst_m: f64) {
    assert!(
        flown.flagged_after_s.is_some_and(|after| after <= 1.0),
        "{:?}",
        flown.flagged_after_s
    );
    as_good_as_before(flown, worst_m);
}

/// Ten seconds after the fault the pose is as good as it was.
fn as_good_as_before(flown: &Flown, worst_m: f64) {
    assert!(
        flown.worst.position_m < worst_m,
        "{} m at worst",
        flown.worst.position_m
    );
    assert!(
        flown.end.position_m < 0.5,
        "{} m at the end",
        flown.end.position_m
    );
    assert!(
        flown.end.attitude_deg < 1.0,
        "{} deg at the end",
        flown.end.attitude_deg
    );
}

#[test]
fn without_a_fault_no_flag() {
    let flown = ride("none", "", |health| {
        health.inertial_missing || health.beacon_implausible
    });
    assert_eq!(flown.flagged_after_s, None);
    assert_eq!(flown.taken, [true; 3]);
    assert!(flown.worst.position_m < 0.5);
}

#[test]
fn an_inertial_sensor_that_stops() {
    for duration in ["0.5", "2.0"] {
        let faults = format!("[[imu]]\nkind = \"stop\"\nstart_s = @T\nduration_s = {duration}");
        let flown = ride(&format!("stop for {duration} s"), &faults, |health| {
            health.inertial_missing
        });
        assert_eq!(flown.counters.imu_stops, 1);
        ridden_out(&flown, 1.0);
    }
}

#[test]
fn an_inertial_sensor_that_sticks() {
    for axis in ["all", "gyro-z"] {
        let faults = format!("[[imu]]\nkind = \"stick\"\nstart_s = @T\nduration_s = 1.0\naxis = \"{axis}\"");
        let flown = ride(&format!("stick, {axis}"), &faults, |health| {
            health.inertial_missing
        });
        assert!(flown.counters.imu_stuck > 900, "{}", flown.counters.imu_stuck);
        ridden_out(&flown, 1.0);
    }
}

#[test]
fn an_inertial_sensor_that_saturates() {
    for axis in ["all", "gyro-x", "accel-z"] {
        let faults =
            format!("[[imu]]\nkind = \"saturate\"\nstart_s = @T\nduration_s = 0.5\naxis = \"{axis}\"");
        let flown = ride(&format!("saturation, {axis}"), &faults, |health| {
            health.inertial_missing
        });
        assert!(
            flown.counters.imu_saturated > 400,
            "{}",
            flown.counters.imu_saturated
        );
        ridden_out(&flown, 1.0);
    }
}

#[test]
fn an_inertial_sensor_that_spikes() {
    let faults = "[[imu]]\nkind = \"spike\"\nstart_s = @T\nduration_s = 8.0\nspikes_per_s = 10.0";
    let flown = ride("spikes", faults, |_| false);
    // Some of 80 fall on a motion that is as quick.
    assert!(flown.counters.imu_spikes > 60, "{}", flown.counters.imu_spikes);
    as_good_as_before(&flown, 1.0);
}

#[test]
fn a_clock_that_steps_by_100_ns() {
    let faults = "[[clock]]\nat_s = @T\nstep_ns = 100.0";
    let flown = ride("clock step", faults, |health| {
        health.clock_contested || health.contested
    });
    ridden_out(&flown, 2.0);
    assert!(flown.end.clock_ns < 2.0);
}

#[test]
fn a_beacon_that_lies_by_5_m() {
    let faults = "[[beacon]]\nstart_s = @T\nduration_s = 5.0\noffset_m = [3.0, -4.0, 0.0]";
    let flown = ride("beacon 5 m off", faults, |health| health.beacon_implausible);
    ridden_out(&flown, 1.5);
}

#[test]
fn a_beacon_that_drifts_by_0_1_m_per_s() {
    let faults = "[[beacon]]\nstart_s = @T\nduration_s = 60.0\ndrift_m_per_s = [0.06, 0.08, 0.0]";
    let flown = ride("beacon drift", faults, |health| health.beacon_implausible);
    // The pose follows the beacon by 0.1 m/s: flagged before that is 1.5 m.
    let moved = flown.flagged_after_s.map_or(f64::INFINITY, |after| 0.1 * after);
    assert!(moved < 1.5, "{moved} m");
    assert!(flown.at_flag.is_some_and(|figures| figures.position_m < 1.5));
}

#[test]
fn timing_that_is_20_m_off_from_the_start() {
    let faults = "[[timing]]\nstart_s = 0.0\nduration_s = 1e9\noffset_ns = 66.7";
    let flown = fly(faults, |health| health.clock_contested);
    println!("timing 20 m off from the start: {flown:?}");
    // Motion has found it.
    as_good_as_before(&flown, 1.0);
    assert!(flown.flagged_after_s.is_some_and(|after| after <= 1.0) && flown.end.clock_ns < 2.0);
}

#[test]
fn fixes_that_are_10_m_off() {
    let flown = ridden("3 fixes 10 m off", fly_wrong_fixes());
    // Not one of them has moved the pose.
    as_good_as_before(&flown, 1.0);
    assert_eq!(flown.taken, [false; 3]);
}

#[test]
fn events_that_are_lost_doubled_or_late() {
    let faults = "[[transport]]\nevents = [\"imu\"]\nstart_s = @T\nlost = 0.02\ndoubled = 0.02\nlate = 0.02\nlate_by_s = 0.004\n\
         [[transport]]\nevents = [\"timing\", \"beacon\"]\nstart_s = @T\nlost = 0.2\ndoubled = 0.1\nlate = 0.2\nlate_by_s = 0.3";
    let flown = ride("transport", faults, |_| false);
    assert!(flown.worst.position_m < 1.5 && flown.end.position_m < 0.6);
    let counters = &flown.counters;
    assert!(
        counters.imu_missing > 100 && counters.imu_refused > 200,
        "{counters:?}"
    );
}
