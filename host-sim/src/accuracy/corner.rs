//! A corner above flat ground: two paths of nearly one length from two directions, and what the ground makes of each. All four lie
//! within a tap of each other and share every transmit beam, so none can be told without the other three.

use rayon::prelude::*;

use cslam_core::geometry::{Direction, Vector3};

use super::{Mode, Range, Truth, angle_rad, estimator};
use crate::crlb::{self, Receiver};
use crate::random::Stream;
use crate::statistics::{median, quantile};

/// Beam in which all four are.
const BEAM: u16 = 12;
/// SNR of the path off one wall, of the one off both, and what the ground takes, dB.
const SNR_DB: [f64; 2] = [20.0, 18.0];
const GROUND_DB: f64 = -5.0;
/// Height of the GMT, m.
const GMT_M: f64 = 1.5;

/// Figures of one distance.
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

/// Runs corners: the second way 0.05 to 0.6 m longer and 4 to 20 degrees aside, GMT at 1.5 m, UAV at 2 to 18 m.
pub fn corner(mode: Mode, distance_m: f64, trials: usize, seed: u64) -> Corner {
    let range = Range::new(&[BEAM], seed);
    let aod = range.aim(BEAM);
    let receiver = Receiver::default();
    let rows: Vec<[f64; 5]> = (0..trials as u32)
        .into_par_iter()
        .map_init(
            || estimator(mode),
            |estimator, trial| {
                let mut stream = Stream::new(seed, u64::from(trial));
                let height_m = 2.0 + 16.0 * stream.uniform();
                let azimuth = std::f64::consts::TAU * stream.uniform();
                let side = if stream.uniform() < 0.5 { -1.0 } else { 1.0 };
                let aside = side * (4.0 + 16.0 * stream.uniform()).to_radians();
                let longer_m = 0.05 + 0.55 * stream.uniform();
                let mut truth = |along_m: f64, azimuth: f64, gmt_m: f64, snr_db| {
                    let (sine, cosine) = (libm::sin(azimuth), libm::cos(azimuth));
                    let way = Vector3::new(along_m * cosine, along_m * sine, gmt_m - height_m);
                    Truth {
                        c_tau_m: way.norm(),
                        aoa: Direction::from_vector(way).expect("not zero"),
                        aod,
                        snr_db,
                        phase_rad: std::f64::consts::TAU * stream.uniform(),
                    }
                };
                let further_m = distance_m + longer_m;
                let truths = [
                    truth(distance_m, azimuth, GMT_M, SNR_DB[0]),
                    truth(further_m, azimuth + aside, GMT_M, SNR_DB[1]),
                    truth(distance_m, azimuth, -GMT_M, SNR_DB[0] + GROUND_DB),
                    truth(further_m, azimuth + aside, -GMT_M, SNR_DB[1] + GROUND_DB),
                ];
                let paths = range.sweep(&truths, trial, estimator.as_mut());
                let wall = &truths[0];
                let bound = crlb::joint(&receiver, &truths.map(|t| t.arrival())).expect("observable");
                let range_m =
                    |p: &cslam_core::ltd::EstimatedPath| (f64::from(p.path.c_tau_m) - wall.c_tau_m).abs();
                // A metre counts as much as a degree.
                let far = |p: &&cslam_core::ltd::EstimatedPath| range_m(p) + angle_rad(p, wall).to_degrees();
                let nearest = paths.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
                let [range_m, angle_deg] = nearest.map_or([f64::INFINITY; 2], |p| {
                    [range_m(p), angle_rad(p, wall).to_degrees()]
                });
                let angular = (0.5 * (bound[(1, 1)] + bound[(2, 2)])).sqrt().to_degrees();
                [
                    range_m,
                    angle_deg,
                    bound[(0, 0)].sqrt(),
                    angular,
                    paths.len() as f64,
                ]
            },
        )
        .collect();
    let column = |i: usize| rows.iter().map(|row| row[i]).collect::<Vec<_>>();
    let at = |i: usize, q: f64| quantile(&column(i), q).unwrap_or(f64::NAN);
    let middle = |i: usize| median(&column(i)).unwrap_or(f64::NAN);
    Corner {
        distance_m,
        trials,
        paths: column(4).iter().sum::<f64>() / trials as f64,
        range_m: [at(0, 0.5), at(0, 0.9)],
        angle_deg: [at(1, 0.5), at(1, 0.9)],
        bound: [middle(2), middle(3)],
    }
}
