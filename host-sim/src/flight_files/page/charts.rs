//! Which charts the page shows.

use super::chart::{Chart, Scale};
use super::figure;
use crate::evaluation::visible_spans;
use crate::flight_files::Outputs;
use crate::flight_log::{FlightLog, Measurement};
use crate::statistics::quantile;

/// Seconds of flight without line of sight: from the last sweep that had it to the next one.
fn outages(log: &FlightLog) -> Vec<(f64, f64)> {
    let end_s = log.sweeps.last().map_or(0.0, |s| s.time_s);
    let mut free_from = 0.0;
    let mut spans = Vec::new();
    for (from, to) in visible_spans(log) {
        spans.push((free_from, from));
        free_from = to;
    }
    spans.push((free_from, end_s));
    spans.retain(|(from, to)| to - from > 1.5 * log.header.sweep_period_s);
    spans
}

/// Errors of the pose over time, with the receiver's own standard deviations; nothing without a pose.
pub(super) fn errors(outputs: &Outputs<'_>) -> String {
    let log = outputs.log;
    let errors = &outputs.evaluation.pose_errors;
    if errors.is_empty() {
        return String::new();
    }
    let poses = log.trajectory();
    let estimates: Vec<_> = poses
        .iter()
        .filter_map(|p| Some((p.time_s, p.estimate?)))
        .collect();
    let root = |c: &[[f64; 3]; 3]| libm::sqrt((c[0][0] + c[1][1] + c[2][2]).max(0.0));
    let dark = outages(log);
    let time = Scale::Linear(0.0, poses.last().map_or(1.0, |p| p.time_s).max(1e-3));
    let over_time = |title: &str, unit: &'static str, error: Vec<(f64, f64)>, sigma: Vec<(f64, f64)>| {
        // The scale is that of the errors: a filter that has not settled yet would hide all else.
        let values: Vec<f64> = error.iter().map(|p| p.1).collect();
        let most = quantile(&values, 0.995).unwrap_or(1.0) * 1.15;
        let mut chart = Chart::new(time, Scale::from_zero(most), "time, s", unit);
        chart
            .spans(&dark, "outage")
            .area(&sigma, "sigma")
            .line(&error, "error");
        let keys = [
            ("k-error", "error"),
            ("k-sigma", "receiver's standard deviation"),
            ("k-outage", "no line of sight"),
        ];
        figure(title, &keys, &chart.svg(title))
    };
    let series = |pick: &dyn Fn(usize) -> f64| {
        (0..errors.len())
            .map(|k| (errors[k].time_s, pick(k)))
            .collect::<Vec<_>>()
    };
    let sigma = |pick: &dyn Fn(usize) -> f64| {
        (0..estimates.len())
            .map(|k| (estimates[k].0, pick(k)))
            .collect::<Vec<_>>()
    };
    let mut page = over_time(
        "Position error",
        "m",
        series(&|k| errors[k].position_m.norm()),
        sigma(&|k| root(&estimates[k].1.position_covariance_m2)),
    );
    page += &over_time(
        "Attitude error",
        "deg",
        series(&|k| errors[k].attitude_rad.norm().to_degrees()),
        sigma(&|k| root(&estimates[k].1.attitude_covariance_rad2).to_degrees()),
    );
    page += &over_time(
        "Velocity error",
        "m/s",
        series(&|k| errors[k].velocity_m_per_s.norm()),
        sigma(&|k| root(&estimates[k].1.velocity_covariance_m2_per_s2)),
    );
    if errors.iter().any(|e| e.clock_s.is_some()) {
        page += &over_time(
            "Clock error, magnitude",
            "ns",
            series(&|k| errors[k].clock_s.map_or(f64::NAN, |s| s.abs() * 1e9)),
            sigma(&|k| estimates[k].1.clock_sigma_s.map_or(0.0, |s| s * 1e9)),
        );
    }
    page
}

/// Paths and accepted points of every sweep.
pub(super) fn paths(log: &FlightLog) -> String {
    let mut accepted = vec![0_usize; log.sweeps.len()];
    for point in &log.points {
        if let Some(count) = log
            .sweeps
            .iter()
            .position(|s| s.sweep == point.sweep)
            .and_then(|k| accepted.get_mut(k))
        {
            *count += 1;
        }
    }
    let steps = |value: &dyn Fn(usize) -> usize| -> Vec<(f64, f64)> {
        let pair = |k: usize| {
            let (time_s, height) = (log.sweeps[k].time_s, value(k) as f64);
            [(time_s, height), (time_s + log.header.sweep_period_s, height)]
        };
        (0..log.sweeps.len()).flat_map(pair).collect()
    };
    let truth = steps(&|k| log.sweeps[k].truth.link.as_ref().map_or(0, |l| l.paths.len()));
    let measured = steps(&|k| log.sweeps[k].estimate.paths.len());
    let accepted = steps(&|k| accepted[k]);
    let most = truth.iter().chain(&measured).map(|p| p.1).fold(1.0, f64::max);
    let end_s = log.sweeps.last().map_or(1.0, |s| s.time_s);
    let mut chart = Chart::new(
        Scale::Linear(0.0, end_s),
        Scale::from_zero(most),
        "time, s",
        "paths per sweep",
    );
    chart
        .area(&truth, "paths-true")
        .line(&measured, "paths-measured")
        .line(&accepted, "paths-accepted");
    let keys = [
        ("k-paths-true", "true paths"),
        ("k-paths-measured", "measured"),
        ("k-paths-accepted", "accepted points"),
    ];
    figure("Paths per sweep", &keys, &chart.svg("Paths per sweep"))
}

