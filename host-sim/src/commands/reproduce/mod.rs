//! `cslam reproduce`: the paper's figures and tables, ours beside the printed values. One file a name.

use clap::Subcommand;

mod lscn;

/// Arguments of `cslam reproduce`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which figure; all of them when absent
    #[command(subcommand)]
    name: Option<Name>,
}

#[derive(Subcommand, Debug)]
enum Name {
    /// Link state: accuracy of the paper's network against K, of the geometric networks, and the map's precision
    ///
    /// Trains the paper's network for K = 1, 3, 5, 9 and 15 on the paper's protocol, and scores the models that come with
    /// the program on links that they have not seen. Takes about ten minutes of processor time.
    Lscn(lscn::Args),
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    match &args.name {
        Some(Name::Lscn(args)) => lscn::run(args),
        None => lscn::run(&lscn::Args::default()),
    }
}
