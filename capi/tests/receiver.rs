//! The receiver behind the C interface sends, byte for byte, what the application that flies sends on the same flight.

use std::ffi::c_void;
use std::ptr::null_mut;
use std::sync::atomic::AtomicBool;

use cslam_c::*;
use cslam_core::signal::{Iq, SAMPLES};
use cslam_core::telemetry::Key;
use cslam_firmware::sensor_stream::{Content, UAV};
use cslam_host_sim::channel::Block;
use cslam_host_sim::flight::FlightConfig;
use cslam_host_sim::flight_log::Header;
use cslam_host_sim::raw_flight::{Recorder, Source, fly, with_board_receiver};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{Profile, World, WorldConfig};

const BLOCK: usize = 32 * SAMPLES * 2;
/// Three seconds at rest, then nine in the air.
const SWEEPS: u32 = 24;

/// A block as C has it: so many `int16_t`.
fn as_c(block: &mut Block) -> *mut i16 {
    block.samples.as_mut_ptr().cast()
}

/// Zeroed memory of a receiver.
fn memory() -> Vec<u128> {
    println!(
        "{} bytes, aligned to {}",
        cslam_receiver_size(),
        cslam_receiver_align()
    );
    assert!(cslam_receiver_align() <= align_of::<u128>());
    vec![0; cslam_receiver_size().div_ceil(16)]
}

fn config() -> CslamReceiverConfig {
    CslamReceiverConfig {
        size: size_of::<CslamReceiverConfig>() as u32,
        uav: UAV,
        has_ground: 1,
        has_earth_field: 0,
        reserved: 0,
        key: *b"PUBLISHED TEST KEY, NOT A SECRET",
        first_counter: 0,
        ground_z_m: 0.0,
        earth_field_ut: [0.0; 3],
    }
}

fn started(memory: &mut Vec<u128>) -> *mut CslamReceiver {
    let mut receiver = null_mut();
    let place = memory.as_mut_ptr().cast::<c_void>();
    // SAFETY: memory of this length, zeroed; the rest are references.
    let status = unsafe { cslam_receiver_init(place, cslam_receiver_size(), &config(), &mut receiver) };
    assert_eq!(status, CslamStatus::Ok);
    receiver
}

/// Flies what a source gives through the C interface: the packets, and the receiver.
fn flown(source: &impl Source, receiver: *mut CslamReceiver) -> Vec<u8> {
    let mut packets = Vec::new();
    let take = |packets: &mut Vec<u8>| {
        let (mut bytes, mut taken) = ([0; 4096], 0);
        // SAFETY: a receiver, and room for so many bytes.
        let status =
            unsafe { cslam_receiver_take_packets(receiver, bytes.as_mut_ptr(), bytes.len(), &mut taken) };
        assert_eq!(status, CslamStatus::Ok);
        packets.extend_from_slice(&bytes[..taken]);
    };
    // What the radio hears of the transmitter is signed by the recorder.
    let mut recorder = Recorder::default();
    for stamped in source.events() {
        let at = stamped.uav_time_ns;
        if matches!(stamped.event, Event::Sweep { sweep } if sweep >= SWEEPS) {
            break;
        }
        // A barometer's sample is none: the receiver has no input for it.
        let Some(record) = recorder.record(&stamped) else {
            continue;
        };
        // SAFETY: a receiver, and arrays as long as each function wants them.
        let status = unsafe {
            match &record.content {
                Content::Imu(raw) => {
                    let sample = raw.at(at);
                    let (rate, force) = (sample.rate_rad_per_s, sample.specific_force_m_per_s2);
                    cslam_receiver_imu(receiver, at, rate.as_ptr(), force.as_ptr())
                }
                Content::Magnetometer(field_ut) => {
                    cslam_receiver_magnetometer(receiver, at, field_ut.as_ptr())
                }
                Content::Timing(offset_s) => cslam_receiver_timing(receiver, at, *offset_s),
                Content::Uplink(bytes) => cslam_receiver_uplink(receiver, at, bytes.as_ptr(), bytes.len()),
                Content::Frames(_) | Content::End => cslam_receiver_elapse(receiver, at),
            }
        };
        assert_eq!(status, CslamStatus::Ok);
        if let Event::Sweep { sweep } = stamped.event {
            let mut heard = source.sweep(sweep).expect("samples");
            let powers: [f32; 72] = heard.beams.powers();
            // SAFETY: a receiver, 72 powers, and whole blocks.
            unsafe {
                assert_eq!(
                    cslam_receiver_powers(receiver, sweep, at, powers.as_ptr()),
                    CslamStatus::Ok
                );
                for block in heard.beams.strongest_first() {
                    let (beam, exponent) = (block.beam, block.exponent);
                    let status = cslam_receiver_beam(receiver, sweep, at, as_c(block), BLOCK, beam, exponent);
                    assert_eq!(status, CslamStatus::Ok);
                }
                for block in &mut heard.pilots.blocks {
                    let (pilot, exponent) = (block.beam, block.exponent);
                    let status =
                        cslam_receiver_pilot(receiver, sweep, at, as_c(block), BLOCK, pilot, exponent);
                    assert_eq!(status, CslamStatus::Ok);
                }
                for block in &mut heard.squint.blocks {
                    let (symbol, exponent) = (block.beam, block.exponent);
                    let status =
                        cslam_receiver_squint(receiver, sweep, at, as_c(block), BLOCK, symbol, exponent);
                    assert_eq!(status, CslamStatus::Ok);
                }
            }
        }
        take(&mut packets);
    }
    // SAFETY: a receiver.
    assert_eq!(unsafe { cslam_receiver_close(receiver) }, CslamStatus::Ok);
    take(&mut packets);
    packets
}

