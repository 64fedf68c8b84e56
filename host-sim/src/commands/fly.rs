//! `cslam fly`: one whole flight over measured paths. The receiver is exactly the firmware's library half.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clap::ValueEnum;
use cslam_core::reflection::Form;
use cslam_firmware::measurement::{PathRecord, Record};
use cslam_firmware::receiver::{BoardMap, ReceiveError, Receiver, board_gates};
use serde::{Deserialize, Serialize};

use crate::evaluation::{downlink, evaluate};
use crate::flight_files::Outputs;
use crate::flight_files::ply::Encoding;
use crate::flight_log::Header;
use crate::input::{InputError, read_text};
use crate::measurement::Sigmas;
use crate::path_flight::{self, Sweep, measure};
use crate::paths::{self, Link};
use crate::progress;
use crate::report::{Report, table};
use crate::scene::Scene;

/// Sweeps a second (design section 7).
const SWEEP_RATE_HZ: f64 = 2.0;

/// The scene that the bundled path list was traced in.
const BUNDLED_SCENE: &str = "outdoor_a";

/// Arguments of `cslam fly`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Paths file to fly over (.jsonl or .jsonl.gz); without it, the bundled outdoor list
    #[arg(long, value_name = "FILE")]
    paths: Option<PathBuf>,
    /// Scene that the paths were traced in, to compare the map with its surfaces; that of the bundled list is known
    #[arg(long, value_name = "NAME|FILE")]
    scene: Option<String>,
    /// Configuration file (TOML); --print-config shows what it may hold
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the configuration in force as TOML and end
    #[arg(long)]
    print_config: bool,
    /// Seed of all measurement errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Fly at most this many sweeps
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Whose methods
    #[arg(long, value_enum, default_value_t = Mode::Best)]
    mode: Mode,
    /// Directory for the results, made when missing
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Encoding of the point clouds
    #[arg(long, value_enum, default_value_t = Ply::Ascii)]
    ply: Ply,
    /// Print the report as one JSON object on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Every path, vector form
    Best,
    /// Strongest path only, the paper's closed form
    Paper,
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

/// The configuration file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Config {
    /// Standard deviations of the measurement errors. The receiver knows them, not the errors.
    errors: Sigmas,
}

