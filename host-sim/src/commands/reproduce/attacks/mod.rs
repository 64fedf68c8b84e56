//! `cslam reproduce attacks`: what hostile or broken surroundings do to a flight. One file a name.

mod beacons;
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
    /// Beacons and two-way timing that lie: what is flagged, when, and what of it shows in the pose's standard deviation
    ///
    /// Flights from raw samples, each flown once; then again from its paths with each lie. docs/security.md holds the table.
    Beacons(beacons::Args),
    /// Starts beside a jammer: four kinds of it over a grid of powers
    ///
    /// Flights from raw samples, cut off after the start. docs/security.md holds the table.
    Jamming(jamming::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Beacons(args) => beacons::run(args),
        What::Jamming(args) => jamming::run(args),
    }
}
