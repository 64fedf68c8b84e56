//! `cslam config`: the configuration, printed or checked.

use std::path::PathBuf;

use crate::config::{Config, DEFAULT};
use crate::progress;

/// Arguments of `cslam config`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Check a configuration file instead of printing the defaults
    #[arg(long, value_name = "FILE")]
    check: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.check {
        None => print!("{DEFAULT}"),
        Some(file) => {
            Config::read(Some(file), None)?;
            progress::note(format_args!(
                "{}: every key is known and in its range",
                file.display()
            ));
        }
    }
    Ok(())
}
