//! The receiver behind the C interface sends, byte for byte, what the application that flies sends of the same samples.

use std::ffi::c_void;
use std::ptr::null_mut;

use cslam_c::*;
use cslam_core::block::BeamBlock;
use cslam_core::cslam::{Beacon, Config, Cslam, LinkStates, Memory};
use cslam_core::geometry::{Rotation, Vector3};
use cslam_core::localization::ImuSample;
use cslam_core::localization::filter::states;
use cslam_core::lscn::{Classifier, models};
use cslam_core::ltd::Iq;
use cslam_core::profile::{FlightConfig, FlightEstimator, Samples};
use cslam_core::telemetry::{Decoder, Key};
use cslam_core::waveform::{SAMPLES, Waveform};
use cslam_firmware::app::{AppConfig, Application, Capture, Downlink, Ground, Map, Symbol, VOXELS};
use cslam_firmware::front_end::{FrontEnd, SoftwareCrc};
use cslam_firmware::sensor_stream::SESSION;

const KEY: [u8; 32] = [7; 32];
const BLOCK: usize = 32 * SAMPLES * 2;
/// At rest for three seconds, then five sweeps.
const SWEEPS: u32 = 5;
const REST_MS: u64 = 3_000;

/// What happens, in order.
enum Event {
    Imu(ImuSample),
    Timing(u64, f64),
    Beam(u32, u64, u16, i32),
    Squint(u32, u64, u16),
    Beacon(u64, Beacon),
}

fn events() -> Vec<Event> {
    let mut events = Vec::new();
    for ms in 1..=REST_MS + 500 * u64::from(SWEEPS) {
        let time_ns = ms * 1_000_000;
        let wobble = (ms % 7) as f32 * 1e-4;
        events.push(Event::Imu(ImuSample {
            time_ns,
            rate_rad_per_s: Vector3::new(wobble, -wobble, 0.5 * wobble),
            specific_force_m_per_s2: Vector3::new(wobble, 0.0, 9.806_65 + wobble),
        }));
        if ms % 250 == 0 {
            events.push(Event::Timing(time_ns, 1e-7));
        }
        if ms > REST_MS && ms % 500 == 250 {
            let sweep = ((ms - REST_MS) / 500) as u32;
            events.extend(
                [12, 13, 15, 40].map(|beam| Event::Beam(sweep, time_ns, beam, -38 - i32::from(beam % 3))),
            );
            events.extend((0..33).map(|symbol| Event::Squint(sweep, time_ns, symbol)));
            events.push(Event::Beacon(
                time_ns + 1_000_000,
                Beacon {
                    sweep,
                    position_m: Vector3::new(1.0, 2.0, 1.5),
                    sigma_m: f64::from(0.02_f32),
                    attitude: Rotation::identity(),
                    sweeps_per_stop: 2,
                },
            ));
        }
    }
    events
}

/// Samples of a wave from the front, 60 m away, over noise of the converter: the same for every block of a beam.
fn samples(beam: u16) -> Box<Samples> {
    let waveform = Waveform::default();
    let mut block = Box::new([[Iq::ZERO; SAMPLES]; 32]);
    let mut state = u32::from(beam).wrapping_mul(747_796_405).wrapping_add(1);
    let wave: Vec<(f64, f64)> = (0..SAMPLES)
        .map(|n| {
            (0..waveform.active).fold((0.0, 0.0), |(re, im), i| {
                let x = waveform.symbol::<f64>(i);
                let turns = f64::from(waveform.offset(i)) * (n as f64 - 49.2) / SAMPLES as f64;
                let (sin, cos) = (core::f64::consts::TAU * turns).sin_cos();
                (re + x.re * cos - x.im * sin, im + x.re * sin + x.im * cos)
            })
        })
        .collect();
    for (channel, samples) in block.iter_mut().enumerate() {
        for (x, (re, im)) in samples.iter_mut().zip(&wave) {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let noise = f64::from((state >> 20) as i16) * 0.02;
            let gain = if channel < 8 { 60.0 } else { 6.0 };
            *x = Iq::new((re * gain + noise) as i16, (im * gain - noise) as i16);
        }
    }
    block
}