#[test]
fn packets_are_those_of_the_application() {
    assert!(Key::new(config().key).is_test());
    let scene = Scene::load("outdoor").expect("built in");
    let told = WorldConfig {
        flight: FlightConfig {
            duration_s: 0.5 * f64::from(SWEEPS + 1),
            ..FlightConfig::default()
        },
        ..WorldConfig::of(Profile::Budget)
    };
    let world = World::new(&scene, told, 3).expect("a flight");
    let header = Header {
        mode: "best".into(),
        scene: "outdoor".into(),
        world: None,
        seed: 3,
        planned_sweeps: SWEEPS as usize,
        sweep_period_s: 0.5,
        delay_cycle_m: None,
    };
    let never = AtomicBool::new(false);
    let (expected, points, position) = with_board_receiver(|application| {
        let (_, packets) = fly(&world, application, header, &never, |_| (), |_, _| ())?;
        let pose = application.cslam().pose().expect("it has started");
        Ok((packets, application.cslam().map().len(), pose.position.to_array()))
    })
    .expect("flown");
    assert!(
        expected.len() > 1000 && points > 0,
        "{} bytes, {points} points",
        expected.len()
    );

    let mut memory = memory();
    let receiver = started(&mut memory);
    let packets = flown(&world, receiver);
    assert!(
        packets == expected,
        "{} bytes, expected {}",
        packets.len(),
        expected.len()
    );
    let mut pose = CslamPose {
        size: size_of::<CslamPose>() as u32,
        ..CslamPose::default()
    };
    let empty = CslamMapPoint {
        size: size_of::<CslamMapPoint>() as u32,
        ..CslamMapPoint::default()
    };
    let (mut map, mut found) = (vec![empty; points + 1], 0);
    // SAFETY: a receiver, and structs with their sizes.
    unsafe {
        assert_eq!(cslam_receiver_pose(receiver, &mut pose), CslamStatus::Ok);
        assert_eq!(pose.position_m, position);
        let status = cslam_receiver_map(receiver, map.as_mut_ptr(), map.len(), &mut found);
        assert_eq!((status, found), (CslamStatus::Ok, points));
        assert_eq!(cslam_receiver_end(receiver), CslamStatus::Ok);
        assert_eq!(cslam_receiver_elapse(receiver, 1), CslamStatus::NotReady);
    }
    assert!(map[..points].iter().all(|point| point.hits > 0) && map[points].hits == 0);
}

