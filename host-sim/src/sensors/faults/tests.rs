//! Each fault does what it says, and nothing else.

use cslam_firmware::icm42688::RawSample;
use cslam_firmware::icm42688::packet::{ACCELERATION_CODE_MAX, RATE_CODE_MAX};

use super::*;
use crate::flight::FlightPlan;
use crate::scene::Scene;
use crate::sensors::{SensedFlight, SensorsConfig};

const SEED: u64 = 11;

fn plan() -> FlightPlan {
    let scene = Scene::load("street").expect("bundled");
    let config = crate::flight::FlightConfig {
        duration_s: 12.0,
        ..Default::default()
    };
    FlightPlan::plan(&scene, &config, SEED).expect("a flight")
}

/// Events of a sound flight and of the same with faults.
fn flown(faults: &str) -> (Vec<Stamped>, Vec<Stamped>) {
    let plan = plan();
    let fly = |faults: FaultsConfig| {
        let config = SensorsConfig {
            faults,
            ..SensorsConfig::default()
        };
        let flight = SensedFlight::new(plan.clone(), config, SEED).expect("sound figures");
        flight.events().collect::<Vec<_>>()
    };
    (
        fly(FaultsConfig::default()),
        fly(toml::from_str(faults).expect("valid")),
    )
}

fn imu(events: &[Stamped]) -> Vec<(f64, RawSample)> {
    let samples = events.iter().filter_map(|s| match s.event {
        Event::Imu(sample) => Some((s.uav_time_ns as f64 * 1e-9, sample)),
        _ => None,
    });
    samples.collect()
}

/// Events that are not of the inertial sensor.
fn others(events: &[Stamped]) -> Vec<Stamped> {
    let other = events.iter().filter(|s| !matches!(s.event, Event::Imu(_)));
    other.copied().collect()
}

#[test]
fn no_fault_is_no_change() {
    let (sound, faulty) = flown("");
    assert!(sound == faulty && sound.len() > 12_000);
}

#[test]
fn a_stopped_sensor_gives_nothing_for_its_time_only() {
    let (sound, faulty) = flown("[[imu]]\nkind = \"stop\"\nstart_s = 4.0\nduration_s = 1.5");
    let expected: Vec<_> = imu(&sound)
        .into_iter()
        .filter(|(t, _)| !(4.0..5.5).contains(t))
        .collect();
    assert_eq!(imu(&faulty), expected);
    assert_eq!(imu(&sound).len() - expected.len(), 1500);
    assert_eq!(others(&sound), others(&faulty));
}

#[test]
fn a_stuck_axis_repeats_and_the_others_go_on() {
    let (sound, faulty) =
        flown("[[imu]]\nkind = \"stick\"\nstart_s = 4.0\nduration_s = 1.0\naxis = \"gyro-z\"");
    let mut held = None;
    for ((t, a), (_, b)) in imu(&sound).into_iter().zip(imu(&faulty)) {
        if (4.0..5.0).contains(&t) {
            assert_eq!(b.rate[2], *held.get_or_insert(a.rate[2]), "{t}");
            assert_eq!(
                (a.rate[0], a.rate[1], a.acceleration),
                (b.rate[0], b.rate[1], b.acceleration)
            );
        } else {
            assert_eq!(a, b, "{t}");
        }
    }
}

#[test]
fn saturation_is_the_end_of_the_range() {
    let (_, faulty) = flown("[[imu]]\nkind = \"saturate\"\nstart_s = 4.0\nduration_s = 1.0");
    for (t, sample) in imu(&faulty) {
        let at_end = sample.rate.iter().all(|r| r.abs() == RATE_CODE_MAX)
            && sample
                .acceleration
                .iter()
                .all(|a| a.abs() == ACCELERATION_CODE_MAX);
        assert_eq!(at_end, (4.0..5.0).contains(&t), "{t}");
        assert_eq!(RawSample::from_packet(&sample.to_packet()), Ok(sample));
    }
}

#[test]
fn spikes_have_their_rate_and_hit_one_value() {
    let (sound, faulty) =
        flown("[[imu]]\nkind = \"spike\"\nstart_s = 1.0\nduration_s = 10.0\nspikes_per_s = 20.0");
    let mut spikes = 0;
    for ((t, a), (_, b)) in imu(&sound).into_iter().zip(imu(&faulty)) {
        let changed = (0..3).filter(|&i| a.rate[i] != b.rate[i]).count()
            + (0..3).filter(|&i| a.acceleration[i] != b.acceleration[i]).count();
        assert!(changed == 0 || (changed == 1 && (1.0..11.0).contains(&t)), "{t}");
        spikes += changed;
    }
    assert!((160..240).contains(&spikes), "{spikes}");
}

#[test]
fn a_beacon_lies_by_an_offset_and_a_drift() {
    let (sound, faulty) = flown(
        "[[beacon]]\nstart_s = 3.0\nduration_s = 5.0\noffset_m = [5.0, 0.0, 0.0]\ndrift_m_per_s = [0.0, 0.1, 0.0]",
    );
    let mut lies = 0;
    for (a, b) in others(&sound).iter().zip(others(&faulty)) {
        let (Event::Beacon(told), Event::Beacon(lied)) = (a.event, b.event) else {
            assert_eq!(*a, b);
            continue;
        };
        let t = told.gmt_time_s;
        let off = Vector3::from(lied.position_m) - Vector3::from(told.position_m);
        let expected = if (3.0..8.0).contains(&t) {
            lies += 1;
            Vector3::new(5.0, 0.1 * (t - 3.0), 0.0)
        } else {
            Vector3::zeros()
        };
        assert!((off - expected).norm() < 1e-12, "{t}: {off:?}");
    }
    assert_eq!(lies, 10);
    assert_eq!(imu(&sound), imu(&faulty));
}

