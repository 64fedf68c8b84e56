//! The receiver: what comes in leads to a packet or a counter.

mod common;

use common::Memory;
use cslam_core::map::PointCloud;
use cslam_core::reflection::{Form, InputError, Rejection};
use cslam_core::telemetry::{Decoder, Message, Summary};
use cslam_firmware::measurement::{LENGTH, PathRecord, Record, RecordError};
use cslam_firmware::receiver::{ReceiveError, Receiver, Step, board_gates};
use cslam_firmware::ring::{Consumer, Producer, RingError, SharedMemory, region_length};
use embedded_io::{ErrorKind, ErrorType, Write};
use proptest::prelude::*;

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
    let mut decoder = Decoder::new();
    let packets = bytes.iter().filter_map(|byte| decoder.push(*byte));
    packets.map(|packet| packet.expect("sound").message).collect()
}

#[test]
fn every_outcome_has_its_packet_and_its_counter() {
    let mut map = PointCloud::<64>::new();
    let mut receiver = Receiver::new(&mut map, Form::Vector, board_gates());
    let mut out = Vec::new();
    let mut damaged = Record::Path(over(POINT_M)).encode();
    damaged[20] ^= 0x10;
    let under_ground = over([41.59, 39.09, -8.0]);
    let nan = PathRecord {
        c_tau_m: f32::NAN,
        ..over(POINT_M)
    };
    let mut take = |bytes: &[u8]| receiver.receive(bytes, &mut out).expect("the vector takes all");
    for path in [over(POINT_M), over(GMT_M), under_ground, nan] {
        assert_eq!(take(&Record::Path(path).encode()), Step::Answered);
    }
    assert_eq!(take(&damaged), Step::Damaged(RecordError::Checksum));
    assert_eq!(take(&damaged[..40]), Step::Damaged(RecordError::Length));
    assert_eq!(take(&Record::End { sent: 9 }.encode()), Step::Ended);

    let counters = *receiver.counters();
    assert_eq!((counters.points, counters.rejected, counters.invalid), (1, 2, 1));
    assert_eq!((counters.damaged_checksum, counters.damaged_length), (1, 1));
    assert_eq!((counters.received(), counters.missing), (6, 3));
    assert_eq!((counters.sent, counters.unsent), (5, 0));

    let messages = decoded(&out);
    assert_eq!(messages.len(), 5);
    let Message::Point(point) = messages[0] else {
        panic!("{messages:?}")
    };
    assert_eq!((point.link, point.path), (3, 1));
    assert!(
        distance(point.position_m, POINT_M) < 1e-3 && point.sigma_m > 0.0,
        "{point:?}"
    );
    let reasons: Vec<_> = messages[1..4]
        .iter()
        .map(|message| match message {
            Message::Rejection(r) => Ok(r.reason),
            Message::Input(i) => Err(i.error),
            other => panic!("{other:?}"),
        })
        .collect();
    let expected = [
        Ok(Rejection::LineOfSight),
        Ok(Rejection::UnderGround),
        Err(InputError::NotFinite),
    ];
    assert_eq!(reasons, expected);
    let summary = Summary {
        points: 1,
        rejected: 2,
        invalid: 1,
        damaged: 2,
        map_points: 1,
        map_dropped: 0,
    };
    assert_eq!(messages[4], Message::Summary(summary));
    assert_eq!(map.len(), 1);
}

#[test]
fn what_a_small_map_does_not_take_is_counted() {
    let mut map = PointCloud::<1>::new();
    let mut receiver = Receiver::new(&mut map, Form::Vector, board_gates());
    let mut out = Vec::new();
    for x in [41.59, 45.0] {
        receiver
            .measure(&over([x, 39.09, 2.0]), &mut out)
            .expect("the vector takes all");
    }
    // Ten kilometres away: a point, but no voxel.
    let far = |p: [f32; 3]| [p[0] + 10_000.0, p[1], p[2]];
    let shifted = PathRecord {
        uav_m: far(UAV_M),
        gmt_m: far(GMT_M),
        ..over(POINT_M)
    };
    receiver
        .measure(&shifted, &mut out)
        .expect("the vector takes all");
    let summary = receiver.summary();
    assert_eq!((summary.points, summary.map_points), (3, 1));
    assert_eq!(summary.map_dropped + receiver.map().counters().replaced, 2);
    assert_eq!(receiver.map().counters().out_of_range, 1);
    assert_eq!(decoded(&out).len(), 3);
}

#[test]
fn the_ring_feeds_it_and_its_errors_come_through() {
    let memory = Memory::new(region_length(LENGTH, 2).expect("sound"));
    let mut producer = Producer::<_, LENGTH>::create(memory.clone(), 2).expect("fits");
    let mut consumer = Consumer::<_, LENGTH>::open(memory.clone()).expect("ready");
    let mut map = PointCloud::<8>::new();
    let mut receiver = Receiver::new(&mut map, Form::Vector, board_gates());
    let mut out = Vec::new();
    assert_eq!(receiver.step(&mut consumer, &mut out), Ok(Step::Idle));
    assert!(
        producer
            .push(&Record::Path(over(POINT_M)).encode())
            .expect("sound")
    );
    assert_eq!(receiver.step(&mut consumer, &mut out), Ok(Step::Answered));
    assert_eq!(decoded(&out).len(), 1);
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
    let mut receiver = Receiver::new(&mut map, Form::Vector, board_gates());
    let mut slow = Link {
        taken: Vec::new(),
        room: 1000,
        then: Ok(0),
    };
    receiver
        .measure(&over(POINT_M), &mut slow)
        .expect("takes all, slowly");
    assert_eq!(decoded(&slow.taken).len(), 1);
    let mut fail = |then| {
        receiver
            .measure(
                &over(POINT_M),
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
    assert_eq!((counters.points, counters.sent, counters.unsent), (4, 1, 3));
}

proptest! {
    /// Whatever bytes arrive, each record is accounted for exactly once and every answer can be decoded.
    #[test]
    fn any_stream_is_accounted_for(
        records in prop::collection::vec((prop::array::uniform32(any::<u32>()), 0..4_u8), 0..40),
    ) {
        let mut map = PointCloud::<8>::new();
        let mut receiver = Receiver::new(&mut map, Form::Vector, board_gates());
        let mut out = Vec::new();
        for (words, kind) in &records {
            let f: Vec<f32> = words.iter().map(|w| f32::from_bits(*w)).collect();
            let path = PathRecord {
                uav_m: [f[0], f[1], f[2]],
                c_tau_m: f[3],
                aoa: [f[4], f[5], f[6]],
                covariance: [f[7], f[8], f[9], f[10], f[11], f[12]],
                ..over(POINT_M)
            };
            let mut bytes = Record::Path(path).encode();
            if *kind == 0 {
                bytes[7] ^= 1;
            }
            receiver.receive(&bytes, &mut out).expect("the vector takes all");
        }
        let counters = *receiver.counters();
        prop_assert_eq!(counters.received() as usize, records.len());
        prop_assert_eq!(counters.sent + counters.damaged_total(), counters.received());
        prop_assert_eq!(decoded(&out).len(), counters.sent as usize);
    }
}
