//! What the station says to a page, over a websocket: points and poses as compact binary messages, the rest as JSON.
//!
//! Binary messages are little endian and made of 32-bit words, so that a page reads them in place; the first word is the kind.
//!
//! ```text
//! 1 points: number of points in the map (slots from there on are free again), number of runs, then runs of neighbouring slots:
//!           first slot, count, then 5 words a point: x y z (f32, m), seen (f32, s), probability | GMT stop | UAV | hits (u8 each)
//! 2 poses:  now (f32, s), number, then 18 words a UAV: id | flags | resets | line of sight (u8 each), seen (f32, s), position (3 f32, m),
//!           attitude w x y z (4 f32), velocity (3 f32, m/s), GMT (3 f32, m, NaN when unknown), sigma of position, attitude,
//!           velocity (3 f32: m, rad, m/s)
//! 3 trail:  id | 0 UAV or 1 GMT (u8 each) | 0 | 0, number, then 3 words a place: x y z (f32, m)
//! ```
//! Flags of a pose, from bit 0: starting, contested, clock contested, beacon implausible, inertial missing, dead reckoning, lost,
//! attitude lost. Stops are modulo 256 and hits at most 255. Times are seconds since the start of the station.

use serde::Serialize;
use serde_json::{Value, json};

use crate::ground::cloud::{Cloud, MapPoint};
use crate::ground::model::{Link, PoseFlags};
use crate::ground::station::Station;
use crate::ground::uav::{At, Uav};

/// Most points of one message.
pub(super) const MOST_POINTS: usize = 1 << 15;

const POINTS: u32 = 1;
const POSES: u32 = 2;
const TRAIL: u32 = 3;

/// Appends words.
#[derive(Default)]
struct Words(Vec<u8>);

impl Words {
    fn word(&mut self, word: u32) {
        self.0.extend_from_slice(&word.to_le_bytes());
    }

    fn float(&mut self, value: f64) {
        self.0.extend_from_slice(&(value as f32).to_le_bytes());
    }

    fn floats(&mut self, values: &[f64]) {
        for value in values {
            self.float(*value);
        }
    }

    fn bytes(&mut self, bytes: [u8; 4]) {
        self.0.extend_from_slice(&bytes);
    }

    fn point(&mut self, point: &MapPoint) {
        self.floats(&point.position_m.map(f64::from));
        self.float(f64::from(point.seen_s));
        let hits = point.hits.min(255) as u8;
        self.bytes([point.probability, (point.gmt_index & 0xff) as u8, point.uav, hits]);
    }
}

/// Points in slots `first..first + count` as far as they are taken.
pub(super) fn points_in(cloud: &Cloud, first: u32, count: usize) -> Vec<u8> {
    let count = count.min(cloud.len().saturating_sub(first as usize));
    let mut words = Words(Vec::with_capacity(20 + 20 * count));
    for word in [POINTS, cloud.len() as u32, 1, first, count as u32] {
        words.word(word);
    }
    for slot in (first..).take(count) {
        if let Some(point) = cloud.get(slot) {
            words.point(&point);
        }
    }
    words.0
}

/// Points in ascending slots.
pub(super) fn points_at(cloud: &Cloud, slots: &[u32]) -> Vec<u8> {
    let mut words = Words(Vec::with_capacity(12 + 28 * slots.len()));
    let runs = slots.chunk_by(|a, b| a + 1 == *b);
    for word in [POINTS, cloud.len() as u32, runs.clone().count() as u32] {
        words.word(word);
    }
    for run in runs {
        words.word(run.first().copied().unwrap_or_default());
        words.word(run.len() as u32);
        for point in run.iter().filter_map(|slot| cloud.get(*slot)) {
            words.point(&point);
        }
    }
    words.0
}

/// Last poses of the UAVs that `wanted` wants.
pub(super) fn poses(station: &Station, now_s: f64, wanted: impl Fn(&Uav) -> bool) -> Option<Vec<u8>> {
    let posed: Vec<_> = station
        .uavs()
        .iter()
        .filter(|(_, uav)| wanted(uav))
        .filter_map(|(id, uav)| Some((*id, uav, uav.pose.as_ref()?)))
        .collect();
    if posed.is_empty() {
        return None;
    }
    let mut words = Words::default();
    words.word(POSES);
    words.float(now_s);
    words.word(posed.len() as u32);
    for (id, uav, at) in posed {
        let pose = &at.what;
        words.bytes([
            id,
            flags(&pose.flags),
            pose.resets,
            u8::from(pose.flags.line_of_sight),
        ]);
        words.float(at.seen_s);
        words.floats(&pose.position_m);
        words.floats(&pose.quaternion_wb);
        words.floats(&pose.velocity_m_per_s);
        words.floats(&uav.gmt_m.unwrap_or([f64::NAN; 3]));
        words.floats(&[
            pose.position.total(),
            pose.attitude.total(),
            pose.velocity.total(),
        ]);
    }
    Some(words.0)
}

