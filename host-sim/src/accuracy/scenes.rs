//! Whole sweeps: nine paths over 30 dB, and the angle of departure.

use rayon::prelude::*;

use super::{Mode, Range, Truth, angle_rad, direction, estimator};
use crate::random::Stream;
use crate::statistics::{median, rms};

/// A path counts as found within these (docs/path-estimation.md).
const GATE_M: f64 = 0.3;
const GATE_RAD: f64 = 0.034_907;
/// Paths of a scene.
const PATHS: usize = 9;

/// Figures of nine-path scenes.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Scenes {
    /// SNR of the strongest path, dB.
    pub snr_db: f64,
    /// Scenes.
    pub scenes: usize,
    /// Share of the paths found, by power under the strongest one: 0-10, 10-20, 20-30 dB.
    pub detected: [f64; 3],
    /// Estimates that are no path, per scene.
    pub false_alarms: f64,
    /// Strongest path: share within 0.2 m and 1 degree, median range error in m, median angle error in deg.
    pub strongest: [f64; 3],
}

/// A scene: the strongest path at `snr_db`, the others uniform over the 30 dB below.
fn draw(stream: &mut Stream, snr_db: f64) -> Vec<Truth> {
    (0..PATHS)
        .map(|index| Truth {
            c_tau_m: 20.0 + 280.0 * stream.uniform(),
            aoa: direction(stream, -45.0..60.0),
            aod: direction(stream, -3.0..30.0),
            snr_db: snr_db - if index == 0 { 0.0 } else { 30.0 * stream.uniform() },
            phase_rad: std::f64::consts::TAU * stream.uniform(),
        })
        .collect()
}

/// Runs nine-path scenes.
pub fn scenes(mode: Mode, snr_db: f64, scenes: usize, seed: u64) -> Scenes {
    let range = Range::new(&[], seed);
    let results: Vec<([[usize; 2]; 3], usize, [f64; 2])> = (0..scenes as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, index| {
                let truths = draw(&mut Stream::new(seed, u64::from(index)), snr_db);
                let paths = range.sweep(&truths, index, estimator.as_mut());
                let near = |p: &cslam_core::paths::EstimatedPath, t: &Truth| {
                    (f64::from(p.path.c_tau_m) - t.c_tau_m).abs() < GATE_M && angle_rad(p, t) < GATE_RAD
                };
                // Found and all, by power.
                let mut counts = [[0; 2]; 3];
                for t in &truths {
                    let bin = (((snr_db - t.snr_db) / 10.0) as usize).min(2);
                    counts[bin][0] += usize::from(paths.iter().any(|p| near(p, t)));
                    counts[bin][1] += 1;
                }
                let false_alarms = paths
                    .iter()
                    .filter(|p| !truths.iter().any(|t| near(p, t)))
                    .count();
                let best = paths
                    .iter()
                    .map(|p| {
                        [
                            (f64::from(p.path.c_tau_m) - truths[0].c_tau_m).abs(),
                            angle_rad(p, &truths[0]).to_degrees(),
                        ]
                    })
                    .min_by(|a, b| (a[0] + a[1]).total_cmp(&(b[0] + b[1])))
                    .unwrap_or([f64::INFINITY; 2]);
                (counts, false_alarms, best)
            },
        )
        .collect();
    let count = |bin: usize, which: usize| results.iter().map(|r| r.0[bin][which]).sum::<usize>() as f64;
    let column = |i: usize| results.iter().map(|r| r.2[i]).collect::<Vec<_>>();
    let good = results.iter().filter(|r| r.2[0] < 0.2 && r.2[1] < 1.0).count();
    Scenes {
        snr_db,
        scenes,
        detected: std::array::from_fn(|bin| count(bin, 0) / count(bin, 1)),
        false_alarms: results.iter().map(|r| r.1).sum::<usize>() as f64 / scenes as f64,
        strongest: [
            good as f64 / scenes as f64,
            median(&column(0)).unwrap_or(f64::NAN),
            median(&column(1)).unwrap_or(f64::NAN),
        ],
    }
}

/// Figures of the angle of departure.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Departures {
    /// SNR in the best beam, dB.
    pub snr_db: f64,
    /// Trials.
    pub trials: usize,
    /// RMSE of the angle, deg (both components together).
    pub rms_deg: f64,
    /// Median, deg.
    pub median_deg: f64,
    /// RMS of the error over the estimator's own standard deviation of a component, per component.
    pub honesty: f64,
}

/// Runs one path over a whole sweep; its angle of departure anywhere in the codebook's sector.
pub fn departures(mode: Mode, snr_db: f64, trials: usize, seed: u64) -> Departures {
    let range = Range::new(&[], seed);
    let errors: Vec<[f64; 2]> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, index| {
                let mut stream = Stream::new(seed, u64::from(index));
                let truth = Truth {
                    c_tau_m: 20.0 + 280.0 * stream.uniform(),
                    aoa: direction(&mut stream, -45.0..45.0),
                    aod: direction(&mut stream, 0.0..25.0),
                    snr_db,
                    phase_rad: 0.0,
                };
                let paths = range.sweep(&[truth], index, estimator.as_mut());
                let departure = paths.first()?.path.aod?;
                let u = departure.direction.vector().cast::<f64>();
                let v = truth.aod.vector();
                let error = libm::atan2(u.cross(v).norm(), u.dot(v));
                Some([
                    error.to_degrees(),
                    error / f64::from(departure.sigma_rad) / std::f64::consts::SQRT_2,
                ])
            },
        )
        .flatten()
        .collect();
    let column = |i: usize| errors.iter().map(|e| e[i]).collect::<Vec<_>>();
    Departures {
        snr_db,
        trials,
        rms_deg: rms(&column(0)).unwrap_or(f64::NAN),
        median_deg: median(&column(0)).unwrap_or(f64::NAN),
        honesty: rms(&column(1)).unwrap_or(f64::NAN),
    }
}
