//! The flights of a campaign, and which of them lie in its directory already.

use std::path::Path;

use serde::Serialize;

use super::worlds::Named;
use super::{Args, Set};
use crate::campaign::{Flight, Lists, Purpose, Shard};
use crate::config::Mode;
use crate::input::InputError;
use crate::scene::Scene;

/// Flights through one world: one for each mode.
pub(super) struct Together<'a> {
    pub(super) world: &'a Named,
    pub(super) scene: String,
    pub(super) seed: u64,
    /// Those that have not been flown.
    pub(super) modes: Vec<(Flight, Mode)>,
}

/// What is still to be flown, for whoever shares it out: shard I of N, as `--shard` has it, is one simulated flight.
#[derive(Debug, Serialize)]
pub(super) struct Missing {
    /// N.
    shards: usize,
    /// Each I of which a flight is missing.
    missing: Vec<usize>,
}

impl Missing {
    /// Of all flights of a campaign.
    pub(super) fn of(all: &[Together<'_>]) -> Self {
        let missing = all
            .iter()
            .enumerate()
            .filter(|(_, flights)| !flights.modes.is_empty());
        Self {
            shards: all.len(),
            missing: missing.map(|(place, _)| place).collect(),
        }
    }
}

/// All that is asked for, world by world, whether it has been flown or not.
///
/// # Errors
/// [`InputError`] when nothing is asked for, a scene cannot be read, or a flight in the directory is no part of this campaign.
pub(super) fn all<'a>(args: &Args, out: &Path, worlds: &'a [Named]) -> Result<Vec<Together<'a>>, InputError> {
    let flights = flights(args)?;
    let mut all = Vec::new();
    for world in worlds {
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
            all.push(Together {
                world,
                scene: scene.clone(),
                seed: *seed,
                modes: modes
                    .filter_map(Result::transpose)
                    .collect::<Result<_, InputError>>()?,
            });
        }
    }
    Ok(all)
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
