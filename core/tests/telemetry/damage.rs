//! Damage on the way: nothing damaged is taken, and nothing sound is lost with it.

use cslam_core::telemetry::{Decoder, Deframer, Key, Message, TelemetryError, Uplink, VERSION};
use proptest::prelude::*;

use super::{UAV, all_frames, decode, encode_all, examples, is_taken};

/// Every example, damaged in every way of a kind: nothing is taken, and it looks like damage and not like an attack.
fn nothing_is_taken(damage: impl Fn(&[u8], &mut dyn FnMut(&[u8]))) -> u32 {
    let mut tried = 0;
    for frame in all_frames() {
        damage(&frame, &mut |damaged| {
            tried += 1;
            let heard = decode::<Message>(damaged);
            let looks_damaged =
                |result: &Result<_, TelemetryError>| matches!(result, Err(e) if e.is_damage());
            assert!(
                damaged == frame || (heard.iter().all(looks_damaged) && !is_taken(damaged)),
                "{frame:02x?} as {damaged:02x?}: {heard:?}"
            );
        });
    }
    tried
}

#[test]
fn no_single_bit_flip_is_taken() {
    let tried = nothing_is_taken(|frame, judge| {
        // The closing zero too: the packet then ends with the next one.
        for bit in 0..frame.len() * 8 {
            let mut damaged = frame.to_vec();
            damaged[bit / 8] ^= 1 << (bit % 8);
            damaged.push(0);
            judge(&damaged);
        }
    });
    assert!(tried > 10_000, "{tried}");
}

#[test]
fn no_truncation_is_taken() {
    nothing_is_taken(|frame, judge| {
        for length in 0..frame.len() - 1 {
            let mut cut = frame[..length].to_vec();
            cut.push(0);
            judge(&cut);
            let cut = &frame[frame.len() - 1 - length..];
            judge(cut);
        }
    });
}

#[test]
fn no_swap_of_two_bytes_is_taken() {
    let tried = nothing_is_taken(|frame, judge| {
        for i in 0..frame.len() {
            for j in 0..i {
                let mut damaged = frame.to_vec();
                damaged.swap(i, j);
                judge(&damaged);
            }
        }
    });
    assert!(tried > 90_000, "{tried}");
}

#[test]
fn a_decoder_is_in_step_again_after_garbage() {
    let messages = examples::down();
    let good = encode_all(&messages).concat();
    for garbage in 0..600 {
        let mut stream = vec![0x55; garbage];
        stream.push(0);
        stream.extend(&good);
        let packets = decode::<Message>(&stream);
        let taken = packets.iter().filter(|p| p.is_ok()).count();
        assert_eq!(taken, messages.len(), "{garbage} bytes of garbage");
    }
    let long = decode::<Message>(&[&[0x55; 500][..], &[0]].concat());
    assert!(matches!(long[..], [Err(TelemetryError::FrameTooLong)]));
}

/// The frame of a packet after a change to its content, with a right checksum and framing.
fn reframed(frame: &[u8], change: impl Fn(&mut Vec<u8>)) -> Vec<u8> {
    let mut packet = cobs::decode_vec(&frame[..frame.len() - 1]).expect("sound");
    packet.truncate(packet.len() - 4);
    change(&mut packet);
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&packet);
    packet.extend(crc.to_be_bytes());
    let mut stuffed = cobs::encode_vec(&packet);
    stuffed.push(0);
    stuffed
}

