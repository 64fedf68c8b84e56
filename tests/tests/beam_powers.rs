//! A front end that hands beams over in the wrong order, tells nothing of their powers, or lies about them: the receiver estimates the
//! same paths, and counts what was wrong.

use std::sync::OnceLock;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Body, Direction, World as WorldFrame};
use cslam_core::paths::EstimatedPath;
use cslam_core::receiver::{PATHS, SweepReport};
use cslam_core::signal::{Iq, SAMPLES, Waveform};
use cslam_firmware::app::{Counters, Observer};
use cslam_firmware::front_end::{
    FRAME_LENGTH, HEADER_LENGTH, Header, Kind, Powers, powers_checksum, read_samples, write_powers,
    write_samples,
};
use cslam_host_sim::raw_flight::{FrameBytes, FrontEndLink, with_board_receiver};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{HeardSweep, Profile, World, WorldConfig, instant};

/// Beams of a sweep.
const BEAMS: usize = 72;
/// Length of the flight, s: it passes walls.
const FLIGHT_S: f64 = 20.0;

type Frames = Vec<Box<FrameBytes>>;

/// Delay with the clock's offset, m, and arrival, body axes.
type TruePath = (f64, Direction<Body, f64>);

/// A sweep as a sound front end sends it: begin, beams, pilots, squint symbols. And the true paths.
struct Sent {
    frames: Frames,
    truth: Vec<TruePath>,
}

fn sweeps() -> &'static [Sent] {
    static SWEEPS: OnceLock<Vec<Sent>> = OnceLock::new();
    SWEEPS.get_or_init(|| {
        let scene = Scene::load("outdoor").expect("built in");
        let mut config = WorldConfig::of(Profile::Budget);
        config.flight.duration_s = FLIGHT_S;
        let world = World::new(&scene, config, 1).expect("a flight");
        let mut link = FrontEndLink::default();
        let mut sweeps = Vec::new();
        for stamped in world.flight().events() {
            let Event::Sweep { sweep } = stamped.event else {
                continue;
            };
            let mut heard = world.sweep(sweep).expect("a sweep");
            sweeps.push(Sent {
                frames: link.frames(&mut heard, stamped.uav_time_ns).expect("frames"),
                truth: true_paths(&heard),
            });
        }
        sweeps
    })
}

fn true_paths(heard: &HeardSweep) -> Vec<TruePath> {
    let at = instant(&heard.truth).expect("a rotation");
    let paths = heard.link.paths.iter().map(|path| {
        let arrival = Direction::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad);
        let arrival = at.attitude.inverse().apply(arrival.expect("finite"));
        (
            SPEED_OF_LIGHT_M_PER_S * (path.delay_s + at.clock_offset_s),
            arrival,
        )
    });
    paths.collect()
}

fn header(frame: &FrameBytes) -> Header {
    Header::decode(frame.first_chunk().expect("as long")).expect("a sound header")
}

/// Numbers frames anew, in the order that they stand in.
fn renumber(frames: &mut Frames, sequence: &mut u32) {
    for frame in frames {
        let numbered = Header {
            sequence: *sequence,
            ..header(frame)
        };
        frame[..HEADER_LENGTH].copy_from_slice(&numbered.encode());
        *sequence += 1;
    }
}

/// Makes the begin of a sweep tell other powers, with a checksum that is right.
fn tell(frames: &mut Frames, lie: impl Fn(&Powers) -> Powers) {
    let begin = &mut frames[0];
    let payload = begin[HEADER_LENGTH..].as_chunks::<4>().0;
    let told: Powers = std::array::from_fn(|beam| f32::from_le_bytes(payload[beam]));
    let powers = lie(&told);
    let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
    write_powers(&powers, &mut samples);
    let lying = Header {
        payload_checksum: powers_checksum(&powers),
        ..header(begin)
    };
    begin[..HEADER_LENGTH].copy_from_slice(&lying.encode());
    let payload: &mut [u8; FRAME_LENGTH - HEADER_LENGTH] =
        (&mut begin[HEADER_LENGTH..]).try_into().expect("as long");
    write_samples(&samples, payload);
}

#[derive(Default)]
struct Log {
    paths: Vec<Vec<EstimatedPath<WorldFrame>>>,
}

impl Observer for Log {
    fn swept(&mut self, report: &SweepReport<PATHS>) {
        assert_eq!(report.beams, BEAMS as u16);
        let estimated = report.paths.iter().map(|path| path.estimated);
        self.paths.push(estimated.collect());
    }
}

/// What the receiver makes of the flight when `change` has worked on each sweep.
fn heard(change: impl Fn(&mut Frames)) -> (Vec<Vec<EstimatedPath<WorldFrame>>>, Counters) {
    with_board_receiver(|receiver| {
        let (mut log, mut sequence) = (Log::default(), 0);
        let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
        for sweep in sweeps() {
            let mut frames = sweep.frames.clone();
            change(&mut frames);
            renumber(&mut frames, &mut sequence);
            for frame in frames {
                let (header, payload) = frame.split_at(HEADER_LENGTH);
                read_samples(payload.try_into()?, &mut samples);
                receiver.frame(header.try_into()?, &mut samples, &mut log)?;
            }
        }
        receiver.end(&mut log);
        Ok((log.paths, *receiver.counters()))
    })
    .expect("a receiver")
}

