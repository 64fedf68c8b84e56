//! The worlds of a campaign.

use std::fs;
use std::path::Path;

use super::Args;
use crate::campaign::{AS_THEY_ARE, Build, Constant, Varied, alone, left_out};
use crate::config::Config;
use crate::input::InputError;
use crate::recording::crc32;
use crate::world::{EFFECTS, Profile};

/// A world that flights are flown in.
pub(super) struct Named {
    pub(super) name: String,
    pub(super) config: Config,
    pub(super) build: Build,
}

/// The worlds that are asked for.
pub(super) fn of(args: &Args) -> anyhow::Result<Vec<Named>> {
    let executable_crc = crc32(&fs::read(std::env::current_exe()?)?);
    let configs = if args.effects {
        with_effects()?
    } else if args.constants {
        with_constants(args)?
    } else {
        asked_for(args)?
    };
    let named = configs.into_iter().map(|(name, config)| {
        let text = toml::to_string(&config)?;
        let steps = format!("{text}\n{:?}", args.steps);
        Ok(Named {
            name,
            config,
            build: Build {
                version: env!("CARGO_PKG_VERSION").to_owned(),
                executable_crc,
                config_crc: crc32(steps.as_bytes()),
            },
        })
    });
    named.collect()
}

/// The worlds of the arguments, with their names.
fn asked_for(args: &Args) -> Result<Vec<(String, Config)>, InputError> {
    let profiles: Vec<Option<Profile>> = match args.profiles[..] {
        [] => vec![None],
        ref some => some.iter().copied().map(Some).collect(),
    };
    let files: Vec<Option<&Path>> = match args.configs[..] {
        [] => vec![None],
        ref some => some.iter().map(|file| Some(file.as_path())).collect(),
    };
    let mut configs: Vec<(String, Config)> = Vec::new();
    for file in files {
        for profile in &profiles {
            let config = Config::read(file, *profile)?;
            let name = name(file, *profile);
            if configs.iter().any(|(before, _)| *before == name) {
                return Err(InputError::new(format!("two worlds have the name {name}")));
            }
            configs.push((name, config));
        }
    }
    Ok(configs)
}

/// `budget` and `real`, and what lies between them by one effect.
fn with_effects() -> anyhow::Result<Vec<(String, Config)>> {
    let mut configs: Vec<_> = [Profile::Budget, Profile::Real]
        .map(|profile| (profile.name().to_owned(), Config::of(profile)))
        .into();
    for effect in &EFFECTS {
        for (name, world) in [
            (alone(effect.name), effect.alone()?),
            (left_out(effect.name), effect.left_out()?),
        ] {
            configs.push((
                name,
                Config {
                    world,
                    ..Config::default()
                },
            ));
        }
    }
    Ok(configs)
}

/// The receiver as it is, and with each constant of data association halved and doubled.
fn with_constants(args: &Args) -> anyhow::Result<Vec<(String, Config)>> {
    let asked = asked_for(args)?;
    let [(_, base)] = asked.as_slice() else {
        let message = "--constants: expected one world and one configuration";
        return Err(InputError::new(message).into());
    };
    let mut configs = vec![(AS_THEY_ARE.to_owned(), base.clone())];
    for constant in Constant::all(base)? {
        for varied in [Varied::Halved, Varied::Doubled] {
            configs.push((constant.world(varied), constant.set(base, varied)?));
        }
    }
    Ok(configs)
}

/// Name of a world: that of its file, of the profile that was asked for, or both.
fn name(file: Option<&Path>, asked: Option<Profile>) -> String {
    let stem = file.and_then(Path::file_stem).map(|stem| stem.to_string_lossy());
    match (stem, asked) {
        (Some(stem), Some(profile)) => format!("{stem}-{}", profile.name()),
        (Some(stem), None) => stem.into_owned(),
        (None, profile) => profile.unwrap_or_default().name().to_owned(),
    }
}
