//! What the command does, for programs that are no command line: nothing is printed, and results are returned.

use std::path::Path;
use std::sync::atomic::AtomicBool;

use crate::commands::{fly, record as recorder};
use crate::recording::Manifest;
use crate::report::Report;

/// Flies over the recording in `directory` as `cslam fly --recording` does, at most `steps` sweeps, until `interrupted`, and smooths the flight
/// afterwards when `smooth` says so; the files of the flight lie in `out` afterwards. Call [`crate::progress::be_quiet`] first where no progress shall be shown.
///
/// # Errors
/// [`crate::input::InputError`], as an [`anyhow::Error`], naming the file that is missing, damaged or cannot be written.
pub fn fly_recording(
    directory: &Path,
    out: &Path,
    steps: Option<usize>,
    smooth: bool,
    interrupted: &AtomicBool,
) -> anyhow::Result<Report> {
    fly::over_recording(directory, out, steps, smooth, interrupted)
}

/// Records a flight of `seed` through a scene (`None`: the default one), or along the links of a file `channel`, with the scene to compare
/// a map with, in a world (`ideal`, `budget`, `real`; `None`: the default one), at most `sweeps` sweeps, into the directory `out`, as
/// `cslam record` does.
///
/// # Errors
/// [`crate::input::InputError`], as an [`anyhow::Error`], naming what is not known, or the file that cannot be written; an error of another
/// kind when it was `interrupted`.
pub fn record(
    scene: Option<&str>,
    channel: Option<&Path>,
    world: Option<&str>,
    seed: u64,
    sweeps: Option<u32>,
    out: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Manifest> {
    recorder::flight(scene, channel, world, seed, sweeps, out, interrupted)
}
