//! Two close paths in one transmit beam: pairs of given separation.

use rayon::prelude::*;

use cslam_core::geometry::Direction;

use super::{Mode, Range, Truth, angle_rad, direction, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;

/// Beam of all cases here; what matters is that both paths are in it.
const BEAM: u16 = 12;
/// A path counts as found within these.
const GATE_M: f64 = 0.2;
const GATE_RAD: f64 = 0.017_453;

/// Figures of one separation.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Pairs {
    /// Separation in c tau, m.
    pub apart_m: f64,
    /// Separation in angle, deg.
    pub apart_deg: f64,
    /// Second path against the first, dB.
    pub second_db: f64,
    /// Trials.
    pub trials: usize,
    /// Share of the trials in which both are within 0.2 m and 1 degree.
    pub both: f64,
    /// Share in which the bound of both, in every parameter, lies within a third of those gates: what any unbiased
    /// estimator could reach.
    pub possible: f64,
}

/// Runs pairs of a separation, the first path at 20 dB.
pub fn pairs(mode: Mode, apart_m: f64, apart_deg: f64, second_db: f64, trials: usize, seed: u64) -> Pairs {
    let range = Range::new(&[BEAM], seed);
    let aod = range.aim(BEAM);
    let receiver = <Receiver>::default();
    let results: Vec<(bool, bool)> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let first = Truth {
                    c_tau_m: 20.0 + 200.0 * stream.uniform(),
                    aoa: direction(&mut stream, -45.0..45.0),
                    aod,
                    snr_db: 20.0,
                    phase_rad: std::f64::consts::TAU * stream.uniform(),
                };
                let (e1, e2) = first.aoa.tangents();
                let turn = std::f64::consts::TAU * stream.uniform();
                let across = e1 * libm::cos(turn) + e2 * libm::sin(turn);
                let apart = apart_deg.to_radians();
                let u = first.aoa.vector() * libm::cos(apart) + across * libm::sin(apart);
                let second = Truth {
                    c_tau_m: first.c_tau_m + apart_m,
                    aoa: Direction::from_vector(u).expect("unit"),
                    snr_db: 20.0 + second_db,
                    phase_rad: std::f64::consts::TAU * stream.uniform(),
                    ..first
                };
                let truths = [first, second];
                let paths = range.sweep(&truths, trial, estimator.as_mut());
                let near = |truth: &Truth| {
                    paths.iter().position(|p| {
                        (f64::from(p.path.c_tau_m) - truth.c_tau_m).abs() < GATE_M
                            && angle_rad(p, truth) < GATE_RAD
                    })
                };
                // Two truths may not share one estimate.
                let both = match (near(&first), near(&second)) {
                    (Some(a), Some(b)) => {
                        a != b || paths.iter().filter(|p| near_any(p, &truths)).count() >= 2
                    }
                    _ => false,
                };
                let bound = crlb::joint(&receiver, &truths.map(|t| t.arrival()));
                let possible = bound.is_some_and(|b| {
                    (0..6).all(|i| 3.0 * b[(i, i)].sqrt() < if i % 3 == 0 { GATE_M } else { GATE_RAD })
                });
                (both, possible)
            },
        )
        .collect();
    let share =
        |pick: fn(&(bool, bool)) -> bool| results.iter().filter(|r| pick(r)).count() as f64 / trials as f64;
    Pairs {
        apart_m,
        apart_deg,
        second_db,
        trials,
        both: share(|r| r.0),
        possible: share(|r| r.1),
    }
}

fn near_any(path: &cslam_core::paths::EstimatedPath, truths: &[Truth; 2]) -> bool {
    truths
        .iter()
        .any(|t| (f64::from(path.path.c_tau_m) - t.c_tau_m).abs() < GATE_M && angle_rad(path, t) < GATE_RAD)
}
