//! One weak path in a flight: how often it is found within three sweeps, and what its energy allows.
//!
//! In flight, beams that show nothing over the noise take turns, so the beam of a weak path is looked at once in three sweeps
//! (docs/path-estimation.md, "What limits detection"). Here one estimator that has learned the noise hears the same path in three sweeps of
//! independent noise, all beams, strongest first.
//!
//! Beside it stands a test that knows delay and direction: the energy that the arrays gather there, each with a phase of its own, over the
//! threshold of the search. A search has more than that by what noise adds at the place that it prefers, one or two noise variances of 33.

use std::ops::Range as Span;

use cslam_core::paths::{EstimatedPath, EstimatorConfig};
use cslam_core::profile::FlightEstimator;
use cslam_core::signal::fit_threshold;
use rayon::prelude::*;

use super::single::{ELEVATIONS_DEG, drawn};
use super::{Range, Truth};
use crate::crlb::Receiver;
use crate::random::Stream;
use crate::statistics::wilson;

/// Beam that favours the path.
const BEAM: u16 = 12;
/// Sweeps within which the path is to be found.
const SWEEPS: usize = 3;
/// Range error up to which an estimate is the path, whatever lobe its angle took, m.
const NEAR_M: f64 = 1.0;
/// Elevations of arrival of the rows, deg: all, and bands.
const BANDS_DEG: [Span<f64>; 6] = [
    ELEVATIONS_DEG,
    -60.0..-45.0,
    -45.0..45.0,
    45.0..55.0,
    55.0..65.0,
    65.0..75.0,
];

/// Figures of one band of elevations.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Revisit {
    /// SNR per element of gain one and active subcarrier, dB.
    pub snr_db: f64,
    /// Elevations of arrival, deg: from, to.
    pub elevation_deg: [f64; 2],
    /// Trials.
    pub trials: usize,
    /// Share in which the path was found in the first, the second, the third sweep: the one in which its beam has its turn.
    pub by_sweep: [f64; SWEEPS],
    /// Share in which it was found in one of three sweeps.
    pub detected: f64,
    /// Wilson interval of that share, 95 %.
    pub interval: [f64; 2],
    /// Share in which its energy is over the threshold: in one look, in one of three, and in the sum of three at the same rate of false alarms.
    pub possible: [f64; 3],
}

/// What one trial found.
struct Trial {
    elevation_deg: f64,
    found: [bool; SWEEPS],
    possible: [bool; 3],
}

/// Rows: all elevations, then bands of them.
pub fn revisit(snr_db: f64, trials: usize, seed: u64) -> Vec<Revisit> {
    let range = Range::new(&[], seed);
    let config = EstimatorConfig::default();
    // A sweep of noise: the gate learns what it is.
    let mut learned = Box::new(FlightEstimator::new(&config));
    range.sweep(&[], u32::MAX, learned.as_mut());
    let threshold = f64::from(fit_threshold(
        config.false_alarms_per_sweep,
        range.codebook().len(),
    ));
    let thresholds = [threshold, equally_rare(threshold)];
    let results: Vec<Trial> = (0..trials as u32)
        .into_par_iter()
        .map_with(learned, |learned, trial| {
            let mut stream = Stream::new(seed, u64::from(trial));
            let truth = drawn(&range, BEAM, snr_db, &mut stream);
            let mut estimator = learned.clone();
            let near = |p: &EstimatedPath| (f64::from(p.path.c_tau_m) - truth.c_tau_m).abs() < NEAR_M;
            let found = std::array::from_fn(|sweep| {
                let index = trial * SWEEPS as u32 + sweep as u32;
                range.sweep(&[truth], index, estimator.as_mut()).iter().any(near)
            });
            Trial {
                elevation_deg: libm::asin(truth.aoa.vector().z).to_degrees(),
                found,
                possible: possible(&truth, thresholds, &mut stream),
            }
        })
        .collect();
    let row = |band: Span<f64>| {
        let of: Vec<&Trial> = results
            .iter()
            .filter(|trial| band.contains(&trial.elevation_deg))
            .collect();
        let share = |hit: &dyn Fn(&Trial) -> bool| {
            of.iter().filter(|trial| hit(trial)).count() as f64 / of.len() as f64
        };
        let hits = of.iter().filter(|trial| trial.found.contains(&true)).count();
        Revisit {
            snr_db,
            elevation_deg: [band.start, band.end],
            trials: of.len(),
            by_sweep: std::array::from_fn(|sweep| share(&|trial| trial.found[sweep])),
            detected: hits as f64 / of.len() as f64,
            interval: wilson(hits, of.len()),
            possible: std::array::from_fn(|i| share(&|trial| trial.possible[i])),
        }
    };
    BANDS_DEG.into_iter().map(row).collect()
}

/// Whether the energy at the path's own place is over the threshold, noise variances: in the first of three looks, in one of them, in their sum.
fn possible(truth: &Truth, [one, sum]: [f64; 2], stream: &mut Stream) -> [bool; 3] {
    let receiver = <Receiver>::default();
    let path = truth.arrival();
    let gathered = path.snr * (receiver.waveform.active * 8) as f64;
    let amplitudes = receiver
        .arrays
        .amplitude(&path.aoa)
        .map(|gain| gain * gathered.sqrt());
    let looks: [f64; SWEEPS] = std::array::from_fn(|_| {
        let mut part = || stream.normal() * std::f64::consts::FRAC_1_SQRT_2;
        amplitudes
            .iter()
            .map(|amplitude| (amplitude + part()).powi(2) + part().powi(2))
            .sum()
    });
    [
        looks[0] > one,
        looks.iter().any(|energy| *energy > one),
        looks.iter().sum::<f64>() > sum,
    ]
}

/// What the energy of three looks at four arrays exceeds, in noise alone, as rarely as that of one look exceeds `one`.
fn equally_rare(one: f64) -> f64 {
    let rate = log_survival(4, one);
    let (mut low, mut high) = (one, 700.0);
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if log_survival(4 * SWEEPS, middle) > rate {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Logarithm of the chance that the energy of so many complex variables of variance one is more than `y`.
fn log_survival(variables: usize, y: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 1.0);
    for i in 1..variables {
        term *= y / i as f64;
        sum += term;
    }
    libm::log(sum) - y
}
