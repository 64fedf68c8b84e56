//! Compares traced paths with a reference list: found, missing, beyond the list, and how far off.

use core::f64::consts::{PI, TAU};

use super::{TracedPath, Tracer};
use crate::paths::{Link, LinkPath};
use crate::scene::{Scene, Vec3};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use rayon::prelude::*;
use serde::Serialize;

/// A path that passes an edge this closely may be missing or extra, m: it appears and vanishes with rounding.
pub const EDGE_EXCEPTION_M: f64 = 5e-3;

const LENGTH_TOLERANCE_M: f64 = 3e-3;
const ANGLE_TOLERANCE_RAD: f64 = 1e-6;
const GAIN_TOLERANCE_DB: f64 = 0.1;
/// Paths this much weaker than the link's strongest may have another gain, dB.
const WEAK_DB: f64 = 40.0;

/// Paths of one kind: how many there are, and how many of them have a counterpart.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Tally {
    /// All paths of the kind.
    pub total: usize,
    /// With a counterpart of the same order, within 3 mm of c tau and 1e-6 rad of each angle.
    pub matched: usize,
    /// Without one, but passing an edge within [`EDGE_EXCEPTION_M`].
    pub at_edge: usize,
}

impl Tally {
    /// Paths without a counterpart and without an excuse.
    pub fn unexplained(&self) -> usize {
        self.total - self.matched - self.at_edge
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.total += other.total;
        self.matched += other.matched;
        self.at_edge += other.at_edge;
    }
}

/// Traced paths against a reference list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Comparison {
    /// Links compared.
    pub links: usize,
    /// Reference paths that two tracers agree on.
    pub confirmed: Tally,
    /// Reference paths of one tracer.
    pub unconfirmed: Tally,
    /// Our paths.
    pub traced: Tally,
    /// Matched paths whose gain is off by more than 0.1 dB, those 40 dB below the strongest excepted.
    pub gain_off: usize,
    /// Greatest error of c tau among matched paths, m.
    pub worst_length_m: f64,
    /// Greatest angle error among matched paths, rad.
    pub worst_angle_rad: f64,
    /// Greatest gain error among matched paths, weak ones excepted, dB.
    pub worst_gain_db: f64,
}

impl Comparison {
    /// Traces every link of a reference list and compares.
    pub fn run(tracer: &Tracer<'_>, reference: &[Link]) -> Self {
        each_link(tracer, reference, Self::of_link, Self::add)
    }

    /// Whether the tracer is right: every reference path found and nothing beyond them, edges excepted, gains included.
    pub fn passes(&self) -> bool {
        let unexplained = self.confirmed.unexplained()
            + self.unconfirmed.unexplained()
            + self.traced.unexplained()
            + self.gain_off;
        unexplained == 0
    }

    /// Compares the traced paths of one link with its reference.
    fn of_link(scene: &Scene, link: &Link, traced: &[TracedPath]) -> Self {
        let mut result = Self {
            links: 1,
            ..Self::default()
        };
        result.traced.total = traced.len();
        let strongest = link.paths.iter().filter_map(amplitude).fold(0.0, f64::max);
        let mut free: Vec<&TracedPath> = traced.iter().collect();
        for path in &link.paths {
            let found = take_nearest(&mut free, |traced| difference(path, traced));
            if let Some(found) = found {
                result.measure(path, found, strongest);
            }
            let kind = if path.confirmed == Some(true) {
                &mut result.confirmed
            } else {
                &mut result.unconfirmed
            };
            kind.total += 1;
            kind.matched += usize::from(found.is_some());
            kind.at_edge +=
                usize::from(found.is_none() && passes_edge(scene, &known_points(link, path), None));
        }
        result.traced.matched = traced.len() - free.len();
        result.traced.at_edge = free
            .iter()
            .filter(|path| {
                let points: Vec<[f64; 3]> = [&[link.tx], path.vertices(), &[link.rx]].concat();
                passes_edge(scene, &points, None)
            })
            .count();
        result
    }

    fn measure(&mut self, path: &LinkPath, found: &TracedPath, strongest: f64) {
        self.worst_length_m = self.worst_length_m.max(length_error_m(path, found));
        self.worst_angle_rad = self.worst_angle_rad.max(angle_error_rad(path, found));
        let Some(amplitude) = amplitude(path) else { return };
        if 20.0 * libm::log10(amplitude / strongest) < -WEAK_DB {
            return;
        }
        let error_db = (20.0 * libm::log10(found.gain.norm() / amplitude)).abs();
        self.gain_off += usize::from(error_db.is_nan() || error_db > GAIN_TOLERANCE_DB);
        self.worst_gain_db = self.worst_gain_db.max(error_db);
    }

    fn add(&mut self, other: &Self) {
        self.links += other.links;
        self.confirmed.add(&other.confirmed);
        self.unconfirmed.add(&other.unconfirmed);
        self.traced.add(&other.traced);
        self.gain_off += other.gain_off;
        self.worst_length_m = self.worst_length_m.max(other.worst_length_m);
        self.worst_angle_rad = self.worst_angle_rad.max(other.worst_angle_rad);
        self.worst_gain_db = self.worst_gain_db.max(other.worst_gain_db);
    }
}

fn amplitude(path: &LinkPath) -> Option<f64> {
    path.gain.map(|[re, im]| (re * re + im * im).sqrt())
}

pub(super) fn length_error_m(path: &LinkPath, found: &TracedPath) -> f64 {
    (path.delay_s * SPEED_OF_LIGHT_M_PER_S - found.length_m).abs()
}

