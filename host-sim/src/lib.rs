//! The world around the receiver, and the `cslam` command that puts the two together.

// First: its macros stand in for those of the standard library in every module below.
#[macro_use]
mod output;

pub use cslam_channel::synthesis as channel;
pub use cslam_channel::{input, paths, random};

pub mod accuracy;
pub mod allan;
pub mod beam_squint;
pub mod campaign;
pub mod cli;
mod commands;
pub mod config;
pub mod crlb;
pub mod estimate;
pub mod evaluation;
pub mod flight;
pub mod flight_files;
pub mod flight_log;
#[cfg(feature = "ground")]
pub mod ground;
mod interrupt;
pub mod kept_flight;
pub mod library;
pub mod link_key;
pub mod link_state;
pub mod link_traffic;
pub mod measurement;
pub mod movers;
pub mod npy;
pub mod path_flight;
pub mod progress;
pub mod radio;
pub mod raw_flight;
pub mod recording;
pub mod report;
pub mod result_directory;
pub mod scene;
pub mod seeded;
pub mod sensors;
pub mod settings_image;
pub mod sigmf;
pub mod smoother;
pub mod solve;
pub mod statistics;
pub mod table;
#[cfg(test)]
mod test_flight;
pub mod tracer;
pub mod uplink_attack;
pub mod vegetation;
pub mod world;
