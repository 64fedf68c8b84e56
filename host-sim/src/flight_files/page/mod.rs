//! `report.html`: one page that needs nothing else - no network, no library - with the map against the truth in plan and
//! in three dimensions, the errors over time, link states, distributions and every table.
//!
//! Drawings are SVG made here; only the 3-D view is drawn by the page's own script (WebGL, without a library), from data
//! in the page. Colours are variables of the style sheet, for light and dark.

mod chart;
mod charts;
pub(super) mod plan;
mod strips;
mod tables;
mod view;

use std::io::{self, Write};

use crate::flight_files::Outputs;

const STYLE: &str = include_str!("../../../assets/report.css");
const SCRIPT: &str = include_str!("../../../assets/report.js");

/// What can be shown or hidden in plan and 3-D view.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Layer {
    Surfaces,
    Map,
    Vertices,
    Estimate,
    Truth,
    Gmt,
}

impl Layer {
    const ALL: [Self; 6] = [
        Self::Surfaces,
        Self::Map,
        Self::Vertices,
        Self::Estimate,
        Self::Truth,
        Self::Gmt,
    ];

    fn name(self) -> &'static str {
        match self {
            Self::Surfaces => "surfaces",
            Self::Map => "map",
            Self::Vertices => "vertices",
            Self::Estimate => "estimate",
            Self::Truth => "truth",
            Self::Gmt => "gmt",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Self::Surfaces => "true surfaces",
            Self::Map => "map",
            Self::Vertices => "true reflection points",
            Self::Estimate => "UAV, estimated",
            Self::Truth => "UAV, true",
            Self::Gmt => "GMT",
        }
    }
}

/// Class of a map point by its distance to the nearest surface: 0 within 0.2 m, 1 within 0.5 m, 2 beyond. Without a
/// scene nothing is known against a point.
pub(super) fn off_surface_class(distance_m: Option<&f64>) -> usize {
    match distance_m {
        Some(&d) if d > 0.5 => 2,
        Some(&d) if d > 0.2 => 1,
        _ => 0,
    }
}

/// South-west and north-east corner of everything there is to show, m. A point far outside the scene does not count.
pub(super) fn size_of(outputs: &Outputs<'_>) -> ([f64; 2], [f64; 2]) {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    let mut grow = |place: [f64; 3]| {
        for k in 0..2 {
            low[k] = low[k].min(place[k]);
            high[k] = high[k].max(place[k]);
        }
    };
    match outputs.scene {
        Some(scene) => scene
            .faces()
            .iter()
            .flat_map(|f| f.vertices())
            .for_each(|v| grow([v.x, v.y, v.z])),
        None => outputs.log.map.iter().for_each(|v| grow(v.position_m)),
    }
    outputs
        .log
        .trajectory()
        .iter()
        .filter_map(|p| p.truth.map(|t| t.position_m).or(p.estimate.map(|e| e.position_m)))
        .for_each(&mut grow);
    outputs
        .log
        .sweeps
        .iter()
        .filter_map(|s| s.estimate.gmt_position_m)
        .for_each(&mut grow);
    if low[0] > high[0] {
        return ([0.0; 2], [1.0; 2]);
    }
    (low, high)
}

