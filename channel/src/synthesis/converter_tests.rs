//! Oscillators, mixers, converters and neighbours reach the samples, alone and as their formulas say.

use std::f64::consts::{PI, TAU};

use cslam_core::geometry::{Body, Direction};

use super::antenna::{phasor, phasor_of_turns};
use super::effects::carrier_offset::CarrierOffset;
use super::effects::rotors::Rotors;
use super::probe::{block, fit, noiseless, one_path, response};
use super::spectrum::Transform;
use super::*;
use crate::paths::Link;

const SEED: u64 = 11;
/// Beam that looks towards the departure.
const BEAM: u16 = 12;

fn link() -> Link {
    one_path(55.5, [1.3, 0.7], [1.5, 0.1])
}

fn simulator(impairments: Impairments) -> Simulator {
    Simulator::new(noiseless(impairments), SEED)
}

fn sweep_of(link: &Link, impairments: Impairments) -> Sweep {
    let sweep = simulator(impairments).sweep(link, &Instant::at_rest(), 0);
    sweep.expect("complete path")
}

fn sweep(impairments: Impairments) -> Sweep {
    sweep_of(&link(), impairments)
}

/// Samples of a channel in a beam, sqrt(W).
fn samples(sweep: &Sweep, beam: u16, channel: usize) -> [C64; 512] {
    let block = block(sweep, beam);
    let scale = libm::ldexp(1.0, block.exponent);
    block.samples[channel].map(|x| C64::new(f64::from(x.re()), f64::from(x.im())) * scale)
}

fn rms(samples: &[C64]) -> f64 {
    (samples.iter().map(|x| x.norm_sqr()).sum::<f64>() / samples.len() as f64).sqrt()
}

fn receiver(receiver: ReceiverErrors) -> Impairments {
    Impairments {
        receiver,
        ..Impairments::none()
    }
}

/// A tone so strong that nothing else counts.
fn loud_tone(impairments: Impairments, bins: f64) -> Sweep {
    sweep(Impairments {
        jammer: Some(Jammer {
            offset_hz: bins * 480e3,
            ..Jammer::tone(0.0)
        }),
        ..impairments
    })
}

#[test]
fn the_image_of_a_tone_stands_in_the_opposite_bin() {
    let with = receiver(ReceiverErrors {
        iq_gain_rms_db: 0.3,
        iq_phase_rms_deg: 2.0,
        ..ReceiverErrors::default()
    });
    let imbalance = effects::quadrature::Quadrature::draw(&with.receiver, 32, SEED).expect("an image");
    let heard = loud_tone(with, 37.0);
    for channel in [0, 3, 7] {
        let mut x = samples(&heard, BEAM, channel);
        Transform::new().forward(&mut x);
        let image = x[512 - 37] / x[37].conj();
        let k = imbalance.0[channel];
        assert!(k.norm() > 3e-3 && (image - k).norm() < 2e-4, "{image} {k}");
    }
}

#[test]
fn leakage_is_a_constant_under_full_scale() {
    let with = receiver(ReceiverErrors {
        leakage_dbfs: Some(-35.0),
        ..ReceiverErrors::default()
    });
    let (with, without) = (sweep(with), sweep(Impairments::none()));
    assert_eq!(block(&with, BEAM).exponent, block(&without, BEAM).exponent);
    let full_scale = libm::ldexp(32_768.0, block(&with, BEAM).exponent);
    for channel in 0..32 {
        let (a, b) = (samples(&with, BEAM, channel), samples(&without, BEAM, channel));
        let first = a[0] - b[0];
        assert!((20.0 * libm::log10(first.norm() / full_scale) + 35.0).abs() < 0.05);
        // Rounding moves either by half a step.
        let worst = a
            .iter()
            .zip(&b)
            .map(|(a, b)| (a - b - first).norm())
            .fold(0.0, f64::max);
        assert!(worst < 3.0 * full_scale / 32_768.0, "{worst}");
    }
}

