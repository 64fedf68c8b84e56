//! What is sent when: a heartbeat and the estimator's status once a second, everything else when it comes.
//!
//! The frames that one packet becomes share datagrams. A packet of points is dozens of frames, and a receiver's operating system
//! charges its buffer the same for a small datagram as for a large one: one by one they would overrun it.

use std::collections::BTreeMap;
use std::io;
use std::net::{SocketAddr, UdpSocket};

use super::axes::{rotation, world_to_frd};
use super::frame::Framer;
use super::messages::{
    EstimatorStatus, Frame, Heartbeat, Message, Obstacle, StatusText, estimator_flags as flags,
};
use super::odometry::Poses;
use crate::ground::model::{self, Heard, Pose};
use crate::ground::uav::STALE_AFTER_S;

/// Time between two heartbeats, s.
const HEARTBEAT_S: f64 = 1.0;
/// Bytes of frames in a datagram at most: no link of the field splits it.
const DATAGRAM: usize = 1200;

/// What is remembered of a UAV.
#[derive(Clone, Debug, Default)]
struct Known {
    poses: Poses,
    seen_s: f64,
    next_obstacle: u16,
}

/// A MAVLink output over UDP.
#[derive(Debug)]
pub struct Out {
    socket: UdpSocket,
    to: SocketAddr,
    frame: Frame,
    framer: Framer,
    uavs: BTreeMap<u8, Known>,
    heartbeat_due_s: f64,
    /// Datagrams that the operating system did not take.
    refused: u64,
    /// Poses that a later one had overtaken.
    overtaken: u64,
}

impl Out {
    /// An output to an address, its poses in a frame.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn new(to: SocketAddr, frame: Frame) -> io::Result<Self> {
        let any: SocketAddr = if to.is_ipv4() {
            ([0, 0, 0, 0], 0).into()
        } else {
            ([0_u16; 8], 0).into()
        };
        Ok(Self {
            socket: UdpSocket::bind(any)?,
            to,
            frame,
            framer: Framer::default(),
            uavs: BTreeMap::new(),
            heartbeat_due_s: 0.0,
            refused: 0,
            overtaken: 0,
        })
    }

    /// Datagrams that the operating system did not take.
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Poses that were not passed on because a later one had overtaken them.
    pub fn overtaken(&self) -> u64 {
        self.overtaken
    }

    /// MAVLink counts systems from 1.
    fn system(uav: u8) -> u8 {
        uav.max(1)
    }

    /// Sends messages in as few datagrams as hold them.
    fn send(&mut self, uav: u8, messages: &[Message]) {
        let mut datagram: Vec<u8> = Vec::with_capacity(DATAGRAM);
        for message in messages {
            let frame = self.framer.frame(Self::system(uav), message);
            if datagram.len() + frame.len() > DATAGRAM {
                self.send_datagram(&datagram);
                datagram.clear();
            }
            datagram.extend_from_slice(&frame);
        }
        self.send_datagram(&datagram);
    }

    fn send_datagram(&mut self, datagram: &[u8]) {
        // Nobody may listen yet: that is no trouble of the station.
        if !datagram.is_empty() && self.socket.send_to(datagram, self.to).is_err() {
            self.refused += 1;
        }
    }

    /// Passes a packet on.
    pub fn hear(&mut self, heard: &Heard, now_s: f64) {
        let known = self.uavs.entry(heard.uav).or_default();
        known.seen_s = now_s;
        let messages: Vec<Message> = match &heard.message {
            model::Message::Pose(pose) => {
                let in_order = known.poses.take(pose);
                self.overtaken += u64::from(!in_order);
                let odometry = in_order.then(|| known.poses.odometry(self.frame)).flatten();
                odometry
                    .map(|odometry| Message::Odometry(Box::new(odometry)))
                    .into_iter()
                    .collect()
            }
            model::Message::Points { points } => {
                let seen = |point: &model::Point| {
                    known.next_obstacle = known.next_obstacle.wrapping_add(1);
                    obstacle(known.poses.last()?, point, known.next_obstacle).map(Message::Obstacle)
                };
                points.iter().filter_map(seen).collect()
            }
            model::Message::Event(event) => vec![Message::StatusText(StatusText {
                severity: event.severity,
                text: event.text.clone(),
            })],
            _ => Vec::new(),
        };
        self.send(heard.uav, &messages);
    }

    /// Sends what is due at a time of the station.
    pub fn elapse(&mut self, now_s: f64) {
        if now_s < self.heartbeat_due_s {
            return;
        }
        self.heartbeat_due_s = now_s + HEARTBEAT_S;
        let due: Vec<(u8, bool, Option<Pose>)> = self
            .uavs
            .iter()
            .map(|(uav, known)| {
                (
                    *uav,
                    now_s - known.seen_s <= STALE_AFTER_S,
                    known.poses.last().copied(),
                )
            })
            .collect();
        for (uav, is_fresh, pose) in due {
            let is_active = is_fresh && pose.is_some_and(|pose| !pose.flags.starting);
            let status = pose.map(|pose| Message::EstimatorStatus(estimator_status(&pose, is_fresh)));
            let heartbeat = Message::Heartbeat(Heartbeat { is_active });
            let both: Vec<Message> = std::iter::once(heartbeat).chain(status).collect();
            self.send(uav, &both);
        }
    }
}

