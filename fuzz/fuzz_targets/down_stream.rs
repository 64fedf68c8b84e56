//! Any bytes into the decoder of a link, as they come from a radio: no panic, and nothing forged is taken.
#![no_main]

use cslam_core::telemetry::{Decoder, Key, Message};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let mut decoder = Decoder::<Message>::new(1, &Key::new([0x5a; Key::LENGTH]));
    for byte in bytes.iter().chain(&[0]) {
        assert!(!matches!(decoder.push(*byte), Some(Ok(_))), "forged");
    }
});