#[test]
fn effective_bits_are_noise_of_that_converter() {
    let with = receiver(ReceiverErrors {
        effective_bits: Some(7.5),
        ..ReceiverErrors::default()
    });
    let (with, without) = (sweep(with), sweep(Impairments::none()));
    let lsb = libm::ldexp(1.0, block(&with, BEAM).exponent);
    let all: Vec<C64> = (0..32)
        .flat_map(|c| {
            let (a, b) = (samples(&with, BEAM, c), samples(&without, BEAM, c));
            (0..512).map(move |n| a[n] - b[n])
        })
        .collect();
    // Both components.
    let expected = lsb * libm::exp2(16.0 - 7.5) / 6_f64.sqrt();
    assert!(
        (rms(&all) / expected - 1.0).abs() < 0.02,
        "{} {expected}",
        rms(&all)
    );
    // What a converter has anyway is not added.
    let own = receiver(ReceiverErrors {
        effective_bits: Some(16.0),
        ..ReceiverErrors::default()
    });
    assert_eq!(sweep(own), without);
    // A dead channel stays dead.
    let dead = Impairments {
        dead_channels: vec![5],
        ..receiver(ReceiverErrors {
            effective_bits: Some(7.5),
            leakage_dbfs: Some(-35.0),
            ..ReceiverErrors::default()
        })
    };
    assert_eq!(rms(&samples(&sweep(dead), BEAM, 5)), 0.0);
}

#[test]
fn jitter_is_noise_by_the_slope_of_the_band() {
    let with = |aperture_jitter_ps| {
        sweep(receiver(ReceiverErrors {
            aperture_jitter_ps,
            ..ReceiverErrors::default()
        }))
    };
    let clean = sweep(Impairments::none());
    assert_eq!(with(0.0), clean);
    let jittered = with(100.0);
    let mut errors_db = Vec::new();
    for channel in 0..16 {
        let (a, b) = (samples(&jittered, BEAM, channel), samples(&clean, BEAM, channel));
        let error: Vec<C64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
        errors_db.push(20.0 * libm::log10(rms(&error) / rms(&b)));
    }
    // 416 subcarriers of 480 kHz, flat: 57.6 MHz rms.
    let expected_db = 20.0 * libm::log10(TAU * 57.64e6 * 100e-12);
    let mean_db = errors_db.iter().sum::<f64>() / 16.0;
    assert!((mean_db - expected_db).abs() < 0.1, "{mean_db} {expected_db}");
    // A shift of all instants by as much has the error of that power: the wave's own slope.
    let shifted = sweep(Impairments {
        clock_offset_s: 100e-12,
        ..Impairments::none()
    });
    let (a, b) = (samples(&shifted, BEAM, 3), samples(&clean, BEAM, 3));
    let error: Vec<C64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    let slope_db = 20.0 * libm::log10(rms(&error) / rms(&b));
    assert!((slope_db - expected_db).abs() < 0.15, "{slope_db} {expected_db}");
    // Both noises are one: what is drawn for the bits stays.
    let both = sweep(receiver(ReceiverErrors {
        effective_bits: Some(7.5),
        aperture_jitter_ps: 1e-3,
        ..ReceiverErrors::default()
    }));
    let bits = sweep(receiver(ReceiverErrors {
        effective_bits: Some(7.5),
        ..ReceiverErrors::default()
    }));
    let (a, b) = (samples(&both, BEAM, 2), samples(&bits, BEAM, 2));
    let error: Vec<C64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
    assert!(rms(&error) < 1e-3 * rms(&b));
}

#[test]
fn phase_noise_turns_the_elements_of_an_array_alike() {
    let with = Impairments {
        oscillators: Oscillators {
            phase_noise: true,
            ..Oscillators::default()
        },
        ..Impairments::none()
    };
    let (with, without) = (sweep(with), sweep(Impairments::none()));
    let turns = |beam: u16, channel: usize| -> Vec<f64> {
        let (a, b) = (samples(&with, beam, channel), samples(&without, beam, channel));
        let level = rms(&b);
        a.iter()
            .zip(&b)
            .filter(|(_, b)| b.norm() > 0.5 * level)
            .map(|(a, b)| (a / b).arg())
            .collect()
    };
    let (first, same, other) = (turns(BEAM, 0), turns(BEAM, 6), turns(BEAM, 9));
    let apart = |a: &[f64], b: &[f64]| {
        let n = a.len().min(b.len()) as f64;
        (a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / n).sqrt()
    };
    assert!(apart(&first, &same) < 1e-3 && apart(&first, &other) > 5e-3);
    // Steps from sample to sample: what the spectrum has, of two oscillators.
    let mut steps = Vec::new();
    for beam in 0..72 {
        let turns = turns(beam, 0);
        let mean = turns.iter().sum::<f64>() / turns.len() as f64;
        steps.extend(turns.iter().map(|t| (t - mean).powi(2)));
    }
    let rms = (steps.iter().sum::<f64>() / steps.len() as f64).sqrt();
    // Beyond 240 kHz one oscillator has 0.036 rad; the block's mean takes a part of that, slower noise adds to it.
    assert!((0.04..0.08).contains(&rms), "{rms}");
}

