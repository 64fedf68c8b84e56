//! Frames that are lost, repeated or of another session are counted exactly.

use super::*;

#[test]
fn a_restarted_front_end_is_told_from_frames_under_way() {
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let mut samples = block(2);
    for found in [0, SESSION - 1] {
        let other = Header {
            session: found,
            ..header(Kind::Beam, 0, &samples)
        };
        let error = link.receive(&other.encode(), &mut samples).expect_err("foreign");
        assert_eq!(
            error,
            FrameError::Session {
                found,
                expected: SESSION
            }
        );
        let says_restarted = error.to_string().contains("restarted");
        assert_eq!(says_restarted, found == 0);
    }
    let first = header(Kind::Beam, 0, &samples);
    link.receive(&first.encode(), &mut samples).expect("sound");
    link.reopen(SESSION + 1);
    assert!(link.receive(&first.encode(), &mut samples).is_err());
    let next = Header {
        session: SESSION + 1,
        sequence: 2,
        dropped: 1,
        ..first
    };
    link.receive(&next.encode(), &mut samples).expect("sound");
    let expected = Counters {
        ok: 2,
        lost: 2,
        overrun: 1,
        foreign: 3,
        ..Counters::default()
    };
    assert_eq!(link.counters(), expected);
}

#[test]
fn what_the_front_end_dropped_is_counted_once() {
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let mut samples = block(2);
    let mut send = |sequence, dropped| {
        let header = Header {
            dropped,
            ..header(Kind::Begin, sequence, &block(2))
        };
        link.receive(&header.encode(), &mut samples).expect("sound");
        link.counters().overrun
    };
    assert_eq!(send(0, 0), 0);
    assert_eq!(send(6, 5), 5);
    assert_eq!(send(7, 5), 5);
    assert_eq!(send(5, 4), 5, "a late frame has an old count");
    assert_eq!(send(10, 7), 7);
}

#[derive(Clone, Copy, Debug)]
enum Fate {
    Sound,
    Drop,
    Twice,
    HeaderBit(u16),
    SampleBit(u32),
    Later(u8),
}

fn fate() -> impl Strategy<Value = Fate> {
    prop_oneof![
        6 => Just(Fate::Sound),
        1 => Just(Fate::Drop),
        1 => Just(Fate::Twice),
        1 => (0..8 * HEADER_LENGTH as u16).prop_map(Fate::HeaderBit),
        1 => (0..8 * SAMPLE_BYTES as u32).prop_map(Fate::SampleBit),
        1 => (1u8..20).prop_map(Fate::Later),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Frames lost, doubled, damaged and late, in any mixture: the counters say exactly what was done.
    #[test]
    fn counters_are_exact(fates in prop::collection::vec(fate(), 1..100)) {
        let sound = block(3);
        // What arrives: (number, header bit, sample bit), late ones put in further back.
        let mut arriving: Vec<(usize, u32, Option<u16>, Option<u32>)> = Vec::new();
        for (number, fate) in (0u32..).zip(&fates) {
            let at = 100 * number as usize;
            match *fate {
                Fate::Sound => arriving.push((at, number, None, None)),
                Fate::Drop => {}
                Fate::Twice => arriving.extend([(at, number, None, None), (at + 1, number, None, None)]),
                Fate::HeaderBit(bit) => arriving.push((at, number, Some(bit), None)),
                Fate::SampleBit(bit) => arriving.push((at, number, None, Some(bit))),
                Fate::Later(by) => arriving.push((at + 100 * usize::from(by) + 50, number, None, None)),
            }
        }
        arriving.sort_by_key(|(at, ..)| *at);
        let mut link = FrontEnd::new(SoftwareCrc, SESSION);
        let mut expected = Counters::default();
        let mut newest: Option<u32> = None;
        let mut given_on = 0;
        for (_, number, header_bit, sample_bit) in arriving {
            let mut samples = sound.clone();
            let mut bytes = header(Kind::Beam, number, &samples).encode();
            if let Some(bit) = header_bit {
                bytes[usize::from(bit / 8)] ^= 1 << (bit % 8);
                expected.damaged_header += 1;
            } else if let Some(bit) = sample_bit {
                let word = &mut samples.as_flattened_mut()[bit as usize / 32];
                *word = Iq::from_word(word.word() ^ 1 << (bit % 32));
                expected.damaged_payload += 1;
            } else if newest.is_none_or(|newest| number > newest) {
                expected.ok += 1;
                newest = Some(number);
            } else if newest == Some(number) {
                expected.repeated += 1;
            } else {
                expected.late += 1;
            }
            given_on += u32::from(link.receive(&bytes, &mut samples).is_ok());
        }
        prop_assert_eq!(given_on, expected.ok + expected.late);
        expected.lost = newest.map_or(0, |newest| newest + 1) - expected.ok - expected.late;
        prop_assert_eq!(link.counters(), expected);
    }
}
