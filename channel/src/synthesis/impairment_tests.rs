//! Each impairment changes what it should, and nothing else.

mod jamming;

use std::f64::consts::{PI, TAU};

use cslam_core::geometry::{Direction, Vector3};

use super::probe::{Fit, block, fits, noiseless, one_path, response};
use super::*;
use crate::paths::Link;

const LENGTH_M: f64 = 55.5;
const ARRIVAL: [f64; 2] = [1.3, 0.7];
/// Beam that looks towards the departure.
const BEAM: u16 = 12;

fn link() -> Link {
    one_path(LENGTH_M, ARRIVAL, [1.5, 0.1])
}

fn config(impairments: Impairments, noise: bool) -> ChannelConfig {
    let mut config = noiseless(impairments);
    config.front_end.noise = noise;
    config
}

fn sweep_at(impairments: Impairments, noise: bool, instant: &Instant) -> (Simulator, Sweep) {
    let simulator = Simulator::new(config(impairments, noise), 3);
    let sweep = simulator.sweep(&link(), instant, 0).expect("complete path");
    (simulator, sweep)
}

fn sweep(impairments: Impairments) -> (Simulator, Sweep) {
    sweep_at(impairments, false, &Instant::at_rest())
}

fn ideal() -> Sweep {
    sweep(Impairments::none()).1
}

