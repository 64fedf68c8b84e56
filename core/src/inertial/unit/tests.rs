//! Faults of the sensor, one by one: what comes out, how soon it is flagged, and what it costs the motion.

mod sensor;

use std::println;
use std::vec::Vec;

use self::sensor::{Outcome, Sensor, run};
use super::*;

extern crate std;

const MS: u64 = 1_000_000;
const G: f32 = 9.80665;

#[test]
fn a_sound_sensor_gives_a_step_every_ten_milliseconds_and_no_flag() {
    let outcome = run(|_, sample| Some(sample));
    assert_eq!(outcome.steps.len(), 200);
    assert!(outcome.is_seamless() && outcome.flagged_ms.is_none());
    assert_eq!((outcome.sums().1, outcome.sums().2), (0.0, 0.0));
    assert!((outcome.sums().0 - 1.0).abs() < 1e-3, "{}", outcome.sums().0);
    assert_eq!(
        *outcome.imu.counters(),
        ImuCounters {
            used: 2000,
            ..ImuCounters::default()
        }
    );
}

#[test]
fn a_stopped_sensor_is_flagged_and_coasted_over() {
    let outcome = run(|ms, sample| (!(500..1500).contains(&ms)).then_some(sample));
    println!("stop at 500 ms flagged at {:?}", outcome.flagged_ms);
    assert!(outcome.flagged_ms.is_some_and(|ms| (550..=570).contains(&ms)));
    assert!(outcome.is_seamless());
    assert!(
        (1000..=1002).contains(&outcome.coasted_ms()),
        "{}",
        outcome.coasted_ms()
    );
    let (angle, angle_variance, velocity_variance) = outcome.sums();
    // Half a radian was turned while nobody measured, and the variance says that this may be.
    assert!(
        (angle - 0.5).abs() < 0.01 && (0.2..0.3).contains(&angle_variance),
        "{angle} {angle_variance}"
    );
    assert!((3.5..4.5).contains(&velocity_variance));
    assert_eq!(outcome.imu.counters().stops, 1);
    let missing = outcome.imu.counters().missing;
    assert!((999..=1001).contains(&missing), "{missing}");
    assert!(outcome.imu.health(2000 * MS).stopped && outcome.imu.health(2500 * MS).stopped);
}

#[test]
fn a_stop_without_a_clock_is_seen_by_the_next_sample() {
    let (mut imu, mut sensor) = (Imu::new(ImuConfig::default()), Sensor(1));
    let mut steps = Vec::new();
    for ms in (0..105).chain(900..921) {
        steps.extend(imu.push(&sensor.at(ms * MS)));
    }
    let coasting: Vec<_> = steps.iter().filter(|s| s.motion == Motion::Coasting).collect();
    assert_eq!(coasting.len(), 1);
    assert_eq!(
        (coasting[0].increment.start_ns, coasting[0].increment.end_ns),
        (104 * MS, 900 * MS)
    );
    assert!(
        steps
            .windows(2)
            .all(|p| p[0].increment.end_ns == p[1].increment.start_ns)
    );
    assert_eq!((imu.counters().stops, imu.counters().missing), (1, 795));
}

#[test]
fn a_stuck_sensor_is_coasted_over_after_twenty_repeats() {
    let mut held = None;
    let outcome = run(|ms, sample| {
        let stuck = (500..1000).contains(&ms);
        let value = if stuck {
            *held.get_or_insert(sample)
        } else {
            sample
        };
        Some(ImuSample {
            time_ns: sample.time_ns,
            ..value
        })
    });
    assert_eq!(outcome.flagged_ms, Some(519));
    assert!(outcome.is_seamless() && outcome.coasted_ms() >= 480);
    assert_eq!(outcome.imu.counters().stuck, 481);
    assert!(outcome.sums().1 > 0.1);
    assert!(outcome.imu.health(1000 * MS).stuck && outcome.imu.health(2040 * MS).is_sound());
}

#[test]
fn one_stuck_axis_is_enough() {
    let outcome = run(|ms, mut sample| {
        if ms >= 700 {
            sample.rate_rad_per_s.y = 0.0125;
        }
        Some(sample)
    });
    assert_eq!(outcome.flagged_ms, Some(719));
    assert_eq!(outcome.steps.last().map(|s| s.motion), Some(Motion::Coasting));
}

