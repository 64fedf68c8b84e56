//! `flight.svg`: the map of a flight as it grows, as a moving picture of twelve seconds that begins again.
//!
//! A drawing with a style sheet that moves it: sharp at any size, without a script, and a picture of the flight's end for who sees no
//! motion. Points appear with the sweep that put them into the map; points that left it again are not shown.

mod keyframes;
mod panel;
mod points;
mod surroundings;
mod timeline;
mod tracks;

use std::fmt::Write as _;
use std::io::{self, Write};

use super::Outputs;
use super::page::{escape, off_surface_class, plan};
use super::views::{View, above, slanted};
use crate::evaluation::Surfaces;
use keyframes::Keyframes;
use panel::Panel;
use tracks::Tracks;

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 620.0;
/// The two views: left, top, width, height.
const LEFT: [f64; 4] = [20.0, 46.0, 425.0, 420.0];
const RIGHT: [f64; 4] = [455.0, 46.0, 425.0, 420.0];

/// Right end and foot of the plan's scale bar, and its greatest length.
const SCALE_BAR: [f64; 2] = [866.0, 452.0];
const MOST_SCALE: f64 = 110.0;

const STYLE: &str = "svg{font:14px system-ui,-apple-system,'Segoe UI',Roboto,Helvetica,Arial,sans-serif;fill:#1b2227}\
.title{font-size:17px;font-weight:600}.small{font-size:13px;fill:#5d6870}\
.count{font-variant-numeric:tabular-nums;font-weight:600}\
.front{stroke:#fff;stroke-width:.7;stroke-linejoin:round;fill-opacity:.8}\
.ground{fill:#f0f1ee}.roof{fill:#dde1e3;stroke:none}.wall{fill:none;stroke:#8a959d;stroke-width:1.1}\
.track{fill:none;stroke-linejoin:round;stroke-linecap:butt;stroke-dasharray:1000;stroke-dashoffset:0}\
.est{stroke:#0b6bcb;stroke-width:2.4;opacity:.55}.true{stroke:#1b2227;stroke-width:.9}.gmt{stroke:#7a3fb5;stroke-width:1.6;opacity:.6}\
.wave{fill:none;stroke:#f0a000;stroke-width:1.5;stroke-linejoin:round;opacity:0}\
.error{fill:none;stroke:#0b6bcb;stroke-width:1.4;stroke-linejoin:round}.now{stroke:#1b2227;stroke-width:1.4}\
.scalebar path{fill:none;stroke:#1b2227;stroke-width:1.3}\
.s0{fill:#c3c8c6}.s1{fill:#2f9e6e}.s2{fill:#e08a1e}.s3{fill:#8d63c9}";

/// What moves: a UAV of four rotors and a mast.
const SYMBOLS: &str = r##"<defs><g id="uav"><path d="M-6-6 6 6M6-6-6 6" stroke="#0b6bcb" stroke-width="1.6"/><g fill="#fff" stroke="#0b6bcb" stroke-width="1.6"><circle cx="-6" cy="-6" r="3.6"/><circle cx="6" cy="-6" r="3.6"/><circle cx="-6" cy="6" r="3.6"/><circle cx="6" cy="6" r="3.6"/></g></g><path id="gmt" d="M0-10 6 5H-6Z" fill="#7a3fb5" stroke="#fff"/></defs>"##;

