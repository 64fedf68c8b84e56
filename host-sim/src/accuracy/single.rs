//! One path in one beam: efficiency over SNR, detection, false alarms.

use rayon::prelude::*;

use cslam_core::paths::EstimatedPath;

use super::{Mode, Range, Truth, angle_rad, direction, error, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;
use crate::statistics::{median, rms, wilson};

/// Elevations of arrival: the dipole hears little beyond (docs/signal-model.md, "Arrays").
pub(super) const ELEVATIONS_DEG: std::ops::Range<f64> = -60.0..75.0;

/// A path at this SNR that a beam favours, of any length, direction of arrival and phase.
pub(super) fn drawn(range: &Range, beam: u16, snr_db: f64, stream: &mut Stream) -> Truth {
    Truth {
        c_tau_m: 5.0 + 400.0 * stream.uniform(),
        aoa: direction(stream, ELEVATIONS_DEG),
        aod: range.aim(beam),
        snr_db,
        phase_rad: std::f64::consts::TAU * stream.uniform(),
    }
}
/// An estimate this far off took another lobe or another tap, and says nothing of the bound.
pub(super) const OUTLIER_SIGMAS: f64 = 10.0;

/// Figures of one SNR.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Single {
    /// SNR per element of gain one and active subcarrier, dB.
    pub snr_db: f64,
    /// Trials.
    pub trials: usize,
    /// Share of the trials in which something was found.
    pub detected: f64,
    /// Share of the found ones that is off by more than ten standard deviations of the bound in any parameter.
    pub outliers: f64,
    /// RMSE over the bound of range and both angles, of the found ones that are no outliers.
    pub ratio: [f64; 3],
    /// Mean squared error in units of the estimator's own covariance, over 3: 1 when it is honest.
    pub nees: f64,
    /// Range error of all found ones, outliers too: median and RMSE, m.
    pub range_m: [f64; 2],
    /// Angle error of all found ones, outliers too: median and RMSE, deg.
    pub angle_deg: [f64; 2],
}

/// What one trial found.
struct Trial {
    /// Errors in units of the bound.
    normalised: [f64; 3],
    /// Squared error in units of the estimator's own covariance, over 3.
    nees: f64,
    /// Range error, m.
    range_m: f64,
    /// Angle error, deg.
    angle_deg: f64,
}

/// Runs one path at one SNR in one beam.
pub fn single(mode: Mode, snr_db: f64, trials: usize, seed: u64) -> Single {
    // A beam in the middle of the first face.
    let beam = 12;
    let range = Range::new(&[beam], seed);
    let receiver = <Receiver>::default();
    let results: Vec<Option<Trial>> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let truth = drawn(&range, beam, snr_db, &mut stream);
                let paths = range.sweep(&[truth], trial, estimator.as_mut());
                let path = paths.first()?;
                let bound = crlb::single(&receiver, &truth.arrival()).expect("observable");
                let e = error(path, &truth);
                let normalised = std::array::from_fn(|i| e[i] / bound[(i, i)].sqrt());
                let own = path.path.covariance.cast::<f64>().try_inverse();
                let e = nalgebra::Vector3::from(e);
                let nees = own.map_or(f64::NAN, |inverse| e.dot(&(inverse * e)) / 3.0);
                Some(Trial {
                    normalised,
                    nees,
                    range_m: e.x.abs(),
                    angle_deg: angle_rad(path, &truth).to_degrees(),
                })
            },
        )
        .collect();
    let found: Vec<_> = results.into_iter().flatten().collect();
    let good: Vec<_> = found
        .iter()
        .filter(|trial| trial.normalised.iter().all(|e| e.abs() < OUTLIER_SIGMAS))
        .collect();
    // Of no good trial there is no mean: NaN.
    let count = good.len() as f64;
    let all = |pick: fn(&Trial) -> f64| {
        let values: Vec<f64> = found.iter().map(pick).collect();
        [median(&values), rms(&values)].map(|figure| figure.unwrap_or(f64::NAN))
    };
    Single {
        snr_db,
        trials,
        detected: found.len() as f64 / trials as f64,
        outliers: 1.0 - good.len() as f64 / found.len().max(1) as f64,
        ratio: std::array::from_fn(|i| {
            (good.iter().map(|trial| trial.normalised[i].powi(2)).sum::<f64>() / count).sqrt()
        }),
        nees: good.iter().map(|g| g.nees).sum::<f64>() / count,
        range_m: all(|trial| trial.range_m),
        angle_deg: all(|trial| trial.angle_deg),
    }
}

/// How often one path in one beam is found.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Detection {
    /// SNR per element of gain one and active subcarrier, dB.
    pub snr_db: f64,
    /// Trials.
    pub trials: usize,
    /// Share in which something was found.
    pub detected: f64,
    /// Wilson interval of that share, 95 %.
    pub interval: [f64; 2],
    /// Share in which the path was found to be within 1 m, whatever lobe its angle took.
    pub right_range: f64,
}

/// Counts detections of one path at one SNR, directions of arrival over the sphere. The threshold is that of whole sweeps.
pub fn detection(mode: Mode, snr_db: f64, trials: usize, seed: u64) -> Detection {
    let beam = 12;
    let range = Range::new(&[beam], seed);
    let found: Vec<[bool; 2]> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let truth = drawn(&range, beam, snr_db, &mut stream);
                let paths = range.sweep(&[truth], trial, estimator.as_mut());
                let near = |p: &EstimatedPath| (f64::from(p.path.c_tau_m) - truth.c_tau_m).abs() < 1.0;
                [!paths.is_empty(), paths.iter().any(near)]
            },
        )
        .collect();
    let count = |i: usize| found.iter().filter(|f| f[i]).count();
    Detection {
        snr_db,
        trials,
        detected: count(0) as f64 / trials as f64,
        interval: wilson(count(0), trials),
        right_range: count(1) as f64 / trials as f64,
    }
}

/// False alarms on noise.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct FalseAlarms {
    /// Sweeps of 72 beams of noise.
    pub sweeps: usize,
    /// Sweeps in which something was found.
    pub sweeps_with_paths: usize,
    /// Wilson interval of their share, 95 %.
    pub interval: [f64; 2],
}

/// Sweeps of noise alone.
pub fn false_alarms(mode: Mode, sweeps: usize, seed: u64) -> FalseAlarms {
    let range = Range::new(&[], seed);
    let count = (0..sweeps as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, index| usize::from(!range.sweep(&[], index, estimator.as_mut()).is_empty()),
        )
        .sum();
    FalseAlarms {
        sweeps,
        sweeps_with_paths: count,
        interval: wilson(count, sweeps),
    }
}
