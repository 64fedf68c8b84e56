//! The plan: map, truth and trajectories seen from above.

use std::fmt::Write as _;

use super::{Layer, off_surface_class, size_of};
use crate::evaluation::true_vertices_m;
use crate::flight_files::Outputs;
use crate::scene::{Face, Scene};

/// Width of the drawing in its own units.
const WIDTH: f64 = 720.0;
const MARGIN: f64 = 14.0;
/// Faces that look up and lie this high above the lowest one are roofs, m.
pub(in crate::flight_files) const ROOF_M: f64 = 0.5;
/// A trajectory is not drawn across jumps faster than this, m/s: path lists jump.
pub(in crate::flight_files) const FASTEST_M_PER_S: f64 = 12.0;

/// From world to drawing.
struct Projection {
    west: f64,
    north: f64,
    per_m: f64,
    height: f64,
}

impl Projection {
    fn new(([west, south], [east, north]): ([f64; 2], [f64; 2])) -> Self {
        let per_m = (WIDTH - 2.0 * MARGIN) / (east - west).max(1.0);
        Self {
            west,
            north,
            per_m,
            height: (north - south).max(1.0) * per_m + 2.0 * MARGIN,
        }
    }

    fn at(&self, x: f64, y: f64) -> (f64, f64) {
        (
            MARGIN + (x - self.west) * self.per_m,
            MARGIN + (self.north - y) * self.per_m,
        )
    }
}

/// The plan as SVG.
pub(super) fn svg(outputs: &Outputs<'_>) -> String {
    let log = outputs.log;
    let view = Projection::new(size_of(outputs));
    let mut body = String::new();
    if let Some(scene) = outputs.scene {
        body += &walls(scene, |x, y| view.at(x, y));
    }
    let vertices = true_vertices_m(log);
    body += &dots(vertices.iter(), &view, "dot vertex", Layer::Vertices);
    for class in [0, 1, 2] {
        let some = log.map.iter().zip(
            outputs
                .evaluation
                .point_errors
                .surface_m
                .iter()
                .map(Some)
                .chain(std::iter::repeat(None)),
        );
        let places = some
            .filter(|(_, off)| off_surface_class(*off) == class)
            .map(|(v, _)| &v.position_m);
        body += &dots(places, &view, &format!("dot off{class}"), Layer::Map);
    }
    let poses = log.trajectory();
    let truth = poses.iter().map(|p| Some((p.time_s, p.truth?.position_m)));
    body += &track(truth, &view, "truth", Layer::Truth);
    let estimate = poses.iter().map(|p| Some((p.time_s, p.estimate?.position_m)));
    body += &track(estimate, &view, "est", Layer::Estimate);
    let gmt = log
        .sweeps
        .iter()
        .map(|s| Some((s.time_s, s.estimate.gmt_position_m?)));
    body += &track(gmt, &view, "gmt", Layer::Gmt);
    if let Some(first) = poses.first().and_then(|first| first.truth) {
        let (x, y) = view.at(first.position_m[0], first.position_m[1]);
        let _ = write!(
            body,
            r#"<circle class="start layer-truth" cx="{x:.1}" cy="{y:.1}" r="5"/>"#
        );
    }
    body += &scale_bar(view.per_m, [WIDTH - MARGIN, view.height - MARGIN], 0.25 * WIDTH);
    format!(
        r#"<svg class="plan" viewBox="0 0 {WIDTH} {:.0}" role="img" aria-label="Plan: map points over the true walls, with the trajectories of UAV and GMT">{body}</svg>"#,
        view.height
    )
}

/// Roofs as areas, walls as lines; `at` says where a place lies in the drawing.
pub(in crate::flight_files) fn walls(scene: &Scene, at: impl Fn(f64, f64) -> (f64, f64)) -> String {
    let lowest = scene
        .faces()
        .iter()
        .flat_map(Face::vertices)
        .map(|v| v.z)
        .fold(f64::INFINITY, f64::min);
    let (mut roofs, mut lines) = (String::new(), String::new());
    for face in scene.faces() {
        let up = face.normal().z;
        let upright = up.abs() < 0.5;
        let roof = up >= 0.5 && face.vertices().iter().all(|v| v.z > lowest + ROOF_M);
        if !(upright || roof) {
            continue;
        }
        let out = if roof { &mut roofs } else { &mut lines };
        for (k, v) in face.vertices().iter().enumerate() {
            let (x, y) = at(v.x, v.y);
            let _ = write!(out, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
        }
        out.push('Z');
    }
    format!(
        r#"<g class="layer-surfaces"><path class="roof" d="{roofs}"/><path class="wall" d="{lines}"/></g>"#
    )
}

fn dots<'a>(
    places: impl Iterator<Item = &'a [f64; 3]>,
    view: &Projection,
    class: &str,
    layer: Layer,
) -> String {
    let mut path = String::new();
    for place in places {
        let (x, y) = view.at(place[0], place[1]);
        let _ = write!(path, "M{x:.1} {y:.1}h0");
    }
    format!(r#"<path class="{class} layer-{}" d="{path}"/>"#, layer.name())
}

/// A line through places in time; a single place between two gaps is a dot.
fn track(
    places: impl Iterator<Item = Option<(f64, [f64; 3])>>,
    view: &Projection,
    class: &str,
    layer: Layer,
) -> String {
    let mut path = String::new();
    let mut last: Option<(f64, [f64; 3])> = None;
    for place in places {
        if let Some((time_s, p)) = place {
            let (x, y) = view.at(p[0], p[1]);
            let joined = last.is_some_and(|(before_s, q)| {
                libm::hypot(p[0] - q[0], p[1] - q[1]) <= FASTEST_M_PER_S * (time_s - before_s)
            });
            let _ = match joined {
                true => write!(path, "L{x:.1} {y:.1}"),
                false => write!(path, "M{x:.1} {y:.1}h0"),
            };
        }
        last = place;
    }
    format!(
        r#"<path class="track {class} layer-{}" d="{path}"/>"#,
        layer.name()
    )
}

/// A bar of a round length below `most`, and which way is north; `per_m` is the scale, and it ends at these coordinates.
pub(in crate::flight_files) fn scale_bar(per_m: f64, [right, bottom]: [f64; 2], most: f64) -> String {
    let lengths_m = [100.0, 50.0, 20.0, 10.0, 5.0, 2.0, 1.0];
    let length_m = lengths_m.into_iter().find(|l| l * per_m < most).unwrap_or(1.0);
    let left = right - length_m * per_m;
    format!(
        r#"<g class="scalebar"><path d="M{left:.1} {:.1}v6H{right:.1}v-6"/><text x="{:.1}" y="{:.1}" text-anchor="middle">{length_m} m</text><path d="M{:.1} {:.1}v-22l-4 8m4 -8l4 8"/><text x="{:.1}" y="{:.1}">N</text></g>"#,
        bottom - 8.0,
        (left + right) / 2.0,
        bottom - 8.0,
        left - 24.0,
        bottom - 2.0,
        left - 18.0,
        bottom - 12.0,
    )
}
