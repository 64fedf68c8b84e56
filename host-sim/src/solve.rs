//! Reflection points of a whole paths file, and how they compare with the truth where the file has it.

use std::collections::BTreeMap;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::Real;
use cslam_core::reflection::{Form, Gates, InputError, Verdict, solve};

use crate::measurement::{self, Sigmas};
use crate::paths::{Link, LinkPath};

/// How to solve.
#[derive(Clone, Copy, Debug)]
pub struct Settings<T: Real> {
    /// Closed form.
    pub form: Form,
    /// Gates.
    pub gates: Gates<T>,
    /// Standard deviations for paths without covariance.
    pub sigmas: Sigmas,
    /// Whether the angles of departure of the file are used.
    pub use_aod: bool,
}

/// What became of one path.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved<T: Real> {
    /// Index of the link.
    pub link: usize,
    /// Index of the path in the link.
    pub path: usize,
    /// `ok`, or the reason in words.
    pub verdict: &'static str,
    /// The point, m.
    pub point: Option<[T; 3]>,
    /// Root of the trace of the point's covariance, m.
    pub sigma_m: Option<T>,
}

/// Solves every path of every link, in order.
pub fn solve_all<'a, T: Real>(
    links: &'a [Link],
    settings: &'a Settings<T>,
) -> impl Iterator<Item = Solved<T>> + 'a {
    links.iter().enumerate().flat_map(move |(link_index, link)| {
        link.paths.iter().enumerate().map(move |(path_index, path)| {
            let (verdict, point, sigma_m) = match solve_one(link, path, settings) {
                Ok(Verdict::Accepted(point)) => {
                    ("ok", Some(point.position.to_array()), Some(point.sigma_m()))
                }
                Ok(Verdict::Rejected(reason)) => (reason.as_str(), None, None),
                Err(error) => (error.as_str(), None, None),
            };
            Solved {
                link: link_index,
                path: path_index,
                verdict,
                point,
                sigma_m,
            }
        })
    })
}

fn solve_one<T: Real>(
    link: &Link,
    path: &LinkPath,
    settings: &Settings<T>,
) -> Result<Verdict<T>, InputError> {
    let ends = measurement::ends(link, &settings.sigmas)?;
    let mut measured = measurement::path(path, &settings.sigmas)?;
    if !settings.use_aod {
        measured.aod = None;
    }
    solve(&ends, &measured, settings.form, &settings.gates)
}

/// Excess delay of a path over the straight way, m.
pub fn excess_m(link: &Link, path: &LinkPath) -> f64 {
    let square = |i: usize| (link.tx[i] - link.rx[i]).powi(2);
    path.delay_s * SPEED_OF_LIGHT_M_PER_S - (square(0) + square(1) + square(2)).sqrt()
}

/// Comparison of solved points with the file's truth.
#[derive(Clone, Debug, Default)]
pub struct Comparison {
    /// Verdict -> number of paths of order 0, 1, 2, 3 or more, and unknown.
    pub verdicts: BTreeMap<&'static str, [usize; 5]>,
    /// Distances from the points of accepted first-order paths to their `last_vertex`, m.
    pub errors_m: Vec<f64>,
    /// The same for those whose excess delay exceeds 1 m.
    pub errors_above_1m_excess_m: Vec<f64>,
    /// First-order paths with more than 1 m of excess delay, accepted or not.
    pub first_order_above_1m_excess: usize,
}

impl Comparison {
    /// Adds one solved path.
    pub fn add<T: Real>(&mut self, links: &[Link], solved: &Solved<T>) {
        let link = &links[solved.link];
        let path = &link.paths[solved.path];
        let column = path.order.map_or(4, |order| usize::from(order).min(3));
        self.verdicts.entry(solved.verdict).or_default()[column] += 1;
        if path.order != Some(1) {
            return;
        }
        let above = excess_m(link, path) > 1.0;
        self.first_order_above_1m_excess += usize::from(above);
        if let (Some(point), Some(truth)) = (solved.point, path.last_vertex) {
            let square = |i: usize| (point[i].to_f64() - truth[i]).powi(2);
            let error_m = (square(0) + square(1) + square(2)).sqrt();
            self.errors_m.push(error_m);
            if above {
                self.errors_above_1m_excess_m.push(error_m);
            }
        }
    }

    /// Higher-order paths (order 2 and more) and how many of them were not accepted.
    pub fn higher_order_caught(&self) -> (usize, usize) {
        let count = |accepted: bool| -> usize {
            let of = self
                .verdicts
                .iter()
                .filter(|(verdict, _)| (**verdict == "ok") == accepted);
            of.map(|(_, n)| n[2] + n[3]).sum()
        };
        (count(true) + count(false), count(false))
    }
}
