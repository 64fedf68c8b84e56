//! The stability promise: the bytes of every example, as they were when this version was made.

use std::fmt::Write as _;

use cslam_core::telemetry::{Content, Message, Uplink};

use super::{decode, encode_all, examples};

/// Bytes of every example, a line each: `way number: bytes`. Nothing in it may ever change while the version is 3; lines may be
/// added at the end of each way.
const GOLDEN: &str = include_str!("../../../tests/golden/telemetry_packets.txt");

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

fn lines<M: Content>(way: &str, messages: &[M]) -> String {
    let mut text = String::new();
    for (number, frame) in encode_all(messages).iter().enumerate() {
        let _ = writeln!(text, "{way} {number}: {}", hex(frame));
    }
    text
}

#[test]
fn the_wire_format_is_pinned() {
    let found = lines("down", &examples::down()) + &lines("up", &examples::up());
    let golden: String = GOLDEN
        .lines()
        .filter(|line| !line.starts_with('#'))
        .flat_map(|line| [line, "\n"])
        .collect();
    assert!(
        golden == found,
        "the wire format of version 3 has changed: old receivers would not understand it. Found:\n{found}"
    );
}

/// What is decoded says the same when it is sent again, byte by byte, and is equal to itself.
fn returns<M: Content + Clone + PartialEq + std::fmt::Debug>(messages: &[M]) {
    let frames = encode_all(messages);
    let packets = decode::<M>(&frames.concat());
    assert_eq!(packets.len(), messages.len());
    let decoded: Vec<M> = packets
        .into_iter()
        .zip(0..)
        .map(|(packet, counter)| {
            let packet = packet.expect("nothing happened to it");
            assert_eq!(
                (packet.uav, packet.counter, packet.signed),
                (super::UAV, counter, true)
            );
            packet.message
        })
        .collect();
    assert_eq!(encode_all(&decoded), frames);
    for (message, frame) in decoded.iter().zip(&frames) {
        let again = decode::<M>(&encode_all(std::slice::from_ref(message)).concat());
        assert_eq!(
            again[0].as_ref().expect("sound").message,
            *message,
            "{frame:02x?}"
        );
    }
}

#[test]
fn every_message_returns() {
    returns::<Message>(&examples::down());
    returns::<Uplink>(&examples::up());
}