#[test]
fn an_axis_that_jumps_to_full_scale_is_coasted_over() {
    let config = ImuConfig::default();
    let outcome = run(|ms, mut sample| {
        if (500..700).contains(&ms) {
            sample.rate_rad_per_s.x = config.rate_limit_rad_per_s + 0.02;
        }
        Some(sample)
    });
    // Three samples pass for spikes.
    assert_eq!(
        (outcome.flagged_ms, outcome.imu.counters().saturated),
        (Some(500), 197)
    );
    assert_eq!(outcome.coasted_ms(), 197);
    assert!(outcome.imu.health(1000 * MS).saturated && outcome.is_seamless());
    let (_, angle_variance, velocity_variance) = outcome.sums();
    assert!((angle_variance - 0.25 * 0.197).abs() < 1e-3, "{angle_variance}");
    assert!(
        (velocity_variance - 4.0 * 0.197).abs() < 1e-2,
        "{velocity_variance}"
    );
    // Nothing of 35 rad/s has got into the motion.
    let turned: f32 = outcome.steps.iter().map(|s| s.increment.delta_angle_rad.x).sum();
    assert!(turned.abs() < 2e-3, "{turned}");
}

#[test]
fn a_clipped_motion_is_used_flagged_and_doubted() {
    let config = ImuConfig::default();
    let outcome = run(|ms, mut sample| {
        // A shaking that grows to 1.2 times the range at 20 Hz.
        let size = 1.2 * config.force_limit_m_per_s2 * ((ms as f32 - 300.0) / 1000.0).clamp(0.0, 1.0);
        let force = &mut sample.specific_force_m_per_s2.x;
        *force += size * libm::sinf(0.02 * core::f32::consts::PI * 2.0 * ms as f32);
        *force = force.clamp(-config.force_limit_m_per_s2, config.force_limit_m_per_s2);
        Some(sample)
    });
    let counters = outcome.imu.counters();
    assert!(counters.saturated > 100 && counters.spikes == 0, "{counters:?}");
    assert_eq!(outcome.coasted_ms(), 0);
    let (_, angle_variance, velocity_variance) = outcome.sums();
    let expected = 4e-3 * counters.saturated as f32;
    assert!(angle_variance == 0.0 && (velocity_variance - expected).abs() < 1e-3 * expected);
    assert!(outcome.imu.health(2000 * MS).saturated);
}

#[test]
fn spikes_are_ridden_out() {
    let clean = run(|_, sample| Some(sample));
    let mut count = 0;
    let spiked = run(|ms, mut sample| {
        if ms % 97 == 50 {
            count += 1;
            sample.rate_rad_per_s.z = -30.0;
            sample.specific_force_m_per_s2.x = 150.0;
        }
        Some(sample)
    });
    assert_eq!(spiked.flagged_ms, Some(50));
    assert_eq!((count, spiked.imu.counters().spikes), (21, 21));
    let (a, b) = (clean.sums(), spiked.sums());
    println!("turned by {} and with {count} spikes by {}", a.0, b.0);
    // Twenty-one spikes of 30 ms rad/s would be 0.64 rad.
    assert!((a.0 - b.0).abs() < 2e-4 && b.1 == 0.0);
    let push = |o: &Outcome| {
        o.steps
            .iter()
            .map(|s| s.increment.delta_velocity_m_per_s.x)
            .sum::<f32>()
    };
    assert!((push(&clean) - push(&spiked)).abs() < 5e-3);
    assert!(spiked.imu.health(2000 * MS).spiking);
}

#[test]
fn lost_doubled_and_late_samples_cost_little() {
    let clean = run(|_, sample| Some(sample));
    let mut imu = Imu::new(ImuConfig::default());
    let mut sensor = Sensor(7);
    let mut steps = Vec::new();
    let mut late = None;
    for ms in 0..=2000u64 {
        let sample = sensor.at(ms * MS);
        match ms % 50 {
            7 => {}
            23 => late = Some(sample),
            24 => {
                steps.extend(imu.push(&sample));
                steps.extend(late.take().and_then(|old| imu.push(&old)));
            }
            40 => {
                steps.extend(imu.push(&sample));
                steps.extend(imu.push(&sample));
            }
            _ => steps.extend(imu.push(&sample)),
        }
    }
    let counters = imu.counters();
    assert_eq!((counters.missing, counters.late, counters.repeated), (80, 40, 40));
    assert!(imu.health(2000 * MS).is_sound());
    let angle: f32 = steps.iter().map(|s| s.increment.delta_angle_rad.z).sum();
    assert!((angle - clean.sums().0).abs() < 2e-4, "{angle}");
    // Bridged: 80 gaps of a millisecond, each with little doubt.
    let doubt: f32 = steps.iter().map(|s| s.angle_variance_rad2).sum();
    assert!(doubt > 0.0 && doubt < 1e-8, "{doubt}");
}

