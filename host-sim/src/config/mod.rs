//! Everything that can be set, in one TOML file: the world that is simulated, the receiver, and the board that it runs on.
//!
//! `default.toml` beside this file is the whole of it, with the defaults, units, ranges and sources; `cslam config` prints it. A file of
//! a user's holds what shall be otherwise. Every command reads the same file and takes the tables that concern it.

mod board;
mod filter;
mod receiver;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::input::limits::CONFIGURATION;
use crate::input::{InputError, from_toml, read_text};
use crate::measurement::Sigmas;
use crate::world::WorldConfig;

pub use board::BoardConfig;
pub use filter::{FilterFigures, HpcFigures, ResidualFigures};
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
    /// Flights over a path list: standard deviations of the measurement errors. The receiver knows them, not the errors.
    pub path_errors: Sigmas,
    /// The receiver's methods, and what it believes.
    pub receiver: ReceiverConfig,
    /// How a board is built.
    pub board: BoardConfig,
}

impl Config {
    /// Reads a TOML file; keys that are missing keep their defaults. Without a file, the defaults.
    ///
    /// # Errors
    /// [`InputError`] naming file, line and key when a key does not belong, is of the wrong type or out of range.
    pub fn read(file: Option<&Path>) -> Result<Self, InputError> {
        match file {
            Some(file) => Self::parse(file, &read_text(file, &CONFIGURATION)?),
            None => Ok(Self::default()),
        }
    }

    /// The configuration of a text; `file` is for messages only.
    ///
    /// # Errors
    /// As [`Config::read`].
    pub fn parse(file: &Path, text: &str) -> Result<Self, InputError> {
        let config: Self = from_toml(file, text)?;
        config.check().map_err(|error| error.in_toml(file, text))?;
        Ok(config)
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        self.world.check().map_err(|error| error.under("world"))?;
        self.path_errors
            .check()
            .map_err(|error| error.under("path_errors"))?;
        self.receiver.check().map_err(|error| error.under("receiver"))
    }
}

#[cfg(test)]
mod tests;
