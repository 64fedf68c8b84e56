//! Compares traced diffracted paths with a reference list of kinds D, RD and DR.

use serde::Serialize;

use super::check::{angle_error_rad, each_link, known_points, length_error_m, passes_edge, take_nearest};
use super::{Tally, TracedPath, Tracer};
use crate::paths::{Kind, Link, LinkPath};
use crate::scene::{Scene, Vec3};

/// Weaker paths, path gain in dB, need not be found and may be extra.
pub const STRONG_DB: f64 = -155.0;

const LENGTH_TOLERANCE_M: f64 = 1e-3;
const ANGLE_TOLERANCE_RAD: f64 = 1e-4;
const POINT_TOLERANCE_M: f64 = 1e-2;
const GAIN_TOLERANCE_DB: f64 = 0.1;
/// Paths this much weaker than the link's strongest diffracted one may have another gain, dB.
const WEAK_DB: f64 = 60.0;

/// Traced diffracted paths against a reference list; paths below [`STRONG_DB`] count only as counterparts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct DiffractionComparison {
    /// Links compared.
    pub links: usize,
    /// Strong reference paths that two tracers agree on.
    pub confirmed: Tally,
    /// Strong reference paths of one tracer.
    pub unconfirmed: Tally,
    /// Our strong paths.
    pub traced: Tally,
    /// Matched paths, weak ones excepted, whose gain is off by more than 0.1 dB.
    pub gain_off: usize,
    /// Greatest error of c tau among matched paths, m.
    pub worst_length_m: f64,
    /// Greatest angle error among matched paths, rad.
    pub worst_angle_rad: f64,
    /// Greatest distance of edge points of matched paths, m.
    pub worst_point_m: f64,
    /// Greatest error of the gain's magnitude among matched paths, weak ones excepted, dB.
    pub worst_gain_db: f64,
    /// The same of its phase, rad.
    pub worst_phase_rad: f64,
}

impl DiffractionComparison {
    /// Traces every link of a reference list and compares. Other kinds of paths are no part of it.
    pub fn run(tracer: &Tracer<'_>, reference: &[Link]) -> Self {
        each_link(tracer, reference, Self::of_link, Self::add)
    }

    /// Whether every strong reference path is found with its gain and nothing strong beyond them, edges excepted.
    pub fn passes(&self) -> bool {
        let unexplained =
            self.confirmed.unexplained() + self.unconfirmed.unexplained() + self.traced.unexplained();
        unexplained + self.gain_off == 0
    }

    fn of_link(scene: &Scene, link: &Link, traced: &[TracedPath]) -> Self {
        let mut result = Self {
            links: 1,
            ..Self::default()
        };
        let expected: Vec<&LinkPath> = link
            .paths
            .iter()
            .filter(|p| p.kind.is_some_and(is_compared))
            .collect();
        let mut free: Vec<&TracedPath> = traced.iter().filter(|p| is_compared(p.kind())).collect();
        let is_strong = |path: &TracedPath| 10.0 * libm::log10(path.gain.norm_sqr()) > STRONG_DB;
        result.traced.total = free.iter().filter(|path| is_strong(path)).count();
        let strongest_db = expected
            .iter()
            .filter_map(|p| p.gain_db())
            .fold(f64::NEG_INFINITY, f64::max);
        for path in expected {
            let found = take_nearest(&mut free, |traced| difference(path, traced));
            if let Some(found) = found {
                result.traced.matched += usize::from(is_strong(found));
                result.measure(path, found, strongest_db);
            }
            if path.gain_db().is_none_or(|gain_db| gain_db <= STRONG_DB) {
                continue;
            }
            let kind = if path.confirmed == Some(true) {
                &mut result.confirmed
            } else {
                &mut result.unconfirmed
            };
            kind.total += 1;
            kind.matched += usize::from(found.is_some());
            kind.at_edge += usize::from(
                found.is_none() && passes_edge(scene, &known_points(link, path), path.edge_point),
            );
        }
        result.traced.at_edge = free
            .iter()
            .filter(|path| is_strong(path))
            .filter(|path| {
                let points: Vec<[f64; 3]> = [&[link.tx], path.vertices(), &[link.rx]].concat();
                passes_edge(scene, &points, path.edge_point())
            })
            .count();
        result
    }

    fn measure(&mut self, path: &LinkPath, found: &TracedPath, strongest_db: f64) {
        self.worst_length_m = self.worst_length_m.max(length_error_m(path, found));
        self.worst_angle_rad = self.worst_angle_rad.max(angle_error_rad(path, found));
        self.worst_point_m = self.worst_point_m.max(point_error_m(path, found));
        let (Some([re, im]), Some(gain_db)) = (path.gain, path.gain_db()) else {
            return;
        };
        if gain_db < strongest_db - WEAK_DB {
            return;
        }
        let ratio = found.gain / nalgebra::Complex::new(re, im);
        let error_db = (20.0 * libm::log10(ratio.norm())).abs();
        self.gain_off += usize::from(error_db.is_nan() || error_db > GAIN_TOLERANCE_DB);
        self.worst_gain_db = self.worst_gain_db.max(error_db);
        self.worst_phase_rad = self.worst_phase_rad.max(libm::atan2(ratio.im, ratio.re).abs());
    }

    fn add(&mut self, other: &Self) {
        self.links += other.links;
        self.confirmed.add(&other.confirmed);
        self.unconfirmed.add(&other.unconfirmed);
        self.traced.add(&other.traced);
        self.gain_off += other.gain_off;
        self.worst_length_m = self.worst_length_m.max(other.worst_length_m);
        self.worst_angle_rad = self.worst_angle_rad.max(other.worst_angle_rad);
        self.worst_point_m = self.worst_point_m.max(other.worst_point_m);
        self.worst_gain_db = self.worst_gain_db.max(other.worst_gain_db);
        self.worst_phase_rad = self.worst_phase_rad.max(other.worst_phase_rad);
    }
}

/// One diffraction, with at most one reflection beside it.
fn is_compared(kind: Kind) -> bool {
    kind.edge().is_some() && kind.interactions().len() <= 2
}

fn point_error_m(path: &LinkPath, found: &TracedPath) -> f64 {
    match (path.edge_point, found.edge_point()) {
        (Some(expected), Some(found)) => (Vec3::from(expected) - Vec3::from(found)).norm(),
        _ => f64::INFINITY,
    }
}

/// How different two paths are, in units of the tolerances; infinite when the kinds differ.
fn difference(path: &LinkPath, found: &TracedPath) -> f64 {
    if path.kind != Some(found.kind()) {
        return f64::INFINITY;
    }
    (length_error_m(path, found) / LENGTH_TOLERANCE_M)
        .max(angle_error_rad(path, found) / ANGLE_TOLERANCE_RAD)
        .max(point_error_m(path, found) / POINT_TOLERANCE_M)
}
