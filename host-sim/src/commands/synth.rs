//! `cslam synth`: a recording of every link of a paths file.

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use cslam_firmware::front_end::PILOT_BEAMS;
use rayon::prelude::*;
use serde::Serialize;

use crate::channel::{ChannelConfig, Instant, Simulator, SquintScheme, Sweep};
use crate::config::Config;
use crate::input::InputError;
use crate::paths::{self, Link};
use crate::progress;
use crate::sigmf::{self, Codebook, Recording};

/// Arguments of `cslam synth`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Paths file (.jsonl or .jsonl.gz), one link a line; each path needs `gain` and its angles of departure
    #[arg(long, value_name = "FILE")]
    paths: PathBuf,
    /// Name of the recording: NAME.sigmf-meta and NAME.sigmf-data; NAME-0000 and on (the link's index) for several links
    #[arg(long, value_name = "NAME")]
    out: PathBuf,
    /// Raise the signal against the noise, dB; added to the configuration's own
    #[arg(long, value_name = "DB", default_value_t = 0.0, allow_negative_numbers = true)]
    snr_offset: f64,
    /// Seed of noise and device errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Errors of arrays, clock and transmitter: none, or the design's budget (the default, without a configuration)
    #[arg(long, value_enum, conflicts_with = "config")]
    impairments: Option<Preset>,
    /// Configuration file (TOML), of which [world.channel] counts; `cslam config` shows what it may hold
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// What the transmitter sends: its 72 beams, the pilots of the 12 strongest of them, or the beam squint symbols that follow the beams
    #[arg(long, value_enum, default_value_t = Sent::Beams)]
    send: Sent,
    /// Print one JSON object a recording on standard output
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Preset {
    None,
    Budget,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Sent {
    Beams,
    Pilots,
    #[value(name = "bsm-seq")]
    SquintSequential,
    #[value(name = "bsm-raster")]
    SquintRaster,
}

/// A line of `--json`.
#[derive(Serialize)]
struct Written {
    link: usize,
    recording: PathBuf,
    paths: usize,
    blocks: usize,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let Config { world, radio, .. } = Config::read(args.config.as_deref(), None)?;
    let mut config = match (&args.config, args.impairments) {
        (Some(_), _) => world.channel,
        (None, Some(Preset::None)) => ChannelConfig::ideal(),
        (None, Some(Preset::Budget) | None) => ChannelConfig::default(),
    };
    config.front_end.snr_offset_db += args.snr_offset;
    config
        .check()
        .map_err(|m| InputError::new(format!("--snr-offset {}: {m}", args.snr_offset)))?;
    let instant = Instant::of(&config.motion)
        .map_err(|e| InputError::at_key("world.channel.motion.uav_quaternion_wb", e.to_string()))?;
    let quaternion_wb = unit(config.motion.uav_quaternion_wb);
    let links = paths::read(&args.paths)?;
    if links.is_empty() {
        return Err(InputError::in_file(&args.paths, "holds no link, expected one a line").into());
    }
    let simulator = Simulator::with_radio(radio.of_channel()?, config, args.seed);
    let bar = progress::bar(links.len() as u64, "synth");
    // Each link has its own random streams, so the number of threads does not show.
    let written: Vec<Written> = links
        .par_iter()
        .enumerate()
        .map(|(index, link)| {
            let name = if links.len() == 1 {
                args.out.clone()
            } else {
                numbered(&args.out, index)
            };
            let sweep = synthesise(&simulator, link, &instant, index, args.send)
                .map_err(|m| InputError::in_file(&args.paths, format!("link {index}, {m}")))?;
            let recording = Recording {
                codebook: args.send.codebook(),
                radio: radio.unless_default(),
                gmt_position_m: Some(link.tx),
                uav_position_m: Some(link.rx),
                uav_quaternion_wb: Some(quaternion_wb),
                blocks: sweep.blocks,
            };
            sigmf::write(&name, &recording)?;
            bar.inc(1);
            Ok(Written {
                link: index,
                recording: sigmf::files(&name).0,
                paths: link.paths.len(),
                blocks: recording.blocks.len(),
            })
        })
        .collect::<Result<_, InputError>>()?;
    bar.finish_and_clear();
    if args.json {
        let mut out = std::io::stdout().lock();
        for line in &written {
            writeln!(out, "{}", serde_json::to_string(line)?)?;
        }
    } else {
        let blocks: usize = written.iter().map(|w| w.blocks).sum();
        progress::note(format_args!(
            "{} recording(s), {blocks} blocks, seed {}",
            written.len(),
            args.seed
        ));
    }
    Ok(())
}

fn synthesise(
    simulator: &Simulator,
    link: &Link,
    instant: &Instant,
    index: usize,
    send: Sent,
) -> Result<Sweep, String> {
    let index = u32::try_from(index).map_err(|_| "too many links".to_owned())?;
    match send {
        Sent::Beams => simulator.sweep(link, instant, index),
        Sent::Pilots => simulator.sweep(link, instant, index).and_then(|heard| {
            let beams = heard.strongest(usize::from(PILOT_BEAMS));
            simulator.pilots(link, instant, index, beams)
        }),
        Sent::SquintSequential => simulator.squint(link, instant, index, SquintScheme::Sequential),
        Sent::SquintRaster => simulator.squint(link, instant, index, SquintScheme::Raster),
    }
    .map_err(|e| e.to_string())
}

impl Sent {
    fn codebook(self) -> Codebook {
        match self {
            Self::Beams => Codebook::Beams,
            Self::Pilots => Codebook::Pilots,
            Self::SquintSequential => Codebook::SquintSequential,
            Self::SquintRaster => Codebook::SquintRaster,
        }
    }
}

/// NAME-0000 for link 0.
fn numbered(name: &Path, index: usize) -> PathBuf {
    let (meta, _) = sigmf::files(name);
    let text = meta.to_string_lossy();
    PathBuf::from(format!("{}-{index:04}", text.trim_end_matches(".sigmf-meta")))
}

fn unit(q: [f64; 4]) -> [f64; 4] {
    let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
    q.map(|c| c / norm)
}
