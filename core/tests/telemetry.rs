//! Packets: golden bytes, round trips, and every kind of damage.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a helper of a test fails by panicking"
)]

use cslam_core::reflection::{InputError, Rejection};
use cslam_core::telemetry::{
    Decoder, Encoder, InputReport, MAX_FRAME, Message, Packet, PointReport, RejectionReport, Summary,
    TelemetryError,
};
use proptest::prelude::*;

fn messages() -> Vec<Message> {
    let mut all = vec![
        Message::Point(PointReport {
            link: 0,
            path: 0,
            position_m: [0.0, 0.0, 0.0],
            sigma_m: 0.0,
        }),
        Message::Point(PointReport {
            link: u32::MAX,
            path: 255,
            position_m: [f32::MAX, f32::MIN_POSITIVE, -1.5],
            sigma_m: 0.15,
        }),
        Message::Input(InputReport {
            link: 7,
            path: 3,
            error: InputError::AngleOutOfRange,
        }),
        Message::Summary(Summary {
            points: u32::MAX,
            rejected: u32::MAX,
            invalid: u32::MAX,
            damaged: u32::MAX,
            map_points: u32::MAX,
            map_dropped: u32::MAX,
        }),
    ];
    all.extend(Rejection::ALL.map(|reason| {
        Message::Rejection(RejectionReport {
            link: 1,
            path: 2,
            reason,
        })
    }));
    all
}

fn decode(bytes: &[u8]) -> Vec<Result<Packet, TelemetryError>> {
    let mut decoder = Decoder::new();
    bytes.iter().filter_map(|&b| decoder.push(b)).collect()
}

fn encode_all(messages: &[Message]) -> Vec<u8> {
    let (mut encoder, mut frame) = (Encoder::new(), [0; MAX_FRAME]);
    messages
        .iter()
        .flat_map(|m| encoder.encode(m, &mut frame).expect("fits").to_vec())
        .collect()
}

#[test]
fn the_wire_format_is_pinned() {
    let message = Message::Rejection(RejectionReport {
        link: 300,
        path: 2,
        reason: Rejection::LineOfSight,
    });
    let bytes = encode_all(&[message]);
    // 01 version | 00 sequence | 01 kind | ac 02 link 300 | 02 path | 00 reason | CRC-32, little endian | 00
    assert_eq!(
        bytes,
        [
            0x02, 0x01, 0x05, 0x01, 0xac, 0x02, 0x02, 0x05, 0x2b, 0xed, 0x74, 0x30, 0x00
        ],
        "{bytes:02x?}"
    );
}

#[test]
fn every_message_returns_with_its_sequence_number() {
    let messages = messages();
    let packets = decode(&encode_all(&messages));
    let expected: Vec<_> = messages
        .iter()
        .zip(0..)
        .map(|(&message, sequence)| Ok(Packet { sequence, message }))
        .collect();
    assert_eq!(packets, expected);
}

#[test]
fn every_single_bit_flip_and_truncation_is_caught() {
    for message in messages() {
        let frame = encode_all(&[message]);
        for bit in 0..(frame.len() - 1) * 8 {
            let mut damaged = frame.clone();
            damaged[bit / 8] ^= 1 << (bit % 8);
            assert!(
                decode(&damaged).iter().all(Result::is_err),
                "bit {bit} of {message:?}"
            );
        }
        for length in 0..frame.len() - 1 {
            let mut cut = frame[..length].to_vec();
            cut.push(0);
            assert!(
                decode(&cut).iter().all(Result::is_err),
                "{length} bytes of {message:?}"
            );
        }
    }
}

#[test]
fn a_decoder_is_in_step_again_after_garbage() {
    let good = encode_all(&messages());
    let mut stream = vec![0x55; 500];
    stream.push(0);
    stream.extend(&good);
    let packets = decode(&stream);
    assert_eq!(packets.first(), Some(&Err(TelemetryError::FrameTooLong)));
    assert_eq!(packets.iter().filter(|p| p.is_ok()).count(), messages().len());
}

/// The frame of a packet after a change to its content, with a right checksum and framing.
fn reframed(message: Message, change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let frame = encode_all(&[message]);
    let mut packet = cobs::decode_vec(&frame[..frame.len() - 1]).expect("sound");
    packet.truncate(packet.len() - 4);
    change(&mut packet);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&packet);
    packet.extend(crc.to_le_bytes());
    let mut stuffed = cobs::encode_vec(&packet);
    stuffed.push(0);
    stuffed
}

#[test]
fn a_right_checksum_does_not_excuse_a_wrong_content() {
    let message = messages()[0];
    assert!(
        matches!(decode(&reframed(message, |_| ()))[..], [Ok(_)]),
        "unchanged, it is a packet"
    );
    assert_eq!(
        decode(&reframed(message, |p| p[0] = 2)),
        [Err(TelemetryError::Version)]
    );
    assert_eq!(
        decode(&reframed(message, |p| p[2] = 99)),
        [Err(TelemetryError::Content)]
    );
    assert_eq!(
        decode(&reframed(message, |p| p.push(7))),
        [Err(TelemetryError::Content)]
    );
    assert_eq!(
        decode(&reframed(message, |p| p.truncate(9))),
        [Err(TelemetryError::Content)]
    );
    assert_eq!(
        decode(&reframed(message, Vec::clear)),
        [Err(TelemetryError::FrameTooShort)]
    );
}

proptest! {
    #[test]
    fn noise_is_never_a_packet_and_never_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        prop_assert!(decode(&bytes).iter().all(Result::is_err));
    }
}