#[test]
fn a_drawn_carrier_offset_turns_the_samples_and_moves_the_clock() {
    let set = Oscillators {
        offset_rms_hz: 90e3,
        ..Oscillators::default()
    };
    let offset_hz = CarrierOffset::draw(&set, SEED).expect("an offset").at(0.0);
    assert!(offset_hz.abs() > 20e3, "{offset_hz}");
    let with = sweep(Impairments {
        oscillators: set,
        ..Impairments::none()
    });
    let drifting = sweep(Impairments {
        clock_drift: -offset_hz / 30e9,
        ..Impairments::none()
    });
    for beam in [0, BEAM, 60] {
        let (a, b) = (samples(&with, beam, 2), samples(&drifting, beam, 2));
        let turned = |n: usize| {
            let time_s = (f64::from(beam) * 1024.0 + n as f64) / 245.76e6;
            b[n] * phasor_of_turns(offset_hz * time_s)
        };
        let worst = (0..512).map(|n| (a[n] - turned(n)).norm()).fold(0.0, f64::max);
        assert!(worst < 2e-3 * rms(&b), "beam {beam}: {worst}");
    }
    // And that clock's drift is the offset's share of the carrier.
    let clean = sweep(Impairments::none());
    let late = |sweep: &Sweep| fit(&response(block(sweep, 60), 2)).delay_s;
    let expected = -offset_hz / 30e9 * 60.0 * 1024.0 / 245.76e6;
    assert!((late(&drifting) - late(&clean) - expected).abs() < 3e-13);
}

#[test]
fn the_amplifier_distorts_all_beams_and_channels_alike() {
    let with = Impairments {
        amplifier: Some(Amplifier::default()),
        ..Impairments::none()
    };
    let (with, without) = (sweep(with), sweep(Impairments::none()));
    let factor = |beam, channel| -> Vec<C64> {
        let [a, b] = [&with, &without].map(|s| response(block(s, beam), channel));
        a.iter().zip(&b).map(|(a, b)| a / b).collect()
    };
    let (first, other) = (factor(BEAM, 0), factor(BEAM + 1, 7));
    let spread = first.iter().map(|f| (f - first[200]).norm()).fold(0.0, f64::max);
    assert!(spread > 0.02, "{spread}");
    for (a, b) in first.iter().zip(&other) {
        assert!((a - b).norm() < 4e-3, "{a} {b}");
    }
    let power = first.iter().map(|f| f.norm_sqr()).sum::<f64>() / 416.0;
    assert!((power - 1.0).abs() < 0.01, "{power}");
}