/// Writes the animation.
pub(super) fn write(out: &mut impl Write, outputs: &Outputs<'_>) -> io::Result<()> {
    let log = outputs.log;
    let times = || log.sweeps.iter().map(|sweep| sweep.time_s);
    let mut keyframes = Keyframes::new(times().next().unwrap_or(0.0), times().next_back().unwrap_or(0.0));
    let surfaces = outputs.scene.map(Surfaces::new);
    let is_off = |place_m: [f64; 3]| {
        let nearest = surfaces.as_ref().and_then(|all| all.nearest(place_m));
        off_surface_class(nearest.map(|(_, off_m)| off_m).as_ref()) == 2
    };
    let map = points::of(log, is_off);
    let poses = log.trajectory();
    let estimated = Tracks::new(poses.iter().map(|p| (p.time_s, p.estimate.map(|e| e.position_m))));
    let real = Tracks::new(poses.iter().map(|p| (p.time_s, p.truth.map(|t| t.position_m))));
    let gmt = Tracks::new(log.sweeps.iter().map(|s| (s.time_s, s.estimate.gmt_position_m)));
    let shown = shown_m(outputs);
    let mut body = String::new();
    for (name, view, rectangle) in [("left", slanted as View, LEFT), ("right", above as View, RIGHT)] {
        let panel = Panel::new(view, rectangle, shown.iter().copied());
        let mut inside = String::new();
        if let Some(scene) = outputs.scene {
            inside += &match name {
                "left" => surroundings::slanted(scene, &panel),
                _ => surroundings::from_above(scene, &panel),
            };
        }
        inside += &points::draw_true(log, &panel, &mut keyframes);
        inside += &gmt.lines(&panel, "gmt", &mut keyframes);
        inside += &estimated.lines(&panel, "est", &mut keyframes);
        inside += &real.lines(&panel, "true", &mut keyframes);
        inside += &tracks::waves(log, &panel, &mut keyframes);
        inside += &points::draw(&map, &panel, &mut keyframes);
        inside += &gmt.marker(&panel, "gmt", &mut keyframes);
        let uav = if estimated.is_empty() { &real } else { &estimated };
        inside += &uav.marker(&panel, "uav", &mut keyframes);
        if name == "right" {
            inside += &plan::scale_bar(panel.per_m(), SCALE_BAR, MOST_SCALE);
        }
        body += &panel.framed(name, &inside);
    }
    body += &timeline::readouts(log, &map, &mut keyframes);
    body += &timeline::strip(log, outputs.evaluation, &mut keyframes);
    body += &legend(&map);
    let world = outputs.report.world.as_ref();
    let world = world.map_or_else(String::new, |world| format!("{world} world, "));
    let title = format!(
        "Flight over {} ({world}seed {})",
        log.header.scene, log.header.seed
    );
    write!(
        out,
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{0}: the map as it grows"><style>{STYLE}{1}
{2}</style><rect width="{WIDTH}" height="{HEIGHT}" rx="10" fill="#fcfcfa"/>{SYMBOLS}<text x="20" y="28" class="title">{0}</text>{body}</svg>
"##,
        escape(&title),
        points::style(),
        keyframes.style(),
    )
}

/// What must be seen: where the UAV, the GMT and the points are, m; the scene when there is nothing of these.
fn shown_m(outputs: &Outputs<'_>) -> Vec<[f64; 3]> {
    let log = outputs.log;
    let poses = log.trajectory();
    let uav = poses
        .iter()
        .filter_map(|p| p.truth.map(|t| t.position_m).or(p.estimate.map(|e| e.position_m)));
    let gmt = log.sweeps.iter().filter_map(|s| s.estimate.gmt_position_m);
    let points = log.points.iter().map(|p| p.position_m);
    let all: Vec<[f64; 3]> = uav.chain(gmt).chain(points).collect();
    match outputs.scene {
        Some(scene) if all.is_empty() => vec![scene.bounds().min_m, scene.bounds().max_m],
        _ => all,
    }
}

/// What the colours mean, in two rows.
fn legend(map: &[points::MapPoint]) -> String {
    let point = points::COLOURS[0];
    let mut items = vec![
        (
            format!(r#"<circle r="4" fill="{point}"/>"#),
            "map point, a colour per surface",
        ),
        (r##"<circle r="2" fill="#8d979d"/>"##.into(), "true reflection"),
        (
            r##"<path d="M-9 0H9" stroke="#f0a000" stroke-width="2"/>"##.into(),
            "wave of a map point",
        ),
        (
            r##"<path d="M-9 0H9" stroke="#0b6bcb" stroke-opacity=".55" stroke-width="3"/>"##.into(),
            "UAV, estimated",
        ),
        (r##"<path d="M-9 0H9" stroke="#1b2227"/>"##.into(), "UAV, true"),
        (r##"<path d="M0-6 4 4H-4Z" fill="#7a3fb5"/>"##.into(), "GMT"),
    ];
    if points::any_off(map) {
        items.insert(
            1,
            (
                format!(r##"<circle r="5" fill="#d1201a"/><circle r="3" fill="{point}"/>"##),
                "over 0.5 m off any surface",
            ),
        );
    }
    let mut body = String::new();
    let (mut x, mut y) = (32.0, 588.0);
    for (symbol, meaning) in items {
        let width = 36.0 + 7.0 * meaning.len() as f64;
        if x + width > WIDTH - 10.0 {
            (x, y) = (32.0, y + 20.0);
        }
        let _ = write!(
            body,
            r#"<g transform="translate({x:.0} {y})">{symbol}<text class="small" x="14" y="4.5">{meaning}</text></g>"#
        );
        x += width;
    }
    body
}
