//! One path, over its Cramer-Rao bound.

use std::f64::consts::TAU;
use std::fmt::Write;

use cslam_core::beam_squint::BeamSquintConfig;
use cslam_core::geometry::{Body, Direction};
use cslam_core::paths::{ElementErrors, EstimatedPath, PathEstimator, WorkLimit};
use cslam_core::profile::{planar_8x8_gmt_72 as planar, quad_4x16_gmt_48 as quad};
use cslam_core::receiver;
use cslam_core::signal::SAMPLES;
use cslam_host_sim::crlb::{Arrival, Receiver, single};
use cslam_host_sim::random::Stream;
use nalgebra::Vector3;
use rayon::prelude::*;

use crate::signal::{Captured, Signal, Wave, planar_rows, tilted_rows};

const TRIALS: u64 = 300;
const SNRS_DB: [f64; 3] = [0.0, 10.0, 20.0];

/// What `profile::quad_4x16_gmt_48` hears.
pub(crate) fn quad_signal() -> Signal {
    Signal {
        carrier_hz: 28e9,
        root: 136.0,
        rows: tilted_rows(),
        elements: 16,
        column: None,
        rear_db: 12.0,
    }
}

/// What `profile::planar_8x8_gmt_72` hears.
pub(crate) fn planar_signal() -> Signal {
    Signal {
        carrier_hz: 60e9,
        root: 273.0,
        rows: planar_rows(),
        elements: 8,
        column: Some(Vector3::z()),
        rear_db: 200.0,
    }
}

/// A direction over the sphere between these elevations, or of it those within 60 degrees of the nose.
fn direction(stream: &mut Stream, ahead: bool) -> Direction<Body, f64> {
    let sine = |deg: f64| deg.to_radians().sin();
    loop {
        let z = sine(-60.0) + (sine(75.0) - sine(-60.0)) * stream.uniform();
        let azimuth_rad = TAU * (stream.uniform() - 0.5);
        let u = Direction::<Body, f64>::from_zenith_azimuth(z.acos(), azimuth_rad).expect("angles");
        if !ahead || u.vector().x > 0.5 {
            return u;
        }
    }
}

/// Errors of one path in units of its bound; `None` when nothing was found.
fn trial<E, const C: usize, const A: usize, const ELEMENTS: usize>(
    estimator: &mut E,
    signal: &Signal,
    receiver: &Receiver<A, ELEMENTS>,
    snr_db: f64,
    trial: u64,
) -> Option<[f64; 3]>
where
    E: PathEstimator<C, { receiver::PATHS }>,
{
    let mut stream = Stream::new(28, trial);
    let aoa = direction(&mut stream, signal.column.is_some());
    let path = Arrival {
        c_tau_m: 5.0 + 400.0 * stream.uniform(),
        aoa,
        snr: 10_f64.powf(snr_db / 10.0),
        phase_rad: 0.0,
    };
    let wave = Wave {
        from: *path.aoa.vector(),
        c_tau_m: path.c_tau_m,
    };
    // A transform that keeps power: the SNR of a subcarrier is that of its amplitude.
    let amplitude = path.snr.sqrt() / (SAMPLES as f64).sqrt();
    let phases = signal.phases(&mut stream);
    let at_rows = signal.waves(&wave, &phases, |_| amplitude);
    let channels = signal.channels(&[(&wave, &at_rows, 1.0)], 1.0, &mut stream);
    estimator.push_beam(Captured::<C>::of(&channels).block(8));
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

/// Prints the errors of a radio's paths over their bounds, and holds them against 1.10.
fn check<E, const C: usize, const A: usize, const ELEMENTS: usize>(
    name: &str,
    signal: &Signal,
    receiver: &Receiver<A, ELEMENTS>,
    estimator: impl Fn() -> Box<E> + Sync + Send,
) where
    E: PathEstimator<C, { receiver::PATHS }>,
{
    // Printed as one: other tests print too.
    let mut table = format!("{name}\n| SNR, dB | found, of {TRIALS} | beyond ten bounds | range | angles |");
    for snr_db in SNRS_DB {
        let trials: Vec<_> = (0..TRIALS)
            .into_par_iter()
            .map_init(&estimator, |estimator, index| {
                trial::<E, C, A, ELEMENTS>(estimator, signal, receiver, snr_db, index)
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
        let _written = write!(
            table,
            "\n| {snr_db:.0} | {} | {outliers} | {range:.2} | {one:.2}, {other:.2} |",
            found.len()
        );
        assert!(
            found.len() as u64 == TRIALS && outliers == 0,
            "{snr_db} dB: {} found, {outliers} far off",
            found.len()
        );
        assert!(ratio.iter().all(|ratio| *ratio <= 1.10), "{snr_db} dB: {ratio:?}");
    }
    println!("{table}");
}

#[test]
fn a_path_of_another_radio_is_as_good_as_its_bound() {
    let radio = quad::radio();
    assert_eq!(radio.check(), Ok(()));
    assert_eq!(radio.codebook::<f32, 3, 8, 8>().len(), quad::BEAMS);
    let receiver = Receiver::<{ quad::ARRAYS }, { quad::ELEMENTS }> {
        arrays: radio.uav_arrays(),
        waveform: radio.waveform,
    };
    let config = quad::Config {
        gating: false,
        element_errors: ElementErrors::Known(0.0),
        work_limit: WorkLimit::NONE,
        ..quad::Config::of(&radio)
    };
    check::<_, { quad::CHANNELS }, { quad::ARRAYS }, { quad::ELEMENTS }>(
        "quad_4x16_gmt_48",
        &quad_signal(),
        &receiver,
        || Box::new(quad::FlightEstimator::checked(&config).expect("a sound radio")),
    );
}

#[test]
fn a_path_at_a_planar_array_is_as_good_as_its_bound() {
    let radio = planar::radio();
    assert_eq!(radio.check(), Ok(()));
    assert_eq!(radio.codebook::<f32, 3, 8, 8>().len(), planar::BEAMS);
    let receiver = Receiver::<{ planar::ARRAYS }, { planar::ELEMENTS }> {
        arrays: radio.uav_arrays(),
        waveform: radio.waveform,
    };
    let config = planar::Config {
        gating: false,
        element_errors: ElementErrors::Known(0.0),
        work_limit: WorkLimit::NONE,
        ..planar::Config::of(&radio)
    };
    check::<_, { planar::CHANNELS }, { planar::ARRAYS }, { planar::ELEMENTS }>(
        "planar_8x8_gmt_72",
        &planar_signal(),
        &receiver,
        || Box::new(planar::FlightEstimator::checked(&config).expect("a sound radio")),
    );
}

#[test]
fn beam_squint_listens_to_it() {
    let (mut radio, errors) = (quad::radio(), BeamSquintConfig::default());
    assert!(<quad::Radio as receiver::Radio>::beam_squint(&radio, errors).is_some());
    // Its type has room for 416 subcarriers.
    radio.waveform.active = 400;
    assert!(<quad::Radio as receiver::Radio>::beam_squint(&radio, errors).is_none());
}