#[test]
fn a_neighbour_adds_its_power_while_it_sends() {
    let with = |duty| Impairments {
        interference: Some(Interference {
            power_dbm: -60.0,
            duty,
        }),
        ..Impairments::none()
    };
    let without = sweep(Impairments::none());
    let powers = |sweep: &Sweep| -> Vec<f64> {
        let added = |beam| {
            let (a, b) = (samples(sweep, beam, 0), samples(&without, beam, 0));
            let difference: Vec<C64> = a.iter().zip(&b).map(|(a, b)| a - b).collect();
            rms(&difference)
        };
        (0..72).map(added).collect()
    };
    let simulator = simulator(with(0.5));
    let neighbour = simulator.neighbour.as_ref().expect("drawn");
    let body = Instant::at_rest().attitude.inverse().apply(neighbour.direction);
    let gain = cslam_core::array::UavArrays::<f64>::default().amplitude(&body)[0];
    let heard = powers(&sweep(with(0.5)));
    let whole: Vec<f64> = heard
        .iter()
        .copied()
        .filter(|p| *p > 0.5 * gain * libm::sqrt(1e-9))
        .collect();
    assert!((5..72).contains(&whole.len()), "{}", whole.len());
    let power = whole.iter().map(|p| p * p).sum::<f64>() / whole.len() as f64;
    // Overlapping bursts are one, and a block may be partly filled.
    assert!(
        (power / (gain * gain * 1e-9) - 1.0).abs() < 0.15,
        "{power} {gain}"
    );
    let silent = heard
        .iter()
        .filter(|p| **p < 1e-3 * gain * libm::sqrt(1e-9))
        .count();
    assert!(silent + whole.len() > 60, "{silent}");
    assert_eq!(sweep(with(0.0)), without);
}

#[test]
fn tips_add_a_turning_copy_of_the_strongest_wave_and_blades_shade() {
    let impairments = Impairments {
        airframe: AirframeEffects {
            rotors: true,
            shadow: false,
        },
        ..Impairments::none()
    };
    // Through the disc of the first rotor to the array on the left.
    let arrival = [1.30, 0.206];
    let link = one_path(55.5, arrival, [1.5, 0.1]);
    let simulator = simulator(impairments);
    let rotors = simulator.rotors.clone().expect("drawn");
    let u = Direction::from_zenith_azimuth(arrival[0], arrival[1]).expect("angles");
    let known = cslam_core::array::UavArrays::<f64>::default();
    let (channel, j, n) = (10, 1, 2.0 - 3.5);
    let crossing = Rotors::crossing(u.vector(), &known.arrays()[j].centre_m).expect("a rotor in the way");
    let per_m = TAU / 299_792_458.0;
    let arrived = |u: &Direction<Body, f64>, f_hz: f64| {
        let (step, gain, lead_m) = (
            known.phase_step_rad(u)[j],
            known.amplitude(u)[j],
            known.lead_m(u)[j],
        );
        phasor(n * step + f_hz * lead_m * per_m) * gain
    };
    let hubs: Vec<Direction<Body, f64>> = (0..4)
        .map(|rotor| PI * (0.25 + 0.5 * f64::from(rotor)))
        .map(|azimuth| nalgebra::Vector3::new(0.25 * libm::cos(azimuth), 0.25 * libm::sin(azimuth), 0.05))
        .map(|way| Direction::from_vector(way).expect("a hub"))
        .collect();
    let clean = sweep_of(&link, Impairments::none());
    let mut shades = Vec::new();
    for instant_s in [
        0.0, 0.4e-3, 0.8e-3, 1.2e-3, 1.6e-3, 2.0e-3, 2.4e-3, 2.8e-3, 3.2e-3, 3.6e-3, 4e-3,
    ] {
        let instant = Instant {
            time_s: instant_s,
            ..Instant::at_rest()
        };
        let turning = simulator.sweep(&link, &instant, 0).expect("complete path");
        let [a, b] = [&turning, &clean].map(|s| response(block(s, BEAM), channel));
        let time_s = instant_s + f64::from(BEAM) * 1024.0 / 245.76e6;
        let tips = rotors.tips(u.vector(), 30e9, time_s);
        let shade = rotors.shade(&crossing, time_s);
        shades.push(shade);
        for k in (0..416).step_by(23) {
            let off_hz = (k as f64 - 208.0) * 480e3;
            let late = phasor(-off_hz * 0.3 * per_m) * libm::exp10(-1.5);
            let scattered: C64 = hubs
                .iter()
                .zip(tips)
                .map(|(hub, tip)| tip * arrived(hub, 30e9 + off_hz))
                .sum();
            let expected = scattered * late / arrived(&u, 30e9 + off_hz) + shade;
            assert!(
                (a[k] / b[k] - expected).norm() < 3e-3,
                "{instant_s} s, {k}: {} {expected}",
                a[k] / b[k]
            );
        }
    }
    assert!(
        shades.contains(&1.0) && shades.iter().any(|shade| *shade < 1.0),
        "{shades:?}"
    );
}
