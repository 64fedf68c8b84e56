//! What the wire takes away: never more than is stated.

use cslam_core::telemetry::{
    Batch, BatchError, BeaconReport, ConfigReport, HealthReport, MAX_POINTS, Message, PointBatch,
    PointReport, PoseReport, Sender, Spread, TelemetryError, TimingReport, Uplink,
};
use cslam_core::telemetry::{Content, Key, MAX_FRAME};
use nalgebra::Matrix3;
use proptest::prelude::*;

use super::{decode, encode_all, examples};

fn through<M: Content>(message: M) -> M {
    let packets = decode(&encode_all(&[message])[0]);
    let [packet] = <[_; 1]>::try_from(packets).ok().expect("one packet");
    packet.expect("sound").message
}

/// A number of -1..=1 from any integer.
fn unit(n: i32) -> f64 {
    f64::from(n) / f64::from(i32::MAX)
}

prop_compose! {
    fn a_pose()(n in prop::array::uniform32(any::<i32>()), near in 1..7_i32) -> PoseReport {
        let reach_m = 10.0_f64.powi(near);
        let quaternion = [n[0], n[1], n[2], n[3] | 1].map(|n| unit(n) as f32);
        let norm = quaternion.iter().map(|c| c * c).sum::<f32>().sqrt();
        let spread = |at: usize| Spread {
            sigma: [n[at], n[at + 1], n[at + 2]].map(|n| 10.0_f32.powf(unit(n) as f32 * 3.9)),
            correlation: [n[at + 3], n[at + 4], n[at + 5]].map(|n| unit(n) as f32),
        };
        let Message::Pose(pose) = examples::down()[4].clone() else { panic!("the fifth example is a pose") };
        PoseReport {
            time_ns: n[4].unsigned_abs().into(),
            position_m: [n[5], n[6], n[7]].map(|n| unit(n) * reach_m.min(2.1e6)),
            velocity_m_per_s: [n[8], n[9], n[10]].map(|n| unit(n) as f32 * 327.6),
            quaternion_wb: quaternion.map(|c| c / norm),
            position: spread(11),
            velocity: spread(17),
            attitude: spread(23),
            ..pose
        }
    }
}

fn assert_near(found: Spread, expected: Spread) {
    for (found, expected) in found.sigma.iter().zip(expected.sigma) {
        let ratio = found / expected.max(1e-4);
        assert!((0.957..1.045).contains(&ratio), "{expected} became {found}");
    }
    for (found, expected) in found.correlation.iter().zip(expected.correlation) {
        assert!(
            (found - expected).abs() <= 1.0 / 254.0 + 1e-6,
            "{expected} became {found}"
        );
    }
}

