//! The report as text for a terminal.

use super::{Report, SmoothedFigures};
use crate::table::Table;

/// The report as text: the flight, then why paths were not mapped, then other counters.
pub fn table(report: &Report) -> String {
    let world = report.world.as_ref().map(|world| format!("{world} world, "));
    let title = format!(
        "flight over {} ({} mode, {}seed {})",
        report.scene,
        report.mode,
        world.unwrap_or_default(),
        report.seed
    );
    let flight = match &report.smoothed {
        None => {
            let mut flight = Table::new([title, String::new()]);
            for (name, value) in rows(report) {
                flight.row([name.to_owned(), value]);
            }
            flight
        }
        Some(smoothed) => beside(title, report, smoothed),
    };
    let mut verdicts = Table::new(["not mapped because", "paths"]);
    for (reason, count) in &report.verdicts {
        verdicts.row([reason.clone(), count.to_string()]);
    }
    if report.counters.is_empty() {
        return format!("{flight}\n{verdicts}");
    }
    let mut counters = Table::new(["also counted", ""]);
    for (name, count) in &report.counters {
        counters.row([name.clone(), count.to_string()]);
    }
    format!("{flight}\n{verdicts}\n{counters}")
}

/// The main table with what smoothing made of each figure: that of the same report with these figures.
fn beside(title: String, report: &Report, smoothed: &SmoothedFigures) -> Table {
    let smoothed = Report {
        trajectory: smoothed.trajectory.clone(),
        clock: smoothed.clock,
        consistency: smoothed.consistency,
        map: smoothed.map.clone(),
        smoothed: None,
        ..report.clone()
    };
    let smoothed = rows(&smoothed);
    let mut flight = Table::new([title, "on board".to_owned(), "smoothed".to_owned()]);
    for (name, value) in rows(report) {
        let found = smoothed.iter().find(|(other, _)| *other == name);
        let other = found.map_or("-", |(_, value)| value);
        // What only the radio or the link state has is the same in both.
        let other = if other == value { "" } else { other };
        flight.row([name.to_owned(), value.clone(), other.to_owned()]);
    }
    flight
}

/// Lines of the main table; figures that are not known are left out.
fn rows(report: &Report) -> Vec<(&'static str, String)> {
    let (map, flown, clock) = (&report.map, &report.trajectory, &report.clock);
    let mut rows = Vec::new();
    let mut add = |name: &'static str, value: Option<String>| rows.extend(value.map(|value| (name, value)));
    let metres = |value: Option<f64>| value.map(|v| format!("{v:.3} m"));
    let percent = |value: Option<f64>| value.map(|v| format!("{:.1} %", 100.0 * v));
    let stopped = if report.interrupted { ", ended early" } else { "" };
    add("sweeps", Some(format!("{}{stopped}", report.sweeps)));
    add("measured paths", Some(report.measurements.to_string()));
    add("accepted reflection points", Some(map.accepted.to_string()));
    add(
        "points per sweep with a first-order path",
        map.accepted_per_sweep.map(|v| format!("{v:.1}")),
    );
    add(
        "of these, first order",
        map.accepted_first_order_per_sweep.map(|v| format!("{v:.1}")),
    );
    add("map points (voxels)", Some(map.points.to_string()));
    add("correct reflection order", percent(map.precision));
    add(
        "correct, presumed first order",
        percent(map.precision_first_order),
    );
    add(
        "correct, presumed higher order",
        percent(map.precision_higher_order),
    );
    add("correct surface", percent(map.precision_by_faces));
    add("correct surface, edges aside", percent(map.precision_edges_aside));
    add("first-order paths accepted", percent(map.recall_first_order));
    add(
        "error of points of correct order, median",
        metres(map.point_median_m),
    );
    add("error of points of correct order, rms", metres(map.point_rmse_m));
    add(
        "all accepted points to surface, median",
        metres(map.accepted_surface_median_m),
    );
    add(
        "all accepted points to surface, rms",
        metres(map.accepted_surface_rmse_m),
    );
    add("map to true surface, median", metres(map.surface_median_m));
    add("map to true surface, rms", metres(map.surface_rmse_m));
    add("lit walls mapped within 0.5 m", percent(map.completeness_0p5m));
    add("F-score at 0.2 m", percent(map.f_score_0p2m));
    add("F-score at 0.5 m", percent(map.f_score_0p5m));
    add("position error, rms", metres(flown.position_rmse_m));
    add(
        "position error, rms, settled",
        metres(flown.settled_position_rmse_m),
    );
    add(
        "attitude error, rms",
        flown.attitude_rmse_deg.map(|v| format!("{v:.3} deg")),
    );
    add("clock error, rms", clock.rmse_ns.map(|v| format!("{v:.3} ns")));
    add(
        "class of the strongest path right",
        percent(report.link_state.measured.strongest_right),
    );
    add(
        "downlink bytes per point",
        report.telemetry.bytes_per_point.map(|v| format!("{v:.1}")),
    );
    add("computed in", Some(format!("{:.2} s", report.elapsed_s)));
    rows
}
