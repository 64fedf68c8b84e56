//! How good a flight's points are, judged from the packets that reached the ground and the truth of the path list.

mod assignment;
pub mod matching;

use std::collections::BTreeMap;

use cslam_core::telemetry::{Decoder, Message, PointReport, Summary, TelemetryError};
use serde::Serialize;

use crate::paths::Link;
use crate::statistics::{median, quantile, rms};

/// Everything the ground heard.
#[derive(Clone, Debug, Default)]
pub struct Downlinked {
    /// Accepted points, in order.
    pub points: Vec<PointReport>,
    /// Reasons of rejections and of unusable input, with their number.
    pub reasons: BTreeMap<&'static str, u32>,
    /// Totals as the receiver counted them.
    pub summary: Option<Summary>,
    /// Packets decoded.
    pub packets: u32,
    /// Frames that were not packets.
    pub damaged: Vec<TelemetryError>,
}

/// Decodes a downlink.
pub fn decode(bytes: &[u8]) -> Downlinked {
    let mut heard = Downlinked::default();
    let mut decoder = Decoder::new();
    for result in bytes.iter().filter_map(|&byte| decoder.push(byte)) {
        let packet = match result {
            Ok(packet) => packet,
            Err(error) => {
                heard.damaged.push(error);
                continue;
            }
        };
        heard.packets += 1;
        match packet.message {
            Message::Point(point) => heard.points.push(point),
            Message::Rejection(report) => *heard.reasons.entry(report.reason.as_str()).or_default() += 1,
            Message::Input(report) => *heard.reasons.entry(report.error.as_str()).or_default() += 1,
            Message::Summary(summary) => heard.summary = Some(summary),
            _ => {}
        }
    }
    heard
}

/// Figures of a map, from points whose true order and reflection point are known.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MapFigures {
    /// Occupied voxels.
    pub points: u32,
    /// Accepted reflection points, before they were fused.
    pub accepted: usize,
    /// Share of accepted points whose path was truly of first order.
    pub precision_first_order: Option<f64>,
    /// Share of the first-order paths flown past that were accepted.
    pub recall_first_order: Option<f64>,
    /// Rms distance of truly first-order points to where the wave was reflected, m.
    pub point_rmse_m: Option<f64>,
    /// Median of the same, m.
    pub point_median_m: Option<f64>,
    /// 95 % quantile of the same, m.
    pub point_p95_m: Option<f64>,
}

/// Compares accepted points with the truth of the list. Links without `order` and `last_vertex` give no figures.
pub fn compare(points: &[PointReport], map_points: u32, flown: &[Link], strongest_only: bool) -> MapFigures {
    let (mut known, mut first, mut errors_m) = (0, 0, Vec::new());
    for report in points {
        let path = flown
            .get(report.link as usize)
            .and_then(|l| l.paths.get(usize::from(report.path)));
        let Some((order, path)) = path.and_then(|p| p.order.map(|order| (order, p))) else {
            continue;
        };
        known += 1;
        if order != 1 {
            continue;
        }
        first += 1;
        if let Some(truth) = path.last_vertex {
            let square = |i: usize| (f64::from(report.position_m[i]) - truth[i]).powi(2);
            errors_m.push((square(0) + square(1) + square(2)).sqrt());
        }
    }
    let heard = flown
        .iter()
        .flat_map(|l| l.paths.iter().take(if strongest_only { 1 } else { usize::MAX }));
    let all_first = heard.filter(|p| p.order == Some(1)).count();
    let share = |part: usize, whole: usize| (whole > 0).then(|| part as f64 / whole as f64);
    MapFigures {
        points: map_points,
        accepted: points.len(),
        precision_first_order: share(first, known),
        recall_first_order: share(first, all_first),
        point_rmse_m: rms(&errors_m),
        point_median_m: median(&errors_m),
        point_p95_m: quantile(&errors_m, 0.95),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paths::{LinkPath, bundled};

    fn report(link: u32, path: u8, position_m: [f32; 3]) -> PointReport {
        PointReport {
            link,
            path,
            position_m,
            sigma_m: 0.1,
        }
    }

    fn first_of_order(links: &[Link], order: u8) -> (u32, u8, LinkPath) {
        let places = links.iter().enumerate().flat_map(|(i, l)| {
            l.paths
                .iter()
                .enumerate()
                .map(move |(j, p)| (i as u32, j as u8, p.clone()))
        });
        places
            .into_iter()
            .find(|(_, _, p)| p.order == Some(order))
            .expect("the list has all orders")
    }

    #[test]
    fn a_wrong_acceptance_costs_precision_and_an_offset_is_measured() {
        let links = bundled().expect("sound");
        let (l1, p1, first) = first_of_order(&links, 1);
        let (l2, p2, second) = first_of_order(&links, 2);
        let mut at = first.last_vertex.expect("known").map(|c| c as f32);
        at[2] += 0.5;
        let wrong = second.last_vertex.expect("known").map(|c| c as f32);
        let figures = compare(&[report(l1, p1, at), report(l2, p2, wrong)], 2, &links, false);
        assert_eq!(figures.precision_first_order, Some(0.5));
        assert!((figures.point_rmse_m.expect("one point") - 0.5).abs() < 1e-5);
        let all = links
            .iter()
            .flat_map(|l| &l.paths)
            .filter(|p| p.order == Some(1))
            .count();
        assert_eq!(figures.recall_first_order, Some(1.0 / all as f64));
    }
}
