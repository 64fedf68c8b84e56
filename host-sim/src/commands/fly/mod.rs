//! `cslam fly`: one whole flight, from raw samples to the map, or over a path list.

pub(crate) mod keep;
mod list;
#[cfg(feature = "ground")]
mod live;
pub(crate) mod methods;
pub(crate) mod raw;
pub(crate) mod recorded;
mod stages;
mod thinning;

use std::num::TryFromIntError;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use clap::ValueEnum;
use cslam_core::inertial::ImuSample;

use self::stages::Stages;
use super::DEFAULT_SCENE;
use crate::config::{Config, Mode};
use crate::evaluation::evaluate;
use crate::flight_files::ply::Encoding;
use crate::flight_files::{Export, Outputs};
use crate::flight_log::FlightLog;
use crate::input::InputError;
use crate::raw_flight::Source;
use crate::report::{Report, table};
use crate::result_directory::ResultDirectory;
use crate::scene::Scene;
use crate::sensors::Event;
use crate::world::Profile;
use crate::{interrupt, progress};

/// Arguments of `cslam fly`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Fly through a scene from raw samples: outdoor (the default), indoor, street, outdoor_a, city:SEED, or a file. With
    /// --paths: the scene that the list was traced in, to compare the map with its surfaces
    #[arg(long, value_name = "NAME|FILE")]
    scene: Option<String>,
    /// Fly over a path list (.jsonl or .jsonl.gz), or over the `bundled` one: no samples, no pose to estimate. A list with
    /// covariances or "measured": true is taken as it is; to a traced one errors of stated size are added
    #[arg(long, value_name = "FILE|bundled")]
    paths: Option<PathBuf>,
    /// Fly along links that a ray tracer of yours found: a path list (.jsonl or .jsonl.gz), line by line the links of consecutive
    /// sweeps. Our radio hears them, our sensors ride along the route, and the receiver gets nothing but samples and sensors, as with
    /// --scene. With --scene: the scene to compare the map with
    #[arg(long, value_name = "FILE", conflicts_with_all = ["paths", "recording", "keep_paths"])]
    channel: Option<PathBuf>,
    /// Fly over a recording (`cslam record`, or --keep-paths): its samples or paths, and its events, instead of a simulated world. With --scene: the scene to compare
    /// the map with, if not the recorded one
    #[arg(long, value_name = "DIR", conflicts_with_all = ["paths", "world", "seed"])]
    recording: Option<PathBuf>,
    /// Keep what path estimation makes of the flight in this directory, as a recording with paths instead of samples: flown with
    /// --recording, it gives the same flight in a second, and a receiver that is changed behind path estimation flies it too
    #[arg(long, value_name = "DIR", conflicts_with_all = ["paths", "recording"])]
    keep_paths: Option<PathBuf>,
    /// Count what is missing or damaged in a recording and fly on, instead of refusing it
    #[arg(long, requires = "recording")]
    keep_going: bool,
    #[command(flatten)]
    thinning: thinning::LeftOut,
    /// Configuration file (TOML), of which [world], [radio], [path_errors] and [receiver] count; `cslam config` shows what it may hold
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// The simulated world [default: the configuration's, real]
    #[arg(long, value_enum)]
    world: Option<Profile>,
    /// Print the configuration with what the options changed as TOML and end
    #[arg(long)]
    print_config: bool,
    /// Seed of the flight and of all errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Fly at most this many sweeps
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Whose methods [default: the configuration's, best]
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    #[command(flatten)]
    stages: Stages,
    /// Fly at real-time speed and show it live: starts a ground station and serves its page on this address
    #[cfg(feature = "ground")]
    #[arg(long, value_name = "ADDR", num_args = 0..=1, default_missing_value = "127.0.0.1:8080", conflicts_with = "paths")]
    live: Option<std::net::SocketAddr>,
    /// Directory for the results, made when missing. It holds one flight: an older one in it is replaced whole when the new
    /// one is there; a directory with anything else in it is refused, and nothing in it is touched
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Write the flight in further forms, too; may be given several times
    #[arg(long, value_enum, value_name = "FORM")]
    export: Vec<Export>,
    /// After the flight, compute the best trajectory of it from all that was measured, before and after, and the map again from that: both
    /// stand beside those on board in the report, and in files of their own. Packets are the same
    #[arg(long, conflicts_with = "paths")]
    smooth: bool,
    /// Encoding of the point clouds
    #[arg(long, value_enum, default_value_t = Ply::Ascii)]
    ply: Ply,
    /// Print the report as one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Ply {
    /// Text
    Ascii,
    /// Little endian
    Binary,
}

