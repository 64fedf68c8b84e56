//! The firmware on an emulated Cortex-M7 against the same library on the host.
//!
//! A stream of measurements goes through a small ring in memory that QEMU shares with this process as a file; what the
//! board sends on UART1 goes to another file. The golden run takes the same stream through the same library half here.
//! Both must be the same bytes.
//!
//! These tests need QEMU and defmt-print, and fail with a line that says what to install when one is missing.

mod board;
mod compare;
mod golden;
mod ring_file;
mod stream;

use std::time::Duration;

use cslam_core::telemetry::{Message, PathOutcome};
use cslam_firmware::ring::SharedMemory;

use board::{Board, Exit};
use ring_file::RingFile;

/// Slots of the ring: much fewer than there are records, so that it fills and wraps.
const SLOTS: u32 = 32;

#[test]
fn the_chip_sends_the_bytes_that_the_host_sends() {
    let records = stream::records();
    let measurements = records.len() - 1;
    assert!(measurements >= 1000, "only {measurements} measurements");
    let golden = golden::run(&records);

    let mut board = Board::start(&["receive"], |memory| RingFile::producer(memory, SLOTS));
    let fed = board.feed(&records);
    let run = board.wait();
    assert_eq!(run.exit, Exit::Code(0), "the board's log:\n{}", run.log);
    if let Some(difference) = compare::first_difference(&golden.bytes, &run.uart1) {
        panic!("{difference}\nthe board's log:\n{}", run.log);
    }

    // What was compared is worth comparing: every outcome occurs, and the ring wrapped and was full.
    let outcomes = &golden.outcomes;
    assert!(outcomes.points > 500 && outcomes.rejected > 500, "{outcomes:?}");
    assert!(
        outcomes.invalid >= 20 && outcomes.blocks_damaged >= 20,
        "{outcomes:?}"
    );
    assert!(
        fed.full > 0,
        "the ring was never full: no back-pressure was tested"
    );
    assert_eq!(fed.records as usize, records.len());
    assert!(fed.records > 20 * SLOTS, "the ring wrapped too few times");
    let messages = compare::messages(&run.uart1);
    let told = messages.iter().map(|message| match message {
        Message::Link(link) => {
            let told = link
                .outcomes
                .iter()
                .filter(|outcome| **outcome != PathOutcome::Missing);
            told.count()
        }
        _ => 0,
    });
    assert_eq!(
        told.sum::<usize>(),
        measurements - outcomes.blocks_damaged as usize
    );
    let points = messages.iter().map(|message| match message {
        Message::Points(points) => points.len(),
        _ => 0,
    });
    assert_eq!(points.sum::<usize>(), outcomes.points as usize);
    let Some(Message::Health(last)) = messages.last() else {
        panic!("the last packet is not the counters")
    };
    assert_eq!(
        (last.counters.points, last.counters.rejected),
        (outcomes.points, outcomes.rejected)
    );
    assert_eq!(last.counters.packets_sent as usize, messages.len() - 1);
    println!(
        "{measurements} measurements, {} bytes equal, ring of {SLOTS} slots full {} times; {outcomes:?}",
        golden.bytes.len(),
        fed.full,
    );
}

#[test]
fn the_board_passes_its_self_test() {
    let run = Board::start(&[], |_| ()).wait();
    assert_eq!(run.exit, Exit::Code(0), "the board's log:\n{}", run.log);
    assert!(run.log.contains("self-test passed"), "{}", run.log);
    // The sweep, its point, the counters.
    assert_eq!(compare::messages(&run.uart1).len(), 3);
}

#[test]
fn the_board_says_by_its_exit_code_how_it_ended() {
    for (mode, code, said) in [
        ("panic", 101, "panicked at"),
        ("fault", 102, "hard fault"),
        ("nonsense", 2, "one argument is expected"),
    ] {
        let run = Board::start(&[mode], |_| ()).wait();
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
    let board = Board::start(&["receive"], |mut memory| {
        let producer = RingFile::producer(memory.view(), SLOTS);
        memory.write(4, &2_u32.to_le_bytes()).expect("inside");
        producer
    });
    let run = board.wait();
    assert_eq!(run.exit, Exit::Code(3), "the board's log:\n{}", run.log);
    assert!(run.log.contains("Version { found: 2 }"), "{}", run.log);
}

#[test]
fn the_board_notices_records_that_never_arrived() {
    let mut records = stream::records();
    records.drain(5..records.len() - 1);
    let mut board = Board::start(&["receive"], |memory| RingFile::producer(memory, SLOTS));
    board.feed(&records);
    let run = board.wait();
    assert_eq!(run.exit, Exit::Code(5), "the board's log:\n{}", run.log);
    let missing = stream::records().len() - records.len();
    assert!(run.log.contains(&format!("missing: {missing},")), "{}", run.log);
}

#[test]
fn a_board_that_does_not_end_is_ended() {
    // No ring is ever made: the board would wait for it for 20 s.
    let run = Board::start_within(Duration::from_secs(1), &["receive"], |_| ()).wait();
    assert_eq!(run.exit, Exit::TimedOut, "the board's log:\n{}", run.log);
}

#[test]
fn a_board_that_is_given_up_leaves_no_emulator_behind() {
    let board = Board::start(&["receive"], |_| ());
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
