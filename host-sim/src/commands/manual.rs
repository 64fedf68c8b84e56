//! `cslam man`: the manual pages, made of what `--help` says.

use std::io::Write;
use std::path::PathBuf;

use crate::input::InputError;
use crate::progress;

/// Arguments of `cslam man`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Write the page of every subcommand, cslam.1, cslam-fly.1 and so on, into this directory, made when missing; else the
    /// page of cslam goes to standard output
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

pub(crate) fn run(args: &Args, command: clap::Command) -> anyhow::Result<()> {
    let Some(out) = &args.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command).render(&mut page)?;
        std::io::stdout().lock().write_all(&page)?;
        return Ok(());
    };
    let cannot = |e: std::io::Error| InputError::in_file(out, format!("cannot hold the pages: {e}"));
    std::fs::create_dir_all(out).map_err(cannot)?;
    clap_mangen::generate_to(command.disable_help_subcommand(true), out).map_err(cannot)?;
    progress::note(format_args!("wrote the manual pages to {}", out.display()));
    Ok(())
}
