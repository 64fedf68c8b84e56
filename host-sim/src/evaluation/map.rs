//! Figures of the map: the accepted points against their paths, the map against the surfaces.

use std::collections::BTreeMap;

use serde::Serialize;

use super::by_faces::{self, vertex};
use super::completeness::{Completeness, Lit, Part};
use super::figures::{Spread, distance, share};
use super::losses::{FirstOrderPaths, first_order_paths};
use super::surface::Surfaces;
use crate::flight_log::{FlightLog, PointRecord};
use crate::paths::LinkPath;

/// Distances at which completeness, precision and F-score are given, m.
const THRESHOLDS_M: [f64; 2] = [0.2, 0.5];

/// A point of several reflections that is off by more lies on another mirror than where the wave was reflected, m.
const OTHER_MIRROR_M: f64 = 1.0;

/// Radii of the lit patches, m; the first one is that of the plain keys.
const PATCHES_M: [f64; 2] = [0.5, 1.0];

/// Figures of a map. Absent where the truth or the scene is not known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MapFigures {
    /// Occupied voxels.
    pub points: usize,
    /// Accepted reflection points, before they were fused.
    pub accepted: usize,
    /// Those of them that paths of several reflections gave, off mirrors that were known.
    pub accepted_higher_order: usize,
    /// Accepted points by what the true path behind them met ([`Kind`](crate::paths::Kind)): `R` one reflection, `D` one edge, `RD` both, `S` a piece of
    /// a diffusely scattered wave. Without ghosts.
    pub accepted_kinds: BTreeMap<String, usize>,
    /// Accepted points whose measured path has no true one behind it.
    pub ghosts: usize,
    /// Share of accepted points whose path truly had as many reflections as they presume; ghosts count as wrong, and so do points
    /// of several reflections off another mirror.
    pub precision: Option<f64>,
    /// Share of accepted points whose path truly had as many reflections as they presume, and that lie within 0.6 m of the plane of the
    /// surface that reflected it there.
    pub precision_by_faces: Option<f64>,
    /// The same where an edge that bent the wave beside its reflections does not count: it was reflected where the point lies all the same.
    pub precision_edges_aside: Option<f64>,
    /// Accepted points that are more than 0.3 m, and more than three standard deviations that are claimed for them, off any true surface.
    pub accepted_far: Option<usize>,
    /// As `precision`, of points that presume one reflection.
    pub precision_first_order: Option<f64>,
    /// The same of points that presume more.
    pub precision_higher_order: Option<f64>,
    /// Share of all true first-order paths that became accepted points.
    pub recall_first_order: Option<f64>,
    /// Share of all true first-order paths that were measured.
    pub measured_first_order: Option<f64>,
    /// What became of the true first-order paths.
    pub first_order: FirstOrderPaths,
    /// Accepted points in an average sweep, over the sweeps with any true first-order path.
    pub accepted_per_sweep: Option<f64>,
    /// Those of them that presume one reflection.
    pub accepted_first_order_per_sweep: Option<f64>,
    /// Median distance of points of the true order to where the wave was reflected, m.
    pub point_median_m: Option<f64>,
    /// Rms of the same, m.
    pub point_rmse_m: Option<f64>,
    /// 95 % quantile of the same, m.
    pub point_p95_m: Option<f64>,
    /// Median distance of the map's points to the nearest true surface, m.
    pub surface_median_m: Option<f64>,
    /// Rms of the same, m.
    pub surface_rmse_m: Option<f64>,
    /// 95 % quantile of the same, m.
    pub surface_p95_m: Option<f64>,
    /// Median distance of the accepted points, before fusion, to the nearest true surface, m.
    pub accepted_surface_median_m: Option<f64>,
    /// Rms of the same, m.
    pub accepted_surface_rmse_m: Option<f64>,
    /// Share of the map's points within 0.2 m of a true surface.
    pub precision_0p2m: Option<f64>,
    /// Share of the map's points within 0.5 m of a true surface.
    pub precision_0p5m: Option<f64>,
    /// Share of the lit walls (patches of 0.5 m) within 0.2 m of a map point.
    pub completeness_0p2m: Option<f64>,
    /// Share of the lit walls (patches of 0.5 m) within 0.5 m of a map point.
    pub completeness_0p5m: Option<f64>,
    /// As `completeness_0p2m`, over all lit surfaces.
    pub completeness_all_0p2m: Option<f64>,
    /// As `completeness_0p5m`, over all lit surfaces.
    pub completeness_all_0p5m: Option<f64>,
    /// Harmonic mean of `precision_0p2m` and `completeness_all_0p2m`.
    pub f_score_0p2m: Option<f64>,
    /// Harmonic mean of `precision_0p5m` and `completeness_all_0p5m`.
    pub f_score_0p5m: Option<f64>,
    /// Completeness of the lit walls for every patch radius and threshold, with what the truth's own points would reach.
    pub completeness: Vec<Completeness>,
}