/// Estimated probabilities of the link's states; nothing without a classifier.
pub(super) fn probabilities(log: &FlightLog) -> String {
    let known = |k: usize| -> Vec<(f64, f64)> {
        let value =
            |s: &crate::flight_log::SweepRecord| s.estimate.link.and_then(|l| l.probabilities).map(|p| p[k]);
        log.sweeps
            .iter()
            .map(|s| (s.time_s, value(s).unwrap_or(f64::NAN)))
            .collect()
    };
    let all = [known(0), known(1), known(2)];
    if all[0].iter().all(|p| p.1.is_nan()) {
        return String::new();
    }
    let end_s = log.sweeps.last().map_or(1.0, |s| s.time_s);
    let mut chart = Chart::new(
        Scale::Linear(0.0, end_s),
        Scale::Linear(0.0, 1.0),
        "time, s",
        "probability",
    );
    for (points, class) in all.iter().zip(["p1", "p2", "p3"]) {
        chart.line(points, class);
    }
    let keys = [
        ("k-state1", "line of sight"),
        ("k-state2", "first order"),
        ("k-state3", "higher order"),
    ];
    figure(
        "Probabilities of the link's state",
        &keys,
        &chart.svg("Probabilities of the link's state"),
    )
}

/// Test ratios of the filter's measurements over time; nothing without a filter.
pub(super) fn innovations(log: &FlightLog) -> String {
    let mut page = String::new();
    let end_s = log.sweeps.last().map_or(1.0, |s| s.time_s);
    for kind in Measurement::ALL {
        let of_kind = |accepted: bool| -> Vec<(f64, f64)> {
            let in_sweep = log
                .sweeps
                .iter()
                .flat_map(|s| s.estimate.innovations.iter().map(move |i| (s.time_s, i)));
            let some = in_sweep.filter(|(_, i)| i.measurement == kind && i.accepted == accepted);
            some.map(|(time_s, i)| (time_s, i.test_ratio)).collect()
        };
        let (accepted, refused) = (of_kind(true), of_kind(false));
        if accepted.is_empty() && refused.is_empty() {
            continue;
        }
        let mut chart = Chart::new(
            Scale::Linear(0.0, end_s),
            Scale::Log(0.001, 1000.0),
            "time, s",
            "NIS / gate",
        );
        chart
            .level(1.0, "gate")
            .dots(&accepted, "taken")
            .dots(&refused, "refused");
        let title = format!("Innovations: {}", kind.label());
        let keys = [("k-taken", "taken"), ("k-refused", "refused"), ("k-gate", "gate")];
        page += &figure(&title, &keys, &chart.svg(&title));
    }
    page
}

/// Cumulative distributions of the errors.
pub(super) fn distributions(outputs: &Outputs<'_>) -> String {
    let evaluation = outputs.evaluation;
    let position: Vec<f64> = evaluation
        .pose_errors
        .iter()
        .map(|e| e.position_m.norm())
        .collect();
    let mut page = String::new();
    for (title, values) in [
        (
            "Reflection points: distance to where the wave was reflected",
            &evaluation.point_errors.reflection_m,
        ),
        (
            "Map: distance to the nearest true surface",
            &evaluation.point_errors.surface_m,
        ),
        ("Position error", &position),
    ] {
        if let (Some(most), Some(_)) = (quantile(values, 0.98), values.first()) {
            let mut sorted = values.clone();
            sorted.sort_by(f64::total_cmp);
            let x = Scale::from_zero(most.max(1e-3));
            let Scale::Linear(_, end) = x else { continue };
            let share = |k: usize| (k + 1) as f64 / sorted.len() as f64;
            let mut curve: Vec<(f64, f64)> = vec![(0.0, 0.0)];
            curve.extend(
                sorted
                    .iter()
                    .enumerate()
                    .map(|(k, v)| (*v, share(k)))
                    .filter(|p| p.0 <= end),
            );
            curve.push((end, curve.last().map_or(0.0, |p| p.1)));
            let mut chart = Chart::new(x, Scale::Linear(0.0, 1.0), "m", "share below");
            chart.level(0.5, "gate").line(&curve, "error");
            let title = format!("{title} ({} values)", values.len());
            page += &figure(&title, &[], &chart.svg(&title));
        }
    }
    page
}
