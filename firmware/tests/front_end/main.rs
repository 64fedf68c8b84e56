//! Frames of the capture front end: what is sound comes through in place, what is not is named and counted.

mod counters;

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{
    Arrival, BEAMS, Block, Checksum, Content, Counters, FRAMES_PER_SWEEP, FrameError, FrontEnd,
    HEADER_LENGTH, Header, Kind, MOST_FRAMES, PILOT_BEAMS, PILOTS_OF_A_BEAM, POWER_BYTES, Powers,
    SAMPLE_BYTES, SQUINT_SYMBOLS, SoftwareCrc, Status, WINDOW, powers_checksum, read_samples, write_powers,
    write_samples,
};
use proptest::prelude::*;

const SESSION: u16 = 7;

fn block(seed: u32) -> Box<Block> {
    let mut block: Box<Block> = vec![[Iq::ZERO; 512]; 32].try_into().expect("32 channels");
    let mut word = seed;
    block.as_flattened_mut().fill_with(|| {
        word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        Iq::from_word(word)
    });
    block
}

fn header(kind: Kind, sequence: u32, samples: &Block) -> Header {
    Header {
        kind,
        session: SESSION,
        sequence,
        sweep: sequence / u32::from(FRAMES_PER_SWEEP),
        index: 3,
        exponent: -38,
        sweep_ns: 123_456_789_012,
        offset_ns: 4_000,
        powers: false,
        payload_checksum: match kind {
            Kind::Begin => 0,
            _ => SoftwareCrc.samples(samples),
        },
        dropped: 0,
        status: Status(0),
    }
}

/// The header's bytes with some changed and the checksum made to fit.
fn altered(header: &Header, at: usize, bytes: &[u8]) -> [u8; HEADER_LENGTH] {
    let mut altered = header.encode();
    altered[at..at + bytes.len()].copy_from_slice(bytes);
    let checksum = SoftwareCrc.bytes(&altered[..HEADER_LENGTH - 4]);
    altered[HEADER_LENGTH - 4..].copy_from_slice(&checksum.to_le_bytes());
    altered
}

#[test]
fn a_header_has_the_layout_of_the_document() {
    let bytes = Header {
        kind: Kind::Squint,
        session: 0x0102,
        sequence: 0x0304_0506,
        sweep: 0x0708_090a,
        index: 0x0020,
        exponent: -2,
        sweep_ns: 0x1112_1314_1516_1718,
        offset_ns: 0x4142_4344,
        powers: false,
        payload_checksum: 0x2122_2324,
        dropped: 0x3132_3334,
        status: Status(Status::CLIPPED | Status::UNTIMED),
    }
    .encode();
    #[rustfmt::skip]
    let expected = [
        b'C', b'S', b'L', b'F', 2, 3, 2, 1, 6, 5, 4, 3, 0xa, 9, 8, 7, 0x20, 0, 0xfe, 0xff, 0, 0, 1, 0,
        0x18, 0x17, 0x16, 0x15, 0x14, 0x13, 0x12, 0x11, 0x24, 0x23, 0x22, 0x21, 0x34, 0x33, 0x32, 0x31, 5, 0,
        0, 0, 0x44, 0x43, 0x42, 0x41,
    ];
    assert_eq!(bytes[..48], expected);
    assert!(bytes[48..60].iter().all(|byte| *byte == 0));
    // By an implementation that is not ours: binascii.crc32 of Python over bytes 0..60.
    assert_eq!(bytes[60..], 0xf3ff_7937u32.to_le_bytes());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]
    #[test]
    fn every_header_survives(
        kind in 0usize..4, powers: bool, session: u16, sequence: u32, sweep: u32, index in 0u16..33, exponent in -128i16..=128,
        sweep_ns: u64, offset_ns: u32, payload_checksum: u32, dropped: u32, status: u16,
    ) {
        let header = Header {
            kind: [Kind::Begin, Kind::Beam, Kind::Squint, Kind::Pilot][kind],
            session, sequence, sweep, index, exponent, sweep_ns, offset_ns, payload_checksum, dropped,
            powers: powers && kind == 0,
            status: Status(status),
        };
        prop_assert_eq!(Header::decode(&header.encode()), Ok(header));
    }

    /// Whatever a sender with the right checksum writes: what passes is what it wrote.
    #[test]
    fn hostile_headers_are_read_as_they_are_or_refused(
        kind in 0u8..6, powers: bool, index in 0u16..260, bytes: [[u8; 32]; 2],
    ) {
        let mut bytes = bytes.as_flattened().to_vec();
        bytes[..6].copy_from_slice(&[b'C', b'S', b'L', b'F', 2, kind]);
        bytes[16..18].copy_from_slice(&index.to_le_bytes());
        let exponent = i16::from(bytes[18] as i8);
        bytes[18..20].copy_from_slice(&exponent.to_le_bytes());
        let length = match (kind, powers) {
            (1, false) => 0,
            (1, true) => POWER_BYTES as u32,
            _ => SAMPLE_BYTES as u32,
        };
        bytes[20..24].copy_from_slice(&length.to_le_bytes());
        let checksum = SoftwareCrc.bytes(&bytes[..HEADER_LENGTH - 4]);
        bytes[HEADER_LENGTH - 4..].copy_from_slice(&checksum.to_le_bytes());
        let limit = [0, MOST_FRAMES, BEAMS, SQUINT_SYMBOLS, PILOTS_OF_A_BEAM * BEAMS, 0][usize::from(kind)];
        let read = Header::decode(bytes[..].try_into().expect("64 bytes"));
        prop_assert_eq!(read.is_ok(), index < limit);
        if let Ok(header) = read {
            prop_assert_eq!(&header.encode()[..42], &bytes[..42]);
        }
    }
}

