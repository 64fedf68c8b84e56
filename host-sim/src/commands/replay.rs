//! `cslam replay`: reads a recorded flight as a receiver would be given it, and checks it whole on the way.

use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::input::InputError;
use crate::progress;
use crate::recording::{self, Damage};
use crate::result_directory::ResultDirectory;
use crate::sensors::Event;
use crate::sigmf::{self, Codebook};
use crate::table::Table;

/// Arguments of `cslam replay`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Directory of the recording
    #[arg(value_name = "DIR")]
    directory: PathBuf,
    /// Write what was read to another directory: the same bytes, truth left out. An older recording in it is replaced whole; a
    /// directory with anything else in it is refused
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print the counts as one JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// What a recording holds.
#[derive(Debug, Default, Serialize)]
struct Counts {
    scene: Option<String>,
    seed: Option<u64>,
    duration_s: f64,
    imu_samples: u64,
    magnetometer_samples: u64,
    barometer_samples: u64,
    timing_exchanges: u64,
    beacons: u64,
    sweeps: u64,
    beam_blocks: u64,
    pilot_blocks: u64,
    squint_blocks: u64,
    estimated_paths: u64,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let recording = recording::read(&args.directory)?;
    let estimated = recording::read_estimated(&args.directory, recording.manifest(), &mut Damage::refused())?;
    recording::check_truth(&args.directory)?;
    let manifest = recording.manifest();
    let mut counts = Counts {
        scene: manifest.scene.clone(),
        seed: manifest.seed,
        duration_s: manifest.duration_s,
        estimated_paths: estimated
            .iter()
            .flatten()
            .map(|sweep| sweep.paths.len() as u64)
            .sum(),
        ..Counts::default()
    };
    let out = args.out.as_deref();
    let out = out
        .map(|out| ResultDirectory::open(out, recording::KIND))
        .transpose()?;
    let to = out.as_ref().map(ResultDirectory::path);
    let bar = progress::bar(recording.events().len() as u64, "replay");
    for stamped in recording.events() {
        match stamped.event {
            Event::Imu(_) => counts.imu_samples += 1,
            Event::Magnetometer(_) => counts.magnetometer_samples += 1,
            Event::Barometer(_) => counts.barometer_samples += 1,
            Event::Timing(_) => counts.timing_exchanges += 1,
            Event::Beacon(_) => counts.beacons += 1,
            Event::Sweep { sweep } => {
                counts.sweeps += 1;
                if manifest.samples {
                    counts.beam_blocks += blocks(args, to, sweep, Codebook::Beams)?;
                    if manifest.pilots {
                        counts.pilot_blocks += blocks(args, to, sweep, Codebook::Pilots)?;
                    }
                    counts.squint_blocks += blocks(args, to, sweep, Codebook::SquintSequential)?;
                }
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    if let Some(out) = out {
        if let Some(estimated) = &estimated {
            recording::write_estimated(out.path(), estimated)?;
        }
        recording::write_events(out.path(), manifest.clone(), recording.events().iter().copied())?;
        out.commit()?;
    }
    if args.json {
        println!("{}", serde_json::to_string(&counts)?)
    } else {
        print!("{}", table(&counts))
    }
    Ok(())
}

/// Reads the blocks of a sweep, and writes them again where that is asked for; their number.
fn blocks(args: &Args, out: Option<&Path>, sweep: u32, expected: Codebook) -> Result<u64, InputError> {
    let base = match expected {
        Codebook::Beams => recording::sweep_base,
        Codebook::Pilots => recording::pilots_base,
        Codebook::SquintSequential | Codebook::SquintRaster => recording::squint_base,
    };
    let name = base(&args.directory, sweep);
    let samples = sigmf::read(&name)?;
    if samples.codebook != expected {
        let message = format!(
            "cslam:codebook is {}, expected {} in a recorded flight",
            samples.codebook.name(),
            expected.name()
        );
        return Err(InputError::in_file(&sigmf::files(&name).0, message));
    }
    if let Some(out) = out {
        sigmf::write(&base(out, sweep), &samples)?;
    }
    Ok(samples.blocks.len() as u64)
}

fn table(counts: &Counts) -> Table {
    let scene = counts.scene.as_deref().unwrap_or("recording");
    let seed = counts
        .seed
        .map_or(String::new(), |seed| format!(" (seed {seed})"));
    let title = format!("{scene}{seed}, {} s", counts.duration_s);
    let mut table = Table::new([title, "records".to_owned()]);
    for (what, count) in [
        ("IMU samples", counts.imu_samples),
        ("magnetometer samples", counts.magnetometer_samples),
        ("barometer samples", counts.barometer_samples),
        ("two-way timing exchanges", counts.timing_exchanges),
        ("beacons", counts.beacons),
        ("sweeps", counts.sweeps),
        ("blocks of transmit beams", counts.beam_blocks),
        ("blocks of pilots", counts.pilot_blocks),
        ("blocks of beam squint symbols", counts.squint_blocks),
        ("estimated paths", counts.estimated_paths),
    ] {
        table.row([what.to_owned(), count.to_string()]);
    }
    table
}
