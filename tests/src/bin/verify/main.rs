//! Every check there is, in one command: `cargo verify`.
//!
//! Sets up what the checks need, runs them two at a time, and ends with a line per stage. A stage that could not run has
//! failed: there is no skipping. See `cargo verify --help`.

mod arguments;
mod command;
mod lanes;
mod report;
mod setup;
mod stages;

use std::env;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use arguments::{Request, parse};
use report::{Outcome, Report};
use stages::{STAGES, Stage, Work};

fn main() -> ExitCode {
    let chosen = match parse(env::args().skip(1)) {
        Ok(Request::Help) => {
            print!("{}", arguments::HELP);
            return ExitCode::SUCCESS;
        }
        Ok(Request::List) => {
            for stage in STAGES {
                println!("{:<16}{}", stage.name, stage.what);
            }
            return ExitCode::SUCCESS;
        }
        Ok(Request::Run(chosen)) => chosen,
        Err(message) => {
            eprintln!("verify: {message}");
            return ExitCode::from(2);
        }
    };
    if let Err(error) = env::set_current_dir(root()) {
        eprintln!("verify: cannot enter {}: {error}", root().display());
        return ExitCode::FAILURE;
    }
    let report = match chosen[..] {
        // One by itself is watched.
        [stage] => {
            let (mut report, started) = (Report::new(&[stage]), Instant::now());
            let outcome = run(stage);
            report.add(stage.name, outcome, started.elapsed());
            report
        }
        _ => match lanes::run_all(&chosen) {
            Ok(report) => report,
            Err(error) => {
                eprintln!("verify: the stages cannot be started: {error}");
                return ExitCode::FAILURE;
            }
        },
    };
    print!("\n{report}");
    if report.passed() {
        ExitCode::SUCCESS
    } else {
        ExitCode::FAILURE
    }
}

/// Runs a stage here and now, its output passed on.
fn run(stage: &Stage) -> Outcome {
    println!("== {}: {}", stage.name, stage.what);
    let result = match stage.work {
        Work::SetUp(set_up) => set_up(),
        Work::Steps(steps) => steps.iter().try_for_each(command::run),
    };
    match result {
        Ok(()) => Outcome::Passed,
        Err(reason) => {
            println!("== {} FAILED: {reason}", stage.name);
            Outcome::Failed(reason)
        }
    }
}

/// Root of the workspace: where cargo says this package is, or where it was built.
fn root() -> PathBuf {
    let package = env::var_os("CARGO_MANIFEST_DIR").unwrap_or_else(|| env!("CARGO_MANIFEST_DIR").into());
    PathBuf::from(package).join("..")
}
