//! Commands of a stage, with an environment that cannot bend them.

use std::ffi::OsString;
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::{env, fs};

/// Variables that change what a build is. RUSTFLAGS, for one, would replace the flags in `.cargo/config.toml`, and the
/// image for the chip would silently lose its choice of processor.
const CLEARED: [&str; 10] = [
    "RUSTFLAGS",
    "CARGO_ENCODED_RUSTFLAGS",
    "CARGO_BUILD_RUSTFLAGS",
    "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUSTFLAGS",
    "CARGO_TARGET_THUMBV7EM_NONE_EABIHF_RUNNER",
    "CARGO_BUILD_TARGET",
    "RUSTDOCFLAGS",
    "CARGO_ENCODED_RUSTDOCFLAGS",
    "DEFMT_LOG",
    "PROPTEST_CASES",
];

/// The toolchain of rustup that the workspace's `rust-version` names.
pub(crate) const OLDEST_COMPILER: &str = env!("CARGO_PKG_RUST_VERSION");

/// One command and what must come of it.
pub(crate) struct Step {
    pub(crate) program: Program,
    pub(crate) arguments: &'static [&'static str],
    pub(crate) expect: Expect,
}

/// Which program a command runs.
pub(crate) enum Program {
    Cargo,
    /// The cargo of the oldest compiler that is promised, [`OLDEST_COMPILER`].
    OldestCargo,
    /// A binary that the stage `release` has built. `cargo run` would choose the features of its package alone, and build everything anew.
    Release(&'static str),
}

/// What must come of a command.
pub(crate) enum Expect {
    Success,
    /// Success of rustdoc with warnings as errors.
    CleanDocs,
    /// Success, and a file that it made is the committed one, byte for byte: first that, then this.
    Same(&'static str, &'static str),
    /// Failure, with this text in its messages: what the command asks for must be refused.
    Refusal(&'static str),
}

/// Runs a command, its output passed on.
pub(crate) fn run(step: &Step) -> Result<(), String> {
    let (name, mut command) = match step.program {
        Program::Cargo => ("cargo".to_owned(), tool(&cargo())),
        Program::OldestCargo => {
            let mut command = tool("rustup");
            command.args(["run", OLDEST_COMPILER, "cargo"]);
            (format!("rustup run {OLDEST_COMPILER} cargo"), command)
        }
        Program::Release(binary) => {
            let file = format!("target/release/{binary}");
            let command = tool(&file);
            (file, command)
        }
    };
    let line = format!("{name} {}", step.arguments.join(" "));
    println!("-- {line}");
    command.args(step.arguments);
    match step.expect {
        Expect::Success => status(&mut command, &line),
        Expect::CleanDocs => status(command.env("RUSTDOCFLAGS", "-D warnings"), &line),
        Expect::Same(made, committed) => {
            status(&mut command, &line)?;
            same(made, committed, &line)
        }
        Expect::Refusal(reason) => refusal(&mut command, &line, reason),
    }
}

/// Runs a command to its end.
pub(crate) fn status(command: &mut Command, line: &str) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}` ended with {status}")),
        Err(error) => Err(format!("`{line}` does not start: {error}")),
    }
}

/// Compares a file with the committed one.
fn same(made: &str, committed: &str, line: &str) -> Result<(), String> {
    let read = |file: &str| fs::read(file).map_err(|error| format!("{file} cannot be read: {error}"));
    if read(made)? == read(committed)? {
        return Ok(());
    }
    Err(format!(
        "{committed} is not what `{line}` makes: copy {made} over it"
    ))
}

fn refusal(command: &mut Command, line: &str, reason: &str) -> Result<(), String> {
    let output = command
        .output()
        .map_err(|error| format!("`{line}` does not start: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if output.status.success() {
        Err(format!("`{line}` was to be refused, and was not"))
    } else if said.contains(reason) {
        println!("refused, as it must be: {reason}");
        Ok(())
    } else {
        eprint!("{said}");
        Err(format!("`{line}` failed, but not because `{reason}`"))
    }
}

/// What a program prints, when it runs and succeeds.
pub(crate) fn output_of(program: &str, arguments: &[&str]) -> Option<String> {
    let output = tool(program)
        .args(arguments)
        .stderr(Stdio::null())
        .output()
        .ok()?;
    output
        .status
        .success()
        .then(|| String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A program with a clean environment, no input, and cargo's own programs on its path.
pub(crate) fn tool(program: &str) -> Command {
    let path = search_path();
    // The parent's path is what finds the program, so ask for it by its whole name where it is not on that path.
    let found = env::split_paths(&path)
        .map(|folder| folder.join(program))
        .find(|file| file.is_file());
    let mut command = Command::new(found.unwrap_or_else(|| PathBuf::from(program)));
    for name in CLEARED {
        command.env_remove(name);
    }
    command.env("PATH", path).stdin(Stdio::null());
    command
}

/// The path, with the folder that `cargo install` fills at its end.
fn search_path() -> OsString {
    let path = env::var_os("PATH").unwrap_or_default();
    let home = env::var_os("CARGO_HOME").map(PathBuf::from);
    let home = home.or_else(|| env::var_os("HOME").map(|home| PathBuf::from(home).join(".cargo")));
    let folders = env::split_paths(&path).chain(home.map(|home| home.join("bin")));
    env::join_paths(folders).unwrap_or(path)
}

/// The cargo that runs this program.
fn cargo() -> String {
    env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_of_the_caller_do_not_reach_a_command() {
        let command = tool("cargo");
        let removed = |name: &str| {
            command
                .get_envs()
                .any(|(key, value)| key == name && value.is_none())
        };
        assert!(CLEARED.iter().all(|name| removed(name)));
    }

    #[test]
    fn failures_say_which_command() {
        let error = status(&mut tool("false"), "false").expect_err("it fails");
        assert!(error.starts_with("`false` ended with exit status: 1"), "{error}");
        let error = status(&mut tool("no-such-program"), "no-such-program x").expect_err("it is not there");
        assert!(error.starts_with("`no-such-program x` does not start"), "{error}");
    }

    #[test]
    fn a_refusal_must_happen_and_for_the_stated_reason() {
        let shell = |script: &str| {
            let mut command = tool("bash");
            command.args(["-c", script]);
            command
        };
        assert_eq!(
            refusal(&mut shell("echo two boards >&2; exit 1"), "x", "two boards"),
            Ok(())
        );
        assert!(refusal(&mut shell("echo two boards >&2"), "x", "two boards").is_err());
        assert!(refusal(&mut shell("echo else; exit 1"), "x", "two boards").is_err());
    }

    #[test]
    fn output_is_only_taken_from_success() {
        assert_eq!(output_of("bash", &["-c", "echo yes"]).as_deref(), Some("yes\n"));
        assert_eq!(output_of("bash", &["-c", "echo no; exit 3"]), None);
        assert_eq!(output_of("no-such-program", &[]), None);
    }
}
