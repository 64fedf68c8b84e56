//! Comparison of two packet streams.

use std::fmt;

use cslam_core::telemetry::{Decoder, Key, Message};

/// The first place where two streams differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Difference {
    /// Offset from the start of the stream.
    pub(crate) offset: usize,
    /// Index of the packet that the offset lies in.
    pub(crate) packet: usize,
    /// Byte of the host; none when its stream has ended.
    pub(crate) expected: Option<u8>,
    /// Byte of the board; none when its stream has ended.
    pub(crate) found: Option<u8>,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let byte = |byte: Option<u8>| byte.map_or("the end".to_owned(), |b| format!("{b:#04x}"));
        write!(
            f,
            "board and host differ first at byte {}, in packet {}: the host has {}, the board {}",
            self.offset,
            self.packet,
            byte(self.expected),
            byte(self.found)
        )
    }
}

/// Where two streams differ first; `None` when they are the same bytes.
pub(crate) fn first_difference(expected: &[u8], found: &[u8]) -> Option<Difference> {
    let length = expected.len().max(found.len());
    let offset = (0..length).find(|&at| expected.get(at) != found.get(at))?;
    // A zero ends a packet, and both streams agree up to here.
    let packet = expected.iter().take(offset).filter(|byte| **byte == 0).count();
    Some(Difference {
        offset,
        packet,
        expected: expected.get(offset).copied(),
        found: found.get(offset).copied(),
    })
}

/// Every message of a stream, none of which may be damaged.
pub(crate) fn messages(bytes: &[u8]) -> Vec<Message> {
    let mut decoder = Decoder::new(crate::golden::UAV, &Key::TEST);
    let packets = bytes.iter().filter_map(|byte| decoder.push(*byte));
    packets
        .map(|packet| packet.expect("no packet is damaged").message)
        .collect()
}

#[test]
fn equal_streams_do_not_differ() {
    assert_eq!(first_difference(&[1, 0, 2, 0], &[1, 0, 2, 0]), None);
    assert_eq!(first_difference(&[], &[]), None);
}

#[test]
fn one_wrong_byte_anywhere_is_found_where_it_is() {
    let golden = crate::golden::run(&crate::stream::records()).bytes;
    for offset in [0, 1, golden.len() / 2, golden.len() - 2, golden.len() - 1] {
        let mut found = golden.clone();
        found[offset] ^= 0x40;
        let difference = first_difference(&golden, &found).expect("they differ");
        assert_eq!(
            (difference.offset, difference.expected),
            (offset, Some(golden[offset]))
        );
        assert_eq!(difference.found, Some(golden[offset] ^ 0x40));
        assert!(difference.to_string().contains(&format!("at byte {offset},")));
    }
}

#[test]
fn a_stream_that_ends_early_or_late_differs_at_its_end() {
    let short = first_difference(&[1, 0, 2, 0], &[1, 0]).expect("they differ");
    assert_eq!(
        short,
        Difference {
            offset: 2,
            packet: 1,
            expected: Some(2),
            found: None
        }
    );
    let long = first_difference(&[1, 0], &[1, 0, 7]).expect("they differ");
    assert_eq!(
        long,
        Difference {
            offset: 2,
            packet: 1,
            expected: None,
            found: Some(7)
        }
    );
    assert!(
        short
            .to_string()
            .ends_with("the host has 0x02, the board the end")
    );
}
