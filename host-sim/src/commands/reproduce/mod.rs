//! `cslam reproduce`: the paper's figures and tables, ours beside the printed values. One file a name.

mod bsm;
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
    /// Beam squint localization alone: fit, parabola and peak subcarrier beside the Cramer-Rao bound
    ///
    /// Seeded trials through channel, 12-bit converter, path estimation and exactly the code that flies: line of sight
    /// alone, with calibration errors, beside a ground bounce; and the range of large arrays in their near field.
    /// docs/beam-squint.md holds the tables.
    Bsm(bsm::Args),
    /// Localization: filter and HPC over flights with every error of the budget
    ///
    /// Flights through a traced scene. Path errors come from the calibration errors of both ends' arrays; inertial samples,
    /// clock, two-way timing and beacons from the sensor models. docs/localization.md holds the tables.
    Localization(localization::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Bsm(args) => bsm::run(args),
        What::Localization(args) => localization::run(args),
    }
}