/// What a sound front end's flight gives.
fn sound() -> &'static (Vec<Vec<EstimatedPath<WorldFrame>>>, Counters) {
    static SOUND: OnceLock<(Vec<Vec<EstimatedPath<WorldFrame>>>, Counters)> = OnceLock::new();
    SOUND.get_or_init(|| heard(|_| {}))
}

/// Sweeps that another one followed: what a sweep lacked is counted then.
fn ended(paths: &[Vec<EstimatedPath<WorldFrame>>]) -> u32 {
    paths.len() as u32 - 1
}

fn total(paths: &[Vec<EstimatedPath<WorldFrame>>]) -> usize {
    paths.iter().map(Vec::len).sum()
}

fn wrong(counters: &Counters) -> [u32; 3] {
    [
        counters.powers_missing,
        counters.powers_contradicted,
        counters.beams_unordered,
    ]
}

/// Share of the paths that are within 0.5 m and 3 degrees of a true one.
fn right(paths: &[Vec<EstimatedPath<WorldFrame>>]) -> f64 {
    let period_m = SAMPLES as f64 * Waveform::default().metres_per_sample();
    let (mut right, mut all) = (0, 0);
    for (found, sweep) in paths.iter().zip(sweeps()) {
        let is_right = |path: &&EstimatedPath<WorldFrame>| {
            sweep.truth.iter().any(|(c_tau_m, arrival)| {
                let off_m = (f64::from(path.path.c_tau_m) - c_tau_m).rem_euclid(period_m);
                let cross = path.path.aoa.vector().cast::<f64>() - arrival.vector();
                off_m.min(period_m - off_m) < 0.5 && cross.norm() < 3.0_f64.to_radians()
            })
        };
        right += found.iter().filter(is_right).count();
        all += found.len();
    }
    right as f64 / all as f64
}

#[test]
fn a_sound_front_end_is_wrong_in_nothing() {
    let (paths, counters) = sound();
    assert_eq!(wrong(counters), [0; 3]);
    assert!(total(paths) > paths.len());
    assert!(right(paths) > 0.95, "{}", right(paths));
}

#[test]
fn a_lie_about_powers_changes_no_path_and_is_counted() {
    let (paths, _) = sound();
    type Lie = fn(&Powers) -> Powers;
    let lies: [(&str, Lie); 3] = [
        ("all zero", |_| [0.0; BEAMS]),
        ("all full", |_| [f32::MAX; BEAMS]),
        ("shuffled", |told| {
            std::array::from_fn(|beam| told[(beam * 29 + 7) % BEAMS])
        }),
    ];
    for (name, lie) in lies {
        let (told, counters) = heard(|frames| tell(frames, lie));
        println!("{name}: {:?}", wrong(&counters));
        assert_eq!(&told, paths, "{name}");
        let [missing, contradicted, unordered] = wrong(&counters);
        assert_eq!((missing, unordered), (0, 0), "{name}");
        // Of powers in another order some are the same to a percent: those of beams of noise.
        let most = (paths.len() * BEAMS) as u32;
        assert!(
            contradicted > most / 4 && contradicted <= most,
            "{name}: {contradicted}"
        );
        assert!(
            name == "shuffled" || contradicted == most,
            "{name}: {contradicted}"
        );
    }
}

#[test]
fn a_begin_that_never_comes_changes_no_path_and_is_counted() {
    let (paths, _) = sound();
    let (without, counters) = heard(|frames| {
        frames.remove(0);
    });
    assert_eq!(&without, paths);
    assert_eq!(wrong(&counters), [ended(paths), 0, 0]);
}

#[test]
fn a_begin_without_powers_changes_no_path_and_is_counted() {
    let (paths, _) = sound();
    let (without, counters) = heard(|frames| {
        let silent = Header {
            powers: false,
            payload_checksum: 0,
            ..header(&frames[0])
        };
        frames[0][..HEADER_LENGTH].copy_from_slice(&silent.encode());
    });
    assert_eq!(&without, paths);
    assert_eq!(wrong(&counters), [ended(paths), 0, 0]);
}

#[test]
fn any_order_gives_right_paths_and_is_counted() {
    let (paths, _) = sound();
    let by_index = |frames: &mut Frames| frames.sort_by_key(|frame| (kind(frame), header(frame).index));
    let weakest_first = |frames: &mut Frames| frames[1..=BEAMS].reverse();
    type Order<'a> = &'a dyn Fn(&mut Frames);
    let orders: [(&str, Order<'_>); 2] = [("by index", &by_index), ("weakest first", &weakest_first)];
    for (name, order) in orders {
        let (other, counters) = heard(order);
        let [right, before] = [&other, paths].map(|paths| right(paths));
        println!(
            "{name}: {:.1} % of {} paths are right; {:.1} % of {} strongest first; {:?}",
            100.0 * right,
            total(&other),
            100.0 * before,
            total(paths),
            wrong(&counters)
        );
        assert!(right > 0.95 && right > before - 0.02, "{name}: {right}");
        assert!(total(&other).abs_diff(total(paths)) * 10 < total(paths), "{name}");
        let [missing, contradicted, unordered] = wrong(&counters);
        assert_eq!((missing, contradicted), (0, 0), "{name}");
        assert!(unordered as usize > 10 * paths.len(), "{name}: {unordered}");
    }
}

/// Begin, beams, pilots, squint symbols.
fn kind(frame: &FrameBytes) -> u8 {
    match header(frame).kind {
        Kind::Begin => 0,
        Kind::Beam => 1,
        Kind::Pilot => 2,
        Kind::Squint => 3,
    }
}
