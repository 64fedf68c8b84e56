//! Bytes by kind of message.

use cslam_core::telemetry::{Decoder, Key, Message};
use serde::Serialize;

/// Baud of the radio that everything must fit, and bytes per second of it: ten bits a byte.
pub const BAUD: f64 = 57_600.0;
const RADIO_BYTES_PER_S: f64 = BAUD / 10.0;

/// A kind of message over a flight.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BudgetRow {
    /// What is sent.
    pub kind: &'static str,
    /// Packets.
    pub packets: u64,
    /// Bytes, framing and checks included.
    pub bytes: u64,
}

/// What a downlink cost.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Budget {
    /// By kind.
    pub rows: Vec<BudgetRow>,
    /// Points in the packets of points.
    pub points: u64,
    /// Time from the first packet to the last, by the times in them, s.
    pub duration_s: f64,
    /// Most bytes of any whole second.
    pub peak_bytes_per_s: u64,
}

/// Kinds, in the order of the table.
const KINDS: [&str; 6] = ["points", "pose", "link", "health", "event", "config"];

/// Bytes of other formats, without and with everything that carries them.
///
/// MAVLink 2 adds 12 bytes to a payload and 13 more when signed (mavlink.io, serialization).
pub mod rivals {
    /// x, y, z as f32, nothing around them.
    pub const POINT_XYZ: u64 = 12;
    /// The same as the Point Cloud Library keeps it, aligned to 16 bytes.
    pub const POINT_XYZ_ALIGNED: u64 = 16;
    /// Frame of MAVLink 2, and its signature.
    pub const MAVLINK_FRAME: u64 = 12;
    /// Signature of MAVLink 2.
    pub const MAVLINK_SIGNATURE: u64 = 13;
    /// OBSTACLE_DISTANCE_3D (message 11037), the payload of one point.
    pub const OBSTACLE_DISTANCE_3D: u64 = 28;
    /// ODOMETRY (message 331), extensions included.
    pub const ODOMETRY: u64 = 233;
    /// SYS_STATUS (message 1) without extensions: the nearest to a health report.
    pub const SYS_STATUS: u64 = 31;
}

impl Budget {
    /// Of everything a UAV sent; `None` when there is no packet with a time in it.
    pub fn new(bytes: &[u8], uav: u8, key: &Key) -> Option<Self> {
        let mut rows = KINDS.map(|kind| BudgetRow {
            kind,
            packets: 0,
            bytes: 0,
        });
        let (mut decoder, mut length, mut points) = (Decoder::new(uav, key), 0, 0);
        let (mut now_ns, mut first_ns) = (None::<u64>, None);
        let mut sent = Vec::new();
        for &byte in bytes {
            length += 1;
            let Some(result) = decoder.push(byte) else {
                continue;
            };
            if let Ok(packet) = result {
                let row = match &packet.message {
                    Message::Points(batch) => {
                        points += batch.len() as u64;
                        0
                    }
                    Message::Pose(_) => 1,
                    Message::Link(_) => 2,
                    Message::Health(_) => 3,
                    Message::Event(_) => 4,
                    Message::Config(_) => 5,
                };
                rows[row].packets += 1;
                rows[row].bytes += length;
                now_ns = now_ns.max(time_ns(&packet.message));
                first_ns = first_ns.or(now_ns);
                sent.push((now_ns.unwrap_or(0), length));
            }
            length = 0;
        }
        let duration_s = (now_ns? - first_ns?) as f64 * 1e-9;
        Some(Self {
            rows: rows.to_vec(),
            points,
            duration_s,
            peak_bytes_per_s: peak(&sent),
        })
    }

    /// Bytes of a point, everything of its packets included.
    pub fn bytes_per_point(&self) -> Option<f64> {
        (self.points > 0).then(|| self.rows[0].bytes as f64 / self.points as f64)
    }

    /// Bytes per second of everything.
    pub fn bytes_per_s(&self) -> f64 {
        self.rows.iter().map(|row| row.bytes as f64).sum::<f64>() / self.duration_s
    }

    /// Share of the radio that everything takes.
    pub fn share_of_radio(&self) -> f64 {
        self.bytes_per_s() / RADIO_BYTES_PER_S
    }

    /// Bytes per second that MAVLink messages of the same would take: an ODOMETRY for a pose, an OBSTACLE_DISTANCE_3D for a point, a
    /// SYS_STATUS for a health report, all signed. It has nothing for the fate of paths.
    pub fn mavlink_bytes_per_s(&self) -> f64 {
        let around = rivals::MAVLINK_FRAME + rivals::MAVLINK_SIGNATURE;
        let bytes = self.points * (rivals::OBSTACLE_DISTANCE_3D + around)
            + self.rows[1].packets * (rivals::ODOMETRY + around)
            + self.rows[3].packets * (rivals::SYS_STATUS + around);
        bytes as f64 / self.duration_s
    }
}

/// Time in a message, ns; points have none, they go with what came before.
fn time_ns(message: &Message) -> Option<u64> {
    match message {
        Message::Points(_) | Message::Config(_) => None,
        Message::Pose(pose) => Some(pose.time_ns),
        Message::Link(link) => Some(link.time_ns),
        Message::Health(health) => Some(health.time_ns),
        Message::Event(event) => Some(event.time_ns),
    }
}

/// Most bytes within a second, of packets in the order of their times.
fn peak(sent: &[(u64, u64)]) -> u64 {
    let (mut from, mut within, mut most) = (0, 0, 0);
    for &(time_ns, length) in sent {
        within += length;
        while sent[from].0 + 1_000_000_000 <= time_ns {
            within -= sent[from].1;
            from += 1;
        }
        most = most.max(within);
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_peak_is_that_of_the_fullest_second() {
        let s = 1_000_000_000;
        assert_eq!(peak(&[]), 0);
        assert_eq!(peak(&[(0, 5), (s - 1, 6), (s, 7), (3 * s, 9)]), 13);
        assert_eq!(peak(&[(0, 5), (s, 5), (2 * s, 5)]), 5);
    }
}
