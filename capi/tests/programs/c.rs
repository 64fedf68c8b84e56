//! C on the host.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::recording::Recorded;
use crate::{ROOT, assert_success, built, is_there, page, printed, rust_example};

/// Random calls that are made under the sanitizers of the compiler.
const CALLS: &str = "1000000";
/// The same under valgrind, which sees into the library too.
const WATCHED_CALLS: &str = "5000";

/// The library for C programs, built by cargo.
fn library() -> PathBuf {
    let files = built(&["--package=cslam-c", "--lib"]);
    let archive = files.into_iter().find(|file| file.ends_with("libcslam_c.a"));
    archive.expect("libcslam_c.a among what cargo built")
}

/// Compiles a program of `capi` against the library.
fn compiled(source: &str, to: &Path, options: &[&str]) {
    let mut command = Command::new("cc");
    command
        .current_dir(Path::new(ROOT).join("capi"))
        .args([
            "-std=c11",
            "-O1",
            "-g",
            "-Wall",
            "-Wextra",
            "-Werror",
            "-D_GNU_SOURCE",
            "-DCSLAM_STD",
            "-Iinclude",
        ])
        // The library is given memory that is too short on purpose.
        .args(["-Wno-array-bounds", "-Wno-stringop-overflow"])
        .args(options)
        .arg(source)
        .arg(library())
        .args(["-lm", "-lpthread", "-ldl", "-o"])
        .arg(to);
    let output = command.output().expect("cc: a C compiler");
    assert_success(&command, &output);
}

#[test]
#[ignore = "builds in release mode and needs a C compiler: the stage capi runs it"]
fn c_prints_what_rust_and_the_command_print() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("estimate");
    compiled("examples/estimate.c", &program, &[]);
    let recorded = Recorded::new();
    let by_the_command = recorded.by_the_command();
    let meta = recorded.meta().to_str().expect("a name");
    assert_eq!(rust_example("estimate", &[meta]), by_the_command, "Rust");
    assert_eq!(printed(Command::new(&program).arg(meta)), by_the_command, "C");
    // Without a recording: an error, in words.
    let nothing = Command::new(&program)
        .arg("nowhere.sigmf-meta")
        .output()
        .expect("runs");
    assert!(
        !nothing.status.success()
            && String::from_utf8_lossy(&nothing.stderr).contains("expected a recording")
    );

    let program = folder.path().join("solve");
    compiled("examples/solve.c", &program, &[]);
    assert_eq!(printed(&mut Command::new(program)), rust_example("solve", &[]));
}

/// A task of a small system has few KiB: what is large must be built where it shall lie, not on the way there.
#[test]
#[ignore = "builds in release mode and needs a C compiler: the stage capi runs it"]
fn building_takes_little_stack() {
    let folder = tempfile::tempdir().expect("a folder");
    let program = folder.path().join("stack");
    compiled("tests/stack.c", &program, &[]);
    let printed = printed(&mut Command::new(program));
    print!("{printed}");
    let bytes_of = |what: &str| -> usize {
        let bytes = printed.lines().find_map(|line| line.strip_prefix(what));
        bytes.and_then(|bytes| bytes.parse().ok()).expect("a line of it")
    };
    for (call, most) in [
        ("cslam_estimator_init: ", 12 * 1024),
        ("cslam_receiver_init: ", 160 * 1024),
    ] {
        let bytes = bytes_of(call);
        assert!(bytes <= most, "{call}{bytes} bytes of stack, {most} at most");
    }
    let header = fs::read_to_string(Path::new(ROOT).join("capi/include/cslam.h")).expect("a header");
    for (size, text, place) in [
        ("cslam_estimator_size: ", &header, "an estimator takes: "),
        (
            "cslam_estimator_size: ",
            &page(),
            "an estimator in memory of yours, ",
        ),
        ("cslam_receiver_size: ", &header, "a receiver takes: "),
        (
            "cslam_receiver_size: ",
            &page(),
            "the whole receiver in memory of yours, ",
        ),
    ] {
        let said = text
            .split(place)
            .nth(1)
            .and_then(|rest| rest.split(" KiB").next());
        let said: usize = said
            .and_then(|number| number.parse().ok())
            .expect("a number of KiB");
        let bytes = bytes_of(size);
        // Enough, and no more than 2 % too much.
        let fits = said * 1024 >= bytes && (said - 1) * 1024 <= bytes + bytes / 50;
        assert!(fits, "{place}{said} KiB, and it takes {bytes} bytes");
    }
}

#[test]
#[ignore = "builds in release mode and needs a C compiler: the stage capi runs it"]
fn wrong_arguments_give_a_status() {
    let folder = tempfile::tempdir().expect("a folder");
    for (program, calls, watched_calls) in [
        ("misuse", &[][..], &[][..]),
        ("random_calls", &[CALLS, "2"][..], &[WATCHED_CALLS, "3"][..]),
    ] {
        let source = format!("tests/{program}.c");
        let sanitized = folder.path().join(format!("{program}-sanitized"));
        let with = ["-fsanitize=address,undefined", "-fno-sanitize-recover=all"];
        compiled(&source, &sanitized, &with);
        print!("{}", printed(Command::new(&sanitized).args(calls)));
        let plain = folder.path().join(program);
        compiled(&source, &plain, &[]);
        if is_there("valgrind") {
            let watch = ["--quiet", "--error-exitcode=9", "--leak-check=full"];
            printed(
                Command::new("valgrind")
                    .args(watch)
                    .arg(&plain)
                    .args(watched_calls),
            );
        } else {
            println!("valgrind is not here: {program} not watched");
            printed(Command::new(&plain).args(watched_calls));
        }
    }
}
