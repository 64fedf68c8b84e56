//! Paths over flat ground, which makes a second one of each: the line of sight, and the two ways round a corner. They lie within a
//! few taps of each other and share every transmit beam, so none can be told without the others.

use rayon::prelude::*;

use cslam_core::geometry::{Direction, Gmt, Vector3};
use cslam_core::paths::EstimatedPath;

use super::{Mode, Range, Truth, angle_rad, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;
use crate::statistics::{median, quantile};

/// Beam in which all paths are.
const BEAM: u16 = 12;
/// Height of the GMT, m.
const GMT_M: f64 = 1.5;

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

/// Figures of a corner at one distance.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Corner {
    /// Horizontal length of the way by one wall, m.
    pub distance_m: f64,
    /// Trials.
    pub trials: usize,
    /// Paths reported, mean.
    pub paths: f64,
    /// Median and 90 % error of the length of the estimate that is nearest to the path off one wall, m.
    pub range_m: [f64; 2],
    /// Median and 90 % error of its direction, deg.
    pub angle_deg: [f64; 2],
    /// Median bound of both: standard deviation in m, and in deg along a tangent.
    pub bound: [f64; 2],
}

/// The UAV of a trial and how it looks to the GMT.
struct Place {
    height_m: f64,
    azimuth_rad: f64,
    aod: Direction<Gmt, f64>,
}

impl Place {
    /// The path from a GMT, or its image, at this height and so far away.
    fn path(&self, stream: &mut Stream, along_m: f64, aside_rad: f64, gmt_m: f64, snr_db: f64) -> Truth {
        let azimuth_rad = self.azimuth_rad + aside_rad;
        let (sine, cosine) = (libm::sin(azimuth_rad), libm::cos(azimuth_rad));
        let way = Vector3::new(along_m * cosine, along_m * sine, gmt_m - self.height_m);
        Truth {
            c_tau_m: way.norm(),
            aoa: Direction::from_vector(way).expect("not zero"),
            aod: self.aod,
            snr_db,
            phase_rad: std::f64::consts::TAU * stream.uniform(),
        }
    }
}

/// What a trial gave: the estimate against the first of the paths.
struct Outcome<const N: usize> {
    truths: [Truth; N],
    paths: usize,
    /// Error of length, m, and of direction, deg.
    error: [f64; 2],
    /// Bound of both: standard deviation in m, and in deg along a tangent.
    bound: [f64; 2],
}

/// Error of an estimate: length in m, direction in deg.
fn error(path: &EstimatedPath, truth: &Truth) -> [f64; 2] {
    [
        (f64::from(path.path.c_tau_m) - truth.c_tau_m).abs(),
        angle_rad(path, truth).to_degrees(),
    ]
}

/// Draws the paths of each trial, UAV at 2 to 18 m, and judges the estimate that `taken` takes for the first of them.
fn run<const N: usize>(
    mode: Mode,
    trials: usize,
    seed: u64,
    draw: impl Fn(&Place, &mut Stream) -> [Truth; N] + Sync,
    taken: impl Fn(&[EstimatedPath], &Truth) -> Option<EstimatedPath> + Sync,
) -> Vec<Outcome<N>> {
    let range = Range::new(&[BEAM], seed);
    let aod = range.aim(BEAM);
    let receiver = <Receiver>::default();
    (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let place = Place {
                    height_m: 2.0 + 16.0 * stream.uniform(),
                    azimuth_rad: std::f64::consts::TAU * stream.uniform(),
                    aod,
                };
                let truths = draw(&place, &mut stream);
                let paths = range.sweep(&truths, trial, estimator.as_mut());
                let bound = crlb::joint(&receiver, &truths.map(|t| t.arrival())).expect("observable");
                let angular = (0.5 * (bound[(1, 1)] + bound[(2, 2)])).sqrt().to_degrees();
                Outcome {
                    truths,
                    paths: paths.len(),
                    error: taken(&paths, &truths[0]).map_or([f64::INFINITY; 2], |p| error(&p, &truths[0])),
                    bound: [bound[(0, 0)].sqrt(), angular],
                }
            },
        )
        .collect()
}

