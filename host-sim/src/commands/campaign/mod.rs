//! `cslam campaign`: many flights in one command, and two campaigns side by side.

mod flown;
mod kept;
mod worlds;

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::Ordering;

use clap::ValueEnum;
use rayon::prelude::*;

use flown::flown;
use kept::Kept;
use worlds::Named;

use crate::campaign::{
    Constant, ConstantsTable, EffectsTable, Flight, Lists, Purpose, Shard, Summary, compare, read_shards,
};
use crate::commands::seeds::AnySeed;
use crate::commands::threads::Threads;
use crate::config::Mode;
use crate::input::InputError;
use crate::interrupt;
use crate::progress;
use crate::scene::Scene;
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
    #[command(flatten)]
    threads: Threads,
    /// Print the summary as one JSON object on standard output
    #[arg(long)]
    json: bool,
    /// Compare two campaigns flight by flight, and fly nothing
    #[arg(long, value_name = "DIR", num_args = 2, conflicts_with_all = ["out", "json"])]
    compare: Option<Vec<PathBuf>>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Set {
    /// Constants may be looked at on them
    Tuning,
    /// Flown when the code is finished
    Reporting,
}

/// Flights through one world that have not been flown: one for each mode.
struct Together<'a> {
    world: &'a Named,
    scene: &'a str,
    seed: u64,
    modes: Vec<(Flight, Mode)>,
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
    let flights = flights(args)?;
    fs::create_dir_all(out).map_err(|e| InputError::unwritable(out, "cannot be made a directory", &e))?;
    let mut missing: Vec<Together> = Vec::new();
    for world in &worlds {
        for (scene, seed) in &flights {
            let modes = args.modes.iter().map(|mode| {
                let flight = Flight {
                    world: world.name.clone(),
                    mode: mode.name().to_owned(),
                    scene: scene.clone(),
                    seed: *seed,
                };
                let flown = is_flown(out, &flight, world, args.smooth)?;
                Ok((!flown).then_some((flight, *mode)))
            });
            let modes: Vec<_> = modes
                .filter_map(Result::transpose)
                .collect::<Result<_, InputError>>()?;
            if !modes.is_empty() {
                missing.push(Together {
                    world,
                    scene,
                    seed: *seed,
                    modes,
                });
            }
        }
    }
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
    report(args, out, &worlds)
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

/// Whether a flight lies in the directory already.
///
/// # Errors
/// [`InputError`] when another build or configuration has flown it, or when it was not smoothed and is to be.
fn is_flown(out: &Path, flight: &Flight, world: &Named, smooth: bool) -> Result<bool, InputError> {
    match Shard::read(out, flight)? {
        None => Ok(false),
        Some(shard) if shard.build == world.build => {
            let plain = shard
                .report
                .is_some_and(|report| report.get("smoothed").is_none());
            if smooth && plain {
                return Err(InputError::in_file(
                    &out.join(flight.file_name()),
                    "was flown without --smooth: expected a directory of smoothed flights, or a new one",
                ));
            }
            Ok(true)
        }
        Some(_) => Err(InputError::in_file(
            &out.join(flight.file_name()),
            "was flown by another build or configuration: expected a directory of this campaign, or a new one",
        )),
    }
}

/// The flights that are asked for, scene and seed.
fn flights(args: &Args) -> Result<Vec<(String, u64)>, InputError> {
    let lists = Lists::of_the_repository()?;
    let flights = match args.set {
        Some(Set::Tuning) => lists.flights(Purpose::Tuning),
        Some(Set::Reporting) => lists.flights(Purpose::Reporting),
        None => {
            let [first, last] = args.seeds[..] else {
                return Err(InputError::new("--seeds: expected the first and the last"));
            };
            let of_scene = |scene: &String| {
                (first..=last)
                    .map(|seed| (scene.clone(), seed))
                    .collect::<Vec<_>>()
            };
            args.scenes.iter().flat_map(of_scene).collect()
        }
    };
    if flights.is_empty() || args.steps == Some(0) {
        return Err(InputError::new(
            "nothing to fly: --seeds or --steps leave no flight",
        ));
    }
    args.any_seed.check(&flights)?;
    // A scene that cannot be read must not cost a night of flights.
    let mut scenes: Vec<&String> = flights.iter().map(|(scene, _)| scene).collect();
    scenes.dedup();
    for scene in scenes {
        Scene::load(scene)?;
    }
    Ok(flights)
}

fn text_of(directory: &Path) -> String {
    directory.display().to_string()
}
