//! One path, over its Cramer-Rao bound.

use std::f64::consts::TAU;

use cslam_core::geometry::{Body, Direction};
use cslam_core::paths::{ElementErrors, EstimatedPath, PathEstimator, WorkLimit};
use cslam_core::profile::quad_4x16_gmt_48::{
    ARRAYS, BEAMS, CHANNELS, Config, ELEMENTS, FlightEstimator, Radio, radio,
};
use cslam_core::receiver;
use cslam_core::signal::SAMPLES;
use cslam_host_sim::crlb::{Arrival, Receiver, single};
use cslam_host_sim::random::Stream;
use rayon::prelude::*;

use crate::signal::{Captured, Signal, Wave, tilted_rows};

const TRIALS: u64 = 300;
const SNRS_DB: [f64; 3] = [0.0, 10.0, 20.0];

pub(crate) fn signal() -> Signal {
    Signal {
        carrier_hz: 28e9,
        root: 136.0,
        rows: tilted_rows(),
        elements: ELEMENTS,
    }
}

fn estimator() -> Box<FlightEstimator> {
    let config = Config {
        gating: false,
        element_errors: ElementErrors::Known(0.0),
        work_limit: WorkLimit::NONE,
        ..Config::of(&radio())
    };
    Box::new(FlightEstimator::checked(&config).expect("a sound radio"))
}

/// Errors of one path in units of its bound; `None` when nothing was found.
fn trial(
    estimator: &mut FlightEstimator,
    receiver: &Receiver<ARRAYS, ELEMENTS>,
    snr_db: f64,
    trial: u64,
) -> Option<[f64; 3]> {
    let mut stream = Stream::new(28, trial);
    let sine = |deg: f64| deg.to_radians().sin();
    let z = sine(-60.0) + (sine(75.0) - sine(-60.0)) * stream.uniform();
    let azimuth_rad = TAU * (stream.uniform() - 0.5);
    let path = Arrival {
        c_tau_m: 5.0 + 400.0 * stream.uniform(),
        aoa: Direction::<Body, f64>::from_zenith_azimuth(z.acos(), azimuth_rad).expect("angles"),
        snr: 10_f64.powf(snr_db / 10.0),
        phase_rad: 0.0,
    };
    let signal = signal();
    let wave = Wave {
        from: *path.aoa.vector(),
        c_tau_m: path.c_tau_m,
    };
    // A transform that keeps power: the SNR of a subcarrier is that of its amplitude.
    let amplitude = path.snr.sqrt() / (SAMPLES as f64).sqrt();
    let phases = signal.phases(&mut stream);
    let at_rows = signal.waves(&wave, &phases, |_| amplitude);
    let channels = signal.channels(&[(&wave, &at_rows, 1.0)], 1.0, &mut stream);
    estimator.push_beam(Captured::<CHANNELS>::of(&channels).block(8));
    let found: EstimatedPath = *estimator.finish().first()?;
    let bound = single(receiver, &path).expect("observable");
    let (e1, e2) = path.aoa.tangents();
    let u = found.path.aoa.vector().cast::<f64>();
    let errors = [
        f64::from(found.path.c_tau_m) - path.c_tau_m,
        e1.dot(&u),
        e2.dot(&u),
    ];
    Some(std::array::from_fn(|i| errors[i] / bound[(i, i)].sqrt()))
}

#[test]
fn a_path_of_another_radio_is_as_good_as_its_bound() {
    let radio = radio();
    assert_eq!(radio.check(), Ok(()));
    assert_eq!(radio.codebook::<f32, 3, 8, 8>().len(), BEAMS);
    let receiver = Receiver {
        arrays: radio.uav_arrays(),
        waveform: radio.waveform,
    };
    println!("| SNR, dB | found, of {TRIALS} | beyond ten bounds | range | angles |");
    for snr_db in SNRS_DB {
        let trials: Vec<_> = (0..TRIALS)
            .into_par_iter()
            .map_init(estimator, |estimator, index| {
                trial(estimator, &receiver, snr_db, index)
            })
            .collect();
        let found: Vec<[f64; 3]> = trials.into_iter().flatten().collect();
        let good: Vec<_> = found
            .iter()
            .filter(|e| e.iter().all(|e| e.abs() < 10.0))
            .collect();
        let ratio: [f64; 3] = std::array::from_fn(|i| {
            (good.iter().map(|e| e[i] * e[i]).sum::<f64>() / good.len() as f64).sqrt()
        });
        let outliers = found.len() - good.len();
        let [range, one, other] = ratio;
        println!(
            "| {snr_db:.0} | {} | {outliers} | {range:.2} | {one:.2}, {other:.2} |",
            found.len()
        );
        assert!(
            found.len() as u64 == TRIALS && outliers == 0,
            "{snr_db} dB: {} found, {outliers} far off",
            found.len()
        );
        assert!(ratio.iter().all(|ratio| *ratio <= 1.10), "{snr_db} dB: {ratio:?}");
    }
}

#[test]
fn beam_squint_listens_to_it() {
    let (mut radio, errors) = (radio(), cslam_core::beam_squint::BeamSquintConfig::default());
    assert!(<Radio as receiver::Radio>::beam_squint(&radio, errors).is_some());
    // Its type has room for 416 subcarriers.
    radio.waveform.active = 400;
    assert!(<Radio as receiver::Radio>::beam_squint(&radio, errors).is_none());
}
