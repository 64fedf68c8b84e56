//! `cslam reproduce`: the paper's figures and tables, ours beside the printed values. One file a name.

mod bsm;
mod flights;
mod localization;
mod lscn;

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
    /// Whole flights from raw samples: both modes, or ours with one stage at a time exchanged for the paper's
    ///
    /// Every error of the budget; figures of each flight and of all. docs/flights.md holds the tables.
    Flights(flights::Args),
    /// Localization: filter and HPC over flights with every error of the budget
    ///
    /// Flights through a traced scene. Path errors come from the calibration errors of both ends' arrays; inertial samples,
    /// clock, two-way timing and beacons from the sensor models. docs/localization.md holds the tables.
    Localization(localization::Args),
    /// Link state: the paper's network against K, ours on scenes it has not seen, precision of the map
    ///
    /// Trains the paper's network for K = 1, 3, 5, 9 and 15 on the paper's protocol, and scores the models that come with
    /// the program on links that they have not seen. Takes about ten minutes of processor time, all of it for the paper's
    /// networks. docs/link-state.md holds the tables.
    Lscn(lscn::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Bsm(args) => bsm::run(args),
        What::Flights(args) => flights::run(args),
        What::Localization(args) => localization::run(args),
        What::Lscn(args) => lscn::run(args),
    }
}
