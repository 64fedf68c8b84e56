//! One file per subcommand.

pub(crate) mod accuracy;
pub(crate) mod bench;
pub(crate) mod campaign;
pub(crate) mod classify;
pub(crate) mod completions;
pub(crate) mod config;
pub(crate) mod dataset;
pub(crate) mod estimate;
pub(crate) mod fly;
#[cfg(feature = "ground")]
pub(crate) mod ground;
pub(crate) mod imu;
mod kept;
pub(crate) mod key;
pub(crate) mod manual;
pub(crate) mod quantize;
pub(crate) mod record;
pub(crate) mod replay;
pub(crate) mod reproduce;
mod seeds;
mod shard;
pub(crate) mod solve;
pub(crate) mod synth;
mod threads;
pub(crate) mod trace;
pub(crate) mod train;

/// Scene of a flight that names none.
const DEFAULT_SCENE: &str = "outdoor";