fn wrap(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

/// What one impairment did to the channels of a beam, against the ideal front end.
struct Change {
    delay_s: Vec<f64>,
    phase_rad: Vec<f64>,
    ratio: Vec<f64>,
}

fn change(sweep: &Sweep, beam: u16) -> Change {
    let ideal = ideal();
    let [a, b]: [Vec<Fit>; 2] = [sweep, &ideal].map(|s| fits(block(s, beam)));
    let pairs = || a.iter().zip(&b);
    Change {
        delay_s: pairs().map(|(a, b)| a.delay_s - b.delay_s).collect(),
        phase_rad: pairs().map(|(a, b)| (a.amplitude / b.amplitude).arg()).collect(),
        ratio: pairs()
            .map(|(a, b)| a.amplitude.norm() / b.amplitude.norm())
            .collect(),
    }
}

fn all_near(values: &[f64], expected: impl Fn(usize) -> f64, tolerance: f64, what: &str) {
    for (c, value) in values.iter().enumerate() {
        let error = value - expected(c);
        let error = if what.contains("phase") {
            wrap(error)
        } else {
            error
        };
        assert!(
            error.abs() < tolerance,
            "{what}, channel {c}: {value}, expected {}",
            expected(c)
        );
    }
}

/// Delays to 0.1 ps (30 um), phases to 0.5 mrad, amplitudes to 0.05 %.
const DELAY: f64 = 1e-13;
const PHASE: f64 = 5e-4;
const RATIO: f64 = 5e-4;

#[test]
fn element_phase_turns_each_channel_by_its_error() {
    let (simulator, sweep) = sweep(Impairments {
        uav_element_phase_rms_deg: 2.0,
        ..Impairments::none()
    });
    let c = change(&sweep, BEAM);
    let error = |c: usize| simulator.device().uav_element[c / 8][c % 8].arg();
    assert!((0..32).any(|c| error(c).abs() > 0.03));
    all_near(&c.phase_rad, error, PHASE, "phase");
    all_near(&c.delay_s, |_| 0.0, DELAY, "delay");
    all_near(&c.ratio, |_| 1.0, RATIO, "ratio");
}

#[test]
fn axis_error_changes_the_phase_slope_of_its_array() {
    let (simulator, sweep) = sweep(Impairments {
        uav_axis_rms_deg: 0.5,
        ..Impairments::none()
    });
    let c = change(&sweep, BEAM);
    let u: Direction<cslam_core::geometry::World, f64> =
        Direction::from_zenith_azimuth(ARRIVAL[0], ARRIVAL[1]).expect("angles");
    let ideal = cslam_core::array::UavArrays::<f64>::default();
    let slope = |j: usize| {
        let (a, [along, across]) = (ideal.arrays()[j], simulator.device().uav_axis_rad[j]);
        // First order in the error, which is a hundredth of a radian.
        PI * (a.normal * along + a.normal.cross(&a.axis) * across).dot(u.vector())
    };
    assert!((0..4).any(|j| slope(j).abs() > 0.01));
    all_near(
        &c.phase_rad,
        |c| slope(c / 8) * ((c % 8) as f64 - 3.5),
        2e-3,
        "phase",
    );
    all_near(&c.delay_s, |_| 0.0, DELAY, "delay");
    all_near(&c.ratio, |_| 1.0, RATIO, "ratio");
}

#[test]
fn array_delay_moves_its_array() {
    let (simulator, sweep) = sweep(Impairments {
        uav_array_delay_rms_ps: 50.0,
        ..Impairments::none()
    });
    let c = change(&sweep, BEAM);
    let error = |c: usize| simulator.device().uav_delay_s[c / 8];
    assert!((0..32).any(|c| error(c).abs() > 20e-12));
    all_near(&c.delay_s, error, DELAY, "delay");
    all_near(&c.phase_rad, |_| 0.0, PHASE, "phase");
    all_near(&c.ratio, |_| 1.0, RATIO, "ratio");
}

#[test]
fn free_array_phases_are_common_to_an_array_and_new_in_every_beam() {
    let (_, sweep) = sweep(Impairments {
        free_array_phase: true,
        ..Impairments::none()
    });
    let (c, next) = (change(&sweep, BEAM), change(&sweep, BEAM + 1));
    all_near(
        &c.phase_rad,
        |k| c.phase_rad[k / 8 * 8],
        PHASE,
        "phase inside an array",
    );
    let apart = |a: f64, b: f64| wrap(a - b).abs() > 0.01;
    assert!((0..3).all(|j| apart(c.phase_rad[8 * j], c.phase_rad[8 * j + 8])));
    assert!((0..4).all(|j| apart(c.phase_rad[8 * j], next.phase_rad[8 * j])));
    all_near(&c.delay_s, |_| 0.0, DELAY, "delay");
    all_near(&c.ratio, |_| 1.0, RATIO, "ratio");
}

#[test]
fn clock_offset_adds_to_every_delay() {
    let offset_s = 2.345e-9;
    let (_, sweep) = sweep(Impairments {
        clock_offset_s: offset_s,
        ..Impairments::none()
    });
    let c = change(&sweep, BEAM);
    all_near(&c.delay_s, |_| offset_s, DELAY, "delay");
    all_near(&c.phase_rad, |_| 0.0, PHASE, "phase");
    all_near(&c.ratio, |_| 1.0, RATIO, "ratio");
}

#[test]
fn clock_drift_grows_over_the_sweep() {
    // 1 ppm: 4 ps a beam, so the waves are made anew several times; the instant's clock counts like the parameter.
    let (_, sweep) = sweep_at(
        Impairments {
            clock_drift: 4e-7,
            ..Impairments::none()
        },
        false,
        &Instant {
            clock_drift: 6e-7,
            ..Instant::at_rest()
        },
    );
    for beam in [0, 5, 6, BEAM, 13, 40, 71] {
        let c = change(&sweep, beam);
        let late_s = 1e-6 * f64::from(beam) * 1024.0 / 245.76e6;
        all_near(&c.delay_s, |_| late_s, 2e-13, "delay");
        all_near(&c.phase_rad, |_| 0.0, PHASE, "phase");
        all_near(&c.ratio, |_| 1.0, 2e-3, "ratio");
    }
}

/// The samples turn by `shift_hz` over time, from the sweep's first sample on.
fn assert_turned(sweep: &Sweep, shift_hz: f64) {
    let ideal = ideal();
    for beam in [0, 7, BEAM] {
        let [a, b] = [sweep, &ideal].map(|s| block(s, beam));
        let (mut worst, scale) = (0.0_f64, libm::exp2(f64::from(a.exponent - b.exponent)));
        for c in [0, 9, 31] {
            let peak = b.samples[c]
                .iter()
                .map(|x| f64::from(x.power()).sqrt())
                .fold(0.0, f64::max);
            for (n, (x, y)) in a.samples[c].iter().zip(&b.samples[c]).enumerate() {
                let complex = |x: &cslam_core::signal::Iq| C64::new(f64::from(x.re()), f64::from(x.im()));
                let time_s = (f64::from(beam) * 1024.0 + n as f64) / 245.76e6;
                let turned = complex(y) * cslam_core::array::phasor(TAU * shift_hz * time_s);
                worst = worst.max((complex(x) * scale - turned).norm() / peak);
            }
        }
        assert!(worst < 2e-3, "beam {beam}: {worst}");
    }
}

#[test]
fn carrier_offset_turns_all_samples_in_time() {
    let (_, sweep) = sweep(Impairments {
        cfo_hz: 30e3,
        ..Impairments::none()
    });
    assert_turned(&sweep, 30e3);
}

#[test]
fn doppler_is_the_closing_speed_in_wavelengths() {
    let (_, sweep) = sweep_at(
        Impairments::none(),
        false,
        &Instant {
            velocity_m_per_s: Vector3::new(8.0, -3.0, 1.0),
            gmt_velocity_m_per_s: Vector3::new(0.0, 2.0, 0.0),
            ..Instant::at_rest()
        },
    );
    let unit = |[zenith, azimuth]: [f64; 2]| {
        let (s, c) = zenith.sin_cos();
        Vector3::new(s * azimuth.cos(), s * azimuth.sin(), c)
    };
    let closing = Vector3::new(8.0, -3.0, 1.0).dot(&unit(ARRIVAL)) + 2.0 * unit([1.5, 0.1]).y;
    assert_turned(&sweep, closing * 30e9 / 299_792_458.0);
}

#[test]
fn a_lost_beam_is_absent_and_the_others_are_untouched() {
    let at_rest = Instant::at_rest();
    let (_, all) = sweep_at(Impairments::none(), true, &at_rest);
    let dropped = Impairments {
        dropped_beams: vec![4, 70],
        ..Impairments::none()
    };
    let (_, some) = sweep_at(dropped, true, &at_rest);
    let kept: Vec<_> = all
        .blocks
        .iter()
        .filter(|b| b.beam != 4 && b.beam != 70)
        .cloned()
        .collect();
    assert_eq!(some.blocks, kept);

    let chance = Impairments {
        dropped_beam_probability: 0.3,
        ..Impairments::none()
    };
    let (_, some) = sweep_at(chance, true, &at_rest);
    // 72 draws at 0.3: 21.6 +- 3.9.
    assert!(
        (5..=40).contains(&(72 - some.blocks.len())),
        "{} left",
        some.blocks.len()
    );
    assert!(some.blocks.iter().all(|b| all.blocks.contains(b)));
}

#[test]
fn a_dead_channel_is_zero_and_the_others_are_untouched() {
    let at_rest = Instant::at_rest();
    let (_, all) = sweep_at(Impairments::none(), true, &at_rest);
    // Channel 20 looks away from the path: it does not set the gain.
    let dead = Impairments {
        dead_channels: vec![20],
        ..Impairments::none()
    };
    let (_, dead) = sweep_at(dead, true, &at_rest);
    let (a, b) = (block(&dead, BEAM), block(&all, BEAM));
    assert_eq!(a.exponent, b.exponent);
    for c in 0..32 {
        let zero = a.samples[c].iter().all(|x| x.word() == 0);
        assert_eq!(zero, c == 20, "channel {c}");
        assert!(c == 20 || a.samples[c] == b.samples[c], "channel {c}");
    }
}

fn power(samples: &[[f64; 2]]) -> f64 {
    samples.iter().map(|[re, im]| re * re + im * im).sum::<f64>() / samples.len() as f64
}

#[test]
fn gmt_element_phases_change_the_beams_and_nothing_at_the_receiver() {
    let (_, sweep) = sweep(Impairments {
        gmt_element_phase_rms_deg: 5.0,
        ..Impairments::none()
    });
    let (c, off) = (change(&sweep, BEAM), change(&sweep, 0));
    for c in [&c, &off] {
        all_near(&c.ratio, |_| c.ratio[0], RATIO, "ratio");
        all_near(&c.phase_rad, |_| c.phase_rad[0], PHASE, "phase");
        all_near(&c.delay_s, |_| 0.0, DELAY, "delay");
    }
    // On the peak, coherent loss exp(-sigma^2/2) within its scatter; in a side lobe, much more.
    assert!(
        (c.ratio[0] - 1.0).abs() < 0.02 && (c.ratio[0] - 1.0).abs() > 1e-4,
        "{}",
        c.ratio[0]
    );
    assert!((off.ratio[0] - 1.0).abs() > 0.01, "{}", off.ratio[0]);
}

#[test]
fn gmt_element_delays_move_the_wave_as_a_whole() {
    let (simulator, sweep) = sweep(Impairments {
        gmt_element_delay_rms_ps: 20.0,
        ..Impairments::none()
    });
    let c = change(&sweep, BEAM);
    // On the peak all elements weigh alike but for the small angle off it: the mean of the face's 64 delays, 2.5 ps rms.
    let mean_s = simulator.device().gmt_delay_s[0].iter().sum::<f64>() / 64.0;
    all_near(&c.delay_s, |_| c.delay_s[0], DELAY, "delay");
    assert!(
        (c.delay_s[0] - mean_s).abs() < 1.5e-12,
        "{} {mean_s}",
        c.delay_s[0]
    );
    all_near(&c.phase_rad, |_| 0.0, 2e-3, "phase");
    all_near(&c.ratio, |_| 1.0, 2e-3, "ratio");
}

#[test]
fn the_converter_width_and_the_offset_do_what_they_say() {
    let mut narrow = config(Impairments::none(), false);
    narrow.front_end.adc_bits = 8;
    let sweep = Simulator::new(narrow, 3)
        .sweep(&link(), &Instant::at_rest(), 0)
        .expect("path");
    assert!(
        block(&sweep, BEAM)
            .samples
            .iter()
            .flatten()
            .all(|x| x.re() & 255 == 0 && x.im() & 255 == 0)
    );

    let mut louder = config(Impairments::none(), false);
    louder.front_end.snr_offset_db = 20.0 * 2_f64.log10();
    let louder = Simulator::new(louder, 3)
        .sweep(&link(), &Instant::at_rest(), 0)
        .expect("path");
    let (a, b) = (block(&louder, BEAM), ideal());
    assert_eq!(a.exponent, block(&b, BEAM).exponent + 1);
    assert_eq!(a.samples, block(&b, BEAM).samples);
}
