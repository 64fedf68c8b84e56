//! `cslam campaign`: many flights in one command, and two campaigns side by side.

mod flown;
mod planned;
mod worlds;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use clap::ValueEnum;
use rayon::prelude::*;

use flown::flown;
use planned::{Missing, Together};
use worlds::Named;

use crate::campaign::{Constant, ConstantsTable, EffectsTable, Shard, Summary, compare, read_shards};
use crate::commands::kept::Kept;
use crate::commands::seeds::AnySeed;
use crate::commands::shard::OneOf;
use crate::commands::threads::Threads;
use crate::config::Mode;
use crate::input::InputError;
use crate::interrupt;
use crate::progress;
use crate::world::Profile;

/// Arguments of `cslam campaign`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Directory of the campaign, made when missing: a file for each flight, and summary.json. Flights that are there already are
    /// not flown again, unless another build or configuration has flown them: then the campaign is refused
    #[arg(long, value_name = "DIR", required_unless_present = "compare")]
    out: Option<PathBuf>,
    /// Flights of a list: those that constants may be tuned on, or those that are flown to report only (tests/seeds.toml)
    #[arg(long, value_enum, conflicts_with_all = ["scenes", "seeds"])]
    set: Option<Set>,
    /// Scenes: outdoor, indoor, street, outdoor_a, city:SEED, or files
    #[arg(long, value_name = "NAME|FILE", num_args = 1.., default_values_t = ["outdoor".to_owned()])]
    scenes: Vec<String>,
    /// First and last seed
    #[arg(long, value_name = "N", num_args = 2, default_values_t = [1, 4])]
    seeds: Vec<u64>,
    #[command(flatten)]
    any_seed: AnySeed,
    /// Whose methods
    #[arg(long, value_enum, num_args = 1.., default_values_t = [Mode::Best])]
    modes: Vec<Mode>,
    /// Worlds, each with the configuration's keys over its own figures [default: the configuration's, real]
    #[arg(long = "world", value_enum, num_args = 1..)]
    profiles: Vec<Profile>,
    /// Configurations (`cslam config`): each flight is flown with each. Their mode is that of --modes
    #[arg(long, value_name = "FILE", num_args = 1..)]
    configs: Vec<PathBuf>,
    /// The worlds budget and real, then budget with each effect of real alone, and real without each: what breaks it
    #[arg(long, conflicts_with_all = ["profiles", "configs"])]
    effects: bool,
    /// The receiver with each number of [receiver.association], [receiver.surfaces], [receiver.filter.gates] and
    /// [receiver.filter.beacon] halved and doubled: what hangs on them. With
    /// --keep-paths each flight costs a second
    #[arg(long, conflicts_with = "effects")]
    constants: bool,
    /// Fly at most this many sweeps of each
    #[arg(long, value_name = "N")]
    steps: Option<usize>,
    /// Keep what path estimation makes of each flight in this directory (`cslam fly --keep-paths`). A flight whose paths lie there
    /// already is flown from them, in a second: for receivers that are changed behind path estimation
    #[arg(long, value_name = "DIR")]
    keep_paths: Option<PathBuf>,
    /// Smooth each flight afterwards (`cslam fly --smooth`): the figures of both stand in the summary
    #[arg(long)]
    smooth: bool,
    /// Write what the trees of the link state are trained on (`cslam train --kind trees`) into this directory, one for each flight: the
    /// inputs that the receiver has of each measured path, and what the path truly was
    #[arg(long, value_name = "DIR")]
    samples: Option<PathBuf>,
    /// Fly only shard I of N, counted from 0, and write no summary: for several processes or machines. Simulated flights go round the
    /// shards, a flight's modes stay together. The same command without it, where the files of all shards lie in DIR, is one campaign
    #[arg(long, value_name = "I/N", conflicts_with = "json")]
    shard: Option<String>,
    /// Print what is not in DIR yet as one JSON object, and fly nothing: {"shards": N, "missing": [I, ...]}, where N is the number of simulated
    /// flights, so that `--shard I/N` is one of them
    #[arg(long, conflicts_with = "shard")]
    missing: bool,
    #[command(flatten)]
    threads: Threads,
    /// Print the summary as one JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Compare two campaigns flight by flight, and fly nothing
    #[arg(long, value_name = "DIR", num_args = 2, conflicts_with_all = ["out", "json", "shard", "missing"])]
    compare: Option<Vec<PathBuf>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Constants may be looked at on them
    Tuning,
    /// Flown when the code is finished
    Reporting,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some([a, b]) = args.compare.as_deref() {
        let text = compare(&read_shards(a)?, &read_shards(b)?).text([&text_of(a), &text_of(b)]);
        println!("{text}");
        return Ok(());
    }
    let Some(out) = &args.out else {
        return Err(InputError::new("--out: expected a directory").into());
    };
    let worlds = worlds::of(args)?;
    // Processes do not know of each other who keeps which paths.
    let is_shared = args.shard.is_some() || args.missing;
    if is_shared && args.keep_paths.is_some() && worlds.len() > 1 {
        let message = "--keep-paths: expected one world where flights are shared out by --shard";
        return Err(InputError::new(message).into());
    }
    let shard = args
        .shard
        .as_deref()
        .map(|text| OneOf::parse(text, usize::MAX))
        .transpose()?;
    let all = planned::all(args, out, &worlds)?;
    if args.missing {
        println!("{}", serde_json::to_string(&Missing::of(&all))?);
        return Ok(());
    }
    let own = all
        .iter()
        .enumerate()
        .filter(|(place, _)| shard.is_none_or(|shard| shard.has(*place)));
    let missing: Vec<&Together> = own
        .map(|(_, flights)| flights)
        .filter(|flights| !flights.modes.is_empty())
        .collect();
    fs::create_dir_all(out).map_err(|e| InputError::unwritable(out, "cannot be made a directory", &e))?;
    let interrupted = interrupt::flag();
    let count = missing.iter().map(|flights| flights.modes.len()).sum::<usize>();
    let bar = progress::bar(count as u64, "flying");
    let failed = Mutex::new(None);
    let kept = args.keep_paths.as_deref().map(Kept::new);
    args.threads.install(|| {
        missing.par_iter().for_each(|flights| {
            if interrupted.load(Ordering::Relaxed) {
                return;
            }
            flown(args, kept.as_ref(), flights, &interrupted, |flight, report| {
                let (report, error) = match report {
                    Ok(Some(report)) => (Some(report), None),
                    // Half a flight is none.
                    Ok(None) => return,
                    Err(error) => (None, Some(error)),
                };
                let shard = Shard {
                    flight: flight.clone(),
                    build: flights.world.build.clone(),
                    report,
                    error,
                };
                if let Err(error) = shard.write(out)
                    && let Ok(mut failed) = failed.lock()
                {
                    interrupted.store(true, Ordering::Relaxed);
                    failed.get_or_insert(error);
                }
                bar.inc(1);
            });
        });
        Ok(())
    })?;
    bar.finish_and_clear();
    if let Ok(Some(error)) = failed.into_inner() {
        return Err(error.into());
    }
    if shard.is_none() {
        return report(args, out, &worlds);
    }
    // Of a shard there is no summary to tell that a part of it is missing.
    if interrupted.load(Ordering::Relaxed) {
        anyhow::bail!("interrupted: the shard is not complete");
    }
    Ok(())
}

