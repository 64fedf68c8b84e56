//! One path, over its Cramer-Rao bound.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use cslam_core::geometry::{Body, Direction};
use cslam_core::paths::{ElementErrors, EstimatedPath, PathEstimator, WorkLimit};
use cslam_core::profile::quad_4x16_gmt_48::{
    ARRAYS, BEAMS, BeamSquint, Block, CHANNELS, Config, ELEMENTS, FlightEstimator, Samples, radio,
};
use cslam_core::signal::{Iq, SAMPLES};
use cslam_host_sim::crlb::{Arrival, Receiver, single};
use cslam_host_sim::random::Stream;
use rayon::prelude::*;

use crate::model::{C64, CARRIER_HZ, delay_s, heard_by_array, polar};

const TRIALS: u64 = 300;
const SNRS_DB: [f64; 3] = [0.0, 10.0, 20.0];

/// The block of one path in noise of variance one a sample, its carrier phase free at each array.
fn heard(path: &Arrival, stream: &mut Stream) -> Box<Samples> {
    let u = path.aoa.vector();
    let mut samples = vec![[C64::new(0.0, 0.0); SAMPLES]; CHANNELS];
    for j in 0..ARRAYS {
        let turns = stream.uniform() - CARRIER_HZ * delay_s(j, path.c_tau_m, u);
        let clean = heard_by_array(j, path.c_tau_m, u, polar(turns) * path.snr.sqrt());
        for (channel, clean) in samples[ELEMENTS * j..].iter_mut().zip(&clean) {
            for (sample, clean) in channel.iter_mut().zip(clean) {
                let noise = C64::new(stream.normal(), stream.normal()) * FRAC_1_SQRT_2;
                *sample = clean + noise;
            }
        }
    }
    let power = |channel: &[C64; SAMPLES]| channel.iter().map(|x| x.norm_sqr()).sum::<f64>();
    let strongest = samples.iter().map(power).fold(0.0, f64::max);
    // 12 dB under full scale at the strongest channel.
    let scale = 0.25 * 32768.0 / (strongest / SAMPLES as f64).sqrt();
    let whole = |x: f64| (x * scale).round().clamp(-32768.0, 32767.0) as i16;
    let mut block: Box<Samples> = vec![[Iq::ZERO; SAMPLES]; CHANNELS]
        .try_into()
        .expect("64 channels");
    for (row, channel) in block.iter_mut().zip(&samples) {
        for (iq, x) in row.iter_mut().zip(channel) {
            *iq = Iq::new(whole(x.re), whole(x.im));
        }
    }
    block
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
    let mut samples = heard(&path, &mut stream);
    estimator.push_beam(Block {
        samples: &mut samples,
        beam: 8,
        exponent: 0,
    });
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
    let (radio, config) = (radio(), cslam_core::beam_squint::BeamSquintConfig::default());
    let listener = |waveform| {
        BeamSquint::new(
            config,
            radio.squint_scheme,
            &radio.squint,
            radio.uav_arrays(),
            &waveform,
        )
    };
    assert!(listener(radio.waveform).is_some());
    // Its type has room for 416 subcarriers.
    let fewer = cslam_core::signal::Waveform {
        active: 400,
        ..radio.waveform
    };
    assert!(listener(fewer).is_none());
}
