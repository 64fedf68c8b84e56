//! Attacks and noise by the million: none is taken, none is a panic.

use cslam_core::telemetry::{
    Content, Decoder, Deframer, Key, MAX_FRAME, MAX_PACKET, Message, Opener, PoseReport, REORDERING, Sender,
    TelemetryError, Uplink, VERSION,
};

use super::{UAV, examples};

/// Inputs of each decoder.
const INPUTS: u32 = 1_000_000;
/// Packets with a right checksum and a random authentication code.
const FORGED: u32 = 10_000_000;
/// Packets of each other kind that must not be taken.
const TRIES: u32 = 100_000;

/// SplitMix64 (Steele, Lea and Flood, 2014): random enough, and the same everywhere.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn fill(&mut self, bytes: &mut [u8]) {
        for chunk in bytes.chunks_mut(8) {
            let word = self.next().to_le_bytes();
            chunk.copy_from_slice(&word[..chunk.len()]);
        }
    }
}

/// A frame around this packet, with a right checksum.
fn framed(packet: &[u8]) -> Vec<u8> {
    static CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut whole = packet.to_vec();
    whole.extend(CRC.checksum(packet).to_be_bytes());
    let mut frame = vec![0; whole.len() + 4];
    let length = cobs::try_encode(&whole, &mut frame).expect("room");
    frame.truncate(length + 1);
    frame[length] = 0;
    frame
}

/// Random bytes into a decoder of a stream, a frame after the other; gives how many packets came out.
fn listen_to_noise<M: Content>(seed: u64) -> usize {
    let (mut random, mut decoder) = (Random(seed), Decoder::<M>::new(UAV, &Key::TEST));
    let (mut bytes, mut taken) = ([0; 400], 0);
    for _ in 0..INPUTS {
        // Zeros are as rare as in any bytes, and each input ends with one: lengths from nothing to too long.
        let length = random.next() as usize % bytes.len();
        random.fill(&mut bytes[..length]);
        let ends = bytes[..length].iter().chain(&[0]);
        taken += ends
            .filter(|byte| matches!(decoder.push(**byte), Some(Ok(_))))
            .count();
    }
    taken
}

#[test]
fn a_million_noises_are_not_heard() {
    assert_eq!(listen_to_noise::<Message>(1), 0);
    assert_eq!(listen_to_noise::<Uplink>(2), 0);
}

/// Bodies of the examples of a kind.
fn bodies<M: Content>(kind: u8, examples: &[M]) -> Vec<Vec<u8>> {
    let mut sender = Sender::unsigned(UAV, 0);
    let packets = examples.iter().map(|example| {
        let mut buffer = [0; MAX_FRAME];
        let frame = sender.encode(example, &mut buffer).expect("it can be said");
        cobs::decode_vec(&frame[..frame.len() - 1]).expect("sound")
    });
    let of_kind = packets.filter(|packet| packet[1] & 0x3f == kind);
    of_kind
        .map(|packet| packet[7..packet.len() - 4].to_vec())
        .collect()
}

/// Bodies of a kind, half of them noise and half examples with a few bits changed, framed so that nothing stops them before the
/// decoder of that kind; gives how many were messages.
fn read_noise<M: Content + std::fmt::Debug>(
    up: bool,
    kind: u8,
    examples: &[M],
    same: fn(&M, &M) -> bool,
) -> u32 {
    let mut random = Random(u64::from(kind) + 100 * u64::from(up));
    let bodies = bodies(kind, examples);
    let mut messages = 0;
    let mut packet = [0; MAX_PACKET];
    packet[..3].copy_from_slice(&[VERSION, u8::from(up) << 7 | kind, UAV]);
    for counter in 0..INPUTS {
        let length = if counter % 2 == 0 || bodies.is_empty() {
            // Short bodies are more often messages.
            let length = 7 + ((random.next() as usize % 341) >> (random.next() % 4));
            random.fill(&mut packet[7..length]);
            length
        } else {
            let body = &bodies[random.next() as usize % bodies.len()];
            let length = 7 + body.len();
            packet[7..length].copy_from_slice(body);
            for _ in 0..1 + random.next() % 8 {
                let bit = random.next() as usize % (8 * body.len());
                packet[7 + bit / 8] ^= 1 << (bit % 8);
            }
            length
        };
        packet[3..7].copy_from_slice(&counter.to_be_bytes());
        let mut decoder = Decoder::<M>::with(Opener::unsigned(UAV));
        let frame = framed(&packet[..length]);
        let heard = frame
            .iter()
            .find_map(|byte| decoder.push(*byte))
            .expect("a frame");
        match heard {
            Ok(heard) => {
                messages += 1;
                // What was read can be sent, and says the same.
                let mut sender = Sender::unsigned(UAV, counter);
                let mut buffer = [0; MAX_FRAME];
                let again = sender.encode(&heard.message, &mut buffer).expect("it was sent");
                let mut decoder = Decoder::<M>::with(Opener::unsigned(UAV));
                let back = again
                    .iter()
                    .find_map(|byte| decoder.push(*byte))
                    .expect("a frame");
                let back = back.expect("sound").message;
                assert!(same(&back, &heard.message), "{:?} became {back:?}", heard.message);
            }
            Err(error) => assert_eq!(error, TelemetryError::Content),
        }
    }
    messages
}