/// Summaries of everything that lies in the directory, world by world and mode by mode.
fn report(args: &Args, out: &Path, worlds: &[Named]) -> anyhow::Result<()> {
    let shards = read_shards(out)?;
    let mut summaries = Vec::new();
    for world in worlds {
        for mode in &args.modes {
            let own: Vec<&Shard> = shards
                .iter()
                .filter(|shard| shard.flight.world == world.name && shard.flight.mode == mode.name())
                .collect();
            let name = format!("{}, {}", world.name, mode.name());
            summaries.push((name, Summary::of(&own)));
        }
    }
    let object: serde_json::Map<String, serde_json::Value> = summaries
        .iter()
        .map(|(name, summary)| Ok((name.clone(), serde_json::to_value(summary)?)))
        .collect::<Result<_, serde_json::Error>>()?;
    let file = out.join("summary.json");
    fs::write(&file, serde_json::to_string_pretty(&object)?)
        .map_err(|e| InputError::unwritable(&file, "cannot be written", &e))?;
    for (name, summary) in &summaries {
        if args.json {
            progress::note(summary.text(name));
        } else if !args.effects && !args.constants {
            // Of all effects, and of all constants, one table says enough.
            println!("{}", summary.text(name));
        }
    }
    if args.json {
        println!("{}", serde_json::to_string(&object)?);
        return Ok(());
    }
    if !args.effects && !args.constants {
        return Ok(());
    }
    // The first world is that of which the others are variants.
    let constants = worlds
        .first()
        .map(|world| Constant::all(&world.config))
        .transpose()?
        .unwrap_or_default();
    for mode in &args.modes {
        let own: Vec<&Shard> = shards
            .iter()
            .filter(|shard| shard.flight.mode == mode.name())
            .collect();
        let text = if args.effects {
            EffectsTable::of(&own).text(mode.name())
        } else {
            ConstantsTable::of(&own, &constants).text(mode.name())
        };
        println!("{text}");
    }
    Ok(())
}

fn text_of(directory: &Path) -> String {
    directory.display().to_string()
}
