//! What the ground heard: a downlink, decoded.

use std::collections::BTreeMap;

use cslam_core::telemetry::{Decoder, Message, PointReport, Summary, TelemetryError};

/// Everything the ground heard.
#[derive(Clone, Debug, Default)]
pub struct Downlinked {
    /// Accepted points, in order.
    pub points: Vec<PointReport>,
    /// Reasons of rejections and of unusable input, with their number.
    pub reasons: BTreeMap<&'static str, u32>,
    /// What became of each path: by link and path, `ok` or the reason.
    pub verdicts: BTreeMap<(u32, u8), &'static str>,
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
        let (link, path, reason) = match packet.message {
            Message::Point(point) => {
                heard.points.push(point);
                heard.verdicts.insert((point.link, point.path), "ok");
                continue;
            }
            Message::Rejection(report) => (report.link, report.path, report.reason.as_str()),
            Message::Input(report) => (report.link, report.path, report.error.as_str()),
            Message::Summary(summary) => {
                heard.summary = Some(summary);
                continue;
            }
            _ => continue,
        };
        *heard.reasons.entry(reason).or_default() += 1;
        heard.verdicts.insert((link, path), reason);
    }
    heard
}
