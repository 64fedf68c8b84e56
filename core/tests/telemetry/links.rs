//! Who may say what: keys, links, counters.

use cslam_core::telemetry::{
    Command, Decoder, Deframer, Direction, Key, MAX_FRAME, Message, Opener, REORDERING, Sender,
    TelemetryError, Uplink,
};

use super::{UAV, examples};

/// The frame of an example with a counter.
fn frame(uav: u8, key: &Key, counter: u32) -> Vec<u8> {
    let message = &examples::down()[1];
    let mut sender = Sender::new(uav, key, counter);
    sender
        .encode(message, &mut [0; MAX_FRAME])
        .expect("sound")
        .to_vec()
}

fn push<M: cslam_core::telemetry::Content>(
    decoder: &mut Decoder<M>,
    frame: &[u8],
) -> Result<u32, TelemetryError> {
    let mut results = frame.iter().filter_map(|byte| decoder.push(*byte));
    results.next().expect("a frame").map(|packet| packet.counter)
}

#[test]
fn only_this_link_with_this_key_is_heard() {
    let mut decoder = Decoder::<Message>::new(UAV, &Key::TEST);
    let mut judge = |frame: &[u8]| push(&mut decoder, frame);
    assert_eq!(
        judge(&frame(UAV + 1, &Key::TEST, 0)),
        Err(TelemetryError::WrongLink)
    );
    assert_eq!(
        judge(&frame(UAV, &Key::new([1; 32]), 0)),
        Err(TelemetryError::Forged)
    );
    let mut up = Sender::<Uplink>::new(UAV, &Key::TEST, 0);
    let mut buffer = [0; MAX_FRAME];
    let command = up
        .encode(&Uplink::Command(Command::Reboot), &mut buffer)
        .expect("sound");
    assert_eq!(
        judge(command),
        Err(TelemetryError::WrongLink),
        "its own command, thrown back"
    );
    let mut plain = Sender::<Message>::unsigned(UAV, 0);
    let mut buffer = [0; MAX_FRAME];
    let unsigned = plain.encode(&examples::down()[0], &mut buffer).expect("sound");
    assert_eq!(judge(unsigned), Err(TelemetryError::Unsigned));
    assert_eq!(
        judge(&frame(UAV, &Key::TEST, 0)),
        Ok(0),
        "none of these has used up a counter"
    );

    let mut open = Decoder::<Message>::with(Opener::unsigned(UAV));
    assert_eq!(
        push(&mut open, &frame(UAV, &Key::TEST, 1)),
        Err(TelemetryError::KeyMissing)
    );
    let unsigned = unsigned.to_vec();
    assert_eq!(push(&mut open, &unsigned), Ok(0));
    assert_eq!(push(&mut open, &unsigned), Err(TelemetryError::Replayed));
}

#[test]
fn a_deframer_says_whose_a_frame_is() {
    let mut deframer = Deframer::new();
    let bytes = frame(9, &Key::TEST, 5);
    let (last, rest) = bytes.split_last().expect("not empty");
    assert!(rest.iter().all(|byte| deframer.push(*byte).is_none()));
    let frame = deframer.push(*last).expect("an end").expect("sound");
    assert_eq!(
        (frame.uav(), frame.direction(), frame.is_signed()),
        (9, Direction::Down, true)
    );
    let opened = Opener::<Message>::new(9, &Key::TEST).open(&frame).expect("sound");
    assert_eq!((opened.uav, opened.counter), (9, 5));
}

#[test]
fn packets_may_overtake_each_other_but_not_come_twice() {
    let mut decoder = Decoder::<Message>::new(UAV, &Key::TEST);
    let mut judge = |counter| push(&mut decoder, &frame(UAV, &Key::TEST, counter));
    assert_eq!(judge(100), Ok(100));
    assert_eq!(judge(100), Err(TelemetryError::Replayed));
    assert_eq!(judge(101 - REORDERING), Ok(37));
    assert_eq!(judge(101 - REORDERING), Err(TelemetryError::Replayed));
    assert_eq!(judge(100 - REORDERING), Err(TelemetryError::Stale));
    assert_eq!(judge(0), Err(TelemetryError::Stale));
    assert_eq!(judge(2_000_000_000), Ok(2_000_000_000), "any loss is survived");
    assert_eq!(judge(101), Err(TelemetryError::Stale));
}

#[test]
fn counters_survive_a_reset_on_both_sides() {
    // The receiver goes on where it was.
    let mut before = Decoder::<Message>::new(UAV, &Key::TEST);
    let old: Vec<_> = (0..200).map(|counter| frame(UAV, &Key::TEST, counter)).collect();
    assert!(old.iter().all(|frame| push(&mut before, frame).is_ok()));
    let stored = before.opener().next();
    let mut after = Decoder::<Message>::with(Opener::resume(UAV, &Key::TEST, stored));
    assert!(
        old.iter().all(|frame| push(&mut after, frame).is_err()),
        "nothing old is taken again"
    );
    assert_eq!(push(&mut after, &frame(UAV, &Key::TEST, 200)), Ok(200));

    // The sender stops at what is stored.
    let mut sender = Sender::<Message>::new(UAV, &Key::TEST, 7);
    sender.allow(9);
    let send = |sender: &mut Sender<Message>| {
        let mut buffer = [0; MAX_FRAME];
        sender.encode(&examples::down()[0], &mut buffer).map(<[u8]>::len)
    };
    assert!(send(&mut sender).is_ok() && send(&mut sender).is_ok());
    assert_eq!((sender.counter(), sender.left()), (9, 0));
    assert_eq!(send(&mut sender), Err(TelemetryError::CounterExhausted));
    sender.allow(10);
    assert!(send(&mut sender).is_ok());
    let mut last = Sender::<Message>::new(UAV, &Key::TEST, u32::MAX);
    assert_eq!(
        send(&mut last),
        Err(TelemetryError::CounterExhausted),
        "it never wraps"
    );
}
