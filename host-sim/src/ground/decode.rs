//! From bytes to what a UAV said.
//!
//! Each source has a deframer of its own, each link id an opener with its replay window. Both are bounded: sources by number, the
//! oldest one being forgotten, and link ids are a byte.

use std::collections::{BTreeMap, HashMap};

use cslam_core::telemetry::{self, Deframer, MAX_FRAME, Message as Wire, Opener, Packet, TelemetryError};
use cslam_firmware::app::NO_REFERENCE;

use super::inputs::Source;
use super::keys::Trust;
use super::model::{Config, Event, Health, Heard, Link, Message, Point, Pose, PoseFlags, Severity, Spread};

/// Sources whose half frames are remembered.
const MOST_SOURCES: usize = 1024;

/// A frame of a source in the making.
#[derive(Clone, Debug, Default)]
struct Stream {
    deframer: Deframer,
    frame: Vec<u8>,
    /// When it last said something, in chunks.
    used: u64,
}

/// What a frame was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Told<'a> {
    /// A packet, and its bytes as they came.
    Packet(&'a Heard, &'a [u8]),
    /// Refused, and why.
    Refused(TelemetryError),
}

/// All ears of a station.
#[derive(Debug)]
pub struct Ears {
    trust: Trust,
    streams: HashMap<Source, Stream>,
    openers: BTreeMap<u8, Opener>,
    chunks: u64,
}

impl Ears {
    /// Ears that take what `trust` trusts.
    pub fn new(trust: Trust) -> Self {
        Self {
            trust,
            streams: HashMap::new(),
            openers: BTreeMap::new(),
            chunks: 0,
        }
    }

