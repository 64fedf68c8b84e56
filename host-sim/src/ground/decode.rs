//! From bytes to what a UAV said.
//!
//! Each stream and each datagram has a deframer of its own, each link id an opener with its replay window. Both are bounded:
//! streams are the inputs that the station was started with, and link ids are a byte.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use cslam_core::telemetry::{self, Deframer, MAX_FRAME, Message as Wire, Opener, Packet, TelemetryError};
use cslam_firmware::app::NO_REFERENCE;

use super::inputs::Source;
use super::keys::Trust;
use super::model::{
    Config, Event, Health, Heard, Link, Message, Point, Pose, PoseFlags, Severity, Spread, SurfaceChange,
};

/// What is left of a datagram after its last whole frame.
const CUT: &str = "the frame is cut by the end of its datagram";

/// A frame in the making.
#[derive(Clone, Debug, Default)]
struct Stream {
    deframer: Deframer,
    frame: Vec<u8>,
}

/// What a frame was.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Told<'a> {
    /// A packet, and its bytes as they came.
    Packet(&'a Heard, &'a [u8]),
    /// Refused, and why.
    Refused(&'static str),
}

/// All ears of a station.
#[derive(Debug)]
pub struct Ears {
    trust: Trust,
    streams: HashMap<Arc<str>, Stream>,
    openers: BTreeMap<u8, Opener>,
}

impl Ears {
    /// Ears that take what `trust` trusts.
    pub fn new(trust: Trust) -> Self {
        Self {
            trust,
            streams: HashMap::new(),
            openers: BTreeMap::new(),
        }
    }

    /// Takes bytes of a source; `tell` gets every frame that ended in them.
    pub fn push(&mut self, source: &Source, bytes: &[u8], mut tell: impl FnMut(Told<'_>)) {
        let mut new = Stream::default();
        let stream = match source {
            Source::Stream(input) => self.streams.entry(Arc::clone(input)).or_default(),
            Source::Datagram(_) => &mut new,
        };
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
                    Err(error) => tell(Told::Refused(error.as_str())),
                }
            }
            if byte == 0 {
                stream.frame.clear();
            }
        }
        if matches!(source, Source::Datagram(_)) && !stream.frame.is_empty() {
            tell(Told::Refused(CUT));
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
        surface: report.surface,
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
        Happened::SurfaceWithdrawn(surface) => (
            Severity::Info,
            format!("surface {surface} withdrawn with its points"),
        ),
        Happened::SurfaceMerged { gone, stays } => {
            (Severity::Info, format!("surface {gone} is surface {stays}"))
        }
    };
    Event {
        time_s: seconds(report.time_ns),
        severity,
        text,
        change: change(&report.event),
    }
}

fn change(event: &telemetry::Event) -> Option<SurfaceChange> {
    match *event {
        telemetry::Event::SurfaceWithdrawn(surface) => Some(SurfaceChange::Withdrawn(surface)),
        telemetry::Event::SurfaceMerged { gone, stays } => Some(SurfaceChange::Merged { gone, stays }),
        _ => None,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn events_of_surfaces_say_what_the_map_has_to_do() {
        let heard = |happened| {
            let told = event(&telemetry::EventReport {
                time_ns: 0,
                event: happened,
            });
            (told.change, told.text)
        };
        let (change, text) = heard(telemetry::Event::SurfaceWithdrawn(3));
        assert_eq!(change, Some(SurfaceChange::Withdrawn(3)));
        assert_eq!(text, "surface 3 withdrawn with its points");
        let (change, text) = heard(telemetry::Event::SurfaceMerged { gone: 5, stays: 4 });
        assert_eq!(change, Some(SurfaceChange::Merged { gone: 5, stays: 4 }));
        assert_eq!(text, "surface 5 is surface 4");
        assert_eq!(heard(telemetry::Event::MapRestarted).0, None);
    }
}