proptest! {
    #[test]
    fn a_pose_keeps_its_errors(pose in a_pose()) {
        let Message::Pose(heard) = through(Message::Pose(pose)) else { panic!("another kind") };
        prop_assert!(pose.time_ns - heard.time_ns < 1000);
        for axis in 0..3 {
            prop_assert!((heard.position_m[axis] - pose.position_m[axis]).abs() < 0.000_501);
            prop_assert!((heard.velocity_m_per_s[axis] - pose.velocity_m_per_s[axis]).abs() < 0.005_02);
        }
        // Half the angle between two attitudes, by the part of one quaternion that is across the other.
        let (p, q) = (pose.quaternion_wb.map(f64::from), heard.quaternion_wb.map(f64::from));
        let dot: f64 = p.iter().zip(q).map(|(a, b)| a * b).sum();
        let across: f64 = p.iter().zip(q).map(|(a, b)| (b - a * dot).powi(2)).sum::<f64>().sqrt();
        prop_assert!(2.0 * across < 4e-5, "{p:?} became {q:?}");
        assert_near(heard.position, pose.position);
        assert_near(heard.velocity, pose.velocity);
        assert_near(heard.attitude, pose.attitude);
    }

    #[test]
    fn points_keep_their_errors(
        points in prop::collection::vec(
            (prop::array::uniform3(any::<i32>()), any::<u8>(), any::<u16>(), 0..=100_u8, prop::option::of(any::<u16>())),
            1..=MAX_POINTS,
        ),
        surfaces in 1..=u16::MAX,
        reach in 0..5_i32,
        origin in prop::array::uniform3(any::<i16>()),
    ) {
        let reach_m = 7.0 * 10.0_f64.powi(reach);
        let (mut batch, mut sent) = (PointBatch::new(), Vec::new());
        for (place, sweep, stop, percent, surface) in points {
            let mut position_m = [0.0; 3];
            for axis in 0..3 {
                let origin_m = f64::from(origin[axis]) / 10.0;
                position_m[axis] = (origin_m + unit(place[axis]) * reach_m) as f32;
            }
            let point = PointReport {
                sweep: 10 + u32::from(sweep),
                stop,
                position_m,
                sigma_m: 0.01 * 181.0_f32.powf(f32::from(percent) / 100.0),
                probability: f32::from(percent) / 100.0,
                // Few surfaces as well as many.
                surface: surface.map(|number| number % surfaces),
            };
            batch.push(&point).expect("it can be sent");
            sent.push(point);
        }
        let Message::Points(heard) = through(Message::Points(batch.clone())) else { panic!("another kind") };
        prop_assert_eq!(&heard, &batch);
        prop_assert_eq!(heard.len(), sent.len());
        // In the order of sweeps; those of a sweep as they came.
        sent.sort_by_key(|point| point.sweep);
        for (heard, sent) in heard.points().zip(&sent) {
            prop_assert_eq!((heard.sweep, heard.stop, heard.surface), (sent.sweep, sent.stop, sent.surface));
            for (heard, sent) in heard.position_m.iter().zip(sent.position_m) {
                // Half a step, and half of what an f32 of that size can tell.
                let rounding = f32::EPSILON * sent.abs();
                prop_assert!((heard - sent).abs() <= PointReport::POSITION_ERROR_M + rounding, "{} {}", heard, sent);
            }
            let ratio = heard.sigma_m / sent.sigma_m;
            prop_assert!(ratio < PointReport::SIGMA_RATIO && ratio > 1.0 / PointReport::SIGMA_RATIO);
            prop_assert!((heard.probability - sent.probability).abs() <= PointReport::PROBABILITY_ERROR + 1e-6);
        }
    }

    #[test]
    fn beacons_and_timing_keep_their_errors(n in prop::array::uniform8(any::<i32>()), time_ns in any::<u64>()) {
        let beacon = BeaconReport {
            sweep: n[0].unsigned_abs(),
            position_m: [n[1], n[2], n[3]].map(|n| unit(n) * 5e7),
            sigma_m: unit(n[4]).abs() * 6.5,
            heading_pitch_roll_rad: [n[5], n[6], n[7]].map(|n| unit(n) * std::f64::consts::PI),
            sweeps_per_stop: n[0].unsigned_abs() % 65_536,
        };
        let Uplink::Beacon(heard) = through(Uplink::Beacon(beacon)) else { panic!("another kind") };
        prop_assert_eq!((heard.sweep, heard.sweeps_per_stop), (beacon.sweep, beacon.sweeps_per_stop));
        prop_assert!((heard.sigma_m - beacon.sigma_m).abs() < 5.01e-5);
        for axis in 0..3 {
            prop_assert!((heard.position_m[axis] - beacon.position_m[axis]).abs() < 5.01e-5);
            let angle = heard.heading_pitch_roll_rad[axis] - beacon.heading_pitch_roll_rad[axis];
            prop_assert!(angle.abs() < 1.5e-9);
        }
        prop_assert!(heard.to_beacon().is_some());
        let timing = TimingReport { time_ns, clock_offset_s: unit(n[1]) * 89_999.0 };
        let Uplink::Timing(heard) = through(Uplink::Timing(timing)) else { panic!("another kind") };
        prop_assert_eq!(heard.time_ns, timing.time_ns);
        prop_assert!((heard.clock_offset_s - timing.clock_offset_s).abs() < 5e-12 + 2e-11);
    }
}

