//! Command line: parsing, dispatch and exit codes.

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use crate::commands;
use crate::input::InputError;

/// A UAV that sees with radio: simulate its world, fly its receiver, look at its map.
///
/// Without a subcommand this flies (`cslam fly`).
#[derive(Parser, Debug)]
#[command(name = "cslam", version, max_term_width = 100)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand, Debug)]
enum Command {
    /// Time the host side: a table of speed figures
    Bench(commands::bench::Args),
    /// Solve the reflection point of each path of a paths file
    Solve(commands::solve::Args),
}

/// Runs the command line. Exit code 0 on success, 1 on an internal failure, 2 on bad input.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match cli.command {
        Some(Command::Bench(args)) => commands::bench::run(&args),
        Some(Command::Solve(args)) => commands::solve::run(&args),
        None => Ok(()),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("cslam: {error:#}");
            if error.downcast_ref::<InputError>().is_some() {
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}
