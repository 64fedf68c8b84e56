//! The ring, from both ends and on damaged memory.

mod common;

use common::Memory;
use cslam_firmware::ring::{
    AccessError, Consumer, HEADER_LENGTH, Producer, RingError, SharedMemory, region_length,
};
use proptest::prelude::*;

const SLOT: usize = 12;
type Writer = Producer<Memory, SLOT>;
type Reader = Consumer<Memory, SLOT>;

fn record(number: u32) -> [u8; SLOT] {
    let mut bytes = [0xa5; SLOT];
    bytes[4..8].copy_from_slice(&number.to_le_bytes());
    bytes
}

fn pop(reader: &mut Reader) -> Option<[u8; SLOT]> {
    let mut bytes = [0; SLOT];
    reader.pop(&mut bytes).expect("sound").then_some(bytes)
}

/// Memory that just holds a ring of `slots` slots, and its writer.
fn ring(slots: u32) -> (Memory, Writer) {
    let memory = Memory::new(region_length(SLOT, slots).expect("sound"));
    let writer = Writer::create(memory.clone(), slots).expect("fits");
    (memory, writer)
}

fn poke(memory: &Memory, at: usize, word: u32) {
    memory.clone().write(at, &word.to_le_bytes()).expect("inside");
}

fn poke_index(memory: &Memory, at: usize, index: u32) {
    poke(memory, at, index);
    poke(memory, at + 4, !index);
}

#[test]
fn records_come_out_in_order_over_many_turns() {
    let (memory, mut writer) = ring(4);
    let mut reader = Reader::open(memory).expect("ready");
    for number in 0..50 {
        assert!(writer.push(&record(2 * number)).expect("sound"));
        assert!(writer.push(&record(2 * number + 1)).expect("sound"));
        assert_eq!(pop(&mut reader), Some(record(2 * number)));
        assert_eq!(pop(&mut reader), Some(record(2 * number + 1)));
    }
    assert_eq!(pop(&mut reader), None);
}

#[test]
fn a_full_ring_takes_nothing_and_loses_nothing() {
    let (memory, mut writer) = ring(4);
    let mut reader = Reader::open(memory.clone()).expect("ready");
    for number in 0..4 {
        assert!(writer.push(&record(number)).expect("sound"));
    }
    let before = memory.bytes();
    assert!(!writer.push(&record(99)).expect("sound"));
    assert_eq!(memory.bytes(), before);
    assert_eq!(pop(&mut reader), Some(record(0)));
    assert!(writer.push(&record(4)).expect("sound"));
    let rest: Vec<_> = std::iter::from_fn(|| pop(&mut reader)).collect();
    assert_eq!(rest, [1, 2, 3, 4].map(record));
}

#[test]
fn an_empty_ring_leaves_the_buffer_alone() {
    let (memory, _writer) = ring(2);
    let mut reader = Reader::open(memory).expect("ready");
    let mut bytes = [7; SLOT];
    assert_eq!(reader.pop(&mut bytes), Ok(false));
    assert_eq!(bytes, [7; SLOT]);
}

#[test]
fn indices_wrap_at_32_bits_and_both_ends_resume() {
    let (memory, _) = ring(4);
    poke_index(&memory, 32, u32::MAX - 1);
    poke_index(&memory, 64, u32::MAX - 1);
    let mut writer = Writer::open(memory.clone()).expect("ready");
    let mut reader = Reader::open(memory.clone()).expect("ready");
    for number in 0..4 {
        assert!(writer.push(&record(number)).expect("sound"));
    }
    assert!(!writer.push(&record(4)).expect("sound"));
    assert_eq!(pop(&mut reader), Some(record(0)));
    assert_eq!(pop(&mut reader), Some(record(1)));
    // Both ends again: from where they stopped, with the head beyond the wrap.
    let mut writer = Writer::open(memory.clone()).expect("ready");
    let mut reader = Reader::open(memory).expect("ready");
    assert!(writer.push(&record(5)).expect("sound"));
    let rest: Vec<_> = std::iter::from_fn(|| pop(&mut reader)).collect();
    assert_eq!(rest, [2, 3, 5].map(record));
}

#[test]
fn the_header_is_laid_out_as_documented() {
    let (memory, mut writer) = ring(4);
    assert!(writer.push(&record(0x0102_0304)).expect("sound"));
    let bytes = memory.bytes();
    assert_eq!(bytes[..16], *b"CSLR\x01\0\0\0\x0c\0\0\0\x04\0\0\0");
    assert_eq!(bytes[32..40], [1, 0, 0, 0, 0xfe, 0xff, 0xff, 0xff]);
    assert_eq!(bytes[64..72], [0, 0, 0, 0, 0xff, 0xff, 0xff, 0xff]);
    assert_eq!(HEADER_LENGTH, 128);
    assert_eq!(bytes[128..140], record(0x0102_0304));
}

