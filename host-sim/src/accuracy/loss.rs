//! What fixed point costs: the flying estimator against its double-precision twin, trial by trial.

use rayon::prelude::*;

use super::single::{OUTLIER_SIGMAS, drawn};
use super::twin::{Fitted, Twin};
use super::{Mode, Range, error_of, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;

/// Beam of all trials.
const BEAM: u16 = 12;

/// Figures of one SNR.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Loss {
    /// SNR per element of gain one and active subcarrier, dB.
    pub snr_db: f64,
    /// Trials that count: neither one is an outlier.
    pub trials: usize,
    /// RMS over range and both angles of the error over its bound: flying estimator, 12-bit converter.
    pub fixed: f64,
    /// The same of the twin on the same samples.
    pub twin: f64,
    /// RMSE of the flying estimator over that of the twin, less one, and its standard error (the trials are paired).
    pub loss: [f64; 2],
    /// The same against the twin on samples of the same noise behind a 16-bit converter: converter and fixed point.
    pub with_converter: [f64; 2],
}

/// Squared errors in units of the bound, over 3: flying, twin, twin behind 16 bits.
type Squares = [f64; 3];

/// Runs one path at one SNR in one beam.
pub fn loss(snr_db: f64, trials: usize, seed: u64) -> Loss {
    let (range, wide) = (Range::new(&[BEAM], seed), Range::with_bits(&[BEAM], seed, 16));
    let (twin, receiver) = (Twin::default(), <Receiver>::default());
    let squares: Vec<Squares> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(Mode::Best),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let truth = drawn(&range, BEAM, snr_db, &mut stream);
                let bound = crlb::single(&receiver, &truth.arrival())?;
                let square = |found: Fitted| {
                    let e = error_of(found.c_tau_m, found.aoa.vector(), &truth);
                    let normalised: [f64; 3] = std::array::from_fn(|i| e[i] / bound[(i, i)].sqrt());
                    let inside = normalised.iter().all(|e| e.abs() < OUTLIER_SIGMAS);
                    inside.then(|| normalised.iter().map(|e| e * e).sum::<f64>() / 3.0)
                };
                let mut sweep = range.hear(&[truth], trial);
                let on_same = square(twin.strongest(sweep.blocks.first()?))?;
                let on_wide = square(twin.strongest(wide.hear(&[truth], trial).blocks.first()?))?;
                for block in sweep.strongest_first() {
                    estimator.push_beam(block.view());
                }
                let path = estimator.finish().first()?.path;
                let aoa = cslam_core::geometry::Direction::from_vector(path.aoa.vector().cast()).ok()?;
                let flying = square(Fitted {
                    c_tau_m: f64::from(path.c_tau_m),
                    aoa,
                })?;
                Some([flying, on_same, on_wide])
            },
        )
        .flatten()
        .collect();
    let mean = |i: usize| squares.iter().map(|s| s[i]).sum::<f64>() / squares.len() as f64;
    Loss {
        snr_db,
        trials: squares.len(),
        fixed: mean(0).sqrt(),
        twin: mean(1).sqrt(),
        loss: compare(&squares, 1),
        with_converter: compare(&squares, 2),
    }
}

/// RMSE of the first column over that of another, less one, and its standard error by the delta method.
fn compare(squares: &[Squares], other: usize) -> [f64; 2] {
    let sum = |i: usize| squares.iter().map(|s| s[i]).sum::<f64>();
    let ratio = sum(0) / sum(other);
    let spread: f64 = squares.iter().map(|s| (s[0] - ratio * s[other]).powi(2)).sum();
    let of_ratio = spread.sqrt() / sum(other);
    [ratio.sqrt() - 1.0, 0.5 * of_ratio / ratio.sqrt()]
}
