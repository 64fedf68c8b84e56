//! Everything that can be set, in one TOML file: the world that is simulated, its radio, the receiver, and the board that it runs on.
//!
//! `default.toml` beside this file is the whole of it, with the defaults, units, ranges and sources; `cslam config` prints it. A file of
//! a user's holds what shall be otherwise. Every command reads the same file and takes the tables that concern it.

mod association;
mod board;
mod filter;
mod receiver;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::input::limits::CONFIGURATION;
use crate::input::{InputError, from_toml, read_text};
use crate::measurement::Sigmas;
use crate::scene::Scene;
use crate::world::{GivenLinks, Profile, World, WorldConfig};

pub use crate::radio::RadioFigures;
pub use association::{AssociationFigures, SurfaceFigures};
pub use board::BoardConfig;
pub use filter::{BaselineFigures, FilterFigures, ResidualFigures};
pub use receiver::{
    DepartureChoice, EarthField, GmtSetup, LinkStateChoice, LocalizationChoice, MappedChoice, Mode,
    ReceiverConfig,
};

/// The defaults as text, with comments: every key there is. Keys that have no default stand there as `#key = ...`.
pub const DEFAULT: &str = include_str!("default.toml");

/// The configuration of a world, a receiver and a board.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Flight, sensors, channel and front end of a simulation.
    pub world: WorldConfig,
    /// The radio: of the simulated world and of the receiver.
    pub radio: RadioFigures,
    /// Flights over a path list: standard deviations of the measurement errors. The receiver knows them, not the errors.
    pub path_errors: Sigmas,
    /// The receiver's methods, and what it believes.
    pub receiver: ReceiverConfig,
    /// How a board is built.
    pub board: BoardConfig,
}

impl Config {
    /// The defaults of a world.
    #[must_use]
    pub fn of(profile: Profile) -> Self {
        Self {
            world: WorldConfig::of(profile),
            ..Self::default()
        }
    }

    /// Reads a TOML file; keys that are missing keep their defaults. Without a file, the defaults. `profile`, or else
    /// `world.profile` of the file, says which the defaults of the world are.
    ///
    /// # Errors
    /// [`InputError`] naming file, line and key when a key does not belong, is of the wrong type or out of range.
    pub fn read(file: Option<&Path>, profile: Option<Profile>) -> Result<Self, InputError> {
        match file {
            Some(file) => Self::parse(file, &read_text(file, &CONFIGURATION)?, profile),
            None => Ok(Self::of(profile.unwrap_or_default())),
        }
    }

    /// The configuration of a text; `file` is for messages only.
    ///
    /// # Errors
    /// As [`Config::read`].
    pub fn parse(file: &Path, text: &str, profile: Option<Profile>) -> Result<Self, InputError> {
        let said: Self = from_toml(file, text)?;
        let profile = profile.unwrap_or(said.world.profile);
        let config = Self::of(profile)
            .overlaid(text, profile)
            .map_err(|error| InputError::in_file(file, error.message()))?;
        config.check().map_err(|error| error.in_toml(file, text))?;
        Ok(config)
    }

    /// A scene, where it stands, at the radio's carrier.
    ///
    /// # Errors
    /// As [`WorldConfig::scene`].
    pub fn scene(&self, name: &str) -> Result<Scene, InputError> {
        Ok(self
            .world
            .scene(name)?
            .at_frequency(self.radio.waveform.carrier_hz))
    }

    /// The world of a scene of [`Self::scene`] and of a seed.
    ///
    /// # Errors
    /// As [`World::new`], or naming what the radio cannot be.
    pub fn world_in<'s>(&self, scene: &'s Scene, seed: u64) -> Result<World<'s>, InputError> {
        World::with_radio(scene, self.radio.of_channel()?, self.world.clone(), seed)
    }

    /// The world of given links and of a seed.
    ///
    /// # Errors
    /// As [`World::along`], or naming what the radio cannot be.
    pub fn world_along(&self, links: GivenLinks, seed: u64) -> Result<World<'static>, InputError> {
        World::along_with_radio(links, self.radio.of_channel()?, self.world.clone(), seed)
    }

    /// This configuration with what a sound text says instead.
    fn overlaid(&self, text: &str, profile: Profile) -> Result<Self, toml::de::Error> {
        let mut all = toml::Table::try_from(self).map_err(serde::de::Error::custom)?;
        overlay(&mut all, toml::from_str(text)?);
        let mut config: Self = all.try_into()?;
        config.world.profile = profile;
        Ok(config)
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.world.check().map_err(|error| error.under("world"))?;
        self.radio.check().map_err(|error| error.under("radio"))?;
        self.path_errors
            .check()
            .map_err(|error| error.under("path_errors"))?;
        self.receiver.check().map_err(|error| error.under("receiver"))
    }
}

/// Puts the keys of one table over those of another; tables within them key by key, lists whole.
fn overlay(below: &mut toml::Table, above: toml::Table) {
    for (key, value) in above {
        match (below.get_mut(&key), value) {
            (Some(toml::Value::Table(below)), toml::Value::Table(above)) => overlay(below, above),
            (_, value) => drop(below.insert(key, value)),
        }
    }
}

#[cfg(test)]
mod tests;