#[test]
fn no_changed_bit_of_a_header_passes() {
    let sound = header(Kind::Beam, 9, &block(1));
    for bit in 0..8 * HEADER_LENGTH {
        let mut bytes = sound.encode();
        bytes[bit / 8] ^= 1 << (bit % 8);
        let error = Header::decode(&bytes).expect_err("a bit has changed");
        let expected = if bit < 32 {
            matches!(error, FrameError::Magic { .. })
        } else {
            error == FrameError::HeaderChecksum
        };
        assert!(expected, "bit {bit}: {error}");
    }
}

#[test]
fn each_field_out_of_range_is_named() {
    let beam = header(Kind::Beam, 0, &block(1));
    let of = |at, bytes: &[u8]| Header::decode(&altered(&beam, at, bytes)).expect_err("out of range");
    for found in [1, 3] {
        assert_eq!(of(4, &[found]), FrameError::Version { found });
    }
    for found in [0, 5] {
        assert_eq!(of(5, &[found]), FrameError::Kind { found });
    }
    assert_eq!(
        of(16, &BEAMS.to_le_bytes()),
        FrameError::Index {
            kind: Kind::Beam,
            found: 72,
            limit: 72
        }
    );
    assert_eq!(of(18, &129i16.to_le_bytes()), FrameError::Exponent { found: 129 });
    assert_eq!(
        of(18, &i16::MIN.to_le_bytes()),
        FrameError::Exponent { found: i16::MIN }
    );
    assert_eq!(
        of(20, &65_532u32.to_le_bytes()),
        FrameError::Length {
            found: 65_532,
            expected: 65_536
        }
    );
    // Pilots of all beams, each twice.
    let limits = [(Kind::Squint, 33), (Kind::Pilot, 144), (Kind::Begin, 250)];
    for (kind, limit) in limits {
        let last = Header {
            index: limit - 1,
            ..header(kind, 0, &block(1))
        };
        assert_eq!(Header::decode(&last.encode()), Ok(last));
        let beyond = Header { index: limit, ..last };
        assert!(matches!(
            Header::decode(&beyond.encode()),
            Err(FrameError::Index { found, .. }) if found == limit
        ));
    }
}

#[test]
fn samples_are_given_on_where_they_lie() {
    let mut samples = block(5);
    let original = samples.clone();
    let place = samples.as_ptr();
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let bytes = header(Kind::Beam, 0, &samples).encode();
    let frame = link.receive(&bytes, &mut samples).expect("sound");
    assert_eq!(frame.arrival, Arrival::Newest { missing: 0 });
    assert_eq!(frame.header.sweep_ns, 123_456_789_012);
    assert_eq!(frame.header.sweep, 0);
    let Content::Beam(block) = frame.content else {
        panic!("a beam was sent");
    };
    assert_eq!((block.beam, block.exponent), (3, -38));
    assert_eq!(block.samples.as_ptr(), place);
    assert_eq!(block.samples, &*original);
}

#[test]
fn a_pilot_says_which_beam_and_which_of_the_two_it_is() {
    assert_eq!((PILOT_BEAMS, PILOTS_OF_A_BEAM, FRAMES_PER_SWEEP), (12, 2, 130));
    let mut samples = block(5);
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    for (sequence, index) in [(0, 3), (1, 72 + 3), (2, 143)] {
        let pilot = Header {
            index,
            ..header(Kind::Pilot, sequence, &samples)
        };
        let bytes = pilot.encode();
        assert_eq!((bytes[5], bytes[16]), (4, index as u8));
        let original = samples.clone();
        let frame = link.receive(&bytes, &mut samples).expect("sound");
        assert_eq!(frame.header, pilot);
        let Content::Pilot(block) = frame.content else {
            panic!("a pilot was sent");
        };
        assert_eq!((block.beam, block.exponent), (index, -38));
        assert_eq!(block.samples, &*original);
    }
    let beyond = Header {
        index: 144,
        ..header(Kind::Pilot, 3, &samples)
    };
    let error = link
        .receive(&beyond.encode(), &mut samples)
        .expect_err("no such beam");
    assert_eq!(
        error,
        FrameError::Index {
            kind: Kind::Pilot,
            found: 144,
            limit: 144
        }
    );
    // Its samples are under the checksum like a beam's.
    let damaged = header(Kind::Pilot, 3, &samples).encode();
    samples[31][511] = Iq::from_word(samples[31][511].word() ^ 1);
    let error = link.receive(&damaged, &mut samples).expect_err("damaged");
    assert_eq!(error, FrameError::PayloadChecksum { sequence: 3 });
    let expected = Counters {
        ok: 3,
        damaged_header: 1,
        damaged_payload: 1,
        ..Counters::default()
    };
    assert_eq!(link.counters(), expected);
}