/// Errors of single points, for curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointErrors {
    /// Distance of each accepted point of the true order to where the wave was reflected, m; without those between the first and
    /// the last reflection of a path, which the truth does not name.
    pub reflection_m: Vec<f64>,
    /// Distance of each map point to the nearest true surface, m; in the order of the map.
    pub surface_m: Vec<f64>,
}

/// True first-order reflection points of the flight, in the order of the sweeps.
pub fn true_vertices_m(log: &FlightLog) -> Vec<[f64; 3]> {
    let links = log.sweeps.iter().filter_map(|s| s.truth.link.as_ref());
    let first = links.flat_map(|link| &link.paths).filter(|p| p.is_first_order());
    first.filter_map(|p| p.last_vertex).collect()
}

/// Judges a map. The log's paths must have been matched.
pub(super) fn judge(log: &FlightLog, surfaces: Option<&Surfaces<'_>>) -> (MapFigures, PointErrors) {
    let mut figures = MapFigures {
        points: log.map.len(),
        accepted: log.points.len(),
        first_order: first_order_paths(log),
        ..MapFigures::default()
    };
    let mut errors = PointErrors {
        reflection_m: judge_points(log, &mut figures),
        surface_m: Vec::new(),
    };
    if let Some(surfaces) = surfaces {
        let map_m: Vec<[f64; 3]> = log.map.iter().map(|v| v.position_m).collect();
        let off = |point| surfaces.nearest(point).map_or(f64::INFINITY, |(_, d)| d);
        errors.surface_m = map_m.iter().map(|p| off(*p)).collect();
        let accepted: Vec<f64> = log.points.iter().map(|p| off(p.position_m)).collect();
        let (map, accepted) = (Spread::of(&errors.surface_m), Spread::of(&accepted));
        (
            figures.surface_median_m,
            figures.surface_rmse_m,
            figures.surface_p95_m,
        ) = (map.median, map.rmse, map.p95);
        (figures.accepted_surface_median_m, figures.accepted_surface_rmse_m) =
            (accepted.median, accepted.rmse);
        let by_faces = by_faces::judge(log, surfaces);
        (figures.precision_by_faces, figures.accepted_far) = (by_faces.precision, by_faces.far);
        figures.precision_edges_aside = by_faces.precision_edges_aside;
        judge_cover(log, surfaces, &map_m, &errors.surface_m, &mut figures);
    }
    (figures, errors)
}

/// Accepted points whose truth is known, and those of the true order.
#[derive(Clone, Copy, Default)]
struct Judged {
    known: usize,
    right: usize,
}

impl Judged {
    fn enter(&mut self, right: bool) {
        self.known += 1;
        self.right += usize::from(right);
    }
}