#[test]
fn a_right_checksum_does_not_excuse_anything_else() {
    let frame = encode_all(&examples::down()[..1]).remove(0);
    let error = |change: fn(&mut Vec<u8>)| {
        let packets = decode::<Message>(&reframed(&frame, change));
        assert_eq!(packets.len(), 1);
        packets[0].as_ref().err().copied()
    };
    assert_eq!(error(|_| ()), None, "unchanged, it is a packet");
    assert_eq!(error(|p| p[0] = 1), Some(TelemetryError::Version));
    assert_eq!(error(|p| p[1] |= 0x80), Some(TelemetryError::WrongLink));
    assert_eq!(error(|p| p[2] += 1), Some(TelemetryError::WrongLink));
    assert_eq!(error(|p| p[1] &= !0x40), Some(TelemetryError::Unsigned));
    assert_eq!(error(|p| p[1] |= 1), Some(TelemetryError::Forged), "another kind");
    assert_eq!(
        error(|p| p[6] += 1),
        Some(TelemetryError::Forged),
        "another counter"
    );
    assert_eq!(error(|p| p[9] += 1), Some(TelemetryError::Forged), "another body");
    assert_eq!(error(|p| p.push(7)), Some(TelemetryError::Forged));
    assert_eq!(error(|p| p.truncate(14)), Some(TelemetryError::FrameTooShort));
    assert_eq!(error(|p| p.truncate(6)), Some(TelemetryError::FrameTooShort));
    assert_eq!(error(Vec::clear), Some(TelemetryError::FrameTooShort));
    let short = decode::<Message>(&[2, 7, 0]);
    assert!(matches!(short[..], [Err(TelemetryError::FrameTooShort)]));
    let torn = decode::<Message>(&[9, 7, 0]);
    assert!(matches!(torn[..], [Err(TelemetryError::Framing)]));
}

proptest! {
    #[test]
    fn noise_is_never_a_packet_and_never_a_panic(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        prop_assert!(!is_taken(&bytes));
    }

    /// Behind a right signature any body is read, and what is read can be sent again.
    #[test]
    fn no_signed_body_is_a_panic(way in any::<bool>(), kind in 0..8_u8, body in prop::collection::vec(any::<u8>(), 0..340)) {
        let frame = signed(way, kind, &body);
        if let Some(Ok(packet)) = decode::<Message>(&frame).pop() {
            prop_assert!(!encode_all(&[packet.message])[0].is_empty());
        }
        if let Some(Ok(packet)) = decode::<Uplink>(&frame).pop() {
            prop_assert!(!encode_all(&[packet.message])[0].is_empty());
        }
    }
}

/// A frame with any body and a right authentication code: what a mistaken sender would make.
fn signed(up: bool, kind: u8, body: &[u8]) -> Vec<u8> {
    use blake2::digest::{KeyInit, Mac};
    let mut packet = vec![VERSION, u8::from(up) << 7 | 0x40 | kind, UAV, 0, 0, 0, 0];
    packet.extend(body);
    let mut mac =
        blake2::Blake2sMac::<blake2::digest::consts::U8>::new_from_slice(b"PUBLISHED TEST KEY, NOT A SECRET")
            .expect("a key of the right length");
    mac.update(&packet);
    packet.extend(mac.finalize().into_bytes());
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC).checksum(&packet);
    packet.extend(crc.to_be_bytes());
    let mut stuffed = cobs::encode_vec(&packet);
    stuffed.push(0);
    stuffed
}

#[test]
fn the_packet_is_what_the_document_says() {
    // Event `Started` at 5 us: 48 bits of microseconds, six of the event, two of filling.
    let frame = signed(false, 4, &[0, 0, 0, 0, 0, 5, 3 << 2]);
    assert_eq!(decode::<Message>(&frame).len(), 1);
    let mut deframer = Deframer::new();
    let heard = frame
        .iter()
        .any(|byte| deframer.push(*byte).is_some_and(|frame| frame.is_ok()));
    assert!(heard);
    let again = encode_all(&examples::down()[15..16]).remove(0);
    assert_eq!(frame, again);
    // Filling that is not zero, and a byte too many, are no messages.
    for body in [
        &[0, 0, 0, 0, 0, 5, 3 << 2 | 1][..],
        &[0, 0, 0, 0, 0, 5, 3 << 2, 0],
        &[0, 0, 0, 0, 0, 5, 63 << 2],
    ] {
        let packets = decode::<Message>(&signed(false, 4, body));
        assert!(
            matches!(packets[..], [Err(TelemetryError::Content)]),
            "{packets:?}"
        );
    }
    assert!(matches!(
        decode::<Message>(&signed(false, 6, &[]))[..],
        [Err(TelemetryError::Content)]
    ));
    let mut decoder = Decoder::<Message>::new(UAV, &Key::TEST);
    assert!(decoder.push(0).is_none(), "an empty frame is nothing");
}
