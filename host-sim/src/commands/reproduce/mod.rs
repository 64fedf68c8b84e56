//! `cslam reproduce`: the paper's figures and tables, ours beside them.

mod localization;

use clap::Subcommand;

/// Arguments of `cslam reproduce`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Localization: filter and HPC over flights with every error of the budget
    ///
    /// Flights through a traced scene. Path errors come from the calibration errors of both ends' arrays; inertial samples,
    /// clock, two-way timing and beacons from the sensor models. docs/localization.md holds the tables.
    Localization(localization::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Localization(args) => localization::run(args),
    }
}