#[test]
fn samples_survive_as_bytes_low_byte_of_the_real_part_first() {
    let mut samples = block(6);
    samples[0][0] = Iq::new(0x0102, 0x0304);
    samples[31][511] = Iq::new(-2, 5);
    let mut bytes = vec![0; SAMPLE_BYTES];
    let bytes: &mut [u8; SAMPLE_BYTES] = bytes.as_mut_slice().try_into().expect("as many bytes");
    write_samples(&samples, bytes);
    assert_eq!(bytes[..4], [2, 1, 4, 3]);
    assert_eq!(bytes[SAMPLE_BYTES - 4..], [0xfe, 0xff, 5, 0]);
    let mut again = block(0);
    read_samples(bytes, &mut again);
    assert_eq!(again, samples);
}

#[test]
fn a_begin_needs_no_samples_and_says_how_many_frames_follow() {
    let mut samples = block(8);
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let begin = Header {
        index: 129,
        ..header(Kind::Begin, 0, &samples)
    };
    let frame = link.receive(&begin.encode(), &mut samples).expect("sound");
    assert!(matches!(
        frame.content,
        Content::Begin {
            frames: 129,
            powers: None
        }
    ));
}

#[test]
fn a_begin_tells_the_powers_of_the_beams() {
    let powers: Powers = std::array::from_fn(|beam| 1e-10 / (beam + 1) as f32);
    let mut samples = block(8);
    write_powers(&powers, &mut samples);
    let begin = |sequence| Header {
        powers: true,
        payload_checksum: powers_checksum(&powers),
        index: 129,
        ..header(Kind::Begin, sequence, &samples)
    };
    let [first, second] = [begin(0), begin(1)].map(|header| header.encode());
    assert_eq!(first[20..24], 288_u32.to_le_bytes());
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let frame = link.receive(&first, &mut samples).expect("sound");
    assert!(matches!(frame.content, Content::Begin { powers: Some(told), .. } if told == powers));
    // What lies behind the powers is filler.
    samples[0][72] = Iq::from_word(!samples[0][72].word());
    samples[0][71] = Iq::from_word(samples[0][71].word() ^ 1);
    assert_eq!(
        link.receive(&second, &mut samples).expect_err("damaged"),
        FrameError::PayloadChecksum { sequence: 1 }
    );
    samples[0][71] = Iq::from_word(samples[0][71].word() ^ 1);
    link.receive(&second, &mut samples).expect("sound again");
}

#[test]
fn damaged_samples_are_refused_and_a_sound_copy_is_taken_later() {
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let mut samples = block(9);
    let frames = [0, 1, 2].map(|n| header(Kind::Beam, n, &samples).encode());
    link.receive(&frames[0], &mut samples).expect("sound");
    samples[17][300] = Iq::from_word(samples[17][300].word() ^ 0x8000);
    assert_eq!(
        link.receive(&frames[1], &mut samples).expect_err("damaged"),
        FrameError::PayloadChecksum { sequence: 1 }
    );
    samples = block(9);
    let frame = link.receive(&frames[2], &mut samples).expect("sound");
    assert_eq!(frame.arrival, Arrival::Newest { missing: 1 });
    assert_eq!(link.counters().lost, 1);
    let frame = link.receive(&frames[1], &mut samples).expect("the copy");
    assert_eq!(frame.arrival, Arrival::Late);
    let expected = Counters {
        ok: 2,
        late: 1,
        damaged_payload: 1,
        ..Counters::default()
    };
    assert_eq!(link.counters(), expected);
}

#[test]
fn a_frame_from_before_the_window_is_not_taken() {
    let mut link = FrontEnd::new(SoftwareCrc, SESSION);
    let mut samples = block(2);
    let mut send = |sequence| {
        let bytes = header(Kind::Begin, sequence, &block(2)).encode();
        link.receive(&bytes, &mut samples).map(|frame| frame.arrival)
    };
    assert!(send(WINDOW).is_ok());
    assert_eq!(send(1), Ok(Arrival::Late));
    assert_eq!(
        send(0),
        Err(FrameError::Stale {
            sequence: 0,
            newest: WINDOW
        })
    );
    let counters = link.counters();
    assert_eq!(
        (counters.ok, counters.late, counters.lost, counters.stale),
        (1, 1, WINDOW - 1, 1)
    );
}