#[test]
fn numbers_that_are_none_are_bridged() {
    let outcome = run(|ms, mut sample| {
        match ms % 100 {
            10 => sample.rate_rad_per_s.y = f32::NAN,
            60 => sample.specific_force_m_per_s2.z = f32::INFINITY,
            _ => {}
        }
        Some(sample)
    });
    assert_eq!(
        (outcome.imu.counters().invalid, outcome.imu.counters().missing),
        (40, 40)
    );
    assert!((outcome.sums().0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_clock_set_back_begins_anew_and_errors_change_between_steps_only() {
    let (mut imu, mut sensor) = (Imu::new(ImuConfig::default()), Sensor(3));
    let errors = ImuErrors {
        gyro_bias_rad_per_s: Vector3::new(0.0, 0.0, 0.5),
        ..ImuErrors::default()
    };
    let mut steps = Vec::new();
    for ms in 5000..=5030 {
        if ms == 5015 {
            imu.set_errors(errors);
        }
        steps.extend(imu.push(&sensor.at(ms * MS)));
    }
    let removed: Vec<_> = steps.iter().map(|s| s.increment.removed).collect();
    assert_eq!(removed, [ImuErrors::default(), ImuErrors::default(), errors]);
    assert!(steps[1].increment.delta_angle_rad.z > 4e-3 && steps[2].increment.delta_angle_rad.z.abs() < 1e-4);
    for ms in 10..=20 {
        steps.extend(imu.push(&sensor.at(ms * MS)));
    }
    assert_eq!((imu.counters().restarts, steps.len()), (1, 4));
    assert_eq!(
        (steps[3].increment.start_ns, steps[3].increment.end_ns),
        (10 * MS, 20 * MS)
    );
}

#[test]
fn a_step_can_be_ended_early() {
    let (mut imu, mut sensor) = (Imu::new(ImuConfig::default()), Sensor(3));
    assert!(imu.finish_step().is_none());
    for ms in 0..=3 {
        assert!(imu.push(&sensor.at(ms * MS)).is_none());
    }
    let step = imu.finish_step().expect("three milliseconds");
    assert_eq!((step.increment.start_ns, step.increment.end_ns), (0, 3 * MS));
    assert!((step.increment.delta_velocity_m_per_s.z - 3e-3 * G).abs() < 2e-4);
    assert!(imu.finish_step().is_none());
    assert_eq!(imu.newest_ns(), Some(3 * MS));
}

/// A measurement just after a few lost samples: the motion up to it is bridged, not unknown.
#[test]
fn samples_lost_just_before_a_measurement_are_bridged_to_it() {
    for lost_ms in [0, 1, 4, 49] {
        let (mut sensor, mut imu) = (Sensor(7), Imu::new(ImuConfig::default()));
        let mut steps = Vec::new();
        let mut last_ms = 0;
        for ms in (0..=1000).filter(|ms| ms + lost_ms <= 700 || *ms > 700) {
            if ms > 700 && last_ms <= 700 {
                // Half a sample after the place of the last one.
                steps.extend(imu.finish_step_at(700 * MS + MS / 2));
                let ended = steps.last().map(|step: &ImuStep| step.increment.end_ns);
                let expected = if lost_ms == 0 { 700 * MS } else { 700 * MS + MS / 2 };
                assert_eq!(ended, Some(expected), "{lost_ms} lost");
            }
            last_ms = ms;
            steps.extend(imu.push(&sensor.at(ms * MS)));
        }
        steps.extend(imu.finish_step());
        let outcome = Outcome {
            imu,
            steps,
            flagged_ms: None,
        };
        let (angle, ..) = outcome.sums();
        assert!(outcome.is_seamless());
        assert_eq!(outcome.coasted_ms(), 0, "{lost_ms} lost");
        assert!((angle - 0.5).abs() < 2e-3, "{lost_ms} lost: {angle}");
    }
}

/// Beyond the longest gap the sensor has stopped, whoever asks.
#[test]
fn a_stopped_sensor_is_not_bridged_to_a_measurement() {
    let (mut sensor, mut imu) = (Sensor(7), Imu::new(ImuConfig::default()));
    for ms in 0..=100 {
        let _ = imu.push(&sensor.at(ms * MS));
    }
    let ended = imu
        .finish_step_at(100 * MS + 51 * MS)
        .map(|step| step.increment.end_ns);
    assert!(ended.is_none_or(|ended| ended <= 100 * MS));
}
