//! The receiver: what comes in leads to a packet or a counter.

mod common;

use common::Memory;
use cslam_core::lscn::LinkState;
use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, InputError, Rejection};
use cslam_core::telemetry::{Decoder, HealthCounters, Key, Message, PathOutcome, PointReport, Sender};
use cslam_firmware::measurement::{LENGTH, PathRecord, Record, RecordError};
use cslam_firmware::receiver::{ReceiveError, Receiver, Step, board_gates};
use cslam_firmware::ring::{Consumer, Producer, RingError, SharedMemory, region_length};
use embedded_io::{ErrorKind, ErrorType, Write};
use proptest::prelude::*;

const UAV: u8 = 1;
const GMT_M: [f32; 3] = [28.20, 23.04, 2.0];
const UAV_M: [f32; 3] = [53.97, 23.24, 2.0];
const POINT_M: [f32; 3] = [41.59, 39.09, 2.0];

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f32>().sqrt()
}

/// A path over `point`.
fn over(point: [f32; 3]) -> PathRecord {
    PathRecord {
        link: 3,
        path: 1,
        uav_m: UAV_M,
        uav_covariance_m2: [0.0025, 0.0, 0.0, 0.0025, 0.0, 0.0025],
        gmt_m: GMT_M,
        c_tau_m: distance(GMT_M, point) + distance(point, UAV_M),
        aoa: [0, 1, 2].map(|i| point[i] - UAV_M[i]),
        covariance: [0.0025, 0.0, 0.0, 3e-6, 0.0, 3e-6],
        aod: None,
    }
}

fn decoded(bytes: &[u8]) -> Vec<Message> {
    let mut decoder = Decoder::new(UAV, &Key::TEST);
    let packets = bytes.iter().filter_map(|byte| decoder.push(*byte));
    packets.map(|packet| packet.expect("sound").message).collect()
}

/// A receiver like the board's.
fn receiver<const N: usize>(map: &mut PointCloud<N>) -> Receiver<'_, N> {
    Receiver::new(map, Form::Vector, board_gates(), Sender::new(UAV, &Key::TEST, 0))
}

/// Outcomes of the paths of all sweeps, in order.
fn outcomes(messages: &[Message]) -> Vec<PathOutcome> {
    let links = messages.iter().filter_map(|message| match message {
        Message::Link(link) => Some(link.outcomes.iter().copied()),
        _ => None,
    });
    links.flatten().collect()
}

/// Points of all batches, in order.
fn points(messages: &[Message]) -> Vec<PointReport> {
    let batches = messages.iter().filter_map(|message| match message {
        Message::Points(batch) => Some(batch.points()),
        _ => None,
    });
    batches.flatten().collect()
}

#[test]
fn every_outcome_is_told_and_counted() {
    let mut map = PointCloud::<64>::new();
    let mut receiver = receiver(&mut map);
    let mut out = Vec::new();
    let mut damaged = Record::Path(over(POINT_M)).encode();
    damaged[20] ^= 0x10;
    let under_ground = over([41.59, 39.09, -8.0]);
    let nan = PathRecord {
        c_tau_m: f32::NAN,
        ..over(POINT_M)
    };
    let mut take = |bytes: &[u8]| receiver.receive(bytes, &mut out).expect("the vector takes all");
    for (number, path) in (0_u8..).zip([over(POINT_M), over(GMT_M), under_ground, nan]) {
        // The third record never comes.
        let path = PathRecord {
            path: number + u8::from(number > 1),
            ..path
        };
        assert_eq!(take(&Record::Path(path).encode()), Step::Answered);
    }
    assert_eq!(take(&damaged), Step::Damaged(RecordError::Checksum));
    assert_eq!(take(&damaged[..40]), Step::Damaged(RecordError::Length));
    assert_eq!(take(&Record::End { sent: 9 }.encode()), Step::Ended);

    let counters = *receiver.counters();
    assert_eq!((counters.points, counters.rejected, counters.invalid), (1, 2, 1));
    assert_eq!((counters.damaged_checksum, counters.damaged_length), (1, 1));
    assert_eq!((counters.received(), counters.missing), (6, 3));
    assert_eq!((counters.sent, counters.unsent), (3, 0));

    let messages = decoded(&out);
    let expected = [
        PathOutcome::Point,
        PathOutcome::Rejected(Rejection::LineOfSight),
        PathOutcome::Missing,
        PathOutcome::Rejected(Rejection::UnderGround),
        PathOutcome::Input(InputError::NotFinite),
    ];
    assert_eq!(outcomes(&messages), expected);
    let [Message::Link(link), Message::Points(_), Message::Health(health)] = &messages[..] else {
        panic!("{messages:?}")
    };
    assert_eq!((link.sweep, link.stop, link.first_path), (3, 0, 0));
    assert_eq!(link.gmt_m.map(|m| m.map(|c| c as f32)), Some(GMT_M));
    assert_eq!(link.state, LinkState::FirstOrder);
    let points = points(&messages);
    assert_eq!((points.len(), points[0].sweep), (1, 3));
    assert!(
        distance(points[0].position_m, POINT_M) < 0.01 && points[0].sigma_m > 0.0,
        "{points:?}"
    );
    let expected = HealthCounters {
        blocks: 4,
        blocks_damaged: 2,
        blocks_lost: 3,
        points: 1,
        rejected: 2,
        invalid: 1,
        map_points: 1,
        packets_sent: 2,
        ..HealthCounters::default()
    };
    assert_eq!(
        health.counters, expected,
        "the packet that says so is not among those sent before it"
    );
    assert_eq!(map.len(), 1);
}

