//! Any body behind a right frame, as a mistaken sender would make it: no panic, and what is read can be sent again.
#![no_main]

#[path = "../frame.rs"]
mod frame;

use cslam_core::telemetry::{Decoder, MAX_FRAME, Message, Opener, Sender};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|input: (u8, &[u8])| {
    let (kind, body) = input;
    let frame = frame::frame(kind & 0x3f, body);
    let mut decoder = Decoder::<Message>::with(Opener::unsigned(1));
    for byte in &frame {
        if let Some(Ok(packet)) = decoder.push(*byte) {
            let mut sender = Sender::unsigned(1, 0);
            let again = sender
                .encode(&packet.message, &mut [0; MAX_FRAME])
                .map(<[u8]>::len);
            assert!(again.is_ok(), "{:?} was sent and cannot be", packet.message);
        }
    }
});