/// Greatest of the zenith and azimuth errors at both ends; azimuths count by the arc that they make.
pub(super) fn angle_error_rad(path: &LinkPath, found: &TracedPath) -> f64 {
    let end = |zenith: f64, azimuth: f64, found: [f64; 2]| {
        let turn = (azimuth - found[1] + PI).rem_euclid(TAU) - PI;
        (zenith - found[0]).abs().max(turn.abs() * libm::sin(zenith))
    };
    let arrival = end(path.aoa_zenith_rad, path.aoa_azimuth_rad, found.arrival_rad);
    match (path.aod_zenith_rad, path.aod_azimuth_rad) {
        (Some(zenith), Some(azimuth)) => arrival.max(end(zenith, azimuth, found.departure_rad)),
        _ => arrival,
    }
}

/// How different two paths are, in units of the tolerances; infinite when the orders differ.
fn difference(path: &LinkPath, found: &TracedPath) -> f64 {
    if path.order.map(usize::from) != Some(found.order) {
        return f64::INFINITY;
    }
    (length_error_m(path, found) / LENGTH_TOLERANCE_M).max(angle_error_rad(path, found) / ANGLE_TOLERANCE_RAD)
}

/// The points of a reference path that its file gives: a point between first and last bounce is not among them.
pub(super) fn known_points(link: &Link, path: &LinkPath) -> Vec<[f64; 3]> {
    let mut points = vec![link.tx];
    points.extend(path.first_vertex);
    if path.order != Some(1) {
        points.extend(path.last_vertex);
    }
    points.push(link.rx);
    points
}

/// Whether a leg comes near an edge of any face, other than those through the point that diffracts.
pub(super) fn passes_edge(scene: &Scene, points: &[[f64; 3]], diffracting: Option<[f64; 3]>) -> bool {
    let points: Vec<Vec3> = points.iter().map(|p| Vec3::from(*p)).collect();
    let own = diffracting.map(Vec3::from);
    points.windows(2).any(|leg| {
        scene.faces().iter().any(|face| {
            let n = face.vertices().len();
            (0..n).any(|i| {
                let edge = [face.vertices()[i], face.vertices()[(i + 1) % n]];
                own.is_none_or(|p| segment_distance_m([p, p], edge) > EDGE_EXCEPTION_M)
                    && segment_distance_m([leg[0], leg[1]], edge) < EDGE_EXCEPTION_M
            })
        })
    })
}

/// Least distance of two segments, the second of positive length, m.
fn segment_distance_m(first: [Vec3; 2], second: [Vec3; 2]) -> f64 {
    let (u, v, w) = (first[1] - first[0], second[1] - second[0], first[0] - second[0]);
    let (uu, uv, vv) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let (uw, vw) = (u.dot(&w), v.dot(&w));
    let spread = uu * vv - uv * uv;
    // Nearest points of the lines, then of the segments: clamp one parameter, solve for the other, clamp, solve back.
    let s = if spread > 1e-12 * uu * vv {
        ((uv * vw - vv * uw) / spread).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let t = ((uv * s + vw) / vv).clamp(0.0, 1.0);
    let s = if uu > 0.0 {
        ((uv * t - uw) / uu).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (w + u * s - v * t).norm()
}

/// Traces every link of a reference list, compares each, and adds up what that gives.
pub(super) fn each_link<C: Default + Send>(
    tracer: &Tracer<'_>,
    reference: &[Link],
    of_link: impl Fn(&Scene, &Link, &[TracedPath]) -> C + Sync,
    add: impl Fn(&mut C, &C),
) -> C {
    let mut sum = C::default();
    for of_one_tx in reference.chunk_by(|a, b| a.tx == b.tx) {
        let Some(first) = of_one_tx.first() else { continue };
        let tree = tracer.transmitter(first.tx);
        let each: Vec<C> = of_one_tx
            .par_iter()
            .map(|link| of_link(tracer.scene(), link, &tree.trace(link.rx)))
            .collect();
        each.iter().for_each(|one| add(&mut sum, one));
    }
    sum
}

/// Takes out the path that differs least, if it is within the tolerances: by 1 at most.
pub(super) fn take_nearest<'p>(
    free: &mut Vec<&'p TracedPath>,
    difference: impl Fn(&TracedPath) -> f64,
) -> Option<&'p TracedPath> {
    let best = (0..free.len()).min_by(|&i, &j| difference(free[i]).total_cmp(&difference(free[j])))?;
    (difference(free[best]) <= 1.0).then(|| free.swap_remove(best))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn segments_have_their_distance() {
        let z = |z: f64| Vec3::new(0.0, 0.0, z);
        let cross = [Vec3::new(-1.0, 0.0, 0.5), Vec3::new(1.0, 0.0, 0.5)];
        assert_eq!(segment_distance_m([z(0.0), z(1.0)], cross), 0.0);
        let beyond = [Vec3::new(3.0, 1.0, 5.0), Vec3::new(3.0, -1.0, 5.0)];
        assert!((segment_distance_m([z(0.0), z(1.0)], beyond) - 5.0).abs() < 1e-12);
        let parallel = [Vec3::new(2.0, 0.0, 0.2), Vec3::new(2.0, 0.0, 9.0)];
        assert!((segment_distance_m([z(0.0), z(1.0)], parallel) - 2.0).abs() < 1e-12);
        // Clamping the first parameter must move the second.
        let slanted = [Vec3::new(1.0, 0.0, 2.0), Vec3::new(5.0, 0.0, -2.0)];
        let expected = (0..=4000)
            .map(|i| slanted[0] + (slanted[1] - slanted[0]) * (f64::from(i) / 4000.0))
            .map(|p| (p - z(p.z.clamp(0.0, 1.0))).norm())
            .fold(f64::INFINITY, f64::min);
        assert!((segment_distance_m([z(0.0), z(1.0)], slanted) - expected).abs() < 1e-3);
    }
}
