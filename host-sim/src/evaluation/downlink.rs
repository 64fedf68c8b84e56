//! What the ground heard: a downlink, decoded.

use std::collections::BTreeMap;

use cslam_core::telemetry::{
    ConfigReport, Decoder, Event, EventReport, HealthCounters, HealthReport, Key, LinkReport, Message,
    PointReport, PoseReport,
};

use crate::flight_log::Downlink;

/// Everything the ground heard of one UAV.
#[derive(Clone, Debug, Default)]
pub struct Downlinked {
    /// Points that stand, in the order in which they came: those of a withdrawn surface have left.
    pub points: Vec<PointReport>,
    /// Poses, in the order in which they came.
    pub poses: Vec<PoseReport>,
    /// Sweeps, in the order in which they came.
    pub links: Vec<LinkReport>,
    /// The last word on the receiver's health.
    pub health: Option<HealthReport>,
    /// What happened, each event once.
    pub events: Vec<EventReport>,
    /// What the receiver is set to.
    pub config: Option<ConfigReport>,
    /// Packets and bytes that were taken.
    pub traffic: Downlink,
    /// Frames that were not taken, by the reason.
    pub refused: BTreeMap<&'static str, u64>,
}

/// Decodes the downlink of a UAV.
pub fn decode(bytes: &[u8], uav: u8, key: &Key) -> Downlinked {
    let mut heard = Downlinked::default();
    let mut decoder = Decoder::new(uav, key);
    let mut length = 0;
    for &byte in bytes {
        length += 1;
        match decoder.push(byte) {
            None => continue,
            Some(Ok(packet)) => heard.take(packet.message, length),
            Some(Err(error)) => *heard.refused.entry(error.as_str()).or_default() += 1,
        }
        length = 0;
    }
    heard
}

impl Downlinked {
    /// Every counter of the last word on the receiver's health, by name: whatever a health packet may hold. Empty without such a word.
    pub fn health_counters(&self) -> BTreeMap<String, u32> {
        let counters = self.health.iter().flat_map(|health| {
            let names = HealthCounters::NAMES.into_iter().map(str::to_owned);
            names.zip(health.counters.to_array())
        });
        counters.collect()
    }

    /// Enters a message whose packet was that many bytes long, framing included.
    fn take(&mut self, message: Message, length: u64) {
        self.traffic.enter(&message, length);
        match message {
            Message::Points(points) => self.points.extend(points.points()),
            Message::Pose(pose) => self.poses.push(pose),
            Message::Link(link) => self.links.push(link),
            Message::Health(health) => self.health = Some(health),
            Message::Event(report) => {
                self.follow(&report.event);
                // Those of surfaces are told again.
                if !self.events.contains(&report) {
                    self.events.push(report);
                }
            }
            Message::Config(config) => self.config = Some(config),
        }
    }

    /// Follows what became of a surface.
    fn follow(&mut self, event: &Event) {
        match *event {
            Event::SurfaceWithdrawn(surface) => self.points.retain(|point| point.surface != Some(surface)),
            Event::SurfaceMerged { gone, stays } => {
                for point in self.points.iter_mut().filter(|point| point.surface == Some(gone)) {
                    point.surface = Some(stays);
                }
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::telemetry::{MAX_FRAME, PointBatch, Sender};

    use super::*;

    #[test]
    fn points_follow_their_surfaces() {
        let mut batch = PointBatch::new();
        for surface in [None, Some(1), Some(2), Some(3)] {
            let point = PointReport {
                sweep: 1,
                stop: 0,
                position_m: [0.0; 3],
                sigma_m: 0.1,
                probability: 1.0,
                surface,
            };
            batch.push(&point).expect("room");
        }
        let event = |event| Message::Event(EventReport { time_ns: 0, event });
        let withdrawn = event(Event::SurfaceWithdrawn(1));
        let merged = event(Event::SurfaceMerged { gone: 3, stays: 2 });
        let mut sender = Sender::new(1, &Key::TEST, 0);
        let mut bytes = Vec::new();
        for message in [Message::Points(batch), withdrawn.clone(), merged, withdrawn] {
            let mut frame = [0; MAX_FRAME];
            bytes.extend_from_slice(sender.encode(&message, &mut frame).expect("it can be sent"));
        }
        let heard = decode(&bytes, 1, &Key::TEST);
        let surfaces: Vec<_> = heard.points.iter().map(|point| point.surface).collect();
        assert_eq!(surfaces, [None, Some(2), Some(2)]);
        assert_eq!(heard.events.len(), 2, "what is told again is one event");
    }
}
