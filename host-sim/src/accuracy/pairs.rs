//! Two close paths in one transmit beam: pairs of given separation, and the line of sight with its ground bounce.

use rayon::prelude::*;

use cslam_core::geometry::{Direction, Vector3};

use super::{Mode, Range, Truth, angle_rad, direction, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;
use crate::statistics::{median, quantile};

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
    let receiver = Receiver::default();
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

/// Figures of the line of sight beside a ground bounce.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Bounce {
    /// Horizontal distance, m.
    pub distance_m: f64,
    /// Trials.
    pub trials: usize,
    /// Median excess length of the bounce, m, and its angle from the line of sight, deg.
    pub apart: [f64; 2],
    /// Median and 90 % error of the line of sight's length, m.
    pub range_m: [f64; 2],
    /// Median and 90 % error of its direction, deg.
    pub angle_deg: [f64; 2],
    /// Median bound of both: standard deviation in m, and in deg along a tangent.
    pub bound: [f64; 2],
}

/// Runs the line of sight (20 dB) with a ground bounce 6 dB under it in the same beam: GMT at 1.5 m, UAV at 2 to 18 m.
pub fn bounce(mode: Mode, distance_m: f64, trials: usize, seed: u64) -> Bounce {
    let range = Range::new(&[BEAM], seed);
    let aod = range.aim(BEAM);
    let receiver = Receiver::default();
    let rows: Vec<[f64; 6]> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let height_m = 2.0 + 16.0 * stream.uniform();
                let azimuth = std::f64::consts::TAU * stream.uniform();
                let mut truth = |gmt_height_m: f64, snr_db| {
                    let (sine, cosine) = (libm::sin(azimuth), libm::cos(azimuth));
                    let v = Vector3::new(distance_m * cosine, distance_m * sine, gmt_height_m - height_m);
                    Truth {
                        c_tau_m: v.norm(),
                        aoa: Direction::from_vector(v).expect("not zero"),
                        aod,
                        snr_db,
                        phase_rad: std::f64::consts::TAU * stream.uniform(),
                    }
                };
                let truths = [truth(1.5, 20.0), truth(-1.5, 14.0)];
                let paths = range.sweep(&truths, trial, estimator.as_mut());
                let los = &truths[0];
                let [range_m, angle] = paths.first().map_or([f64::INFINITY; 2], |p| {
                    [
                        (f64::from(p.path.c_tau_m) - los.c_tau_m).abs(),
                        angle_rad(p, los).to_degrees(),
                    ]
                });
                let bound = crlb::joint(&receiver, &truths.map(|t| t.arrival())).expect("observable");
                let angular = (0.5 * (bound[(1, 1)] + bound[(2, 2)])).sqrt().to_degrees();
                let apart_deg =
                    libm::acos(los.aoa.vector().dot(truths[1].aoa.vector()).min(1.0)).to_degrees();
                [
                    range_m,
                    angle,
                    bound[(0, 0)].sqrt(),
                    angular,
                    truths[1].c_tau_m - los.c_tau_m,
                    apart_deg,
                ]
            },
        )
        .collect();
    let at =
        |i: usize, q: f64| quantile(&rows.iter().map(|r| r[i]).collect::<Vec<_>>(), q).unwrap_or(f64::NAN);
    let middle = |i: usize| median(&rows.iter().map(|r| r[i]).collect::<Vec<_>>()).unwrap_or(f64::NAN);
    Bounce {
        distance_m,
        trials,
        apart: [middle(4), middle(5)],
        range_m: [at(0, 0.5), at(0, 0.9)],
        angle_deg: [at(1, 0.5), at(1, 0.9)],
        bound: [middle(2), middle(3)],
    }
}

fn near_any(path: &cslam_core::ltd::EstimatedPath, truths: &[Truth; 2]) -> bool {
    truths
        .iter()
        .any(|t| (f64::from(path.path.c_tau_m) - t.c_tau_m).abs() < GATE_M && angle_rad(path, t) < GATE_RAD)
}
