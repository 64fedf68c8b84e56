//! `cslam reproduce attacks`: what hostile surroundings make of the pose.

mod jamming;

use clap::Subcommand;

/// Arguments of `cslam reproduce attacks`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Starts beside a jammer: four kinds of it over a grid of powers
    ///
    /// Flights from raw samples, cut off after the start. docs/localization.md holds the table.
    Jamming(jamming::Args),
}

pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Jamming(args) => jamming::run(args),
    }
}
