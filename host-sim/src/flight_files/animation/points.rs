//! The map as it grows: points in the colours of their surfaces, over the places where waves were truly reflected.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::keyframes::Keyframes;
use super::panel::Panel;
use crate::flight_log::{FlightLog, PointRecord};

/// Colours of surfaces, by the order in which their first points came; then over again.
pub(super) const COLOURS: [&str; 8] = [
    "#0f9d8a", "#c2368f", "#d96b00", "#5a9a1f", "#0089c4", "#8c5a2b", "#b8960c", "#5b53c9",
];
/// Widths of the strokes that dots are.
const POINT: f64 = 6.0;
const HALO: f64 = 10.0;
const TRUTH: f64 = 2.2;
/// A new point is so many times as large.
const NEW: f64 = 2.4;
/// True reflection points appear together within so much of a flight, of 1.
const TOGETHER: f64 = 0.01;

/// A point of the map, ready to be drawn.
pub(super) struct MapPoint {
    /// When it came into the map, s.
    mapped_s: f64,
    position_m: [f64; 3],
    /// Place of its surface among those of all points, in the order in which they came.
    surface: usize,
    /// Whether it lies on no true surface.
    off: bool,
}

/// The accepted points of a flight in the order in which they came into the map. `is_off` says of a place whether it lies on no true surface.
pub(super) fn of(log: &FlightLog, is_off: impl Fn([f64; 3]) -> bool) -> Vec<MapPoint> {
    let mapped_s = |point: &PointRecord| log.mapped_with(point).map_or(point.time_s, |sweep| sweep.time_s);
    let mut points: Vec<(f64, &PointRecord)> = log.points.iter().map(|p| (mapped_s(p), p)).collect();
    points.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut surfaces: BTreeMap<Option<u16>, usize> = BTreeMap::new();
    points
        .into_iter()
        .map(|(mapped_s, point)| {
            let next = surfaces.len();
            MapPoint {
                mapped_s,
                position_m: point.position_m,
                surface: *surfaces.entry(point.surface).or_insert(next),
                off: is_off(point.position_m),
            }
        })
        .collect()
}

/// The points that the map has at a time, s.
pub(super) fn until(points: &[MapPoint], time_s: f64) -> &[MapPoint] {
    &points[..points.partition_point(|point| point.mapped_s <= time_s)]
}

/// How many surfaces have points.
pub(super) fn surfaces(points: &[MapPoint]) -> usize {
    points.iter().map(|point| point.surface + 1).max().unwrap_or(0)
}

/// Whether any point lies on no true surface.
pub(super) fn any_off(points: &[MapPoint]) -> bool {
    points.iter().any(|point| point.off)
}

/// The points in a panel.
pub(super) fn draw(points: &[MapPoint], panel: &Panel, keyframes: &mut Keyframes) -> String {
    let mut body = String::new();
    for together in points.chunk_by(|a, b| a.mapped_s == b.mapped_s) {
        let time_s = together[0].mapped_s;
        let off = dots(together.iter().filter(|p| p.off).map(|p| p.position_m), panel);
        if !off.is_empty() {
            let name = keyframes.dots_from(time_s, HALO, NEW);
            let _ = write!(
                body,
                r#"<path class="dot off move" style="animation-name:{name}" d="{off}"/>"#
            );
        }
        let name = keyframes.dots_from(time_s, POINT, NEW);
        for colour in 0..COLOURS.len() {
            let some = together.iter().filter(|p| p.surface % COLOURS.len() == colour);
            let some = dots(some.map(|p| p.position_m), panel);
            if !some.is_empty() {
                let _ = write!(
                    body,
                    r#"<path class="dot c{colour} move" style="animation-name:{name}" d="{some}"/>"#
                );
            }
        }
    }
    body
}

/// Where waves were truly reflected once, heard or not, as the flight comes by.
pub(super) fn draw_true(log: &FlightLog, panel: &Panel, keyframes: &mut Keyframes) -> String {
    let mut body = String::new();
    let part = |time_s: f64, keyframes: &Keyframes| (keyframes.share(time_s) / TOGETHER) as u32;
    let sweeps = |a: &f64, b: &f64| part(*a, keyframes) == part(*b, keyframes);
    let groups: Vec<_> = log.sweeps.chunk_by(|a, b| sweeps(&a.time_s, &b.time_s)).collect();
    for group in groups {
        let links = group.iter().filter_map(|sweep| sweep.truth.link.as_ref());
        let once = links.flat_map(|link| &link.paths).filter(|p| p.is_first_order());
        let some = dots(once.filter_map(|p| p.last_vertex), panel);
        if !some.is_empty() {
            let name = keyframes.dots_from(group[0].time_s, TRUTH, 1.0);
            let _ = write!(
                body,
                r#"<path class="dot truth-dot move" style="animation-name:{name}" d="{some}"/>"#
            );
        }
    }
    body
}

/// Strokes of no length at these places.
fn dots(places_m: impl Iterator<Item = [f64; 3]>, panel: &Panel) -> String {
    let mut path = String::new();
    for place in places_m {
        let [x, y] = panel.at(place);
        let _ = write!(path, "M{x:.1} {y:.1}h0");
    }
    path
}

/// How dots look: in the end, and for who sees no motion.
pub(super) fn style() -> String {
    let mut css = format!(
        ".dot{{fill:none;stroke-linecap:round;stroke-width:{POINT}px}}.dot.off{{stroke:#d1201a;stroke-width:{HALO}px}}\
         .truth-dot{{stroke:#9aa4aa;stroke-width:{TRUTH}px}}"
    );
    for (number, colour) in COLOURS.iter().enumerate() {
        let _ = write!(css, ".c{number}{{stroke:{colour}}}");
    }
    css
}
