//! The flight as an MCAP recording for Foxglove: poses and transforms, the growing cloud, the scene, link states,
//! innovations and errors, all on the flight's own time.
//!
//! Geometry uses Foxglove's well-known protobuf schemas, so its 3-D panel shows it as it is; series are JSON with a
//! schema, so its plot panel takes them (`/errors.position_m`, `/innovations/los_delay.test_ratio`). Without compression
//! and without a wall clock: the same flight gives the same bytes.

pub(crate) mod geometry;
mod recorder;
mod series;

use std::io::{self, Seek, Write};

use super::Outputs;
use crate::flight_log::{FlightLog, Measurement, PoseRecord, SweepRecord};

pub(crate) use recorder::Recorder;

/// The accepted points are written anew after this many sweeps.
const SWEEPS_PER_CLOUD: usize = 4;

/// Writes the recording.
pub(super) fn write(out: impl Write + Seek, outputs: &Outputs<'_>) -> io::Result<()> {
    let mut recorder = Recorder::new(out).map_err(io::Error::other)?;
    record(&mut recorder, outputs).map_err(io::Error::other)?;
    recorder.finish().map_err(io::Error::other)
}

fn record<W: Write + Seek>(recorder: &mut Recorder<W>, outputs: &Outputs<'_>) -> Result<(), mcap::McapError> {
    let log = outputs.log;
    if let Some(scene) = outputs.scene {
        recorder.message("/scene", 0, &geometry::scene(scene))?;
    }
    let poses = log.trajectory();
    let mut poses = poses.iter().peekable();
    let mut points = 0;
    for (index, sweep) in log.sweeps.iter().enumerate() {
        while let Some(pose) = poses.next_if(|pose| pose.time_s <= sweep.time_s) {
            record_pose(recorder, pose)?;
        }
        let accepted = log.points[points..]
            .iter()
            .take_while(|p| p.sweep <= sweep.sweep)
            .count();
        points += accepted;
        record_sweep(recorder, sweep, accepted)?;
        let last = index + 1 == log.sweeps.len();
        if last || (index + 1) % SWEEPS_PER_CLOUD == 0 {
            let time_ns = nanoseconds(sweep.time_s);
            recorder.message(
                "/points",
                time_ns,
                &geometry::points(&log.points[..points], time_ns),
            )?;
        }
    }
    for pose in poses {
        record_pose(recorder, pose)?;
    }
    let end_ns = end_of(log);
    recorder.message("/map", end_ns, &geometry::map(&log.map, end_ns))?;
    recorder.message("/trajectory", end_ns, &geometry::path(log, false, end_ns))?;
    recorder.message("/truth/trajectory", end_ns, &geometry::path(log, true, end_ns))
}

fn record_pose<W: Write + Seek>(
    recorder: &mut Recorder<W>,
    pose: &PoseRecord,
) -> Result<(), mcap::McapError> {
    let time_ns = nanoseconds(pose.time_s);
    if let Some(truth) = &pose.truth {
        let truth = (truth.position_m, truth.quaternion_wb);
        recorder.message("/tf", time_ns, &geometry::transform("body_true", truth, time_ns))?;
        recorder.message("/truth/pose", time_ns, &geometry::pose(truth, time_ns))?;
    }
    if let Some(estimate) = &pose.estimate {
        let estimated = (estimate.position_m, estimate.quaternion_wb);
        recorder.message("/tf", time_ns, &geometry::transform("body", estimated, time_ns))?;
        recorder.message("/pose", time_ns, &geometry::pose(estimated, time_ns))?;
        if let Some(truth) = &pose.truth {
            recorder.json(
                "/errors",
                "cslam.Errors",
                series::ERRORS,
                time_ns,
                &series::errors(estimate, truth),
            )?;
        }
    }
    Ok(())
}

fn record_sweep<W: Write + Seek>(
    recorder: &mut Recorder<W>,
    sweep: &SweepRecord,
    accepted: usize,
) -> Result<(), mcap::McapError> {
    let time_ns = nanoseconds(sweep.time_s);
    if let Some(position_m) = sweep.estimate.gmt_position_m {
        let gmt = (position_m, [1.0, 0.0, 0.0, 0.0]);
        recorder.message("/tf", time_ns, &geometry::transform("gmt", gmt, time_ns))?;
    }
    let state = series::link_state(sweep, accepted);
    recorder.json(
        "/link_state",
        "cslam.LinkState",
        series::LINK_STATE,
        time_ns,
        &state,
    )?;
    for innovation in &sweep.estimate.innovations {
        let topic = innovation_topic(innovation.measurement);
        recorder.json(
            &topic,
            "cslam.Innovation",
            series::INNOVATION,
            time_ns,
            &series::innovation(innovation),
        )?;
    }
    Ok(())
}

fn innovation_topic(measurement: Measurement) -> String {
    format!("/innovations/{}", measurement.key())
}

/// Time of the last thing in a log.
fn end_of(log: &FlightLog) -> u64 {
    let sweep_s = log.sweeps.last().map_or(0.0, |s| s.time_s);
    let pose_s = log.poses.last().map_or(0.0, |p| p.time_s);
    nanoseconds(sweep_s.max(pose_s))
}

/// Seconds as whole nanoseconds, rounded half up.
pub(super) fn nanoseconds(time_s: f64) -> u64 {
    libm::floor(time_s * 1e9 + 0.5).max(0.0) as u64
}
