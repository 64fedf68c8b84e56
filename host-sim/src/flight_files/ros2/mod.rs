//! The flight as a recording of ROS 2 (MCAP, profile `ros2`): rviz2, `ros2 bag play`, `rosbags` and PlotJuggler read it, no ROS is needed
//! to write it.

mod cdr;
mod definitions;
mod messages;

use std::io::{self, Seek, Write};

use super::Outputs;
use super::recording::{Recorder, nanoseconds};
use definitions::Kind;

/// A message and where it goes.
struct Message {
    time_ns: u64,
    topic: &'static str,
    kind: Kind,
    bytes: Vec<u8>,
}

/// Writes the recording, in order of time.
pub(super) fn write(out: impl Write + Seek, outputs: &Outputs<'_>) -> io::Result<()> {
    let mut messages = all(outputs);
    messages.sort_by_key(|message| message.time_ns);
    let mut recorder = Recorder::of_profile(out, "ros2").map_err(io::Error::other)?;
    for message in &messages {
        recorder
            .cdr(
                message.topic,
                message.kind.name,
                || message.kind.schema(),
                message.time_ns,
                &message.bytes,
            )
            .map_err(io::Error::other)?;
    }
    recorder.finish().map_err(io::Error::other)
}

fn all(outputs: &Outputs<'_>) -> Vec<Message> {
    let log = outputs.log;
    let mut all = Vec::new();
    let mut put = |time_ns, topic, kind, bytes| {
        all.push(Message {
            time_ns,
            topic,
            kind,
            bytes,
        });
    };
    for sample in outputs.imu {
        put(sample.time_ns, "/imu", definitions::IMU, messages::imu(sample));
    }
    for pose in log.trajectory().iter() {
        let time_ns = nanoseconds(pose.time_s);
        if let Some(truth) = &pose.truth {
            let bytes = messages::odometry(time_ns, "base_link_true", &truth.into());
            put(time_ns, "/truth/odometry", definitions::ODOMETRY, bytes);
        }
        if let Some(estimate) = &pose.estimate {
            let bytes = messages::odometry(time_ns, messages::BODY, &estimate.into());
            put(time_ns, "/odometry", definitions::ODOMETRY, bytes);
            let bytes = messages::transform(
                time_ns,
                messages::BODY,
                estimate.position_m,
                estimate.quaternion_wb,
            );
            put(time_ns, "/tf", definitions::TRANSFORMS, bytes);
        }
    }
    let mut from = 0;
    for sweep in &log.sweeps {
        let time_ns = nanoseconds(sweep.time_s);
        if let Some(gmt_m) = sweep.estimate.gmt_position_m {
            let bytes = messages::transform(time_ns, "gmt", gmt_m, [1.0, 0.0, 0.0, 0.0]);
            put(time_ns, "/tf", definitions::TRANSFORMS, bytes);
        }
        // Points are in the order in which they were accepted.
        let rest = &log.points[from..];
        let of_sweep = rest.iter().take_while(|p| p.sweep <= sweep.sweep).count();
        if of_sweep > 0 {
            let bytes = messages::points(time_ns, &rest[..of_sweep]);
            put(time_ns, "/points", definitions::CLOUD, bytes);
            from += of_sweep;
        }
    }
    let end_ns = all.iter().map(|message| message.time_ns).max().unwrap_or(0);
    all.push(Message {
        time_ns: end_ns,
        topic: "/map",
        kind: definitions::CLOUD,
        bytes: messages::map(end_ns, &log.map),
    });
    all
}