/// Text as HTML.
pub(super) fn escape(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// A drawing with its title and the keys of its colours (class, meaning).
fn figure(title: &str, keys: &[(&str, &str)], svg: &str) -> String {
    let keys: String = keys
        .iter()
        .map(|(class, meaning)| format!(r#"<li><i class="key {class}"></i>{}</li>"#, escape(meaning)))
        .collect();
    let keys = if keys.is_empty() {
        keys
    } else {
        format!(r#"<ul class="keys">{keys}</ul>"#)
    };
    format!(
        "<figure><figcaption>{}</figcaption>{keys}{svg}</figure>",
        escape(title)
    )
}

fn section(id: &str, title: &str, content: &str) -> String {
    if content.is_empty() {
        return String::new();
    }
    format!(r#"<section aria-labelledby="{id}"><h2 id="{id}">{title}</h2>{content}</section>"#)
}

/// Writes the page.
pub(crate) fn write(out: &mut impl Write, outputs: &Outputs<'_>) -> io::Result<()> {
    let report = outputs.report;
    let title = format!("Flight over {}", report.scene);
    let early = if report.interrupted {
        r#" · <strong class="early">ended early</strong>"#
    } else {
        ""
    };
    let layers: String = Layer::ALL
        .iter()
        .map(|layer| {
            let (name, label) = (layer.name(), layer.label());
            format!(r#"<label><input type="checkbox" data-layer="{name}" checked><i class="key k-{name}"></i>{label}</label>"#)
        })
        .collect();
    let map_keys: &[(&str, &str)] = match outputs.scene {
        Some(_) => &[
            ("k-off0", "map point within 0.2 m of a true surface"),
            ("k-off1", "within 0.5 m"),
            ("k-off2", "farther off"),
        ],
        None => &[("k-off0", "map point")],
    };
    let views = format!(
        r#"<div class="layers" role="group" aria-label="Show in plan and view"><span>Show</span>{layers}</div><div class="views">{}{}</div>"#,
        figure("Plan", map_keys, &plan::svg(outputs)),
        figure("In three dimensions", &[], VIEW)
    );
    let grid = |content: String| {
        if content.is_empty() {
            content
        } else {
            format!(r#"<div class="charts">{content}</div>"#)
        }
    };
    let strips = figure(
        "Link state of every sweep",
        &STATE_KEYS,
        &strips::svg(outputs.log),
    );
    let links = [
        strips,
        charts::probabilities(outputs.log),
        charts::paths(outputs.log),
    ]
    .concat();
    let body = [
        section("map", "Map", &views),
        section("errors", "Errors over time", &grid(charts::errors(outputs))),
        section(
            "distributions",
            "Distributions",
            &grid(charts::distributions(outputs)),
        ),
        section("link", "Links", &grid(links)),
        section("filter", "Filter", &grid(charts::innovations(outputs.log))),
        section(
            "tables",
            "Tables",
            &format!(r#"<div class="tables">{}</div>"#, tables::all(report)),
        ),
    ]
    .concat();
    let world = report.world.as_ref().map(|world| format!("{world} world · "));
    let world = escape(&world.unwrap_or_default());
    write!(
        out,
        r##"<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width,initial-scale=1">
<meta name="color-scheme" content="light dark"><link rel="icon" href="data:,"><title>{0}</title><style>{STYLE}</style></head>
<body><a class="skip" href="#tables">Skip to the tables</a>
<header><h1>{0}</h1><p>{1} mode · {world}seed {2} · {3} sweeps in {4:.0} s{early}</p><dl class="tiles">{5}</dl></header>
<main>{body}</main>
<footer><p>{DEFINITIONS}</p></footer>
<script type="application/json" id="flight">{6}</script><script>{SCRIPT}</script></body></html>
"##,
        escape(&title),
        escape(&report.mode),
        report.seed,
        report.sweeps,
        report.flight_s,
        tables::tiles(report),
        view::data(outputs)?,
    )
}

const STATE_KEYS: [(&str, &str); 4] = [
    ("k-state0", "outage"),
    ("k-state1", "line of sight"),
    ("k-state2", "first order"),
    ("k-state3", "higher order"),
];

const VIEW: &str = r#"<div class="view"><canvas id="view" tabindex="0" role="img" aria-label="Map, true surfaces and trajectories in three dimensions. Arrow keys turn, plus and minus zoom, Home resets."></canvas><p id="no-view" hidden>This browser draws no WebGL; the plan shows the same.</p></div><p class="hint">Drag or arrow keys turn, wheel, pinch or + − zoom, Shift moves, Home resets.</p>"#;

const DEFINITIONS: &str = "A measured path is matched with the true one within 1 m and 3° as the antennas see them, true clock \
offset and attitude applied, one to one. Lit is what lies within a patch radius of a true first-order reflection point of this \
flight on the same face; nothing is said of surfaces that no wave reached. Walls are faces that stand within 30° of upright. \
Position error is absolute: the world frame is that of the GMT, nothing is aligned unless said. Settled means with line of \
sight, 1.5 s and more after it came back.";
