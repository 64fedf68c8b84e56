//! `cslam replay`: the events of a recorded flight.

use std::io::{BufWriter, Write};
use std::path::PathBuf;

use serde::Serialize;

use crate::recording;
use crate::sensors::{Beacon, Event, Stamped};
use crate::table::Table;

/// Arguments of `cslam replay`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Directory of the recording
    #[arg(value_name = "DIR")]
    recording: PathBuf,
    /// Print every event as a JSON line on stdout, in order, instead of the summary
    #[arg(long)]
    json: bool,
}

/// An event as a line: codes where the sensor gives codes.
#[derive(Serialize)]
#[serde(tag = "event", rename_all = "snake_case")]
enum Line {
    Imu {
        uav_time_ns: u64,
        rate: [i32; 3],
        acceleration: [i32; 3],
    },
    Magnetometer {
        uav_time_ns: u64,
        field: [i32; 3],
    },
    Timing {
        uav_time_ns: u64,
        clock_offset_s: f64,
    },
    Sweep {
        uav_time_ns: u64,
        sweep: u32,
    },
    Beacon {
        uav_time_ns: u64,
        beacon: Beacon,
    },
}

impl From<&Stamped> for Line {
    fn from(stamped: &Stamped) -> Self {
        let uav_time_ns = stamped.uav_time_ns;
        match stamped.event {
            Event::Imu(sample) => Self::Imu {
                uav_time_ns,
                rate: sample.rate,
                acceleration: sample.acceleration,
            },
            Event::Magnetometer(sample) => Self::Magnetometer {
                uav_time_ns,
                field: sample.field,
            },
            Event::Timing(sample) => Self::Timing {
                uav_time_ns,
                clock_offset_s: sample.clock_offset_s,
            },
            Event::Sweep { sweep } => Self::Sweep { uav_time_ns, sweep },
            Event::Beacon(beacon) => Self::Beacon { uav_time_ns, beacon },
        }
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let recording = recording::read(&args.recording)?;
    if args.json {
        let mut out = BufWriter::new(std::io::stdout().lock());
        for stamped in recording.events() {
            serde_json::to_writer(&mut out, &Line::from(stamped))?;
            out.write_all(b"\n")?;
        }
        out.flush()?;
        return Ok(());
    }
    let manifest = recording.manifest();
    println!(
        "scene {}, seed {}, {:.1} s, samples {}",
        manifest.scene,
        manifest.seed,
        manifest.duration_s,
        if manifest.samples {
            "recorded"
        } else {
            "not recorded"
        }
    );
    let mut table = Table::new(["file", "records", "bytes"]);
    for entry in &manifest.files {
        table.row([
            entry.name.clone(),
            entry.records.to_string(),
            entry.bytes.to_string(),
        ]);
    }
    print!("{table}");
    Ok(())
}
