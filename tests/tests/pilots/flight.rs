//! Sweeps with their pilots, changed, and what the receiver makes of them.

use std::sync::OnceLock;

use cslam_core::geometry::Vector3;
use cslam_core::inertial::ImuSample;
use cslam_core::path::RangeRate;
use cslam_core::paths::EstimatedPath;
use cslam_core::receiver::{Config, PATHS, Pilots, SweepReport};
use cslam_core::signal::Iq;
use cslam_firmware::app::{Counters, Observer};
use cslam_firmware::front_end::{
    BEAMS, Block, Checksum, Counters as LinkCounters, FrameError, HEADER_LENGTH, Header, Kind, PILOT_BEAMS,
    PILOTS_OF_A_BEAM, SoftwareCrc, read_samples, write_samples,
};
use cslam_host_sim::raw_flight::{BoardReceiver, FrameBytes, FrontEndLink, board_config, with_receiver};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{Profile, World, WorldConfig};

/// Pilots of a sweep.
pub(super) const PER_SWEEP: usize = (PILOTS_OF_A_BEAM * PILOT_BEAMS) as usize;
/// Length of the flight, and from when on its sweeps are heard: it passes walls then, s.
const FLIGHT_S: f64 = 20.0;
const FROM_S: f64 = 13.0;

pub(super) type Frames = Vec<Box<FrameBytes>>;

pub(super) fn world(scene: &Scene, duration_s: f64) -> World<'_> {
    let mut config = WorldConfig::of(Profile::Budget);
    config.flight.duration_s = duration_s;
    World::new(scene, config, 1).expect("a flight")
}

/// The sweeps as a sound front end sends them.
pub(super) fn sweeps() -> &'static [Frames] {
    static SWEEPS: OnceLock<Vec<Frames>> = OnceLock::new();
    SWEEPS.get_or_init(|| {
        let scene = Scene::load("outdoor").expect("built in");
        let world = world(&scene, FLIGHT_S);
        let mut link = FrontEndLink::default();
        let mut sweeps = Vec::new();
        for stamped in world.flight().events() {
            let is_heard = stamped.uav_time_ns as f64 * 1e-9 > FROM_S;
            if let Event::Sweep { sweep } = stamped.event
                && is_heard
            {
                let mut heard = world.sweep(sweep).expect("a sweep");
                sweeps.push(link.frames(&mut heard, stamped.uav_time_ns).expect("frames"));
            }
        }
        sweeps
    })
}

pub(super) fn header(frame: &FrameBytes) -> Header {
    Header::decode(frame.first_chunk().expect("as long")).expect("a sound header")
}

pub(super) fn change_header(frame: &mut FrameBytes, change: impl Fn(Header) -> Header) {
    let changed = change(header(frame)).encode();
    frame[..HEADER_LENGTH].copy_from_slice(&changed);
}

pub(super) fn is_pilot(frame: &FrameBytes) -> bool {
    header(frame).kind == Kind::Pilot
}

/// Whether a pilot is its beam's second one.
pub(super) fn is_second(frame: &FrameBytes) -> bool {
    header(frame).index >= BEAMS
}

/// Puts other samples into a frame, under a checksum that is right.
pub(super) fn fill(frame: &mut FrameBytes, mut sample: impl FnMut() -> Iq) {
    let mut samples: Box<Block> = Box::new([[Iq::ZERO; 512]; 32]);
    samples.as_flattened_mut().fill_with(&mut sample);
    change_header(frame, |header| Header {
        payload_checksum: SoftwareCrc.samples(&samples),
        ..header
    });
    write_samples(
        &samples,
        (&mut frame[HEADER_LENGTH..]).try_into().expect("as long"),
    );
}

/// A sweep as it was estimated, and the path that was listened to.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Estimated {
    sweep: u32,
    /// Without their rates.
    pub(super) paths: Vec<EstimatedPath>,
    pub(super) rates: Vec<Option<RangeRate>>,
    pub(super) sighted: Option<usize>,
    /// Whether there was a pose after it.
    pub(super) placed: bool,
}

#[derive(Default)]
pub(super) struct Log {
    pub(super) sweeps: Vec<Estimated>,
}

impl Observer for Log {
    fn estimated(&mut self, paths: &[EstimatedPath], sighted: Option<usize>) {
        self.sweeps.push(Estimated {
            sweep: 0,
            rates: paths.iter().map(|path| path.range_rate).collect(),
            paths: paths
                .iter()
                .map(|path| EstimatedPath {
                    range_rate: None,
                    ..*path
                })
                .collect(),
            sighted,
            placed: false,
        });
    }

    fn swept(&mut self, report: &SweepReport<PATHS>) {
        let last = self.sweeps.last_mut().expect("it was estimated");
        last.sweep = report.sweep;
        last.placed = report.pose.is_some();
    }
}

/// What the receiver made of a flight.
pub(super) struct Heard {
    pub(super) sweeps: Vec<Estimated>,
    counters: Counters,
    pub(super) stray_blocks: u32,
    link: LinkCounters,
    pub(super) refused: Vec<FrameError>,
}