impl From<Ply> for Encoding {
    fn from(ply: Ply) -> Self {
        match ply {
            Ply::Ascii => Self::Ascii,
            Ply::Binary => Self::Binary,
        }
    }
}

impl Default for Args {
    fn default() -> Self {
        Self {
            scene: None,
            paths: None,
            channel: None,
            recording: None,
            keep_paths: None,
            keep_going: false,
            thinning: thinning::LeftOut::default(),
            config: None,
            world: None,
            print_config: false,
            seed: 1,
            steps: None,
            mode: None,
            stages: Stages::default(),
            #[cfg(feature = "ground")]
            live: None,
            out: "out".into(),
            export: Vec::new(),
            smooth: false,
            ply: Ply::Ascii,
            json: false,
        }
    }
}

/// A flight, or as much of it as was flown before an interrupt.
struct Flown {
    logs: raw::Logs,
    scene: Option<Scene>,
    /// What the inertial sensor said, when an export wants it.
    imu: Vec<ImuSample>,
    out: ResultDirectory,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let config = read_config(args)?;
    if args.print_config {
        print!("{}", toml::to_string(&config)?);
        return Ok(());
    }
    let start = Instant::now();
    // The flight ends there, and what was flown is written.
    let interrupted = interrupt::flag();
    #[cfg(feature = "ground")]
    let mut shown = None;
    let mut flown = match &args.paths {
        Some(file) => list::run(args, &config, file, &interrupted)?,
        None => {
            #[cfg(feature = "ground")]
            if let Some(http) = args.live {
                let live = live::Live::start(http, scene_behind(args), &interrupted)?;
                let flown = from_samples(args, &config, &interrupted, |at_ns, bytes| {
                    live.send(at_ns, bytes)
                })?;
                shown = Some(live);
                flown
            } else {
                from_samples(args, &config, &interrupted, |_, _| {})?
            }
            #[cfg(not(feature = "ground"))]
            from_samples(args, &config, &interrupted, |_, _| {})?
        }
    };
    let report = write(args, &mut flown, start)?;
    flown.out.commit()?;
    if args.json {
        println!("{}", serde_json::to_string(&report)?);
        progress::note(table(&report));
    } else {
        println!("{}", table(&report));
    }
    progress::note(format_args!(
        "wrote {} to {}",
        args.written().join(", "),
        args.out.display()
    ));
    #[cfg(feature = "ground")]
    if let Some(live) = shown {
        live.wait()?;
    }
    Ok(())
}

/// Evaluates a flight and writes its files into the directory of results.
fn write(args: &Args, flown: &mut Flown, start: Instant) -> anyhow::Result<Report> {
    let elapsed_s = start.elapsed().as_secs_f64();
    let raw::Logs {
        log,
        packets,
        smoothed,
    } = &mut flown.logs;
    let evaluation = evaluate(log, flown.scene.as_ref());
    let mut report = Report::new(log, &evaluation, elapsed_s);
    if let Some(smoothed) = smoothed {
        report.smoothed = Some(evaluate(smoothed, flown.scene.as_ref()).into());
    }
    let outputs = Outputs {
        log,
        smoothed: smoothed.as_ref(),
        scene: flown.scene.as_ref(),
        evaluation: &evaluation,
        report: &report,
        packets,
        imu: &flown.imu,
    };
    outputs.write(flown.out.path(), args.ply.into(), &args.export)?;
    Ok(report)
}

