//! How fast paths grow, told by their pilots, against the bound of a phase: `period / (2 pi sqrt SNR)`, SNR of all elements and subcarriers.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, Vector3};
use cslam_core::paths::EstimatedPath;
use cslam_core::signal::Waveform;
use rayon::prelude::*;

use super::single::drawn;
use super::{Mode, Range, Truth, estimator};
use crate::channel::{ChannelConfig, Impairments, Oscillators};
use crate::crlb::Receiver;
use crate::random::Stream;
use crate::statistics::{quantile, rms};

/// Beam that favours the paths.
const BEAM: u16 = 12;
/// Frequency shifts are drawn within this, Hz: less than half of what two pilots tell.
const MOST_HZ: f64 = 100.0;
/// Range error up to which an estimate is the path, m.
const NEAR_M: f64 = 0.5;
/// Errors of more standard deviations of the bound are no noise.
const OUTLIER_SIGMAS: f64 = 10.0;

/// What is heard.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Heard {
    /// One path.
    Alone,
    /// One path, with the phase noise of the world `real`.
    Oscillators,
    /// A second path beside it, 10 dB weaker, 1.5 m and 10 degrees away, with another frequency shift.
    BesideAnother,
}

impl Heard {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Alone => "alone",
            Self::Oscillators => "phase noise",
            Self::BesideAnother => "second path at -10 dB",
        }
    }
}

/// Figures of a row.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RangeRates {
    /// What is heard.
    pub heard: Heard,
    /// SNR per element of gain one and active subcarrier, dB.
    pub snr_db: f64,
    /// Trials.
    pub trials: usize,
    /// Share of the paths that were found of which a rate was told.
    pub told: f64,
    /// Error, m/s: median and nine of ten.
    pub error_m_per_s: [f64; 2],
    /// RMSE over the bound, without outliers.
    pub ratio: f64,
    /// Mean squared error in units of the claimed standard deviation.
    pub nees: f64,
}

/// A path's error, m/s, over the bound and over what is claimed.
struct Error {
    m_per_s: f64,
    of_bound: f64,
    of_claimed: f64,
}

/// Runs a row.
pub fn range_rates(heard: Heard, snr_db: f64, trials: usize, seed: u64) -> RangeRates {
    let range = match heard {
        Heard::Alone | Heard::BesideAnother => Range::new(&[BEAM], seed),
        Heard::Oscillators => {
            // Offset, wander and walk are in every rate, the same in all.
            let oscillators = Oscillators {
                phase_noise: Impairments::real().oscillators.phase_noise,
                ..Impairments::none().oscillators
            };
            let impairments = Impairments {
                free_array_phase: true,
                oscillators,
                ..Impairments::none()
            };
            let config = ChannelConfig {
                impairments,
                ..ChannelConfig::default()
            };
            Range::over(config, seed)
        }
    };
    let results: Vec<Option<Option<Error>>> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(Mode::Best),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let truth = drawn(&range, BEAM, snr_db, &mut stream);
                let mut truths = vec![truth];
                if heard == Heard::BesideAnother {
                    truths.push(beside(&truth));
                }
                let mut shift_hz = || MOST_HZ * (2.0 * stream.uniform() - 1.0);
                let shifted: Vec<(Truth, f64)> = truths.iter().map(|truth| (*truth, shift_hz())).collect();
                let paths = range.sweep_with_pilots(&shifted, trial, BEAM, estimator.as_mut());
                let near =
                    |path: &&EstimatedPath| (f64::from(path.path.c_tau_m) - truth.c_tau_m).abs() < NEAR_M;
                let (_, shift_hz) = shifted[0];
                paths.iter().find(near).map(|path| error(path, &truth, shift_hz))
            },
        )
        .collect();
    let found: Vec<Option<Error>> = results.into_iter().flatten().collect();
    let count = found.len().max(1) as f64;
    let told: Vec<Error> = found.into_iter().flatten().collect();
    let sizes: Vec<f64> = told.iter().map(|error| error.m_per_s.abs()).collect();
    let sound = |error: &&Error| error.of_bound.abs() < OUTLIER_SIGMAS;
    let of_bound: Vec<f64> = told.iter().filter(sound).map(|error| error.of_bound).collect();
    let of_claimed: Vec<f64> = told.iter().map(|error| error.of_claimed).collect();
    RangeRates {
        heard,
        snr_db,
        trials,
        told: told.len() as f64 / count,
        error_m_per_s: [0.5, 0.9].map(|share| quantile(&sizes, share).unwrap_or(f64::NAN)),
        ratio: rms(&of_bound).unwrap_or(f64::NAN),
        nees: rms(&of_claimed).map_or(f64::NAN, |x| x * x),
    }
}

/// A path beside another.
fn beside(truth: &Truth) -> Truth {
    let (_, up) = truth.aoa.tangents();
    let (along, across) = 10_f64.to_radians().sin_cos();
    let aoa: Vector3<f64> = truth.aoa.vector() * across + up * along;
    Truth {
        c_tau_m: truth.c_tau_m + 1.5,
        aoa: Direction::from_vector(aoa).unwrap_or(truth.aoa),
        snr_db: truth.snr_db - 10.0,
        phase_rad: truth.phase_rad + 1.0,
        ..*truth
    }
}

fn error(path: &EstimatedPath, truth: &Truth, shift_hz: f64) -> Option<Error> {
    let told = path.range_rate?;
    let receiver = <Receiver>::default();
    let wavelength_m = SPEED_OF_LIGHT_M_PER_S / Waveform::default().carrier_hz;
    let period = f64::from(told.period_m_per_s);
    let beyond = f64::from(told.m_per_s) + shift_hz * wavelength_m;
    let m_per_s = beyond - period * (beyond / period).round();
    let gains = receiver.arrays.amplitude(&truth.aoa);
    let heard: f64 = gains.iter().map(|gain| gain * gain * 8.0).sum();
    let snr = libm::exp10(truth.snr_db / 10.0) * heard * receiver.waveform.active as f64;
    // A half of noise each in phase and in amplitude, of two pilots.
    let bound = period / (std::f64::consts::TAU * snr.sqrt());
    Some(Error {
        m_per_s,
        of_bound: m_per_s / bound,
        of_claimed: m_per_s / f64::from(told.sigma_m_per_s),
    })
}
