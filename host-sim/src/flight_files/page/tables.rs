//! The tables of the page.

use super::escape;
use super::strips::STATES;
use crate::flight_log::MeasuredPath;
use crate::report::Report;

/// A table with a caption; the first column names the row.
fn table(caption: &str, header: &[&str], rows: &[Vec<String>]) -> String {
    let cell = |tag: &str, text: &str| format!("<{tag}>{}</{tag}>", escape(text));
    let head: String = header
        .iter()
        .map(|h| format!(r#"<th scope="col">{}</th>"#, escape(h)))
        .collect();
    let body: String = rows
        .iter()
        .map(|row| {
            let first = row.first().map_or(String::new(), |c| {
                format!(r#"<th scope="row">{}</th>"#, escape(c))
            });
            let rest: String = row.iter().skip(1).map(|c| cell("td", c)).collect();
            format!("<tr>{first}{rest}</tr>")
        })
        .collect();
    format!(
        r#"<div class="scroll" tabindex="0" role="region" aria-label="{0}"><table><caption>{0}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table></div>"#,
        escape(caption)
    )
}

fn metres(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.3} m"))
}

fn percent(value: Option<f64>) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{:.1} %", 100.0 * v))
}

fn number(value: Option<f64>, unit: &str) -> String {
    value.map_or_else(|| "-".into(), |v| format!("{v:.3} {unit}").trim_end().to_owned())
}

fn row(cells: &[&str]) -> Vec<String> {
    cells.iter().map(|c| (*c).to_owned()).collect()
}

/// How many times faster; a path list is flown in no time.
fn faster(times: f64) -> String {
    if times > 1000.0 {
        ">1000×".to_owned()
    } else {
        format!("{times:.1}×")
    }
}

/// The big figures on top: name, value.
pub(super) fn tiles(report: &Report) -> String {
    let (map, flown) = (&report.map, &report.trajectory);
    let speed = (report.elapsed_s > 0.0).then(|| report.flight_s / report.elapsed_s);
    let tiles = [
        (
            "map to true surface, median",
            map.surface_median_m.map(|v| format!("{v:.3} m")),
        ),
        (
            "error of points of correct order, median",
            map.point_median_m.map(|v| format!("{v:.3} m")),
        ),
        (
            "correct reflection order",
            map.precision.map(|v| format!("{:.1} %", 100.0 * v)),
        ),
        (
            "lit walls mapped within 0.5 m",
            map.completeness_0p5m.map(|v| format!("{:.0} %", 100.0 * v)),
        ),
        (
            "position error, rms",
            flown.position_rmse_m.map(|v| format!("{v:.3} m")),
        ),
        (
            "attitude error, rms",
            flown.attitude_rmse_deg.map(|v| format!("{v:.2}°")),
        ),
        (
            "clock error, rms",
            report.clock.rmse_ns.map(|v| format!("{v:.2} ns")),
        ),
        ("map points", Some(map.points.to_string())),
        ("faster than real time", speed.map(faster)),
    ];
    let known = tiles.into_iter().filter_map(|(name, value)| Some((name, value?)));
    known
        .map(|(name, value)| format!("<div><dt>{name}</dt><dd>{value}</dd></div>"))
        .collect()
}

/// All tables.
pub(super) fn all(report: &Report) -> String {
    [
        map(report),
        trajectory(report),
        completeness(report),
        link_state(report),
        fates(report),
        rest(report),
        health(report),
    ]
    .concat()
}

fn map(report: &Report) -> String {
    let m = &report.map;
    let rows = [
        row(&["points in the map (voxels)", &m.points.to_string()]),
        row(&["accepted reflection points", &m.accepted.to_string()]),
        row(&[
            "points per sweep with a first-order path",
            &number(m.accepted_per_sweep, ""),
        ]),
        row(&[
            "of these, first order",
            &number(m.accepted_first_order_per_sweep, ""),
        ]),
        row(&["correct reflection order", &percent(m.precision)]),
        row(&["correct, presumed first order", &percent(m.precision_first_order)]),
        row(&[
            "correct, presumed higher order",
            &percent(m.precision_higher_order),
        ]),
        row(&["correct surface", &percent(m.precision_by_faces)]),
        row(&["correct surface, edges aside", &percent(m.precision_edges_aside)]),
        row(&["without a true path (ghosts)", &m.ghosts.to_string()]),
        row(&["first-order paths measured", &percent(m.measured_first_order)]),
        row(&["first-order paths accepted", &percent(m.recall_first_order)]),
        row(&[
            "error of points of correct order, median",
            &metres(m.point_median_m),
        ]),
        row(&["error of points of correct order, rms", &metres(m.point_rmse_m)]),
        row(&["error of points of correct order, 95 %", &metres(m.point_p95_m)]),
        row(&["map to surface, median", &metres(m.surface_median_m)]),
        row(&["map to surface, rms", &metres(m.surface_rmse_m)]),
        row(&["map to surface, 95 %", &metres(m.surface_p95_m)]),
        row(&[
            "accepted points to surface, median",
            &metres(m.accepted_surface_median_m),
        ]),
        row(&[
            "accepted points to surface, rms",
            &metres(m.accepted_surface_rmse_m),
        ]),
    ];
    table("Map", &["", "value"], &rows)
}

fn trajectory(report: &Report) -> String {
    let (t, n) = (&report.trajectory, &report.consistency);
    if t.poses == 0 {
        return String::new();
    }
    let rows = [
        row(&["first pose", &number(t.first_pose_s, "s")]),
        row(&["position error, rms", &metres(t.position_rmse_m)]),
        row(&["position error, median", &metres(t.position_median_m)]),
        row(&["position error, 95 %", &metres(t.position_p95_m)]),
        row(&["position error, largest", &metres(t.position_max_m)]),
        row(&["position error, rms, aligned", &metres(t.position_aligned_rmse_m)]),
        row(&["position error, rms, settled", &metres(t.settled_position_rmse_m)]),
        row(&["share of poses settled", &percent(t.settled_share)]),
        row(&["relative error, pose to pose, rms", &metres(t.rpe_rmse_m)]),
        row(&["relative error over 1 s, rms", &metres(t.rpe_1s_rmse_m)]),
        row(&["velocity error, rms", &number(t.velocity_rmse_m_per_s, "m/s")]),
        row(&["attitude error, rms", &number(t.attitude_rmse_deg, "deg")]),
        row(&["about x (east)", &number(t.attitude_x_rmse_deg, "deg")]),
        row(&["about y (north)", &number(t.attitude_y_rmse_deg, "deg")]),
        row(&["about z (heading)", &number(t.attitude_z_rmse_deg, "deg")]),
        row(&["clock error, rms", &number(report.clock.rmse_ns, "ns")]),
        row(&["NEES of the position, 1 is honest", &number(n.position_nees, "")]),
        row(&["NEES of the attitude", &number(n.attitude_nees, "")]),
        row(&["NEES of the velocity", &number(n.velocity_nees, "")]),
        row(&["NEES of the clock", &number(n.clock_nees, "")]),
    ];
    table("Trajectory and clock", &["", "value"], &rows)
}

fn completeness(report: &Report) -> String {
    let m = &report.map;
    if m.completeness.is_empty() {
        return String::new();
    }
    let mut rows: Vec<Vec<String>> = m
        .completeness
        .iter()
        .map(|c| {
            vec![
                format!("lit walls, patches of {} m", c.patch_m),
                format!("{} m", c.threshold_m),
                percent(Some(c.share)),
                percent(Some(c.ceiling)),
                format!("{:.0} m²", c.lit_m2),
            ]
        })
        .collect();
    for (name, at, value) in [
        (
            "all lit surfaces, patches of 0.5 m",
            "0.2 m",
            m.completeness_all_0p2m,
        ),
        (
            "all lit surfaces, patches of 0.5 m",
            "0.5 m",
            m.completeness_all_0p5m,
        ),
        ("map points near a surface", "0.2 m", m.precision_0p2m),
        ("map points near a surface", "0.5 m", m.precision_0p5m),
        ("F-score of these two", "0.2 m", m.f_score_0p2m),
        ("F-score of these two", "0.5 m", m.f_score_0p5m),
    ] {
        rows.push(row(&[name, at, &percent(value), "", ""]));
    }
    table(
        "Coverage",
        &["", "within", "share", "with the true points", "area"],
        &rows,
    )
}

fn link_state(report: &Report) -> String {
    let s = &report.link_state;
    let line = |k: usize| {
        let told = s.confusion[k].iter().map(ToString::to_string);
        [STATES[k].to_owned()]
            .into_iter()
            .chain(told)
            .chain([s.true_sweeps[k].to_string()])
            .collect()
    };
    let rows: Vec<Vec<String>> = (0..4).map(line).collect();
    let caption = match s.accuracy {
        Some(accuracy) => format!(
            "Link state, sweeps: true (rows) by estimated; {:.1} % right",
            100.0 * accuracy
        ),
        None => "Link state, sweeps: true; the receiver told none".to_owned(),
    };
    table(
        &caption,
        &["", STATES[0], STATES[1], STATES[2], STATES[3], "sweeps"],
        &rows,
    )
}

fn fates(report: &Report) -> String {
    let line = |f: &crate::evaluation::Fate| {
        let counts = [f.los, f.first_order, f.higher_order, f.ghosts].map(|n| n.to_string());
        let name = match f.verdict.as_str() {
            MeasuredPath::OK => "accepted",
            MeasuredPath::OK_HIGHER_ORDER => "accepted, higher order",
            verdict => verdict,
        };
        [name.to_owned()].into_iter().chain(counts).collect()
    };
    let rows: Vec<Vec<String>> = report.fates.iter().map(line).collect();
    let header = ["", "line of sight", "first order", "higher order", "no true path"];
    table(
        "What became of measured paths, by their true order",
        &header,
        &rows,
    )
}

fn rest(report: &Report) -> String {
    let t = &report.telemetry;
    let mut rows = vec![
        row(&["sweeps", &report.sweeps.to_string()]),
        row(&["flight", &format!("{:.1} s", report.flight_s)]),
        row(&["computed in", &format!("{:.2} s", report.elapsed_s)]),
        row(&["measured paths", &report.measurements.to_string()]),
        row(&["packets", &t.packets.to_string()]),
        row(&["bytes per point", &number(t.bytes_per_point, "")]),
        row(&["bytes per second", &number(t.bytes_per_s, "")]),
        row(&[
            "sweeps with line of sight",
            &report.link_state.los_visible.to_string(),
        ]),
        row(&["sweeps that used one", &report.link_state.los_used.to_string()]),
        row(&[
            "of these without one",
            &report.link_state.los_used_wrongly.to_string(),
        ]),
    ];
    rows.extend(
        report
            .counters
            .iter()
            .map(|(name, count)| vec![name.clone(), count.to_string()]),
    );
    table("Flight, downlink and counters", &["", "value"], &rows)
}

/// The receiver's own counters; nothing when it sent none.
fn health(report: &Report) -> String {
    let words = |(name, count): (&String, &u32)| vec![name.replace('_', " "), count.to_string()];
    let rows: Vec<Vec<String>> = report.health.iter().map(words).collect();
    if rows.is_empty() {
        return String::new();
    }
    table("Receiver's health counters", &["", "value"], &rows)
}