#[test]
fn a_foreign_or_damaged_header_is_named() {
    let open = |at: usize, word: u32| {
        let (memory, _) = ring(4);
        poke(&memory, at, word);
        Reader::open(memory).expect_err("damaged")
    };
    assert_eq!(open(0, 0), RingError::NotReady);
    assert_eq!(open(4, 2), RingError::Version { found: 2 });
    assert_eq!(
        open(8, 16),
        RingError::SlotSize {
            found: 16,
            expected: 12
        }
    );
    assert_eq!(open(12, 0), RingError::SlotCount { found: 0 });
    assert_eq!(open(12, 3), RingError::SlotCount { found: 3 });
    assert_eq!(open(12, 8), RingError::TooLarge);
    assert_eq!(open(12, 1 << 31), RingError::TooLarge);
    // Its own index, which nobody else may write.
    assert_eq!(open(64, 1), RingError::IndexDamaged);
}

#[test]
fn memory_too_small_for_a_header_is_no_ring() {
    assert_eq!(
        Reader::open(Memory::new(3)).err(),
        Some(RingError::Access(AccessError::OutOfRange))
    );
    let needed = region_length(SLOT, 4).expect("sound");
    assert_eq!(
        Writer::create(Memory::new(needed - 1), 4).err(),
        Some(RingError::TooLarge)
    );
    assert_eq!(
        Writer::create(Memory::new(needed), 5).err(),
        Some(RingError::SlotCount { found: 5 })
    );
}

#[test]
fn impossible_indices_stop_both_ends() {
    let (memory, mut writer) = ring(4);
    let mut reader = Reader::open(memory.clone()).expect("ready");
    poke_index(&memory, 32, 5);
    assert_eq!(
        reader.pop(&mut [0; SLOT]),
        Err(RingError::Indices { head: 5, tail: 0 })
    );
    poke_index(&memory, 64, 1);
    assert_eq!(
        writer.push(&record(0)),
        Err(RingError::Indices { head: 0, tail: 1 })
    );
}

#[test]
fn a_half_written_index_is_not_believed_and_not_for_ever() {
    let (memory, mut writer) = ring(4);
    let mut reader = Reader::open(memory.clone()).expect("ready");
    assert!(writer.push(&record(1)).expect("sound"));
    // The writer's value has changed, its complement has not yet: neither empty nor five records.
    poke(&memory, 32, 2);
    assert_eq!(pop(&mut reader), None);
    poke(&memory, 36, !2);
    assert_eq!(pop(&mut reader), Some(record(1)));
    // One that stays so is damage.
    poke(&memory, 36, 0);
    let mut polls = 0_u32;
    let error = loop {
        match reader.pop(&mut [0; SLOT]) {
            Ok(taken) => assert!(!taken),
            Err(error) => break error,
        }
        polls += 1;
        assert!(polls < 1 << 21, "never found out");
    };
    assert_eq!(error, RingError::IndexDamaged);
    assert!(polls > 1 << 19, "too soon for a writer that was merely suspended");
}

#[test]
fn memory_that_fails_is_said_to() {
    let (memory, mut writer) = ring(4);
    let mut reader = Reader::open(memory.clone()).expect("ready");
    memory.break_down();
    assert_eq!(
        writer.push(&record(0)),
        Err(RingError::Access(AccessError::Failed))
    );
    assert_eq!(
        reader.pop(&mut [0; SLOT]),
        Err(RingError::Access(AccessError::Failed))
    );
}

proptest! {
    /// Against a queue of the standard library, for any order of pushes and pops.
    #[test]
    fn equals_a_bounded_queue(operations in prop::collection::vec(any::<bool>(), 0..300), exponent in 0_u32..4) {
        let slots = 1 << exponent;
        let (memory, mut writer) = ring(slots);
        let mut reader = Reader::open(memory).expect("ready");
        let mut model = std::collections::VecDeque::new();
        for (number, push) in (0_u32..).zip(operations) {
            if push {
                let room = model.len() < slots as usize;
                prop_assert_eq!(writer.push(&record(number)), Ok(room));
                if room {
                    model.push_back(record(number));
                }
            } else {
                prop_assert_eq!(pop(&mut reader), model.pop_front());
            }
        }
    }

    /// Whatever the other party leaves in the header: a typed error or a working ring, never a panic or a wild access.
    #[test]
    fn any_header_is_survived(
        geometry in prop::array::uniform2(any_word()),
        indices in prop::array::uniform2(any_word()),
        damage in prop::option::of((0_usize..18, any_word())),
    ) {
        let (memory, _) = ring(4);
        poke(&memory, 8, geometry[0]);
        poke(&memory, 12, geometry[1]);
        poke_index(&memory, 32, indices[0]);
        poke_index(&memory, 64, indices[1]);
        if let Some((word, value)) = damage {
            poke(&memory, 4 * word, value);
        }
        if let Ok(mut reader) = Reader::open(memory.clone()) {
            let _ = reader.pop(&mut [0; SLOT]);
        }
        if let Ok(mut writer) = Writer::open(memory) {
            let _ = writer.push(&record(0));
        }
    }
}

/// Words that headers go wrong by, and any other.
fn any_word() -> impl Strategy<Value = u32> {
    prop_oneof![
        4 => prop::sample::select(vec![0, 1, 2, 3, 4, 5, SLOT as u32]),
        1 => prop::sample::select(vec![1 << 31, u32::MAX - 1, u32::MAX]),
        1 => any::<u32>(),
    ]
}