#[test]
fn a_sweep_of_many_paths_is_told_in_several_reports() {
    let mut map = PointCloud::<64>::new();
    let mut receiver = receiver(&mut map);
    let mut out = Vec::new();
    for path in 0..40 {
        let record = PathRecord { path, ..over(GMT_M) };
        receiver.measure(&record, &mut out).expect("the vector takes all");
    }
    // A GMT that has moved on, and a path that comes again.
    for (path, x) in [(0, 30.0), (1, 30.0), (1, 30.0)] {
        let record = PathRecord {
            link: 4,
            path,
            gmt_m: [x, 23.04, 2.0],
            ..over(POINT_M)
        };
        receiver.measure(&record, &mut out).expect("the vector takes all");
    }
    receiver
        .receive(&Record::End { sent: 43 }.encode(), &mut out)
        .expect("the vector takes all");
    let links: Vec<_> = decoded(&out)
        .into_iter()
        .filter_map(|message| match message {
            Message::Link(link) => Some((link.sweep, link.stop, link.first_path, link.outcomes.len())),
            _ => None,
        })
        .collect();
    let expected = [
        (3, 0, 0, 15),
        (3, 0, 15, 15),
        (3, 0, 30, 10),
        (4, 1, 0, 2),
        (4, 1, 1, 1),
    ];
    assert_eq!(links, expected);
}

#[test]
fn what_a_small_map_does_not_take_is_counted() {
    let mut map = PointCloud::<1>::new();
    let mut receiver = receiver(&mut map);
    let mut out = Vec::new();
    for (path, x) in [(0, 41.59), (1, 45.0)] {
        let record = PathRecord {
            path,
            ..over([x, 39.09, 2.0])
        };
        receiver.measure(&record, &mut out).expect("the vector takes all");
    }
    // Ten kilometres away: a point, but no voxel.
    let far = |p: [f32; 3]| [p[0] + 10_000.0, p[1], p[2]];
    let shifted = PathRecord {
        uav_m: far(UAV_M),
        gmt_m: far(GMT_M),
        path: 2,
        ..over(POINT_M)
    };
    receiver
        .receive(&Record::Path(shifted).encode(), &mut out)
        .expect("the vector takes all");
    let answer = receiver.answer().expect("it was judged");
    assert_eq!(
        (answer.link, answer.path, answer.outcome),
        (3, 2, PathOutcome::PointOutOfRange)
    );
    assert!(answer.point.is_some());
    receiver
        .receive(&Record::End { sent: 3 }.encode(), &mut out)
        .expect("the vector takes all");
    let counters = receiver.health().counters;
    assert_eq!((counters.points, counters.map_points), (3, 1));
    assert_eq!(counters.map_dropped + receiver.map().counters().replaced, 2);
    assert_eq!(receiver.map().counters().out_of_range, 1);
    let messages = decoded(&out);
    assert_eq!(
        points(&messages).len(),
        2,
        "what the map cannot hold is told, not sent"
    );
    assert_eq!(outcomes(&messages)[2], PathOutcome::PointOutOfRange);
}