    /// Takes bytes of a source; `tell` gets every frame that ended in them.
    pub fn push(&mut self, source: &Source, bytes: &[u8], mut tell: impl FnMut(Told<'_>)) {
        self.chunks += 1;
        if self.streams.len() >= MOST_SOURCES && !self.streams.contains_key(source) {
            let oldest = self.streams.iter().min_by_key(|(_, stream)| stream.used);
            if let Some(oldest) = oldest.map(|(source, _)| source.clone()) {
                self.streams.remove(&oldest);
            }
        }
        let stream = self.streams.entry(source.clone()).or_default();
        stream.used = self.chunks;
        for &byte in bytes {
            // What is longer than any frame is refused, and need not be kept.
            if stream.frame.len() < MAX_FRAME {
                stream.frame.push(byte);
            }
            if let Some(frame) = stream.deframer.push(byte) {
                let opened = frame.and_then(|frame| {
                    let uav = frame.uav();
                    let trust = &self.trust;
                    let opener = self.openers.entry(uav);
                    match trust.opener(uav) {
                        Some(new) => opener.or_insert(new).open(&frame),
                        None => Err(TelemetryError::KeyMissing),
                    }
                });
                match opened {
                    Ok(packet) => tell(Told::Packet(&heard(packet), &stream.frame)),
                    Err(error) => tell(Told::Refused(error)),
                }
            }
            if byte == 0 {
                stream.frame.clear();
            }
        }
    }
}

/// A packet in the station's words.
fn heard(packet: Packet) -> Heard {
    Heard {
        uav: packet.uav,
        counter: packet.counter,
        message: message(&packet.message),
    }
}

fn seconds(time_ns: u64) -> f64 {
    time_ns as f64 * 1e-9
}

fn message(wire: &Wire) -> Message {
    match wire {
        Wire::Points(batch) => Message::Points {
            points: batch.points().map(|report| point(&report)).collect(),
        },
        Wire::Pose(report) => Message::Pose(pose(report)),
        Wire::Link(report) => Message::Link(link(report)),
        Wire::Health(report) => Message::Health(health(report)),
        Wire::Event(report) => Message::Event(event(report)),
        Wire::Config(report) => Message::Config(config(report)),
    }
}

fn point(report: &telemetry::PointReport) -> Point {
    Point {
        position_m: report.position_m.map(f64::from),
        sigma_m: f64::from(report.sigma_m),
        probability: f64::from(report.probability),
        sweep: report.sweep,
        gmt_index: report.stop,
    }
}

fn spread(spread: &telemetry::Spread) -> Spread {
    Spread {
        sigma: spread.sigma.map(f64::from),
        correlation: spread.correlation.map(f64::from),
    }
}

fn pose(report: &telemetry::PoseReport) -> Pose {
    let health = &report.health;
    Pose {
        time_s: seconds(report.time_ns),
        position_m: report.position_m,
        velocity_m_per_s: report.velocity_m_per_s.map(f64::from),
        quaternion_wb: report.quaternion_wb.map(f64::from),
        position: spread(&report.position),
        velocity: spread(&report.velocity),
        attitude: spread(&report.attitude),
        clock_offset_s: report.clock.map(|clock| clock.offset_s),
        resets: report.resets,
        flags: PoseFlags {
            starting: health.starting,
            contested: health.contested,
            clock_contested: health.clock_contested,
            beacon_implausible: health.beacon_implausible,
            inertial_missing: health.inertial_missing,
            dead_reckoning: health.dead_reckoning,
            lost: health.lost,
            attitude_lost: health.attitude_lost,
            line_of_sight: report.line_of_sight,
        },
    }
}

fn link(report: &telemetry::LinkReport) -> Link {
    Link {
        sweep: report.sweep,
        time_s: seconds(report.time_ns),
        state: report.state as u8,
        outcomes: report
            .outcomes
            .iter()
            .map(telemetry::PathOutcome::as_str)
            .collect(),
        snr_db: report.snr_db.map(f64::from),
        beams: report.beams,
        gmt_m: report.gmt_m,
        verdict: report.verdict.as_str(),
    }
}

fn health(report: &telemetry::HealthReport) -> Health {
    let counters = report.counters.to_array();
    Health {
        time_s: seconds(report.time_ns),
        uptime_s: f64::from(report.uptime_ms) / 1000.0,
        cpu_load: f64::from(report.load),
        free_stack_bytes: report.free_stack,
        reset_cause: report.reset.as_str(),
        counters: telemetry::HealthCounters::NAMES
            .into_iter()
            .zip(counters)
            .collect(),
    }
}

fn event(report: &telemetry::EventReport) -> Event {
    use telemetry::Event as Happened;
    let (severity, text) = match report.event {
        Happened::Reset(record) => {
            let cause = record.cause.as_str();
            let place = match record.program_counter {
                0 => String::new(),
                at => format!(" at {at:#010x}, called from {:#010x}", record.link_register),
            };
            let text = format!(
                "reset by {cause}{place}, stage {}, after {:.1} s",
                record.stage,
                f64::from(record.uptime_ms) / 1000.0
            );
            (reset_severity(record.cause), text)
        }
        Happened::ConfigAccepted(crc) => (Severity::Info, format!("configuration {crc:08x} taken")),
        Happened::ConfigRefused(NO_REFERENCE) => (
            Severity::Error,
            "no reference clock: degraded, without the front end".into(),
        ),
        Happened::ConfigRefused(reason) => (
            Severity::Warning,
            format!("configuration refused, reason {reason}"),
        ),
        Happened::Started => (Severity::Info, "pose set for the first time".into()),
        Happened::Refixed => (Severity::Warning, "pose set anew".into()),
        Happened::KeyMissing => (Severity::Error, "no key: nothing is taken from the ground".into()),
        Happened::StorageDamaged(record) => (
            Severity::Error,
            format!("record {record} of the permanent memory was damaged"),
        ),
        Happened::MapRestarted => (Severity::Info, "map emptied".into()),
    };
    Event {
        time_s: seconds(report.time_ns),
        severity,
        text,
    }
}

fn reset_severity(cause: telemetry::ResetCause) -> Severity {
    use telemetry::ResetCause as Cause;
    match cause {
        Cause::PowerOn | Cause::Pin | Cause::Command => Severity::Info,
        Cause::Unknown | Cause::BrownOut => Severity::Warning,
        Cause::Watchdog | Cause::Fault | Cause::Panic => Severity::Error,
    }
}

fn config(report: &telemetry::ConfigReport) -> Config {
    let [major, minor, patch] = report.firmware;
    Config {
        entries: vec![
            ("firmware", format!("{major}.{minor}.{patch}")),
            ("mode", format!("{:?}", report.mode).to_lowercase()),
            ("format", report.version.to_string()),
            ("crc", format!("{:08x}", report.crc)),
            ("map_capacity", report.map_capacity.to_string()),
            ("voxel_edge_m", report.voxel_edge_m.to_string()),
        ],
    }
}
