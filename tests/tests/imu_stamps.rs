//! The driver of the inertial sensor against a chip after the data sheet: when was what it gives measured?
//!
//! The chip (`cslam_host_sim::sensors::ImuChip`) has a clock of its own that is off and drifts while it warms, and filters that hold
//! samples up. The board captures its edges to 100 ns and reads packets one by one and in bursts. A turn that swings slowly goes in;
//! what comes out is fitted to it in time.

use cslam_core::inertial::ImuSample;
use cslam_firmware::icm42688::packet::RATE_PER_CODE_RAD_PER_S;
use cslam_firmware::icm42688::{Fifo, Next, PACKET_LEN, RawSample, Samples, TRANSFER};
use cslam_host_sim::sensors::{ImuChip, ImuChipConfig};

/// How far a stamp may be off, s.
const LIMIT_S: f64 = 20e-6;
/// Length of a run, samples by the chip's clock, and of the windows in which the stamps are looked at.
const RUN: usize = 61_000;
const WINDOW: usize = 1000;

/// A slow swing, rad/s, that uses the range well; and how fast it changes.
const SWING_RAD_PER_S: f64 = 30.0;
const SWING_PER_S: f64 = 1.3;

fn swing(time_s: f64) -> f64 {
    SWING_RAD_PER_S * (SWING_PER_S * time_s).sin()
}

fn swing_slope(time_s: f64) -> f64 {
    SWING_RAD_PER_S * SWING_PER_S * (SWING_PER_S * time_s).cos()
}

/// Asks the driver for what has piled up.
fn read(fifo: &mut Fifo, waiting: &mut Vec<[u8; PACKET_LEN]>, edge_ns: u64, given: &mut Vec<ImuSample>) {
    let mut samples = Samples::new();
    loop {
        let asked = (fifo.request() - 4) / PACKET_LEN;
        let mut bytes = [0xff; TRANSFER];
        let [_, status, high, low, rest @ ..] = &mut bytes;
        *status = 0x04;
        [*high, *low] = (waiting.len() as u16).to_be_bytes();
        let read = waiting.drain(..asked.min(waiting.len()));
        for (place, packet) in rest.chunks_mut(PACKET_LEN).zip(read) {
            place.copy_from_slice(&packet);
        }
        let next = fifo.answer(&bytes, edge_ns, &mut samples);
        given.extend(&samples);
        match next {
            Next::Again => {}
            Next::Wait => return,
            other => panic!("{other:?}"),
        }
    }
}

/// The driver's samples of a run.
fn run(config: ImuChipConfig) -> Vec<ImuSample> {
    let mut chip = ImuChip::new(config);
    let mut fifo = Fifo::new();
    let (mut waiting, mut given) = (Vec::new(), Vec::new());
    // Until its filters are full nobody reads it.
    (0..100).for_each(|_| {
        chip.sample(swing);
    });
    for number in 0..RUN {
        let sample = chip.sample(swing);
        let code = (sample.value / RATE_PER_CODE_RAD_PER_S).round() as i32;
        let raw = RawSample {
            acceleration: [0, 0, 8192],
            rate: [code, 0, 0],
            temperature: 0,
            time_ticks: sample.stamp,
        };
        waiting.push(raw.to_packet());
        // Three times per second the processor comes seven samples late.
        if number % 333 < 326 {
            // By the timer, to its tick.
            let edge_ns = (sample.edge_s * 1e7) as u64 * 100;
            read(&mut fifo, &mut waiting, edge_ns, &mut given);
        }
    }
    let counters = fifo.counters();
    assert_eq!(
        (counters.lost, counters.damaged, counters.repeated),
        (0, 0, 0),
        "{config:?}: {counters:?}"
    );
    assert!(given.len() + 8 > RUN, "{config:?}: {} samples", given.len());
    given
}

/// By how much the stamps of a window are late, s: the shift in time that fits the samples to the swing best. A sample is the mean of
/// the interval between the stamp before it and its own.
fn late_s(window: &[ImuSample]) -> f64 {
    let (mut dot, mut square) = (0.0, 0.0);
    for (before, sample) in window.iter().zip(window.iter().skip(1)) {
        let middle_s = before.time_ns.midpoint(sample.time_ns) as f64 * 1e-9;
        let slope = swing_slope(middle_s);
        dot += (swing(middle_s) - f64::from(sample.rate_rad_per_s.x)) * slope;
        square += slope * slope;
    }
    dot / square
}

#[test]
fn stamps_are_within_20_us_of_when_it_was_measured_for_a_minute() {
    let mut worst_s = 0.0f64;
    for clock_error in [-0.015, 0.0, 0.015] {
        for clock_error_at_85_deg_c in [-0.02, 0.02] {
            let config = ImuChipConfig {
                clock_error,
                clock_error_at_85_deg_c,
                start_deg_c: -10.0,
                end_deg_c: 60.0,
                warming_s: 15.0,
                age_s: 1234.5,
            };
            let given = run(config);
            let windows: Vec<f64> = given.chunks_exact(WINDOW).map(late_s).collect();
            assert!(windows.len() >= 60, "{} seconds", windows.len());
            let worst = windows.iter().fold(
                0.0f64,
                |worst, late| if late.abs() > worst.abs() { *late } else { worst },
            );
            println!(
                "clock {:+.1} %, {:+.1} % more at 85 deg C: stamps late by up to {:+.1} us, in the first second {:+.1}, after a minute {:+.1}",
                clock_error * 100.0,
                clock_error_at_85_deg_c * 100.0,
                worst * 1e6,
                windows.first().copied().unwrap_or(f64::NAN) * 1e6,
                windows.last().copied().unwrap_or(f64::NAN) * 1e6,
            );
            worst_s = worst_s.max(worst.abs());
        }
    }
    assert!(
        worst_s < LIMIT_S,
        "stamps are off by up to {:.1} us",
        worst_s * 1e6
    );
}