fn column<const N: usize>(outcomes: &[Outcome<N>], of: impl Fn(&Outcome<N>) -> f64) -> Vec<f64> {
    outcomes.iter().map(of).collect()
}

fn middle<const N: usize>(outcomes: &[Outcome<N>], of: impl Fn(&Outcome<N>) -> f64) -> f64 {
    median(&column(outcomes, of)).unwrap_or(f64::NAN)
}

/// Median and 90 % of a part of the error.
fn spread<const N: usize>(outcomes: &[Outcome<N>], part: usize) -> [f64; 2] {
    let errors = column(outcomes, |o| o.error[part]);
    [0.5, 0.9].map(|q| quantile(&errors, q).unwrap_or(f64::NAN))
}

/// Runs the line of sight (20 dB) with a ground bounce 6 dB under it in the same beam: GMT at 1.5 m, UAV at 2 to 18 m.
pub fn bounce(mode: Mode, distance_m: f64, trials: usize, seed: u64) -> Bounce {
    let draw = |place: &Place, stream: &mut Stream| {
        [(GMT_M, 20.0), (-GMT_M, 14.0)]
            .map(|(gmt_m, snr_db)| place.path(stream, distance_m, 0.0, gmt_m, snr_db))
    };
    let outcomes = run(mode, trials, seed, draw, |paths, _| paths.first().copied());
    let apart_deg = |[los, bounce]: &[Truth; 2]| {
        libm::acos(los.aoa.vector().dot(bounce.aoa.vector()).min(1.0)).to_degrees()
    };
    Bounce {
        distance_m,
        trials,
        apart: [
            middle(&outcomes, |o| o.truths[1].c_tau_m - o.truths[0].c_tau_m),
            middle(&outcomes, |o| apart_deg(&o.truths)),
        ],
        range_m: spread(&outcomes, 0),
        angle_deg: spread(&outcomes, 1),
        bound: [0, 1].map(|part| middle(&outcomes, |o| o.bound[part])),
    }
}

/// Runs corners: one way by a wall (20 dB), one by both (18 dB), 0.05 to 0.6 m longer and 4 to 20 degrees aside, and 5 dB under
/// each what the ground makes of it. GMT at 1.5 m, UAV at 2 to 18 m.
pub fn corner(mode: Mode, distance_m: f64, trials: usize, seed: u64) -> Corner {
    let draw = |place: &Place, stream: &mut Stream| {
        let side = if stream.uniform() < 0.5 { -1.0 } else { 1.0 };
        let aside_rad = side * (4.0 + 16.0 * stream.uniform()).to_radians();
        let further_m = distance_m + (0.05 + 0.55 * stream.uniform());
        [
            (distance_m, 0.0, GMT_M, 20.0),
            (further_m, aside_rad, GMT_M, 18.0),
            (distance_m, 0.0, -GMT_M, 15.0),
            (further_m, aside_rad, -GMT_M, 13.0),
        ]
        .map(|(along_m, aside_rad, gmt_m, snr_db)| place.path(stream, along_m, aside_rad, gmt_m, snr_db))
    };
    // A metre counts as much as a degree.
    let far = |path: &EstimatedPath, truth: &Truth| error(path, truth).iter().sum::<f64>();
    let nearest = |paths: &[EstimatedPath], truth: &Truth| {
        let nearer = |a: &&EstimatedPath, b: &&EstimatedPath| far(a, truth).total_cmp(&far(b, truth));
        paths.iter().min_by(nearer).copied()
    };
    let outcomes = run(mode, trials, seed, draw, nearest);
    Corner {
        distance_m,
        trials,
        paths: column(&outcomes, |o| o.paths as f64).iter().sum::<f64>() / trials as f64,
        range_m: spread(&outcomes, 0),
        angle_deg: spread(&outcomes, 1),
        bound: [0, 1].map(|part| middle(&outcomes, |o| o.bound[part])),
    }
}
