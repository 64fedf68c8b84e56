//! What the station knows of one UAV.

use std::collections::{BTreeMap, VecDeque};

use super::losses::Losses;
use super::model::{Config, Event, Health, Heard, Link, Message, Pose};
use super::surfaces::Surfaces;
use super::trail::Trail;

/// Sweeps whose links are remembered: ten minutes at two sweeps per second.
pub const MOST_LINKS: usize = 1200;

/// Events that are remembered.
pub const MOST_EVENTS: usize = 64;

/// A UAV is stale when it has not been heard for so long, s: poses come ten times per second.
pub const STALE_AFTER_S: f64 = 2.0;

/// A clock that goes back by so much began anew, s.
pub(super) const RESTARTED_S: f64 = 1.0;

/// Something with the station's time at which it came, s.
#[derive(Clone, Debug, PartialEq)]
pub struct At<T> {
    /// Seconds since the start of the station.
    pub seen_s: f64,
    /// What came.
    pub what: T,
}

/// One UAV.
#[derive(Clone, Debug, Default)]
pub struct Uav {
    /// When it was last heard, s since the start of the station.
    pub seen_s: f64,
    /// Packets by kind.
    pub kinds: BTreeMap<&'static str, u64>,
    /// Bytes of all its packets, framing included.
    pub bytes: u64,
    /// Points that came.
    pub points: u64,
    /// Latest time of its clock, s.
    pub clock_s: f64,
    /// What was lost on the way.
    pub losses: Losses,
    /// Last pose.
    pub pose: Option<At<Pose>>,
    /// Where it has been.
    pub trail: Trail,
    /// Where its GMT was last.
    pub gmt_m: Option<[f64; 3]>,
    /// Where its GMT has been.
    pub gmt_trail: Trail,
    /// Last links.
    pub links: VecDeque<At<Link>>,
    /// Links that the pages have not been told of: the last so many of `links`.
    pub fresh_links: usize,
    /// Last word on its health.
    pub health: Option<At<Health>>,
    /// What it runs with.
    pub config: Option<Config>,
    /// Last events, each once, however often it was told.
    pub events: VecDeque<At<Event>>,
    /// Its surfaces.
    pub surfaces: Surfaces,
    /// Whether the pages have not been told of the last pose.
    pub fresh_pose: bool,
    /// Whether the pages have not been told of the last change.
    pub changed: bool,
}

impl Uav {
    /// Whether it has not been heard for too long.
    pub fn is_stale(&self, now_s: f64) -> bool {
        now_s - self.seen_s > STALE_AFTER_S
    }

    /// Takes in a packet of `bytes` bytes, points excepted. Whether it is news: an event may be told again.
    pub(super) fn hear(&mut self, heard: &Heard, bytes: usize, now_s: f64) -> bool {
        self.seen_s = now_s;
        self.changed = true;
        self.bytes += bytes as u64;
        self.losses.count(heard.counter);
        if let Some(time_s) = heard.message.time_s() {
            // Packets that overtake each other are not so far apart.
            if time_s < self.clock_s - RESTARTED_S {
                self.losses.restart();
                self.surfaces.restart(heard.counter);
                self.clock_s = time_s;
            }
            self.clock_s = self.clock_s.max(time_s);
        }
        *self.kinds.entry(kind(&heard.message)).or_default() += 1;
        match &heard.message {
            Message::Points { points } => self.points += points.len() as u64,
            Message::Pose(pose) => self.go(pose, now_s),
            Message::Link(link) => {
                if let Some(gmt_m) = link.gmt_m {
                    self.gmt_m = link.gmt_m;
                    self.gmt_trail.go(gmt_m);
                }
                push_bounded(&mut self.links, MOST_LINKS, now_s, link.clone());
                self.fresh_links = (self.fresh_links + 1).min(MOST_LINKS);
            }
            Message::Health(health) => {
                self.health = Some(At {
                    seen_s: now_s,
                    what: health.clone(),
                });
            }
            Message::Event(event) if self.events.iter().any(|at| at.what == *event) => return false,
            Message::Event(event) => push_bounded(&mut self.events, MOST_EVENTS, now_s, event.clone()),
            Message::Config(config) => self.config = Some(config.clone()),
        }
        true
    }

    fn go(&mut self, pose: &Pose, now_s: f64) {
        if !pose.flags.starting {
            self.trail.go(pose.position_m);
        }
        self.fresh_pose = true;
        self.pose = Some(At {
            seen_s: now_s,
            what: *pose,
        });
    }
}

/// Name of a kind of packet.
pub fn kind(message: &Message) -> &'static str {
    match message {
        Message::Points { .. } => "points",
        Message::Pose(_) => "pose",
        Message::Link(_) => "link",
        Message::Health(_) => "health",
        Message::Event(_) => "event",
        Message::Config(_) => "config",
    }
}

fn push_bounded<T>(queue: &mut VecDeque<At<T>>, most: usize, seen_s: f64, what: T) {
    if queue.len() == most {
        queue.pop_front();
    }
    queue.push_back(At { seen_s, what });
}