#[test]
fn a_clock_step_is_in_stamps_exchanges_and_truth() {
    let config = |faults: &str| SensorsConfig {
        faults: toml::from_str(faults).expect("valid"),
        ..SensorsConfig::default()
    };
    let make = |faults: &str| SensedFlight::new(plan(), config(faults), SEED).expect("sound figures");
    let (sound, stepped) = (make(""), make("[[clock]]\nat_s = 6.0\nstep_ns = 100.0"));
    for (t, step) in [(5.9999, 0.0), (6.0, 1e-7), (11.0, 1e-7)] {
        let off = stepped.truth(t).clock_offset_s - sound.truth(t).clock_offset_s;
        assert!((off - step).abs() < 1e-18, "{t}: {off}");
        assert_eq!(stepped.truth(t).clock_drift, sound.truth(t).clock_drift);
    }
    let exchanges = |flight: &SensedFlight| {
        let timing = flight.events().filter_map(|s| match s.event {
            Event::Timing(sample) => Some((s.uav_time_ns, sample.clock_offset_s)),
            _ => None,
        });
        timing.collect::<Vec<_>>()
    };
    let mut after = 0;
    for ((ns_a, a), (ns_b, b)) in exchanges(&sound).into_iter().zip(exchanges(&stepped)) {
        let step = if ns_a < 6_000_000_000 { 0 } else { 100 };
        after += u32::from(step > 0);
        assert_eq!(ns_b, ns_a + step);
        assert!((b - a - step as f64 * 1e-9).abs() < 1e-15);
    }
    assert!(after > 5);
    // The inertial sensor ticks with the UAV clock: on time by it, a sample that is 100 ns short.
    let ticks = |flight: &SensedFlight| {
        flight
            .events()
            .filter(|s| matches!(s.event, Event::Imu(_)))
            .count()
    };
    assert_eq!(ticks(&sound), ticks(&stepped));
}

#[test]
fn a_wrong_fix_is_its_distance_away_in_one_direction() {
    let config: FaultsConfig =
        toml::from_str("[[fix]]\nsweep = 4\nsweeps = 3\ndistance_m = 10.0").expect("valid");
    let at = |sweep| wrong_fix_m(&config, sweep, SEED);
    assert!((at(4).norm() - 10.0).abs() < 1e-12);
    assert!(at(4) == at(5) && at(5) == at(6));
    assert!(at(3) == Vector3::zeros() && at(7) == Vector3::zeros());
    assert_ne!(at(4), wrong_fix_m(&config, 4, SEED + 1));
}

#[test]
fn lost_doubled_and_late_events_have_their_shares_and_keep_their_stamps() {
    let (sound, faulty) = flown(
        "[[transport]]\nevents = [\"imu\", \"timing\"]\nstart_s = 2.0\nduration_s = 8.0\nlost = 0.1\ndoubled = 0.2\nlate = 0.3\nlate_by_s = 0.05",
    );
    let mut left = sound.clone();
    let (mut doubled, mut late, mut newest_ns, mut latest_ns) = (0, 0, 0, 0);
    for event in &faulty {
        match left.iter().position(|other| other == event) {
            Some(place) => {
                left.remove(place);
            }
            None => doubled += 1,
        }
        if event.uav_time_ns < newest_ns {
            late += 1;
            latest_ns = latest_ns.max(newest_ns - event.uav_time_ns);
        }
        newest_ns = newest_ns.max(event.uav_time_ns);
    }
    // 8000 samples of the inertial sensor.
    assert!((700..900).contains(&left.len()), "{} lost", left.len());
    assert!((1450..1750).contains(&doubled), "{doubled} doubled");
    assert!((2200..2600).contains(&late), "{late} late");
    assert!(
        (49_000_000..52_000_000).contains(&latest_ns),
        "{latest_ns} ns late"
    );
    let touched = |s: &Stamped| matches!(s.event, Event::Imu(_) | Event::Timing(_));
    assert!(
        left.iter()
            .all(|s| touched(s) && (2_000_000_000..10_000_000_000).contains(&s.uav_time_ns))
    );
    // The rest is as it was, in order.
    let rest = |events: &[Stamped]| events.iter().filter(|s| !touched(s)).copied().collect::<Vec<_>>();
    assert_eq!(rest(&sound), rest(&faulty));
}

#[test]
fn the_same_seed_gives_the_same_faults() {
    let faults = "[[imu]]\nkind = \"spike\"\nstart_s = 0.0\nduration_s = 9.0\n[[transport]]\nevents = [\"imu\"]\nlost = 0.1";
    assert!(flown(faults).1 == flown(faults).1);
}

#[test]
fn paths_of_late_events_cannot_be_kept() {
    let config = SensorsConfig {
        faults: toml::from_str("[[transport]]\nevents = [\"beacon\"]\nlate = 0.5\nlate_by_s = 0.2")
            .expect("valid"),
        ..SensorsConfig::default()
    };
    let flight = SensedFlight::new(plan(), config, SEED).expect("sound figures");
    let error = crate::recording::check_order(&flight);
    let message = error.expect_err("must be refused").to_string();
    assert!(
        message.contains("world.sensors.faults.transport: with late events"),
        "{message}"
    );
}