#[test]
fn the_ring_feeds_it_and_its_errors_come_through() {
    let memory = Memory::new(region_length(LENGTH, 2).expect("sound"));
    let mut producer = Producer::<_, LENGTH>::create(memory.clone(), 2).expect("fits");
    let mut consumer = Consumer::<_, LENGTH>::open(memory.clone()).expect("ready");
    let mut map = PointCloud::<8>::new();
    let mut receiver = receiver(&mut map);
    let mut out = Vec::new();
    assert_eq!(receiver.step(&mut consumer, &mut out), Ok(Step::Idle));
    assert!(
        producer
            .push(&Record::Path(over(POINT_M)).encode())
            .expect("sound")
    );
    assert_eq!(receiver.step(&mut consumer, &mut out), Ok(Step::Answered));
    assert_eq!(
        receiver.answer().expect("it was judged").outcome,
        PathOutcome::Point
    );
    memory
        .clone()
        .write(32, &[9, 0, 0, 0, 0xf6, 0xff, 0xff, 0xff])
        .expect("inside");
    let error = RingError::Indices { head: 9, tail: 1 };
    assert_eq!(
        receiver.step(&mut consumer, &mut out),
        Err(ReceiveError::Ring(error))
    );
}

/// Takes a few bytes at a time, then behaves as told.
struct Link {
    taken: Vec<u8>,
    room: usize,
    then: Result<usize, ErrorKind>,
}

impl ErrorType for Link {
    type Error = ErrorKind;
}

impl Write for Link {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        if self.room == 0 {
            return self.then;
        }
        let n = bytes.len().min(3).min(self.room);
        self.room -= n;
        self.taken.extend_from_slice(&bytes[..n]);
        Ok(n)
    }

    fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

#[test]
fn a_downlink_that_writes_little_or_lies_does_no_harm() {
    let mut map = PointCloud::<8>::new();
    let mut receiver = receiver(&mut map);
    let mut slow = Link {
        taken: Vec::new(),
        room: 1000,
        then: Ok(0),
    };
    // Each record is of another sweep than the one before, whose report goes down.
    let mut link = 0;
    let mut next = || {
        link += 1;
        PathRecord {
            link,
            ..over(POINT_M)
        }
    };
    assert_eq!(
        receiver.measure(&next(), &mut slow),
        Ok(()),
        "nothing to send yet"
    );
    receiver.measure(&next(), &mut slow).expect("takes all, slowly");
    assert_eq!(decoded(&slow.taken).len(), 1);
    let mut fail = |then| {
        receiver
            .measure(
                &next(),
                &mut Link {
                    taken: Vec::new(),
                    room: 5,
                    then,
                },
            )
            .expect_err("fails")
    };
    assert_eq!(fail(Ok(0)), ReceiveError::DownlinkStuck);
    assert_eq!(fail(Ok(usize::MAX)), ReceiveError::DownlinkStuck);
    assert_eq!(
        fail(Err(ErrorKind::TimedOut)),
        ReceiveError::Downlink(ErrorKind::TimedOut)
    );
    let counters = receiver.counters();
    assert_eq!((counters.points, counters.sent, counters.unsent), (5, 1, 3));
}

proptest! {
    /// Whatever bytes arrive, each record is accounted for exactly once and every answer can be decoded.
    #[test]
    fn any_stream_is_accounted_for(
        records in prop::collection::vec((prop::array::uniform32(any::<u32>()), 0..4_u8), 0..40),
    ) {
        let mut map = PointCloud::<8>::new();
        let mut receiver = receiver(&mut map);
        let mut out = Vec::new();
        for (number, (words, kind)) in (0_u32..).zip(&records) {
            let f: Vec<f32> = words.iter().map(|w| f32::from_bits(*w)).collect();
            let path = PathRecord {
                uav_m: [f[0], f[1], f[2]],
                c_tau_m: f[3],
                aoa: [f[4], f[5], f[6]],
                covariance: [f[7], f[8], f[9], f[10], f[11], f[12]],
                link: number / 5,
                path: words[13] as u8,
                ..over(POINT_M)
            };
            let mut bytes = Record::Path(path).encode();
            if *kind == 0 {
                bytes[7] ^= 1;
            }
            receiver.receive(&bytes, &mut out).expect("the vector takes all");
        }
        receiver.receive(&Record::End { sent: 40 }.encode(), &mut out).expect("the vector takes all");
        let counters = *receiver.counters();
        prop_assert_eq!(counters.received() as usize, records.len());
        let messages = decoded(&out);
        prop_assert_eq!(messages.len(), counters.sent as usize);
        let told = outcomes(&messages).into_iter().filter(|outcome| *outcome != PathOutcome::Missing);
        prop_assert_eq!(told.count() as u32 + counters.damaged_total(), counters.received());
        let sent = outcomes(&messages).into_iter().filter(PathOutcome::is_point);
        prop_assert!(points(&messages).len() <= sent.count());
    }
}
