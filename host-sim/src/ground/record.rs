//! Recording: `packets.bin` (what came, as it came, for `cslam ground --file`), `ground.mcap` (for Foxglove) and, at the end,
//! `map.ply`.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use super::cloud::Cloud;
use super::model::{Heard, Message, Point};
use super::page::ply;
use crate::flight_files;
use crate::flight_files::recording::{Recorder, geometry};
use crate::flight_log::{MapVoxel, PointRecord};
use crate::input::InputError;

/// A recording in the making.
pub struct Recording {
    directory: PathBuf,
    packets: BufWriter<File>,
    mcap: Recorder<BufWriter<File>>,
    /// Time of the station at which everything was given to the system, s.
    flushed_s: f64,
}

/// Time after which what came is given to the system, which keeps it whatever becomes of this process, s. A second is promised:
/// half of it leaves as much for a thread that has to wait for its processor.
const FLUSH_S: f64 = 0.5;

impl std::fmt::Debug for Recording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Recording({})", self.directory.display())
    }
}

impl Recording {
    /// Names of the files.
    pub const NAMES: [&'static str; 3] = ["packets.bin", "ground.mcap", "map.ply"];

    /// Begins a recording in a directory, which is made when it is missing.
    ///
    /// # Errors
    /// [`InputError`] naming the directory or file that cannot be made, or that is there already: a recording is never
    /// overwritten.
    pub fn begin(directory: &Path) -> Result<Self, InputError> {
        fs::create_dir_all(directory)
            .map_err(|e| InputError::unwritable(directory, "cannot be made a directory", &e))?;
        let create = |name: &str| {
            let file = directory.join(name);
            File::create_new(&file)
                .map(BufWriter::new)
                .map_err(|e| InputError::unwritable(&file, "cannot be made", &e))
        };
        let packets = create("packets.bin")?;
        let mcap = Recorder::new(create("ground.mcap")?).and_then(|mut mcap| {
            // Even a recording that is killed at once can be opened.
            mcap.flush()?;
            Ok(mcap)
        });
        let unwritable =
            |e| InputError::unwritable(&directory.join("ground.mcap"), "cannot be written", &io_error(e));
        Ok(Self {
            directory: directory.to_owned(),
            packets,
            mcap: mcap.map_err(unwritable)?,
            flushed_s: 0.0,
        })
    }

    /// Gives what came to the system when it is time to, `now_s` being the time of the station, s.
    ///
    /// # Errors
    /// Those of the files.
    pub fn elapse(&mut self, now_s: f64) -> io::Result<()> {
        if now_s - self.flushed_s < FLUSH_S {
            return Ok(());
        }
        self.flushed_s = now_s;
        self.packets.flush()?;
        self.mcap.flush().map_err(io_error)
    }

    /// Writes a packet, `frame` being its bytes as they came.
    ///
    /// # Errors
    /// Those of the file.
    pub fn hear(&mut self, heard: &Heard, frame: &[u8], time_ns: u64) -> io::Result<()> {
        self.packets.write_all(frame)?;
        self.record(heard, time_ns).map_err(io_error)
    }

    fn record(&mut self, heard: &Heard, time_ns: u64) -> Result<(), mcap::McapError> {
        let uav = heard.uav;
        let (mcap, topic) = (&mut self.mcap, |what: &str| format!("/uav_{uav}/{what}"));
        match &heard.message {
            Message::Points { points } => {
                let records: Vec<PointRecord> = points.iter().map(|p| point_record(p, time_ns)).collect();
                mcap.message(&topic("points"), time_ns, &geometry::points(&records, time_ns))
            }
            Message::Pose(pose) => {
                let placed = (pose.position_m, pose.quaternion_wb);
                if !pose.flags.starting {
                    let transform = geometry::transform(&format!("uav_{uav}"), placed, time_ns);
                    mcap.message("/tf", time_ns, &transform)?;
                    mcap.message(&topic("pose"), time_ns, &geometry::pose(placed, time_ns))?;
                }
                mcap.json(&topic("state"), "cslam.State", STATE, time_ns, pose)
            }
            Message::Link(link) => {
                if let Some(gmt_m) = link.gmt_m {
                    let placed = (gmt_m, [1.0, 0.0, 0.0, 0.0]);
                    let transform = geometry::transform(&format!("gmt_{uav}"), placed, time_ns);
                    mcap.message("/tf", time_ns, &transform)?;
                }
                mcap.json(&topic("link"), "cslam.Link", LINK, time_ns, link)
            }
            Message::Health(health) => mcap.json(&topic("health"), "cslam.Health", HEALTH, time_ns, health),
            Message::Event(event) => mcap.json(&topic("event"), "cslam.Event", EVENT, time_ns, event),
            Message::Config(config) => mcap.json(&topic("config"), "cslam.Config", CONFIG, time_ns, config),
        }
    }

    /// Writes the merged map and the recording's index.
    ///
    /// # Errors
    /// Those of the files; all that came has been written before.
    pub fn finish(mut self, cloud: &Cloud, time_ns: u64) -> anyhow::Result<()> {
        self.packets.flush()?;
        self.mcap.flush()?;
        let voxels: Vec<MapVoxel> = cloud
            .points()
            .map(|point| MapVoxel {
                position_m: point.position_m.map(f64::from),
                covariance_trace_m2: f64::from(point.variance_m2),
                hits: point.hits,
            })
            .collect();
        self.mcap
            .message("/map", time_ns, &geometry::map(&voxels, time_ns))
            .and_then(|()| self.mcap.finish())?;
        let points: Vec<_> = cloud.points().collect();
        flight_files::file(&self.directory, "map.ply", |file| {
            file.write_all(&ply::write(&points))
        })
    }
}

/// What the system said, where it was the system.
fn io_error(error: mcap::McapError) -> io::Error {
    match error {
        mcap::McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

fn point_record(point: &Point, time_ns: u64) -> PointRecord {
    PointRecord {
        sweep: point.sweep,
        path: 0,
        order: 1,
        reflection: 1,
        surface: None,
        mapped_sweep: None,
        time_s: time_ns as f64 * 1e-9,
        gmt_index: u32::from(point.gmt_index),
        position_m: point.position_m,
        covariance_trace_m2: point.sigma_m * point.sigma_m,
        probability: Some(point.probability),
        snr_db: None,
    }
}

const STATE: &str = r#"{"title":"cslam.State","description":"Pose with uncertainty and flags","type":"object","properties":{
"time_s":{"type":"number"},"position_m":{"type":"array","items":{"type":"number"}},"velocity_m_per_s":{"type":"array","items":{"type":"number"}},
"quaternion_wb":{"type":"array","items":{"type":"number"}},"position":{"type":"object"},"velocity":{"type":"object"},"attitude":{"type":"object"},
"clock_offset_s":{"type":["number","null"]},"resets":{"type":"integer"},"flags":{"type":"object"}}}"#;

const LINK: &str = r#"{"title":"cslam.Link","description":"State: 0 outage, 1 line of sight, 2 one reflection, 3 more","type":"object","properties":{
"sweep":{"type":"integer"},"time_s":{"type":"number"},"state":{"type":"integer"},"outcomes":{"type":"array","items":{"type":"string"}},
"snr_db":{"type":["number","null"]},"beams":{"type":"integer"},"gmt_m":{"type":["array","null"]},"verdict":{"type":"string"}}}"#;

const HEALTH: &str = r#"{"title":"cslam.Health","type":"object","properties":{"time_s":{"type":"number"},"uptime_s":{"type":"number"},
"cpu_load":{"type":"number"},"free_stack_bytes":{"type":"integer"},"reset_cause":{"type":"string"},"counters":{"type":"object"}}}"#;

const EVENT: &str = r#"{"title":"cslam.Event","type":"object","properties":{"time_s":{"type":"number"},"severity":{"type":"string"},"text":{"type":"string"},
"change":{"type":"object"}}}"#;

const CONFIG: &str = r#"{"title":"cslam.Config","type":"object","properties":{"entries":{"type":"object"}}}"#;
