//! What the command line asks for.

use crate::stages::{STAGES, Stage};

/// Text of `--help`.
pub(crate) const HELP: &str = "\
Runs every check of this workspace, two at a time, and ends with a line per stage.

Usage: cargo verify [--only STAGE]... [--list] [--help]

  --only STAGE   run this stage and no other (may be repeated; set-up stages too must be named); one by itself prints what it does
  --list         print the stages and what they do
  --help         print this

The first stages install what is missing: the compiler's targets and components with rustup, QEMU, chromium and node with
apt-get, the log decoder with cargo install, Python packages with pip, JavaScript packages with npm. Nothing is skipped:
a stage that cannot run has failed. What a stage prints is in target/verify/STAGE.log; where it fails, on the terminal too.
Exit code: 0 when every stage has passed, 1 when one has not, 2 for a wrong argument.
";

/// What to do.
pub(crate) enum Request {
    Help,
    List,
    /// Run these stages, in the order of the table.
    Run(Vec<&'static Stage>),
}

/// Reads the arguments.
pub(crate) fn parse(arguments: impl IntoIterator<Item = String>) -> Result<Request, String> {
    let mut arguments = arguments.into_iter();
    let mut only = Vec::new();
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--help" | "-h" => return Ok(Request::Help),
            "--list" => return Ok(Request::List),
            "--only" => {
                let name = arguments
                    .next()
                    .ok_or("--only expects the name of a stage (see --list)")?;
                if !STAGES.iter().any(|stage| stage.name == name) {
                    return Err(format!("there is no stage `{name}` (see --list)"));
                }
                only.push(name);
            }
            _ => return Err(format!("unknown argument `{argument}` (see --help)")),
        }
    }
    let wanted = |stage: &&Stage| only.is_empty() || only.iter().any(|name| name == stage.name);
    Ok(Request::Run(STAGES.iter().filter(wanted).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(arguments: &[&str]) -> Result<Vec<&'static str>, String> {
        match parse(arguments.iter().map(|a| (*a).to_owned()))? {
            Request::Run(stages) => Ok(stages.iter().map(|stage| stage.name).collect()),
            Request::Help => Ok(vec!["help"]),
            Request::List => Ok(vec!["list"]),
        }
    }

    #[test]
    fn without_arguments_everything_runs() {
        assert_eq!(names(&[]).expect("sound").len(), STAGES.len());
    }

    #[test]
    fn chosen_stages_run_in_the_order_of_the_table() {
        assert_eq!(
            names(&["--only", "emulated", "--only", "fmt"]),
            Ok(vec!["fmt", "emulated"])
        );
    }

    #[test]
    fn mistakes_are_named() {
        assert!(
            names(&["--only", "fnt"])
                .expect_err("no such stage")
                .contains("`fnt`")
        );
        assert!(
            names(&["--only"])
                .expect_err("no name")
                .contains("--only expects")
        );
        assert!(
            names(&["fmt"])
                .expect_err("no option")
                .contains("unknown argument `fmt`")
        );
        assert_eq!(names(&["--help"]), Ok(vec!["help"]));
        assert_eq!(names(&["--list"]), Ok(vec!["list"]));
    }
}
