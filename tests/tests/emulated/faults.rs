//! What cannot happen happens: a record survives the reset, and the next start tells the ground.

use cslam_core::telemetry::{Decoder, Event, EventReport, Key, Message, ResetCause};
use cslam_firmware::sensor_stream::UAV;

use crate::board::{Board, Exit, PATIENCE};

/// Deadline of the task that hangs, and how long it goes round before, ms.
const DEADLINE_MS: u32 = 50;

/// Every message of a stream, none of which may be damaged.
fn messages(bytes: &[u8]) -> Vec<Message> {
    let mut decoder = Decoder::new(UAV, &Key::TEST);
    let packets = bytes.iter().filter_map(|byte| decoder.push(*byte));
    packets
        .map(|packet| packet.expect("no packet is damaged").message)
        .collect()
}

#[test]
fn a_panic_a_fault_a_hang_and_a_stack_too_small_are_recorded_and_told_after_the_reset() {
    for (mode, stage, cause, said) in [
        ("panic", 1, ResetCause::Panic, "a panic in stage 1"),
        ("fault", 2, ResetCause::Fault, "called from"),
        (
            "hang",
            3,
            ResetCause::Watchdog,
            "task `tested` has made no progress",
        ),
        ("overflow", 4, ResetCause::Fault, "the stack overflowed"),
    ] {
        let run = Board::start("faults-an500", PATIENCE, &[mode], |_| ()).wait();
        let log = &run.log;
        assert_eq!(run.exit, Exit::Code(0), "{mode}: the board's log:\n{log}");
        assert!(
            log.contains("the program before ended") && log.contains(said),
            "{mode}: {log}"
        );
        let messages = messages(&run.uart1);
        let [
            Message::Event(EventReport {
                event: Event::Reset(record),
                ..
            }),
        ] = messages.as_slice()
        else {
            panic!("{mode}: {messages:?}");
        };
        assert_eq!((record.cause, record.stage), (cause, stage), "{mode}");
        assert!(record.uptime_ms >= 2 * DEADLINE_MS, "{mode}: {record:?}");
        match mode {
            // The instruction that is none, in flash behind the vector table.
            "fault" => assert!((0x400..0x20_0000).contains(&record.program_counter), "{record:?}"),
            // The task's number; it was given its deadline, and no more than a look beyond.
            "hang" => {
                assert_eq!(record.program_counter, 1);
                let waited_ms = record.uptime_ms - 2 * DEADLINE_MS;
                assert!((DEADLINE_MS..DEADLINE_MS + 5).contains(&waited_ms), "{record:?}");
            }
            _ => assert_eq!(record.program_counter, 0),
        }
    }
}

#[test]
fn a_record_of_another_cause_is_noticed() {
    let run = Board::start("faults-an500", PATIENCE, &["nonsense"], |_| ()).wait();
    assert_eq!(run.exit, Exit::Code(2), "the board's log:\n{}", run.log);
}
