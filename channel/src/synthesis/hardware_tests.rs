//! Each effect of the hardware reaches the samples, alone and as its formula says.

use std::f64::consts::PI;

use cslam_core::geometry::Direction;

use super::antenna::phasor;
use super::effects::coupling::Coupling;
use super::effects::ripple::Ripple;
use super::effects::{Draw, airframe};
use super::probe::{block, noiseless, one_path, response};
use super::*;
use crate::paths::Link;

const SEED: u64 = 3;
const ARRIVAL: [f64; 2] = [2.2, 0.75];
/// Beam that looks towards the departure.
const BEAM: u16 = 12;

fn link() -> Link {
    one_path(55.5, ARRIVAL, [1.5, 0.1])
}

fn simulator(impairments: Impairments) -> Simulator {
    Simulator::new(noiseless(impairments), SEED)
}

/// Response of every channel in a beam.
fn heard(impairments: Impairments, instant: &Instant) -> Vec<Vec<C64>> {
    let sweep = simulator(impairments)
        .sweep(&link(), instant, 0)
        .expect("complete path");
    (0..32).map(|c| response(block(&sweep, BEAM), c)).collect()
}

/// What an effect multiplies each channel's subcarriers by.
fn factors(impairments: Impairments, instant: &Instant) -> Vec<Vec<C64>> {
    let clean = heard(Impairments::none(), &Instant::at_rest());
    let pairs = heard(impairments, instant).into_iter().zip(clean);
    pairs
        .map(|(a, b)| a.iter().zip(b).map(|(a, b)| a / b).collect())
        .collect()
}

fn uav_arrays(uav_arrays: UavArrayErrors) -> Impairments {
    Impairments {
        uav_arrays,
        ..Impairments::none()
    }
}

/// Factors of all subcarriers within `tolerance` of what is expected in a channel, for the arrays that hear the path well.
fn assert_near(factors: &[Vec<C64>], tolerance: f64, expected: impl Fn(usize, usize) -> C64) {
    for (channel, factors) in factors.iter().enumerate().take(16) {
        for (k, factor) in factors.iter().enumerate() {
            let expected = expected(channel, k);
            assert!(
                (factor - expected).norm() < tolerance,
                "channel {channel}, {k}: {factor} {expected}"
            );
        }
    }
}

fn arrival() -> Direction<cslam_core::geometry::Body, f64> {
    Direction::from_zenith_azimuth(ARRIVAL[0], ARRIVAL[1]).expect("angles")
}

#[test]
fn gain_errors_scale_each_channel() {
    let with = uav_arrays(UavArrayErrors {
        gain_rms_db: 0.5,
        ..UavArrayErrors::default()
    });
    let device = simulator(with.clone()).device().clone();
    assert_near(&factors(with, &Instant::at_rest()), 2e-3, |c, _| {
        device.uav_element[c / 8][c % 8]
    });
}

#[test]
fn a_displaced_array_turns_the_carrier_and_moves_the_delay() {
    let with = uav_arrays(UavArrayErrors {
        centre_rms_mm: 1.0,
        ..UavArrayErrors::default()
    });
    let device = simulator(with.clone()).device().clone();
    assert_near(&factors(with, &Instant::at_rest()), 3e-3, |c, k| {
        let lead_m = device.uav_centre_m[c / 8].dot(arrival().vector());
        let f_hz = 30e9 + (k as f64 - 208.0) * 480e3;
        phasor(2.0 * PI * f_hz * lead_m / 299_792_458.0)
    });
}

#[test]
fn coupling_mixes_the_elements_of_an_array() {
    let with = uav_arrays(UavArrayErrors {
        coupling_unknown_share: 0.2,
        ..UavArrayErrors::default()
    });
    let coupling = Coupling::<4, 8>::draw(0.2, &Radio::default(), Draw::Coupling.stream(SEED));
    let known = cslam_core::array::UavArrays::<f64>::default();
    let steering = known
        .phase_step_rad(&arrival())
        .map(cslam_core::array::UavArrays::<f64, 4, 8>::steering);
    let coupled = coupling.of(&steering);
    assert_near(&factors(with, &Instant::at_rest()), 2e-3, |c, _| {
        let (j, i) = (c / 8, c % 8);
        coupled[j][i] / steering[j][i]
    });
}

#[test]
fn cross_polarisation_lets_in_what_tilt_and_reflections_make_horizontal() {
    use super::effects::cross_polarisation::CrossPolarisation;
    use cslam_core::geometry::Rotation;
    let with = |cross_polarisation_db| {
        uav_arrays(UavArrayErrors {
            cross_polarisation_db,
            ..UavArrayErrors::default()
        })
    };
    let tilted = Instant {
        attitude: Rotation::from_yaw_pitch_roll(0.0, 0.0, 0.2).expect("angles"),
        ..Instant::at_rest()
    };
    let mut crossed = link();
    let [re, im] = crossed.paths[0].gain.expect("given");
    // A third of the field is horizontal, a quarter of a turn ahead.
    crossed.paths[0].cross_gain = Some([-im / 3.0, re / 3.0]);
    let heard = |impairments: Impairments, link: &Link, instant: &Instant| -> Vec<Vec<C64>> {
        let sweep = simulator(impairments)
            .sweep(link, instant, 0)
            .expect("complete path");
        (0..16).map(|c| response(block(&sweep, BEAM), c)).collect()
    };
    let of_device = CrossPolarisation::<4, 8>::draw(18.0, SEED);
    for (link, instant) in [
        (&link(), &tilted),
        (&crossed, &Instant::at_rest()),
        (&crossed, &tilted),
    ] {
        let across = simulator(Impairments::none())
            .rays(link, instant)
            .expect("complete")[0]
            .across;
        let (clean, found) = (
            heard(with(None), link, instant),
            heard(with(Some(18.0)), link, instant),
        );
        for (channel, (clean, found)) in clean.iter().zip(&found).enumerate() {
            let expected = 1.0 + of_device.taken[channel / 8][channel % 8] * across;
            let factor = found[200] / clean[200];
            assert!((factor - expected).norm() < 3e-3, "{channel}: {factor}");
        }
    }
    // Level, and vertical: nothing, to the last bit.
    let level = |db| {
        simulator(with(db))
            .sweep(&link(), &Instant::at_rest(), 0)
            .expect("complete path")
    };
    assert_eq!(level(None), level(Some(18.0)));
}

