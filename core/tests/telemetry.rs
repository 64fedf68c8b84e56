//! Packets: golden bytes, round trips, every kind of damage, and what a forger can try.

#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::panic,
    reason = "a helper of a test fails by panicking"
)]

#[path = "telemetry/attacks.rs"]
mod attacks;
#[path = "telemetry/damage.rs"]
mod damage;
#[path = "telemetry/examples.rs"]
mod examples;
#[path = "telemetry/golden.rs"]
mod golden;
#[path = "telemetry/links.rs"]
mod links;
#[path = "telemetry/quantities.rs"]
mod quantities;

use cslam_core::telemetry::{
    Content, Decoder, Key, MAX_FRAME, Message, Packet, Sender, TelemetryError, Uplink,
};

/// Number of the UAV of these tests.
const UAV: u8 = 7;

/// Frames of these messages.
fn encode_all<M: Content>(messages: &[M]) -> Vec<Vec<u8>> {
    let (mut sender, mut frame) = (Sender::new(UAV, &Key::TEST, 0), [0; MAX_FRAME]);
    let frames = messages.iter();
    frames
        .map(|m| sender.encode(m, &mut frame).expect("it can be said").to_vec())
        .collect()
}

/// Everything that a new decoder makes of these bytes.
fn decode<M: Content>(bytes: &[u8]) -> Vec<Result<Packet<M>, TelemetryError>> {
    let mut decoder = Decoder::new(UAV, &Key::TEST);
    bytes.iter().filter_map(|&b| decoder.push(b)).collect()
}

/// Frames of every example, down and up.
fn all_frames() -> Vec<Vec<u8>> {
    let mut frames = encode_all(&examples::down());
    frames.extend(encode_all(&examples::up()));
    frames
}

/// Whether either way takes anything of these bytes.
fn is_taken(bytes: &[u8]) -> bool {
    decode::<Message>(bytes).iter().any(Result::is_ok) || decode::<Uplink>(bytes).iter().any(Result::is_ok)
}