impl Heard {
    pub(super) fn rates(&self) -> usize {
        self.sweeps
            .iter()
            .flat_map(|sweep| &sweep.rates)
            .flatten()
            .count()
    }

    /// The paths are those of the sound front end, and frames were refused as often as this.
    pub(super) fn is_sound_but_for(&self, late: usize, out_of_range: usize, name: &str) {
        let bare = |sweeps: &[Estimated]| -> Vec<Estimated> {
            let without = |sweep: &Estimated| Estimated {
                rates: Vec::new(),
                ..sweep.clone()
            };
            sweeps.iter().map(without).collect()
        };
        assert_eq!(bare(&self.sweeps), bare(&sound().sweeps), "{name}");
        let wrong = [
            self.counters.late_blocks,
            self.link.damaged_header,
            self.stray_blocks,
            self.link.damaged_payload,
            self.counters.powers_contradicted,
        ];
        assert_eq!(wrong, [late as u32, out_of_range as u32, 0, 0, 0], "{name}");
        assert_eq!(self.refused.len(), out_of_range, "{name}");
    }
}

/// What the receiver makes of the flight when `change` has worked on all sweeps.
pub(super) fn heard_by(config: Config<'static>, change: impl FnOnce(&mut Vec<Frames>)) -> Heard {
    let mut flight = sweeps().to_vec();
    change(&mut flight);
    with_receiver(config, |receiver| {
        let (mut log, mut refused) = (Log::default(), Vec::new());
        let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
        let mut begun = None;
        for (sequence, mut frame) in (0..).zip(flight.into_iter().flatten()) {
            // The rest of a header may be wrong.
            let sweep = u32::from_le_bytes(frame[12..16].try_into()?);
            if begun < Some(sweep) {
                begun = Some(sweep);
                let sweep_ns = u64::from_le_bytes(frame[24..32].try_into()?);
                turn(receiver, (sweep, sweep_ns), &mut log);
            }
            // An index that is out of range stays so.
            let index = u16::from_le_bytes([frame[16], frame[17]]);
            frame[16..18].copy_from_slice(&[0; 2]);
            seal(&mut frame);
            change_header(&mut frame, |header| Header {
                sequence,
                index,
                ..header
            });
            let (header, payload) = frame.split_at(HEADER_LENGTH);
            read_samples(payload.try_into()?, &mut samples);
            refused.extend(receiver.frame(header.try_into()?, &mut samples, &mut log).err());
        }
        receiver.end(&mut log);
        Ok(Heard {
            sweeps: log.sweeps,
            counters: *receiver.counters(),
            stray_blocks: receiver.cslam().counters().stray_blocks,
            link: receiver.front_end().counters(),
            refused,
        })
    })
    .expect("a receiver")
}

/// Tells how fast the body turns when a sweep begins: two samples, of which the second says how long the first one holds.
fn turn(receiver: &mut BoardReceiver<'_>, (sweep, sweep_ns): (u32, u64), log: &mut Log) {
    static TURNS: OnceLock<Vec<Vector3<f32>>> = OnceLock::new();
    let turns = TURNS.get_or_init(|| {
        let scene = Scene::load("outdoor").expect("built in");
        let world = world(&scene, FLIGHT_S);
        let turn = |sweep| world.flight().sweep_truth(sweep).uav.rate_rad_per_s;
        (0..world.sweeps())
            .map(|sweep| turn(sweep).cast::<f32>())
            .collect()
    });
    for before_ns in [1_000_000, 0] {
        let sample = ImuSample {
            time_ns: sweep_ns - before_ns,
            rate_rad_per_s: turns[sweep as usize],
            specific_force_m_per_s2: Vector3::new(0.0, 0.0, 9.8),
        };
        receiver.imu(&sample, log);
    }
}

/// Makes the checksum of a header fit.
fn seal(frame: &mut FrameBytes) {
    let checksum = SoftwareCrc.bytes(&frame[..HEADER_LENGTH - 4]);
    frame[HEADER_LENGTH - 4..HEADER_LENGTH].copy_from_slice(&checksum.to_le_bytes());
}

/// The same of a receiver that reads the pilots of every sweep.
pub(super) fn heard(change: impl FnOnce(&mut Vec<Frames>)) -> Heard {
    let config = Config {
        pilots: Pilots::EverySweep,
        ..board_config().expect("the board's")
    };
    heard_by(config, change)
}

/// The same of what `change` makes of each pilot.
pub(super) fn heard_with(mut change: impl FnMut(&mut FrameBytes)) -> Heard {
    heard(|flight| {
        for frame in flight.iter_mut().flatten().filter(|frame| is_pilot(frame)) {
            change(frame);
        }
    })
}

/// What a sound front end's flight gives.
pub(super) fn sound() -> &'static Heard {
    static SOUND: OnceLock<Heard> = OnceLock::new();
    SOUND.get_or_init(|| heard(|_| {}))
}