#[test]
fn a_covariance_returns_as_spread() {
    let covariance = Matrix3::new(0.04_f32, 0.01, 0.0, 0.01, 0.09, -0.05, 0.0, -0.05, 0.25);
    let back = Spread::new(&covariance).matrix();
    assert!((back - covariance).abs().max() < 1e-7, "{back}");
    let nothing = Spread::new(&Matrix3::zeros());
    assert_eq!((nothing.sigma, nothing.correlation), ([0.0; 3], [0.0; 3]));
}

#[test]
fn what_cannot_be_said_is_refused_and_not_counted() {
    let Message::Pose(pose) = examples::down()[4].clone() else {
        panic!("the fifth example is a pose")
    };
    let Message::Config(config) = examples::down()[20].clone() else {
        panic!("the twenty-first example is a configuration")
    };
    let Uplink::Beacon(beacon) = examples::up()[0] else {
        panic!("the first example is a beacon")
    };
    let mut spread = pose.velocity;
    spread.sigma[1] = f32::NAN;
    let health = |load| {
        Message::Health(HealthReport {
            load,
            ..HealthReport::default()
        })
    };
    let down = [
        Message::Points(PointBatch::new()),
        Message::Pose(PoseReport {
            position_m: [f64::NAN, 0.0, 0.0],
            ..pose
        }),
        Message::Pose(PoseReport {
            position_m: [0.0, 2.2e6, 0.0],
            ..pose
        }),
        Message::Pose(PoseReport {
            velocity_m_per_s: [0.0, 0.0, 330.0],
            ..pose
        }),
        Message::Pose(PoseReport {
            quaternion_wb: [f32::NAN, 0.0, 0.0, 0.0],
            ..pose
        }),
        Message::Pose(PoseReport {
            velocity: spread,
            ..pose
        }),
        health(f32::NAN),
        health(1.01),
        health(-0.01),
        Message::Config(ConfigReport {
            voxel_edge_m: -1.0,
            ..config
        }),
        Message::Config(ConfigReport {
            voxel_edge_m: f32::INFINITY,
            ..config
        }),
    ];
    let mut sender = Sender::new(1, &Key::TEST, 41);
    for message in down {
        let result = sender.encode(&message, &mut [0; MAX_FRAME]).map(<[u8]>::len);
        assert_eq!(result, Err(TelemetryError::OutOfRange), "{message:?}");
    }
    assert_eq!(sender.counter(), 41);
    let up = [
        Uplink::Beacon(BeaconReport {
            sigma_m: -0.1,
            ..beacon
        }),
        Uplink::Beacon(BeaconReport {
            sigma_m: 7.0,
            ..beacon
        }),
        Uplink::Beacon(BeaconReport {
            sweeps_per_stop: 65_536,
            ..beacon
        }),
        Uplink::Beacon(BeaconReport {
            heading_pitch_roll_rad: [7.0, 0.0, 0.0],
            ..beacon
        }),
        Uplink::Timing(TimingReport {
            time_ns: 0,
            clock_offset_s: f64::INFINITY,
        }),
        Uplink::Timing(TimingReport {
            time_ns: 0,
            clock_offset_s: 1e7,
        }),
    ];
    let mut sender = Sender::new(1, &Key::TEST, 41);
    for message in up {
        let result = sender.encode(&message, &mut [0; MAX_FRAME]).map(<[u8]>::len);
        assert_eq!(result, Err(TelemetryError::OutOfRange), "{message:?}");
    }
}

