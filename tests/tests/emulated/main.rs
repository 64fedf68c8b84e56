//! Boards that end, hang, and meet what cannot happen, under emulation: what a run leaves behind, and what its exit code says. That the
//! board sends the bytes that the host sends is the business of `cargo fw` (stage `loop`).
//!
//! These tests need QEMU and defmt-print, and fail with a line that says what to install when one is missing.

mod board;
mod faults;
mod ring_file;

use std::time::Duration;

use cslam_firmware::ring::{Producer, SharedMemory};
use cslam_firmware::sensor_stream;

use board::{Board, Exit};

/// A board that waits for a ring which nobody makes.
fn waiting(patience: Duration) -> Board {
    Board::start("receiver-an500", patience, &["lines"], |_| ())
}

#[test]
fn the_board_says_by_its_exit_code_how_it_ended() {
    for (mode, code, said) in [
        ("panic", 101, "panicked at"),
        ("fault", 102, "hard fault"),
        ("nonsense", 2, "expected: kernels, networks"),
    ] {
        let run = Board::start("checks-an500", board::PATIENCE, &[mode], |_| ()).wait();
        assert_eq!(
            run.exit,
            Exit::Code(code),
            "mode {mode}, the board's log:\n{}",
            run.log
        );
        assert!(run.log.contains(said), "mode {mode}: {}", run.log);
    }
}

#[test]
fn the_board_refuses_a_ring_of_another_version() {
    let run = Board::start("receiver-an500", board::PATIENCE, &["lines"], |file| {
        let records = file.from(sensor_stream::RECORDS_AT);
        let ring = Producer::<_, { sensor_stream::LENGTH }>::create(records, 32);
        assert!(ring.is_ok(), "the ring fits the memory");
        let mut records = file.from(sensor_stream::RECORDS_AT);
        records.write(4, &2_u32.to_le_bytes()).expect("inside");
    })
    .wait();
    assert_eq!(run.exit, Exit::Code(3), "the board's log:\n{}", run.log);
    assert!(run.log.contains("Version { found: 2 }"), "{}", run.log);
}

#[test]
fn a_board_that_does_not_end_is_ended() {
    let run = waiting(Duration::from_secs(1)).wait();
    assert_eq!(run.exit, Exit::TimedOut, "the board's log:\n{}", run.log);
}

#[test]
fn a_board_that_is_given_up_leaves_no_emulator_behind() {
    let board = waiting(board::PATIENCE);
    let group = board.group();
    // The emulator has made its output file as soon as it runs.
    board.wait_for_emulator();
    assert!(board::runs(group));
    drop(board);
    assert!(!board::runs(group), "process group {group} still runs");
}

#[test]
fn a_missing_emulator_is_said_in_one_line() {
    let nothing = tempfile::tempdir().expect("a temporary folder");
    let output = std::process::Command::new("/bin/bash")
        .arg(board::runner())
        .args(["mps2-an500", "image.elf"])
        .env("PATH", nothing.path())
        .output()
        .expect("bash starts");
    assert_eq!(output.status.code(), Some(127));
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(
        said.contains("qemu-system-arm is missing; install it with: apt-get install"),
        "{said}"
    );
}