/// What `cslam fly --recording DIRECTORY --out OUT` does, with `--smooth` where that is asked for, for a program: nothing is printed, and what would be is returned.
pub(crate) fn over_recording(
    directory: &Path,
    out: &Path,
    steps: Option<usize>,
    smooth: bool,
    interrupted: &AtomicBool,
) -> anyhow::Result<Report> {
    let args = Args {
        recording: Some(directory.to_owned()),
        out: out.to_owned(),
        steps,
        smooth,
        ..Args::default()
    };
    let start = Instant::now();
    let mut flown = from_samples(&args, &read_config(&args)?, interrupted, |_, _| {})?;
    let report = write(&args, &mut flown, start)?;
    flown.out.commit()?;
    Ok(report)
}

/// A flight over a recording, along links, or through a simulated world.
fn from_samples(
    args: &Args,
    config: &Config,
    interrupted: &AtomicBool,
    sent: impl FnMut(u64, &[u8]),
) -> anyhow::Result<Flown> {
    match (&args.recording, &args.channel) {
        (Some(directory), _) => recorded::run(args, config, directory, interrupted, sent),
        (None, Some(links)) => raw::along(args, config, links, interrupted, sent),
        (None, None) => {
            let scene = args.scene.as_deref().unwrap_or(DEFAULT_SCENE);
            raw::run(args, config, scene, interrupted, sent)
        }
    }
}

/// The scene that a live page shows behind the map: that of a recording or of links only when it is named.
#[cfg(feature = "ground")]
fn scene_behind(args: &Args) -> Option<&str> {
    let is_simulated = args.recording.is_none() && args.channel.is_none();
    let default = is_simulated.then_some(DEFAULT_SCENE);
    args.scene.as_deref().or(default)
}

impl Args {
    /// Refuses a flight of no sweep, before a world is made or a recording read.
    fn refuse_no_steps(&self) -> Result<(), InputError> {
        match self.steps {
            Some(0) => Err(InputError::new("nothing to fly: --steps is 0")),
            _ => Ok(()),
        }
    }

    /// Names of the files that are written.
    fn written(&self) -> Vec<&'static str> {
        let exports = self.export.iter().map(|export| export.name());
        let smoothed = Outputs::SMOOTHED_NAMES.into_iter().filter(|_| self.smooth);
        Outputs::NAMES
            .into_iter()
            .chain(smoothed)
            .chain(exports)
            .collect()
    }

    /// What the inertial sensor said in a flight, up to its last pose; nothing when no export wants it.
    fn imu(&self, source: &impl Source, log: &FlightLog) -> Vec<ImuSample> {
        if self.export.is_empty() {
            return Vec::new();
        }
        let end_ns = log.poses.last().map_or(0.0, |pose| pose.time_s * 1e9) as u64;
        let events = source.events().filter(|stamped| stamped.uav_time_ns <= end_ns);
        events
            .filter_map(|stamped| match stamped.event {
                Event::Imu(sample) => Some(sample.at(stamped.uav_time_ns)),
                _ => None,
            })
            .collect()
    }

    /// Sweeps to fly of those that there are.
    fn planned(&self, sweeps: u32) -> Result<usize, TryFromIntError> {
        Ok(usize::try_from(sweeps)?.min(self.steps.unwrap_or(usize::MAX)))
    }
}

/// Before the flight: a directory that cannot be used must not cost one.
fn result_directory(args: &Args) -> Result<ResultDirectory, InputError> {
    ResultDirectory::open(&args.out, Outputs::KIND)
}

/// The configuration, with what the options say instead.
fn read_config(args: &Args) -> Result<Config, InputError> {
    let mut config = Config::read(args.config.as_deref(), args.world)?;
    config.receiver.mode = args.mode.unwrap_or(config.receiver.mode);
    args.stages.set(&mut config.receiver);
    Ok(config)
}