/// Accepted points against the true paths behind them; returns the errors of those of the true order.
fn judge_points(log: &FlightLog, figures: &mut MapFigures) -> Vec<f64> {
    let (mut first, mut higher) = (Judged::default(), Judged::default());
    let mut errors_m = Vec::new();
    for point in &log.points {
        figures.accepted_higher_order += usize::from(point.order > 1);
        let Some(truth) = log.truth_of(point) else {
            continue;
        };
        figures.ghosts += usize::from(truth.is_none());
        if let Some(kind) = truth.and_then(LinkPath::kind_or_order) {
            *figures.accepted_kinds.entry(kind.to_string()).or_default() += 1;
        }
        // Where a mover was, the map has nothing.
        let right = truth.filter(|path| path.order == Some(point.order) && !path.is_off_mover());
        let vertex = right.and_then(|path| vertex(path, point));
        let error_m = vertex.map(|vertex| distance(point.position_m, vertex));
        if point.order > 1 {
            // As many reflections off other mirrors are wrong too.
            higher.enter(right.is_some() && error_m.is_none_or(|error_m| error_m < OTHER_MIRROR_M));
        } else {
            first.enter(right.is_some());
        }
        errors_m.extend(error_m);
    }
    let (mut all, mut measured, mut rich) = (0, 0, Vec::new());
    for sweep in &log.sweeps {
        let paths = sweep.truth.link.iter().flat_map(|l| &l.paths);
        let here = paths.filter(|p| p.is_first_order()).count();
        all += here;
        if here > 0 {
            rich.push(sweep.sweep);
        }
        let is_first_order = |index: &&usize| {
            let link = sweep.truth.link.as_ref();
            link.and_then(|link| link.paths.get(**index))
                .is_some_and(LinkPath::is_first_order)
        };
        measured += sweep
            .truth
            .matches
            .iter()
            .flatten()
            .filter(is_first_order)
            .count();
    }
    rich.sort_unstable();
    let in_rich = |point: &&PointRecord| rich.binary_search(&point.sweep).is_ok();
    let here = log.points.iter().filter(in_rich);
    let (accepted, accepted_first) = here.fold((0, 0), |(all, first), point| {
        (all + 1, first + usize::from(point.order == 1))
    });
    let spread = Spread::of(&errors_m);
    (figures.point_median_m, figures.point_rmse_m, figures.point_p95_m) =
        (spread.median, spread.rmse, spread.p95);
    figures.precision = share(first.right + higher.right, first.known + higher.known);
    figures.precision_first_order = share(first.right, first.known);
    figures.precision_higher_order = share(higher.right, higher.known);
    figures.recall_first_order = share(first.right, all);
    figures.measured_first_order = share(measured, all);
    figures.accepted_per_sweep = share(accepted, rich.len());
    figures.accepted_first_order_per_sweep = share(accepted_first, rich.len());
    errors_m
}

/// Precision, completeness and F-score of the map's points against the surfaces.
fn judge_cover(
    log: &FlightLog,
    surfaces: &Surfaces<'_>,
    map_m: &[[f64; 3]],
    surface_m: &[f64],
    figures: &mut MapFigures,
) {
    let vertices_m = true_vertices_m(log);
    let within = |threshold_m: f64| surface_m.iter().filter(|&&d| d <= threshold_m).count();
    let precision = THRESHOLDS_M.map(|t| share(within(t), surface_m.len()));
    let all = Lit::new(surfaces, &vertices_m, PATCHES_M[0], Part::All);
    let recall = THRESHOLDS_M.map(|t| all.completeness(map_m, &vertices_m, t).map(|c| c.share));
    [figures.precision_0p2m, figures.precision_0p5m] = precision;
    [figures.completeness_all_0p2m, figures.completeness_all_0p5m] = recall;
    [figures.f_score_0p2m, figures.f_score_0p5m] = [0, 1].map(|k| harmonic(precision[k]?, recall[k]?));
    for patch_m in PATCHES_M {
        let walls = Lit::new(surfaces, &vertices_m, patch_m, Part::Walls);
        let rows = THRESHOLDS_M
            .iter()
            .filter_map(|&t| walls.completeness(map_m, &vertices_m, t));
        figures.completeness.extend(rows);
    }
    let plain = |threshold_m: f64| {
        let mut rows = figures.completeness.iter();
        rows.find(|c| (c.patch_m, c.threshold_m) == (PATCHES_M[0], threshold_m))
            .map(|c| c.share)
    };
    let plain = THRESHOLDS_M.map(plain);
    [figures.completeness_0p2m, figures.completeness_0p5m] = plain;
}

fn harmonic(a: f64, b: f64) -> Option<f64> {
    (a + b > 0.0).then(|| 2.0 * a * b / (a + b))
}