impl Default for Args {
    fn default() -> Self {
        Self {
            paths: None,
            scene: None,
            config: None,
            print_config: false,
            seed: 1,
            steps: None,
            mode: Mode::Best,
            out: "out".into(),
            ply: Ply::Ascii,
            json: false,
        }
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let config = read_config(args.config.as_deref())?;
    if args.print_config {
        print!("{}", toml::to_string(&config)?);
        return Ok(());
    }
    // The surfaces behind a list are known for the bundled one, or when they are named.
    let (list_name, mut links, list_scene) = match &args.paths {
        Some(file) => (file.display().to_string(), paths::read(file)?, None),
        None => (BUNDLED_SCENE.to_owned(), paths::bundled()?, Some(BUNDLED_SCENE)),
    };
    let scene = args
        .scene
        .as_deref()
        .or(list_scene)
        .map(Scene::load)
        .transpose()?;
    links.truncate(args.steps.unwrap_or(usize::MAX));
    if links.is_empty() {
        return Err(InputError::new("nothing to fly: the path list is empty, or --steps is 0").into());
    }
    // Before the flight: a directory that cannot be made must not cost one.
    fs::create_dir_all(&args.out)
        .map_err(|e| InputError::in_file(&args.out, format!("cannot be made a directory: {e}")))?;

    let start = Instant::now();
    let flight = fly(&links, &config, args)?;
    let elapsed_s = start.elapsed().as_secs_f64();

    let heard = downlink::decode(&flight.packets);
    let header = Header {
        mode: if args.mode == Mode::Paper { "paper" } else { "best" }.into(),
        scene: list_name,
        seed: args.seed,
        planned_sweeps: links.len(),
        sweep_period_s: 1.0 / SWEEP_RATE_HZ,
        delay_cycle_m: None,
    };
    let mut log = path_flight::log(header, &flight.flown, &heard, flight.packets.len(), &flight.map);
    let evaluation = evaluate(&mut log, scene.as_ref());
    let report = Report::new(&log, &evaluation, elapsed_s);
    let outputs = Outputs {
        log: &log,
        scene: scene.as_ref(),
        evaluation: &evaluation,
        report: &report,
        packets: &flight.packets,
    };
    outputs.write(&args.out, args.ply.into())?;
    if args.json {
        println!("{}", serde_json::to_string(&report)?);
        eprintln!("{}", table(&report));
    } else {
        println!("{}", table(&report));
    }
    eprintln!("wrote {} to {}", Outputs::NAMES.join(", "), args.out.display());
    Ok(())
}

fn read_config(file: Option<&Path>) -> Result<Config, InputError> {
    let Some(file) = file else {
        return Ok(Config::default());
    };
    let config: Config =
        toml::from_str(&read_text(file)?).map_err(|e| InputError::in_file(file, e.message().to_owned()))?;
    config
        .errors
        .check()
        .map_err(|message| InputError::in_file(file, format!("errors.{message}")))?;
    Ok(config)
}

/// A flight, or as much of it as was flown before an interrupt.
struct Flight<'a> {
    map: Box<BoardMap>,
    packets: Vec<u8>,
    /// What was measured on each link.
    flown: Vec<(&'a Link, Sweep)>,
}

fn fly<'a>(links: &'a [Link], config: &Config, args: &Args) -> anyhow::Result<Flight<'a>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&interrupted);
    // A second handler in one process is an error of no consequence here: the first one stays.
    let _ = ctrlc::set_handler(move || flag.store(true, Ordering::Relaxed));

    let form = if args.mode == Mode::Paper {
        Form::Paper
    } else {
        Form::Vector
    };
    let mut map = Box::new(BoardMap::new());
    let mut receiver = Receiver::new(&mut map, form, board_gates());
    let mut packets = Vec::new();
    let bar = progress::bar(links.len() as u64, "flying");
    let (mut flown, mut sent) = (Vec::with_capacity(links.len()), 0);
    for (index, link) in links.iter().enumerate() {
        if interrupted.load(Ordering::Relaxed) {
            bar.abandon();
            break;
        }
        let sweep = measure(
            index as u32,
            link,
            &config.errors,
            args.seed,
            args.mode == Mode::Paper,
        )
        .map_err(|e| InputError::new(format!("link {index} of the path list: {e}")))?;
        for (path, number) in sweep.paths.iter().zip(0..=u8::MAX) {
            let record = PathRecord::new(sweep.link, number, &sweep.ends, path);
            receive(&mut receiver, Record::Path(record), &mut packets)?;
            sent += 1;
        }
        flown.push((link, sweep));
        bar.inc(1);
    }
    bar.finish_and_clear();
    receive(&mut receiver, Record::End { sent }, &mut packets)?;
    Ok(Flight { map, packets, flown })
}

/// Through the bytes of a record, as the chip gets it.
fn receive<const N: usize>(
    receiver: &mut Receiver<'_, N>,
    record: Record,
    packets: &mut Vec<u8>,
) -> anyhow::Result<()> {
    receiver
        .receive(&record.encode(), &mut Downlink(packets))
        .map(drop)
        .map_err(|e| match e {
            ReceiveError::Downlink(never) => match never {},
            other => anyhow::anyhow!("the receiver stopped: {other}"),
        })
}

/// A downlink that remembers everything.
struct Downlink<'a>(&'a mut Vec<u8>);

impl embedded_io::ErrorType for Downlink<'_> {
    type Error = std::convert::Infallible;
}

impl embedded_io::Write for Downlink<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