/// Equal, but for the attitude of a pose: no sender would leave out another component than the largest, as noise does; and
/// for what an f64 of the size of its clock offset cannot tell.
fn same_down(a: &Message, b: &Message) -> bool {
    let (Message::Pose(a), Message::Pose(b)) = (a, b) else {
        return a == b;
    };
    let near = a
        .quaternion_wb
        .iter()
        .zip(b.quaternion_wb)
        .all(|(a, b)| (a - b).abs() < 5e-5);
    let turned = a
        .quaternion_wb
        .iter()
        .zip(b.quaternion_wb)
        .all(|(a, b)| (a + b).abs() < 5e-5);
    let offset_s = |pose: &PoseReport| pose.clock.map_or(0.0, |clock| clock.offset_s);
    let on_time = (offset_s(a) - offset_s(b)).abs() < 2e-11;
    let rest = PoseReport {
        quaternion_wb: b.quaternion_wb,
        clock: b.clock,
        ..*a
    };
    (near || turned) && on_time && rest == *b
}

/// Equal, but for what an f64 of that size cannot tell.
fn same_up(a: &Uplink, b: &Uplink) -> bool {
    match (a, b) {
        (Uplink::Timing(a), Uplink::Timing(b)) => {
            a.time_ns == b.time_ns && (a.clock_offset_s - b.clock_offset_s).abs() < 2e-11
        }
        _ => a == b,
    }
}

#[test]
fn a_million_bodies_of_each_kind_down_are_messages_or_not() {
    let examples = examples::down();
    let judge = |kind| read_noise(false, kind, &examples, same_down);
    let messages: Vec<_> = (0..7).map(judge).collect();
    println!("of a million bodies of each kind down, messages: {messages:?}");
    assert!(
        messages[..6].iter().all(|messages| *messages > 10_000),
        "{messages:?}"
    );
    assert_eq!(messages[6], 0, "there is no such kind");
}

#[test]
fn a_million_bodies_of_each_kind_up_are_messages_or_not() {
    let examples = examples::up();
    let judge = |kind| read_noise(true, kind, &examples, same_up);
    let messages: Vec<_> = (0..4).map(judge).collect();
    println!("of a million bodies of each kind up, messages: {messages:?}");
    assert!(
        messages[..3].iter().all(|messages| *messages > 10_000),
        "{messages:?}"
    );
    assert_eq!(messages[3], 0, "there is no such kind");
}

#[test]
fn ten_million_forgeries_are_refused() {
    let mut random = Random(3);
    let mut deframer = Deframer::new();
    let mut opener = Opener::<Uplink>::new(UAV, &Key::TEST);
    let (mut judged, mut taken) = (0, 0);
    // A command to reboot, which a forger would like to send.
    let mut packet = [VERSION, 0xc0 | 2, UAV, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 0, 0, 0];
    for counter in 0..FORGED {
        packet[3..7].copy_from_slice(&counter.to_be_bytes());
        random.fill(&mut packet[8..]);
        for byte in framed(&packet) {
            if let Some(frame) = deframer.push(byte) {
                judged += 1;
                match opener.open(&frame.expect("the checksum is right")) {
                    Ok(_) => taken += 1,
                    Err(error) => assert_eq!(error, TelemetryError::Forged),
                }
            }
        }
    }
    assert_eq!((judged, taken), (FORGED, 0));
    // The same packet with the right code would have been taken.
    let mut sender = Sender::new(UAV, &Key::TEST, 0);
    let mut buffer = [0; MAX_FRAME];
    let right = sender.encode(&examples::up()[7], &mut buffer).expect("sound");
    assert_eq!(right.len(), packet.len() + 4 + 2);
    let opened = right.iter().find_map(|byte| {
        let frame = deframer.push(*byte)?.expect("sound");
        Some(opener.open(&frame).is_ok())
    });
    assert_eq!(opened, Some(true));
}