fn by_the_application(events: &[Event]) -> (Vec<u8>, usize, Option<[f64; 3]>) {
    let classifier = Classifier::new(
        models::geometric().expect("sound"),
        models::geometric_without_departure().expect("sound"),
    );
    let config = Config::best(LinkStates::Geometric(classifier.expect("a pair")));
    let mut estimator = Box::new(FlightEstimator::new(&FlightConfig::default()));
    let mut squint = Box::new(config.beam_squint().expect("sound"));
    let mut map = Box::new(Map::new());
    let memory = Memory {
        estimator: &mut *estimator,
        squint: &mut squint,
        map: &mut map,
    };
    let ground = Ground {
        downlink: Downlink::new(9, &Key::new(KEY), 100),
        uplink: Decoder::new(9, &Key::new(KEY)),
    };
    let mut app = Application::<_, VOXELS, { states(2) }, _>::new(
        AppConfig::default(),
        FrontEnd::new(SoftwareCrc, SESSION),
        ground,
        Cslam::new(config, memory),
    );
    let mut packets = Vec::new();
    let mut waiting = vec![0; 4096];
    for event in events {
        match event {
            Event::Imu(sample) => app.imu(sample, &mut ()),
            Event::Timing(time_ns, offset_s) => app.timing(*time_ns, *offset_s, &mut ()),
            Event::Beacon(time_ns, beacon) => app.beacon(*time_ns, beacon, &mut ()),
            Event::Beam(sweep, sweep_ns, beam, exponent) => {
                let mut samples = samples(*beam);
                let block = BeamBlock {
                    samples: &mut samples,
                    beam: *beam,
                    exponent: *exponent,
                };
                app.capture(
                    Capture {
                        sweep: *sweep,
                        sweep_ns: *sweep_ns,
                        symbol: Symbol::Beam(block),
                    },
                    &mut (),
                );
            }
            Event::Squint(sweep, sweep_ns, symbol) => {
                let mut samples = samples(*symbol);
                let block = BeamBlock {
                    samples: &mut samples,
                    beam: *symbol,
                    exponent: -38,
                };
                app.capture(
                    Capture {
                        sweep: *sweep,
                        sweep_ns: *sweep_ns,
                        symbol: Symbol::Squint(block),
                    },
                    &mut (),
                );
            }
        }
        let taken = app.downlink().take(&mut waiting);
        packets.extend_from_slice(&waiting[..taken]);
    }
    app.end(&mut ());
    app.close();
    let taken = app.downlink().take(&mut waiting);
    packets.extend_from_slice(&waiting[..taken]);
    let position = app.cslam().pose().map(|pose| pose.position.to_array());
    (packets, app.cslam().map().len(), position)
}

/// Zeroed memory of a receiver.
fn memory() -> Vec<u128> {
    println!("{} bytes, aligned to {}", cslam_receiver_size(), cslam_receiver_align());
    assert!(cslam_receiver_align() <= align_of::<u128>());
    vec![0; cslam_receiver_size().div_ceil(16)]
}

fn config() -> CslamReceiverConfig {
    CslamReceiverConfig {
        size: size_of::<CslamReceiverConfig>() as u32,
        uav: 9,
        has_ground: 1,
        reserved: [0; 2],
        key: KEY,
        first_counter: 100,
        ground_z_m: 0.0,
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

#[test]
fn packets_are_those_of_the_application() {
    let events = events();
    let (expected, points, position) = by_the_application(&events);
    println!("{} bytes, {points} points, at {position:?}", expected.len());
    assert!(expected.len() > 200, "{} bytes", expected.len());

    let mut memory = memory();
    let receiver = started(&mut memory);
    let mut packets = Vec::new();
    let take = |packets: &mut Vec<u8>| {
        let (mut bytes, mut taken) = ([0; 4096], 0);
        // SAFETY: a receiver, and room for so many bytes.
        let status =
            unsafe { cslam_receiver_take_packets(receiver, bytes.as_mut_ptr(), bytes.len(), &mut taken) };
        assert_eq!(status, CslamStatus::Ok);
        packets.extend_from_slice(&bytes[..taken]);
    };
    for event in &events {
        // SAFETY: a receiver, and arrays and structs as each function wants them.
        let status = unsafe {
            match event {
                Event::Imu(sample) => cslam_receiver_imu(
                    receiver,
                    sample.time_ns,
                    sample.rate_rad_per_s.as_ptr(),
                    sample.specific_force_m_per_s2.as_ptr(),
                ),
                Event::Timing(time_ns, offset_s) => cslam_receiver_timing(receiver, *time_ns, *offset_s),
                Event::Beacon(time_ns, beacon) => {
                    let told = CslamBeacon {
                        size: size_of::<CslamBeacon>() as u32,
                        sweep: beacon.sweep,
                        position_m: beacon.position_m.into(),
                        attitude_wxyz: [1.0, 0.0, 0.0, 0.0],
                        sigma_m: beacon.sigma_m as f32,
                        sweeps_per_stop: beacon.sweeps_per_stop,
                    };
                    cslam_receiver_beacon(receiver, *time_ns, &told)
                }
                Event::Beam(sweep, sweep_ns, beam, exponent) => {
                    let mut samples = samples(*beam);
                    let at = samples.as_mut_ptr().cast();
                    cslam_receiver_beam(receiver, *sweep, *sweep_ns, at, BLOCK, *beam, *exponent)
                }
                Event::Squint(sweep, sweep_ns, symbol) => {
                    let mut samples = samples(*symbol);
                    let at = samples.as_mut_ptr().cast();
                    cslam_receiver_squint(receiver, *sweep, *sweep_ns, at, BLOCK, *symbol, -38)
                }
            }
        };
        assert_eq!(status, CslamStatus::Ok);
        take(&mut packets);
    }
    // SAFETY: a receiver.
    assert_eq!(unsafe { cslam_receiver_close(receiver) }, CslamStatus::Ok);
    take(&mut packets);
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
    let mut found = 0;
    // SAFETY: a receiver, and structs with their sizes.
    unsafe {
        let known = cslam_receiver_pose(receiver, &mut pose);
        let known = (known == CslamStatus::Ok).then_some(pose.position_m);
        assert_eq!(known, position);
        assert_eq!(
            cslam_receiver_map(receiver, null_mut(), 0, &mut found),
            CslamStatus::Ok
        );
        assert_eq!(found, points);
        assert_eq!(cslam_receiver_end(receiver), CslamStatus::Ok);
        assert_eq!(cslam_receiver_elapse(receiver, 1), CslamStatus::NotReady);
    }
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
    let receiver = started(&mut memory);
    let mut block = samples(0);
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
        assert_eq!(
            cslam_receiver_squint(receiver, 0, 1, samples, BLOCK, 33, 0),
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