#[test]
fn wrong_arguments_give_a_status() {
    let mut memory = memory();
    let place = memory.as_mut_ptr().cast::<c_void>();
    let mut receiver = null_mut();
    let size = cslam_receiver_size();
    let keyless = CslamReceiverConfig {
        key: [0; 32],
        ..config()
    };
    // SAFETY: memory of this length, zeroed; null and references.
    unsafe {
        let mut init = |length, config: *const _| cslam_receiver_init(place, length, config, &mut receiver);
        assert_eq!(init(size - 1, &config()), CslamStatus::TooShort);
        assert_eq!(init(size, core::ptr::null()), CslamStatus::Null);
        assert_eq!(init(size, &keyless), CslamStatus::Config);
        assert_eq!(
            init(size, &CslamReceiverConfig { size: 4, ..config() }),
            CslamStatus::Size
        );
        assert_eq!(
            init(
                size,
                &CslamReceiverConfig {
                    ground_z_m: f32::NAN,
                    ..config()
                }
            ),
            CslamStatus::NotFinite
        );
    }
    let magnetic = CslamReceiverConfig {
        has_earth_field: 1,
        ..config()
    };
    // SAFETY: as above.
    let status = unsafe { cslam_receiver_init(place, size, &magnetic, &mut receiver) };
    assert_eq!(status, CslamStatus::OutOfRange);
    let receiver = started(&mut memory);
    let mut block = Box::new([[Iq::ZERO; SAMPLES]; 32]);
    let samples: *mut i16 = block.as_mut_ptr().cast();
    let (good, bad) = ([0.0_f32; 3], [0.0, f32::NAN, 0.0]);
    let mut pose = CslamPose {
        size: size_of::<CslamPose>() as u32,
        ..CslamPose::default()
    };
    let beacon = CslamBeacon {
        size: size_of::<CslamBeacon>() as u32,
        sweep: 0,
        position_m: [0.0; 3],
        attitude_wxyz: [0.0; 4],
        sigma_m: 0.1,
        sweeps_per_stop: 0,
    };
    let mut count = 0;
    // SAFETY: a receiver; arrays as long as they are said to be, or null where that is tried.
    unsafe {
        let again = cslam_receiver_init(memory.as_mut_ptr().cast(), size, &config(), &mut null_mut());
        assert_eq!(again, CslamStatus::AlreadyReady);
        assert_eq!(
            cslam_receiver_imu(receiver, 1, good.as_ptr(), bad.as_ptr()),
            CslamStatus::NotFinite
        );
        assert_eq!(
            cslam_receiver_imu(receiver, 1, good.as_ptr(), core::ptr::null()),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_imu(null_mut(), 1, good.as_ptr(), good.as_ptr()),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_timing(receiver, 1, f64::NAN),
            CslamStatus::NotFinite
        );
        assert_eq!(cslam_receiver_timing(receiver, 1, 2.0), CslamStatus::OutOfRange);
        assert_eq!(
            cslam_receiver_beam(receiver, 0, 1, samples, BLOCK, 72, 0),
            CslamStatus::OutOfRange
        );
        assert_eq!(
            cslam_receiver_beam(receiver, 0, 1, samples, 9, 0, 0),
            CslamStatus::TooShort
        );
        for (count, pilot, exponent, expected) in [
            (BLOCK, 143, 0, CslamStatus::Ok),
            (BLOCK, 144, 0, CslamStatus::OutOfRange),
            (BLOCK, 0, i32::MAX, CslamStatus::OutOfRange),
            (BLOCK - 1, 0, 0, CslamStatus::TooShort),
        ] {
            assert_eq!(
                cslam_receiver_pilot(receiver, 0, 1, samples, count, pilot, exponent),
                expected
            );
        }
        assert_eq!(
            cslam_receiver_pilot(receiver, 0, 1, null_mut(), BLOCK, 0, 0),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_pilot(null_mut(), 0, 1, samples, BLOCK, 0, 0),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_squint(receiver, 0, 1, samples, BLOCK, 33, 0),
            CslamStatus::OutOfRange
        );
        // A sweep that was begun before it has ended: its pilots are late.
        assert_eq!(
            cslam_receiver_pilot(receiver, 1, 2, samples, BLOCK, 0, 0),
            CslamStatus::Ok
        );
        assert_eq!(
            cslam_receiver_pilot(receiver, 0, 1, samples, BLOCK, 72, 0),
            CslamStatus::OutOfRange
        );
        assert_eq!(
            cslam_receiver_beacon(receiver, 1, &beacon),
            CslamStatus::OutOfRange
        );
        let turned = CslamBeacon {
            sweeps_per_stop: 1,
            ..beacon
        };
        assert_eq!(cslam_receiver_beacon(receiver, 1, &turned), CslamStatus::NoLength);
        assert_eq!(
            cslam_receiver_uplink(receiver, 1, core::ptr::null(), 3),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_uplink(receiver, 1, core::ptr::null(), 0),
            CslamStatus::Ok
        );
        assert_eq!(cslam_receiver_pose(receiver, &mut pose), CslamStatus::NotKnown);
        assert_eq!(cslam_receiver_pose(receiver, null_mut()), CslamStatus::Null);
        assert_eq!(
            cslam_receiver_map(receiver, null_mut(), 1, &mut count),
            CslamStatus::Null
        );
        assert_eq!(
            cslam_receiver_take_packets(receiver, null_mut(), 1, &mut count),
            CslamStatus::Null
        );
        assert_eq!(cslam_receiver_end(receiver), CslamStatus::Ok);
        assert_eq!(cslam_receiver_end(receiver), CslamStatus::NotReady);
    }
}
