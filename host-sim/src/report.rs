//! The figures of a flight, as `report.json` and as a table for people.

use std::collections::BTreeMap;

use serde::Serialize;

use crate::evaluation::MapFigures;
use crate::table::Table;

/// `report.json`.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    /// `best` or `paper`.
    pub mode: &'static str,
    /// Scene or path list.
    pub scene: &'a str,
    /// Seed of all errors.
    pub seed: u64,
    /// Whether the flight was ended before its last sweep.
    pub interrupted: bool,
    /// Sweeps flown.
    pub sweeps: usize,
    /// Time flown, s.
    pub flight_s: f64,
    /// Time the computation took, s.
    pub elapsed_s: f64,
    /// Paths measured.
    pub measurements: u32,
    /// Why paths were not mapped, with their number.
    pub verdicts: &'a BTreeMap<&'static str, u32>,
    /// Figures of the map.
    pub map: &'a MapFigures,
    /// Figures of the downlink.
    pub telemetry: TelemetryFigures,
}

/// Figures of the downlink.
#[derive(Debug, Serialize)]
pub struct TelemetryFigures {
    /// Packets sent.
    pub packets: u32,
    /// Bytes sent, framing included.
    pub bytes: usize,
    /// Bytes for each accepted point, everything sent included.
    pub bytes_per_point: Option<f64>,
    /// Bytes a second of flight.
    pub bytes_per_s: f64,
}

/// The report as text.
pub fn table(report: &Report<'_>) -> String {
    let meters = |value: Option<f64>| value.map_or_else(|| "-".into(), |v| format!("{v:.3} m"));
    let percent = |value: Option<f64>| value.map_or_else(|| "-".into(), |v| format!("{:.1} %", 100.0 * v));
    let mut flight = Table::new([
        format!(
            "flight over {} ({} mode, seed {})",
            report.scene, report.mode, report.seed
        ),
        String::new(),
    ]);
    flight.row(["sweeps".to_owned(), report.sweeps.to_string()]);
    flight.row(["measured paths".to_owned(), report.measurements.to_string()]);
    flight.row([
        "accepted reflection points".to_owned(),
        report.map.accepted.to_string(),
    ]);
    flight.row(["map points (voxels)".to_owned(), report.map.points.to_string()]);
    flight.row([
        "truly first-order".to_owned(),
        percent(report.map.precision_first_order),
    ]);
    flight.row([
        "first-order paths accepted".to_owned(),
        percent(report.map.recall_first_order),
    ]);
    flight.row([
        "point error, median".to_owned(),
        meters(report.map.point_median_m),
    ]);
    flight.row(["point error, 95 %".to_owned(), meters(report.map.point_p95_m)]);
    flight.row(["point error, rms".to_owned(), meters(report.map.point_rmse_m)]);
    let bytes = report
        .telemetry
        .bytes_per_point
        .map_or_else(|| "-".into(), |b| format!("{b:.1}"));
    flight.row(["downlink bytes a point".to_owned(), bytes]);
    flight.row(["computed in".to_owned(), format!("{:.2} s", report.elapsed_s)]);
    let mut verdicts = Table::new(["not mapped because", "paths"]);
    for (reason, count) in report.verdicts {
        verdicts.row([(*reason).to_owned(), count.to_string()]);
    }
    format!("{flight}\n{verdicts}")
}
