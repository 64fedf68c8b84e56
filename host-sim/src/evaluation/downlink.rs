//! What the ground heard: a downlink, decoded.

use std::collections::BTreeMap;

use cslam_core::telemetry::{
    ConfigReport, Decoder, EventReport, HealthCounters, HealthReport, Key, LinkReport, Message, PointReport,
    PoseReport,
};

use crate::flight_log::Downlink;

/// Everything the ground heard of one UAV.
#[derive(Clone, Debug, Default)]
pub struct Downlinked {
    /// Points, in the order in which they came.
    pub points: Vec<PointReport>,
    /// Poses, in the order in which they came.
    pub poses: Vec<PoseReport>,
    /// Sweeps, in the order in which they came.
    pub links: Vec<LinkReport>,
    /// The last word on the receiver's health.
    pub health: Option<HealthReport>,
    /// What happened.
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
            Message::Event(event) => self.events.push(event),
            Message::Config(config) => self.config = Some(config),
        }
    }
}
