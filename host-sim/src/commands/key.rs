//! `cslam key`: the secrets of the links.

use std::path::PathBuf;

use clap::Subcommand;

use crate::link_key::{self, LinkKey};

/// Arguments of `cslam key`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Subcommand, Debug)]
enum What {
    /// Draw a new key and write it to a new file that only its owner may read
    New {
        /// The file, which must not exist
        file: PathBuf,
        /// Number of the UAV
        #[arg(long, value_name = "0-255")]
        uav: u8,
    },
    /// Check a key file and print its fingerprint, which says whether two files hold the same key
    Check {
        /// The file
        file: PathBuf,
    },
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let (file, LinkKey { uav, key }) = match &args.what {
        What::New { file, uav } => (file, link_key::create(file, *uav)?),
        What::Check { file } => (file, link_key::read(file)?),
    };
    let print: Vec<String> = key
        .fingerprint()
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    println!("{}: UAV {uav}, fingerprint {}", file.display(), print.join(":"));
    Ok(())
}
