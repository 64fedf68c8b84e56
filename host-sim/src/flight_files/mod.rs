//! What a flight leaves on disk, from its log: point clouds, trajectories, a recording, the packets and the report.
//!
//! A log that was cut short anywhere makes complete files. Each file takes its name only when it is whole, so a run that
//! is killed while writing leaves the files of the run before.

mod animation;
mod clouds;
mod columns;
mod page;
pub mod ply;
pub(crate) mod recording;
mod ros2;
mod tum;
pub(crate) mod views;

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::Path;

use anyhow::Context;
use clap::ValueEnum;
use cslam_core::inertial::ImuSample;
use serde::Deserialize;
use serde::de::IgnoredAny;

use crate::evaluation::Evaluation;
use crate::flight_log::FlightLog;
use crate::report::Report;
use crate::result_directory::Kind;
use crate::scene::Scene;
use ply::Encoding;

/// Everything that files are made of.
#[derive(Clone, Copy, Debug)]
pub struct Outputs<'a> {
    /// The flight.
    pub log: &'a FlightLog,
    /// The same flight smoothed, where that was asked for.
    pub smoothed: Option<&'a FlightLog>,
    /// Its scene, where there is one.
    pub scene: Option<&'a Scene>,
    /// How good it was.
    pub evaluation: &'a Evaluation,
    /// The same as a report.
    pub report: &'a Report,
    /// Every byte that went to the ground.
    pub packets: &'a [u8],
    /// What the inertial sensor said, as far as it is wanted.
    pub imu: &'a [ImuSample],
}

/// A further form of the same flight, for other programs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Export {
    /// flight.npz: columns for NumPy
    Npz,
    /// flight.ros2.mcap: messages of ROS 2 (Odometry, PointCloud2, Imu, tf2)
    Ros2,
    /// flight.svg: the map as it grows, a moving picture for a page
    Animation,
}

impl Export {
    /// Name of its file.
    pub fn name(self) -> &'static str {
        match self {
            Self::Npz => "flight.npz",
            Self::Ros2 => "flight.ros2.mcap",
            Self::Animation => "flight.svg",
        }
    }
}

/// What every `report.json` has.
#[derive(Deserialize)]
#[allow(dead_code, reason = "that the keys are there is what counts")]
struct Described {
    mode: String,
    scene: String,
    seed: u64,
    sweeps: u64,
    map: IgnoredAny,
    telemetry: IgnoredAny,
}

impl Outputs<'_> {
    /// How a directory of them is known again: `report.json` has what every report of ours has.
    pub const KIND: Kind = Kind {
        what: "flight",
        description: "report.json",
        describes: |text| serde_json::from_str::<Described>(text).is_ok(),
        writes: |name| {
            let name = name.strip_suffix(".part").unwrap_or(name);
            Self::NAMES.contains(&name)
                || Self::SMOOTHED_NAMES.contains(&name)
                || Export::value_variants()
                    .iter()
                    .any(|export| export.name() == name)
        },
    };

    /// Names of the files that [`write`](Self::write) makes.
    pub const NAMES: [&'static str; 9] = [
        "map.ply",
        "points.ply",
        "map_truth.ply",
        "trajectory.tum",
        "truth.tum",
        "packets.bin",
        "flight.mcap",
        "report.json",
        "report.html",
    ];

    /// Names of the files that it makes of a smoothed flight beside these.
    pub const SMOOTHED_NAMES: [&'static str; 3] = [
        "map_smoothed.ply",
        "points_smoothed.ply",
        "trajectory_smoothed.tum",
    ];

    /// Writes all files into `out`, which must exist, and these further ones.
    ///
    /// # Errors
    /// When a file cannot be written, naming it.
    pub fn write(&self, out: &Path, encoding: Encoding, exports: &[Export]) -> anyhow::Result<()> {
        let log = self.log;
        file(out, "map.ply", |f| clouds::map(f, encoding, log))?;
        file(out, "points.ply", |f| clouds::points(f, encoding, log))?;
        file(out, "map_truth.ply", |f| clouds::truth(f, encoding, log))?;
        file(out, "trajectory.tum", |f| tum::estimate(f, log))?;
        file(out, "truth.tum", |f| tum::truth(f, log))?;
        if let Some(smoothed) = self.smoothed {
            let [map, points, trajectory] = Self::SMOOTHED_NAMES;
            file(out, map, |f| clouds::map(f, encoding, smoothed))?;
            file(out, points, |f| clouds::points(f, encoding, smoothed))?;
            file(out, trajectory, |f| tum::estimate(f, smoothed))?;
        }
        file(out, "packets.bin", |f| f.write_all(self.packets))?;
        file(out, "flight.mcap", |f| recording::write(f, self))?;
        for export in exports {
            file(out, export.name(), |f| match export {
                Export::Npz => columns::write(f, self),
                Export::Ros2 => ros2::write(f, self),
                Export::Animation => animation::write(f, self),
            })?;
        }
        file(out, "report.json", |f| {
            serde_json::to_writer_pretty(&mut *f, self.report)?;
            writeln!(f)
        })?;
        file(out, "report.html", |f| page::write(f, self))
    }
}

/// Writes a file under another name and renames it when it is whole.
pub(crate) fn file(
    out: &Path,
    name: &str,
    content: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>,
) -> anyhow::Result<()> {
    let (whole, part) = (out.join(name), out.join(format!("{name}.part")));
    let result = File::create(&part).and_then(|f| {
        let mut writer = BufWriter::new(f);
        content(&mut writer)?;
        writer.flush()?;
        fs::rename(&part, &whole)
    });
    if result.is_err() {
        // Half a file is of no use, and its room is for others.
        let _left = fs::remove_file(&part);
    }
    result.with_context(|| format!("{} cannot be written", whole.display()))
}