#[test]
fn ripple_multiplies_the_element_pattern() {
    let with = uav_arrays(UavArrayErrors {
        ripple_rms_db: 1.0,
        ripple_rms_deg: 5.0,
        ..UavArrayErrors::default()
    });
    let ripple = Ripple::<4, 8>::draw((1.0, 5.0), &Radio::default(), Draw::Ripple.stream(SEED))
        .factors(arrival().vector());
    assert_near(&factors(with, &Instant::at_rest()), 3e-3, |c, _| {
        ripple[c / 8][c % 8]
    });
}

#[test]
fn drift_turns_the_elements_with_the_time_since_switch_on() {
    let with = uav_arrays(UavArrayErrors {
        phase_drift_rms_deg_per_k: 0.2,
        delay_drift_rms_ps_per_k: 1.0,
        ..UavArrayErrors::default()
    });
    let drift = effects::drift::Drift::<4, 8>::draw(&with, SEED).expect("drifts");
    for time_s in [10.0, 900.0] {
        let instant = Instant {
            time_s,
            ..Instant::at_rest()
        };
        let (phase, delay) = drift.at(time_s);
        assert_near(&factors(with.clone(), &instant), 3e-3, |c, k| {
            let f_hz = (k as f64 - 208.0) * 480e3;
            phasor(phase[c / 8][c % 8] - 2.0 * PI * f_hz * delay[c / 8])
        });
    }
}

#[test]
fn squint_in_the_arrays_is_the_phase_over_frequency() {
    let with = uav_arrays(UavArrayErrors {
        squint: true,
        ..UavArrayErrors::default()
    });
    let steps = cslam_core::array::UavArrays::<f64>::default().phase_step_rad(&arrival());
    let expected = |c: usize, k: usize| {
        let n = (c % 8) as f64 - 3.5;
        phasor(n * steps[c / 8] * (k as f64 - 208.0) * 480e3 / 30e9)
    };
    assert!((0..16).any(|c| (expected(c, 0) - 1.0).norm() > 0.02));
    assert_near(&factors(with.clone(), &Instant::at_rest()), 2e-3, expected);

    // And in the symbols whose waves are shaped.
    let symbols = |impairments| {
        let simulator = simulator(impairments);
        let sweep = simulator
            .squint(&link(), &Instant::at_rest(), 0, SquintScheme::Sequential)
            .expect("path");
        response(block(&sweep, 4), 0)
    };
    let (a, b) = (symbols(with), symbols(Impairments::none()));
    let peak = b.iter().map(|b| b.norm()).fold(0.0, f64::max);
    for (k, (a, b)) in a.iter().zip(&b).enumerate() {
        assert!((a - b * expected(0, k)).norm() < 3e-3 * peak, "{k}");
    }
}

#[test]
fn the_body_shades_and_scatters() {
    let with = Impairments {
        airframe: AirframeEffects {
            shadow: true,
            rotors: false,
        },
        ..Impairments::none()
    };
    let left = airframe::shadow(arrival().vector());
    assert!(left < 0.6, "{left}");
    // The copy: from the other side, half a nanosecond later, at the elements that look there.
    let known = cslam_core::array::UavArrays::<f64>::default();
    let other = Direction::from_zenith_azimuth(ARRIVAL[0], ARRIVAL[1] - PI).expect("angles");
    let of = |u: &Direction<cslam_core::geometry::Body, f64>| {
        let (steps, gains, leads) = (known.phase_step_rad(u), known.amplitude(u), known.lead_m(u));
        move |c: usize, f_hz: f64| {
            let (j, n) = (c / 8, (c % 8) as f64 - 3.5);
            phasor(n * steps[j] + 2.0 * PI * f_hz * leads[j] / 299_792_458.0) * gains[j]
        }
    };
    let (direct, copied) = (of(&arrival()), of(&other));
    assert_near(&factors(with, &Instant::at_rest()), 4e-3, |c, k| {
        let off_hz = (k as f64 - 208.0) * 480e3;
        let f_hz = 30e9 + off_hz;
        // Only the baseband of the detour: its carrier phase is the ray's own.
        let copy =
            copied(c, f_hz) * phasor(-2.0 * PI * off_hz * 0.15 / 299_792_458.0) * libm::exp10(-22.0 / 20.0);
        left + copy * airframe::shadow(other.vector()) / direct(c, f_hz)
    });
}
