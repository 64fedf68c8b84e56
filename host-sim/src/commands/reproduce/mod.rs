//! `cslam reproduce`: the paper's figures and tables, ours beside the printed values. One file a name.

mod attacks;
mod beam_squint;
mod complexity;
mod flights;
mod known_pose;
mod lines;
mod link;
mod link_state;
mod localization;
mod map_plot;
mod maps;
mod pattern;
mod points;
mod selected;
mod telemetry;
mod training;

use clap::Subcommand;

/// Arguments of `cslam reproduce`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Attacks: flights in which the GMT lies, starts beside a jammer
    Attacks(attacks::Args),
    /// Beam squint localization alone: fit, parabola and peak subcarrier beside the Cramer-Rao bound
    ///
    /// Seeded trials through channel, 12-bit converter, path estimation and exactly the code that flies: line of sight
    /// alone, with calibration errors, beside a ground bounce; and the range of large arrays in their near field.
    /// docs/beam-squint.md holds the tables.
    BeamSquint(beam_squint::Args),
    /// Cost of a reflection point: the closed forms beside iteration and search
    ///
    /// Evaluations and time for one point at several precisions, as a table and a plot; the time is this machine's.
    Complexity(complexity::Args),
    /// One link: its 25 strongest paths, and what estimator, networks and closed form make of them
    ///
    /// The paper's worked example, on a link like the paper's unless others are given. From raw samples with the
    /// true pose.
    Link(link::Args),
    /// Whole flights from raw samples: both modes, ours with one stage at a time exchanged for the paper's, or where points are lost
    ///
    /// Every error of the budget; figures of each flight and of all. docs/flights.md holds the tables.
    Flights(flights::Args),
    /// Localization: the pose over whole flights and at the end of planned outages, without each aid in turn, and the paper's HPC
    ///
    /// Flights from raw samples, each flown once; then again from its paths by each receiver, and with the line of sight taken out for a
    /// while. docs/localization.md holds the tables.
    Localization(localization::Args),
    /// Link state: the paper's network against K, ours on scenes it has not seen, precision of the map
    ///
    /// Trains the paper's network for K = 1, 3, 5, 9 and 15 on the paper's protocol, and scores the models that come with
    /// the program on links that they have not seen. Takes about ten minutes of processor time, all of it for the paper's
    /// networks. docs/link-state.md holds the tables.
    LinkState(link_state::Args),
    /// Maps: outdoors and indoors, from raw samples with the true pose
    ///
    /// Flies through each scene with every error of the budget but those of the pose, estimates, classifies, solves and maps as
    /// each mode does, and compares with the truth. Writes the maps as point clouds and as plots.
    Maps(maps::Args),
    /// Beam patterns of the arrays at both ends, and of beam squint, as tables and a plot
    ///
    /// Transmit beams of the GMT in azimuth and elevation, directivity of the UAV's arrays, and where the subcarriers of a squint
    /// symbol look. Arrays without errors.
    Pattern(pattern::Args),
    /// Reflection points: the paper's table of errors over 10 000 links of first order
    ///
    /// Experiment 2 solves the points from true delays and angles; experiment 1 from raw samples: int16 blocks of 72 beams with
    /// every path of the link, thermal noise and 12-bit converter, through the estimator and the classifier that fly, with
    /// the true pose. docs/reproduction.md holds the tables.
    Points(points::Args),
    /// The link to the ground: bytes per point and per second, and what a bad radio leaves of the map
    ///
    /// Flies outdoors from raw samples and counts what goes down, raw points and MAVLink messages beside it; then loses packets,
    /// lets them overtake each other, and damages bytes. docs/telemetry.md holds the tables.
    Telemetry(telemetry::Args),
    /// Training curves of the paper's network, K = 9, as a table and a plot
    ///
    /// Trains on the paper's protocol as `reproduce link-state` does; about two minutes of processor time. --rate 1 takes the paper's whole
    /// training set, 28.8 million links.
    Training(training::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.what {
        What::Attacks(args) => attacks::run(args),
        What::BeamSquint(args) => beam_squint::run(args),
        What::Complexity(args) => complexity::run(args),
        What::Flights(args) => flights::run(args),
        What::Localization(args) => localization::run(args),
        What::Link(args) => link::run(args),
        What::LinkState(args) => link_state::run(args),
        What::Maps(args) => maps::run(args),
        What::Pattern(args) => pattern::run(args),
        What::Points(args) => points::run(args),
        What::Telemetry(args) => telemetry::run(args),
        What::Training(args) => training::run(args),
    }
}
