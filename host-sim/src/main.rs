//! The `cslam` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    cslam_host_sim::cli::main()
}