fn flags(flags: &PoseFlags) -> u8 {
    let bits = [
        flags.starting,
        flags.contested,
        flags.clock_contested,
        flags.beacon_implausible,
        flags.inertial_missing,
        flags.dead_reckoning,
        flags.lost,
        flags.attitude_lost,
    ];
    bits.iter().rev().fold(0, |byte, bit| byte << 1 | u8::from(*bit))
}

/// The ways of a UAV and of its GMT.
pub(super) fn trails(id: u8, uav: &Uav) -> [Vec<u8>; 2] {
    [(0, &uav.trail), (1, &uav.gmt_trail)].map(|(whose, trail)| {
        let mut words = Words::default();
        words.word(TRAIL);
        words.bytes([id, whose, 0, 0]);
        words.word(trail.places().len() as u32);
        for place in trail.places() {
            words.floats(place);
        }
        words.0
    })
}

/// First message to a page: which run of the station it talks to, and how large the map may get.
pub(super) fn hello(station: &Station, session: u64, now_s: f64, scene: bool) -> String {
    let size = station.cloud().size();
    json!({
        "type": "hello", "session": session.to_string(), "now_s": now_s, "version": env!("CARGO_PKG_VERSION"),
        "capacity": size.capacity, "edge_m": size.edge_m, "stale_after_s": crate::ground::uav::STALE_AFTER_S, "scene": scene,
    })
    .to_string()
}

/// The last `count(uav)` links of UAVs, rows of `[sweep, seen_s, state, snr_db, beams, verdict, outcomes]`.
pub(super) fn links<'a>(
    uavs: impl Iterator<Item = (&'a u8, &'a Uav)>,
    count: impl Fn(&Uav) -> usize,
) -> Option<String> {
    let row = |at: &At<Link>| {
        let link = &at.what;
        json!([
            link.sweep,
            at.seen_s,
            link.state,
            link.snr_db,
            link.beams,
            link.verdict,
            link.outcomes
        ])
    };
    let of_uav = |(id, uav): (&u8, &Uav)| {
        let skipped = uav.links.len().saturating_sub(count(uav));
        let rows: Vec<Value> = uav.links.iter().skip(skipped).map(row).collect();
        (!rows.is_empty()).then(|| json!({"uav": id, "rows": rows}))
    };
    let links: Vec<Value> = uavs.filter_map(of_uav).collect();
    (!links.is_empty()).then(|| json!({"type": "links", "links": links}).to_string())
}

/// Counters and health: of the station, and of the UAVs that `wanted` wants.
#[derive(Serialize)]
pub(super) struct Status {
    r#type: &'static str,
    now_s: f64,
    map: Value,
    refused: Value,
    inputs: Value,
    outputs: Vec<String>,
    uavs: Vec<Value>,
}

impl Status {
    pub(super) fn new(
        station: &Station,
        now_s: f64,
        outputs: Vec<String>,
        wanted: impl Fn(&Uav) -> bool,
    ) -> Self {
        let cloud = station.cloud();
        Self {
            r#type: "status",
            now_s,
            map: json!({"points": cloud.len(), "capacity": cloud.size().capacity, "counters": cloud.counters()}),
            refused: json!(station.refused()),
            inputs: json!(station.inputs()),
            outputs,
            uavs: station
                .uavs()
                .iter()
                .filter(|(_, uav)| wanted(uav))
                .map(|(id, uav)| of_uav(*id, uav, now_s))
                .collect(),
        }
    }

    pub(super) fn json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

fn of_uav(id: u8, uav: &Uav, now_s: f64) -> Value {
    json!({
        "uav": id,
        "seen_s": uav.seen_s,
        "stale": uav.is_stale(now_s),
        "bytes": uav.bytes,
        "points": uav.points,
        "packets": uav.kinds,
        "losses": uav.losses,
        "pose": uav.pose.as_ref().map(|at| json!(at.what)),
        "health": uav.health.as_ref().map(|at| json!({
            "seen_s": at.seen_s, "uptime_s": at.what.uptime_s, "cpu_load": at.what.cpu_load,
            "free_stack_bytes": at.what.free_stack_bytes, "reset_cause": at.what.reset_cause,
            "counters": at.what.counters,
        })),
        "config": uav.config.as_ref().map(|config| json!(config.entries)),
        "events": uav.events.iter().map(|at| json!([at.seen_s, at.what.severity, at.what.text])).collect::<Vec<_>>(),
    })
}