/// The frame of a command by a sender.
fn command<'a>(sender: &mut Sender<Uplink>, buffer: &'a mut [u8; MAX_FRAME]) -> &'a [u8] {
    sender.encode(&examples::up()[5], buffer).expect("sound")
}

fn judge(decoder: &mut Decoder<Uplink>, frame: &[u8]) -> Result<u32, TelemetryError> {
    let heard = frame
        .iter()
        .find_map(|byte| decoder.push(*byte))
        .expect("a frame");
    heard.map(|packet| packet.counter)
}

#[test]
fn a_hundred_thousand_replays_are_refused() {
    let mut sender = Sender::new(UAV, &Key::TEST, 0);
    let mut decoder = Decoder::new(UAV, &Key::TEST);
    let mut random = Random(4);
    let mut recorded: Vec<Vec<u8>> = Vec::new();
    for counter in 0..TRIES {
        let mut buffer = [0; MAX_FRAME];
        let frame = command(&mut sender, &mut buffer);
        assert_eq!(judge(&mut decoder, frame), Ok(counter));
        recorded.push(frame.to_vec());
        // Half of them at once or nearly so, half from any time before.
        let back = if counter % 2 == 0 {
            random.next() as usize % 70
        } else {
            random.next() as usize
        };
        let replay = &recorded[recorded.len() - 1 - back % recorded.len()];
        let refused = judge(&mut decoder, replay);
        assert!(
            matches!(refused, Err(TelemetryError::Replayed | TelemetryError::Stale)),
            "{refused:?}"
        );
    }
}

#[test]
fn a_hundred_thousand_late_or_stale_packets_are_refused() {
    let frames: Vec<_> = {
        let mut sender = Sender::new(UAV, &Key::TEST, 0);
        (0..TRIES + REORDERING)
            .map(|_| command(&mut sender, &mut [0; MAX_FRAME]).to_vec())
            .collect()
    };
    // Each comes later than the window is long, and for the first time.
    let mut decoder = Decoder::new(UAV, &Key::TEST);
    for late in 0..TRIES {
        let newest = late + REORDERING;
        assert_eq!(judge(&mut decoder, &frames[newest as usize]), Ok(newest));
        assert_eq!(
            judge(&mut decoder, &frames[late as usize]),
            Err(TelemetryError::Stale)
        );
    }
    // All of them come to a receiver that was told, at its start, where the last one had been.
    let next = TRIES + REORDERING;
    let mut decoder = Decoder::with(Opener::resume(UAV, &Key::TEST, next));
    let refused = frames
        .iter()
        .filter(|frame| {
            matches!(
                judge(&mut decoder, frame),
                Err(TelemetryError::Replayed | TelemetryError::Stale)
            )
        })
        .count();
    assert_eq!(refused, frames.len());
}

#[test]
fn a_hundred_thousand_packets_of_other_links_are_refused() {
    let mut random = Random(5);
    let mut decoder = Decoder::<Uplink>::new(UAV, &Key::TEST);
    let mut down = Sender::<Message>::new(UAV, &Key::TEST, 0);
    for number in 0..TRIES {
        let mut buffer = [0; MAX_FRAME];
        let (frame, expected) = match number % 3 {
            0 => {
                let uav = UAV.wrapping_add(1 + (random.next() % 255) as u8);
                let mut sender = Sender::new(uav, &Key::TEST, number);
                (command(&mut sender, &mut buffer), TelemetryError::WrongLink)
            }
            1 => {
                let mut key = [0; Key::LENGTH];
                random.fill(&mut key);
                let mut sender = Sender::new(UAV, &Key::new(key), number);
                (command(&mut sender, &mut buffer), TelemetryError::Forged)
            }
            _ => {
                let echo = down.encode(&examples::down()[15], &mut buffer).expect("sound");
                (echo, TelemetryError::WrongLink)
            }
        };
        assert_eq!(judge(&mut decoder, frame), Err(expected));
    }
    assert_eq!(decoder.opener().next(), 0, "nothing was taken");
}