#[test]
fn a_batch_takes_points_in_any_order_within_reach() {
    let mut batch = PointBatch::new();
    let point = PointReport {
        sweep: 1000,
        ..examples::wall_point(20)
    };
    let at = |sweep| PointReport { sweep, ..point };
    batch.push(&point).expect("the first");
    assert_eq!(batch.push(&at(1000 - 256)), Err(BatchError::Order));
    assert_eq!(batch.push(&at(1000 + 256)), Err(BatchError::Order));
    assert_eq!(batch.push(&at(1000 + 255)), Ok(()));
    assert_eq!(batch.push(&at(1000 - 255)), Ok(()));
    assert_eq!(batch.push(&at(1001)), Ok(()), "between the others");
    let sweeps: Vec<u32> = batch.points().map(|point| point.sweep).collect();
    assert_eq!(sweeps, [745, 1000, 1001, 1255]);
    for position_m in [
        [f32::NAN, 0.0, 0.0],
        [0.0, 84_000.0, 0.0],
        [0.0, 0.0, f32::NEG_INFINITY],
    ] {
        assert_eq!(
            batch.push(&PointReport { position_m, ..point }),
            Err(BatchError::OutOfRange)
        );
    }
    for probability in [-0.1, 1.1, f32::NAN] {
        assert_eq!(
            batch.push(&PointReport { probability, ..point }),
            Err(BatchError::OutOfRange)
        );
    }
    assert_eq!(batch.len(), 4);
    while !batch.is_full() {
        batch.push(&at(1255)).expect("room");
    }
    assert_eq!(batch.push(&at(1255)), Err(BatchError::Full));
    assert_eq!(batch.len(), MAX_POINTS);
}

#[test]
fn a_batch_closes_when_full_old_or_out_of_reach() {
    const S: u64 = 1_000_000_000;
    let mut batch = Batch::new(8 * S);
    assert_eq!(batch.due(100 * S), None, "nothing in it");
    assert_eq!(batch.push(100 * S, &examples::wall_point(0)), Ok(None));
    assert_eq!(batch.due(108 * S - 1), None);
    assert_eq!(batch.push(108 * S - 1, &examples::wall_point(1)), Ok(None));
    assert_eq!(
        batch.due(108 * S).map(|points| points.len()),
        Some(2),
        "the oldest counts"
    );
    for n in 0..MAX_POINTS as u16 {
        assert_eq!(batch.due(200 * S), None);
        assert_eq!(batch.push(200 * S, &examples::wall_point(n)), Ok(None));
    }
    let full = batch.push(200 * S, &examples::wall_point(30)).expect("in range");
    assert_eq!(full.map(|points| points.len()), Some(MAX_POINTS));
    let older = PointReport {
        sweep: examples::wall_point(30).sweep - 256,
        ..examples::wall_point(0)
    };
    let closed = batch.push(201 * S, &older).expect("in range");
    assert_eq!(closed.map(|points| points.len()), Some(1));
    assert_eq!(batch.close().map(|points| points.len()), Some(1));
    assert_eq!(batch.close(), None);
}

#[test]
fn the_longest_packet_fits_and_nothing_is_wasted() {
    let frame = encode_all(&[examples::widest_batch()]).remove(0);
    assert!(frame.len() <= MAX_FRAME, "{} bytes", frame.len());
    assert!(
        frame.len() + 8 > MAX_FRAME,
        "{} of {MAX_FRAME} bytes",
        frame.len()
    );
}

/// Bytes of a frame that holds a batch of points on a wall, each on the surface that `surface` says.
fn bytes_of(surface: impl Fn(u16) -> Option<u16>) -> usize {
    let mut batch = PointBatch::new();
    for n in 0..MAX_POINTS as u16 {
        let point = PointReport {
            surface: surface(n),
            ..examples::wall_point(n)
        };
        batch.push(&point).expect("it fits");
    }
    encode_all(&[Message::Points(batch)])[0].len()
}

#[test]
fn surfaces_cost_bits_and_not_bytes() {
    let without = bytes_of(|_| None);
    let one = bytes_of(|_| Some(700)) - without;
    assert!(one <= 2, "one surface takes {one} bytes more");
    let four = bytes_of(|n| Some([0, 31, 408, 700][usize::from(n % 4)])) - without;
    assert!(four <= 11, "four surfaces take {four} bytes more");
}