/// Where a reflection point lies as the UAV sees it.
fn obstacle(pose: &Pose, point: &model::Point, id: u16) -> Option<Obstacle> {
    let attitude = rotation(pose.quaternion_wb).filter(|_| !pose.flags.starting)?;
    let away = std::array::from_fn(|i| point.position_m[i] - pose.position_m[i]);
    Some(Obstacle {
        time_ms: (pose.time_s * 1e3) as u32,
        position_m: world_to_frd(&attitude, away),
        id,
    })
}

fn estimator_status(pose: &Pose, is_fresh: bool) -> EstimatorStatus {
    let [east, north, up] = pose.position.sigma;
    let usable = is_fresh && pose.flags.is_sound();
    let velocity = flags::VELOCITY_HORIZONTAL | flags::VELOCITY_VERTICAL;
    let position = flags::POSITION_HORIZONTAL | flags::POSITION_VERTICAL;
    let good = match usable {
        false => 0,
        true if pose.flags.dead_reckoning => flags::ATTITUDE | velocity,
        true => flags::ATTITUDE | velocity | position,
    };
    EstimatorStatus {
        time_us: (pose.time_s * 1e6).round() as u64,
        flags: good,
        horizontal_m: libm::hypot(east, north),
        vertical_m: up,
    }
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;
    use crate::ground::model::Severity;

    #[test]
    fn frames_share_datagrams_in_their_order() {
        let listener = UdpSocket::bind("127.0.0.1:0").expect("a free port");
        listener
            .set_read_timeout(Some(Duration::from_secs(60)))
            .expect("longer than nothing");
        let mut out = Out::new(listener.local_addr().expect("bound"), Frame::default()).expect("a free port");
        let texts = (0..40).map(|number| {
            Message::StatusText(StatusText {
                severity: Severity::Info,
                text: format!("text number {number:02} of several"),
            })
        });
        out.send(7, &texts.collect::<Vec<_>>());
        let (mut heard, mut datagrams, mut buffer) = (Vec::new(), 0, [0; 2048]);
        while !String::from_utf8_lossy(&heard).contains("number 39") {
            let length = listener.recv(&mut buffer).expect("it comes over the loopback");
            assert!(length <= DATAGRAM, "{length}");
            datagrams += 1;
            heard.extend_from_slice(&buffer[..length]);
        }
        let all = String::from_utf8_lossy(&heard);
        let places: Vec<_> = (0..40).map(|n| all.find(&format!("number {n:02}"))).collect();
        assert!(places.iter().all(Option::is_some) && places.is_sorted());
        // 46 bytes each, 26 of them to a datagram.
        assert_eq!(datagrams, 2);
        assert_eq!(out.refused(), 0);
    }
}
