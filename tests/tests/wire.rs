//! Faults on the wires of the whole receiver: frames of the front end, and records of sensors and beacon, are damaged, dropped,
//! repeated, swapped, overrun and held back at 0.1, 1 and 10 %. Every counter must be exact, no point may be wrong, and the first whole sweep
//! after the last fault must be heard whole.

use std::collections::BTreeSet;

use cslam_core::receiver::{PATHS, SweepReport};
use cslam_core::signal::Iq;
use cslam_core::telemetry::Key;
use cslam_firmware::app::Observer;
use cslam_firmware::front_end::{HEADER_LENGTH, Header, POWER_BYTES, read_samples};
use cslam_firmware::sensor_stream::{LENGTH, UAV};
use cslam_host_sim::evaluation::{Surfaces, downlink};
use cslam_host_sim::random::Stream;
use cslam_host_sim::raw_flight::{
    BoardReceiver, FrameBytes, FrontEndLink, Recorder, drain, with_board_receiver,
};
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{Profile, World, WorldConfig};

/// Length of the flight, and when faults begin and end: the filter has started by then, s.
const FLIGHT_S: f64 = 30.0;
const FAULTS_S: [f64; 2] = [12.0, 25.0];
/// A point is wrong when it is this far from every surface, m.
const WRONG_M: f64 = 0.5;

/// What happens to a frame or a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fault {
    None,
    Flip,
    Drop,
    Repeat,
    /// Comes after the next one.
    Swap,
    /// Is given up by the front end, which says so in the frames after it.
    Overrun,
}

/// Draws faults at a rate, each kind a fifth of it.
struct Faults {
    rate: f64,
    stream: Stream,
}

impl Faults {
    fn draw(&mut self) -> Fault {
        let u = self.stream.uniform();
        match (u / self.rate * 5.0) as u32 {
            0 => Fault::Flip,
            1 => Fault::Drop,
            2 => Fault::Repeat,
            3 => Fault::Swap,
            4 => Fault::Overrun,
            _ => Fault::None,
        }
    }

    fn below(&mut self, n: usize) -> usize {
        ((self.stream.uniform() * n as f64) as usize).min(n - 1)
    }
}

/// Keeps what a flight came to.
#[derive(Default)]
struct Log {
    /// Number, time and beams of each sweep.
    sweeps: Vec<(u32, u64, u16)>,
}

impl Observer for Log {
    fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.sweeps.push((report.sweep, report.time_ns, report.beams));
    }
}

/// What was done to one wire, and so what its counters must say.
#[derive(Default, Debug)]
struct Expected {
    damaged: u32,
    repeated: u32,
    /// Given up by the front end, and how many of them a frame that came has told.
    given_up: u32,
    told: u32,
    /// Numbers of those that came whole.
    whole: BTreeSet<u32>,
}

impl Expected {
    fn lost(&self) -> u32 {
        self.whole
            .last()
            .map_or(0, |last| last + 1 - self.whole.len() as u32)
    }
}

/// Figures of a flight.
struct Flown {
    points: usize,
    wrong: usize,
    worst_m: f64,
    log: Log,
}

/// Flies with faults at a rate and checks the counters.
fn fly(rate: f64) -> Flown {
    let scene = Scene::load("outdoor").expect("built in");
    let mut config = WorldConfig::of(Profile::Budget);
    config.flight.duration_s = FLIGHT_S;
    let world = World::new(&scene, config, 1).expect("a flight");
    let mut packets = Vec::new();
    let mut log = Log::default();
    with_board_receiver(|receiver| {
        let mut wires = Wires {
            faults: Faults {
                rate: rate.max(1e-9),
                stream: Stream::new(7, (rate * 1e6) as u64),
            },
            receiver,
            log: &mut log,
            packets: &mut packets,
            samples: Box::new([[Iq::ZERO; 512]; 32]),
            frames: Expected::default(),
            records: Expected::default(),
            late_record: None,
        };
        wires.fly(&world);
        Ok(())
    })
    .expect("a receiver");
    let heard = downlink::decode(&packets, UAV, &Key::TEST);
    assert!(heard.refused.is_empty(), "{:?}", heard.refused);
    let surfaces = Surfaces::new(&scene);
    let off_m: Vec<f64> = heard
        .points
        .iter()
        .filter_map(|point| Some(surfaces.nearest(point.position_m.map(f64::from))?.1))
        .collect();
    Flown {
        points: off_m.len(),
        wrong: off_m.iter().filter(|off| **off > WRONG_M).count(),
        worst_m: off_m.iter().copied().fold(0.0, f64::max),
        log,
    }
}

struct Wires<'a, 'm> {
    faults: Faults,
    receiver: &'a mut BoardReceiver<'m>,
    log: &'a mut Log,
    packets: &'a mut Vec<u8>,
    samples: Box<[[Iq; 512]; 32]>,
    frames: Expected,
    records: Expected,
    late_record: Option<[u8; LENGTH]>,
}

impl Wires<'_, '_> {
    fn fly(&mut self, world: &World<'_>) {
        let mut recorder = Recorder::default();
        let mut link = FrontEndLink::default();
        let mut held: Vec<Box<FrameBytes>> = Vec::new();
        let mut hold = 0;
        let mut sequence = 0;
        for stamped in world.flight().events() {
            let at_s = stamped.uav_time_ns as f64 * 1e-9;
            let faulty = (FAULTS_S[0]..FAULTS_S[1]).contains(&at_s);
            let Some(record) = recorder.record(&stamped) else {
                continue;
            };
            let fault = if faulty { self.faults.draw() } else { Fault::None };
            self.record(record.number, record.encode(), fault);
            if let Event::Sweep { sweep } = stamped.event {
                let mut heard = world.sweep(sweep).expect("a sweep");
                let mut frames = link.frames(&mut heard, stamped.uav_time_ns).expect("frames");
                // A stall: the rest of the sweep comes 0.2 s late.
                let stalled = faulty && self.faults.stream.uniform() < self.faults.rate;
                let whole = if stalled { frames.len() / 2 } else { frames.len() };
                held = frames.split_off(whole);
                hold = 200;
                self.frames(frames, &mut sequence, faulty);
            } else if !held.is_empty() {
                hold -= 1;
                if hold == 0 {
                    let late = std::mem::take(&mut held);
                    self.frames(late, &mut sequence, faulty);
                }
            }
            drain(self.receiver.downlink(), self.packets);
        }
        self.receiver.end(self.log);
        self.receiver.close();
        drain(self.receiver.downlink(), self.packets);
        self.check();
    }

    /// A record through its wire.
    fn record(&mut self, number: u32, mut bytes: [u8; LENGTH], fault: Fault) {
        let mut deliver = |bytes: &[u8; LENGTH]| {
            let _counted = self.receiver.record(bytes, self.log);
        };
        match fault {
            Fault::Drop | Fault::Overrun => {}
            Fault::Flip => {
                let bit = self.faults.below(8 * LENGTH);
                bytes[bit / 8] ^= 1 << (bit % 8);
                self.records.damaged += 1;
                deliver(&bytes);
            }
            Fault::Swap if self.late_record.is_none() => {
                self.late_record = Some(bytes);
                return;
            }
            Fault::Repeat => {
                deliver(&bytes);
                deliver(&bytes);
                self.records.repeated += 1;
                self.records.whole.insert(number);
            }
            _ => {
                deliver(&bytes);
                self.records.whole.insert(number);
            }
        }
        if let Some(late) = self.late_record.take() {
            let came = self.records.whole.last().copied();
            let _counted = self.receiver.record(&late, self.log);
            if came == Some(number) {
                // A newer one has been used: it is late, and stays among the lost.
                self.records.repeated += 1;
            } else {
                self.records.whole.insert(number - 1);
            }
        }
    }

    /// Frames through their wire.
    fn frames(&mut self, frames: Vec<Box<FrameBytes>>, sequence: &mut u32, faulty: bool) {
        let mut late: Option<(u32, Box<FrameBytes>)> = None;
        for mut frame in frames {
            let number = *sequence;
            *sequence += 1;
            self.tell(&mut frame);
            match if faulty { self.faults.draw() } else { Fault::None } {
                Fault::Drop => {}
                Fault::Overrun => self.frames.given_up += 1,
                Fault::Flip => {
                    // Behind its powers a begin has filler.
                    let bytes = if frame[5] == 1 {
                        HEADER_LENGTH + POWER_BYTES
                    } else {
                        frame.len()
                    };
                    let bit = self.faults.below(8 * bytes);
                    frame[bit / 8] ^= 1 << (bit % 8);
                    self.frames.damaged += 1;
                    self.frame(&frame);
                }
                Fault::Repeat => {
                    self.frame(&frame);
                    self.frame(&frame);
                    self.frames.repeated += 1;
                    self.came(number, &frame);
                }
                Fault::Swap if late.is_none() => {
                    late = Some((number, frame));
                    continue;
                }
                _ => {
                    self.frame(&frame);
                    self.came(number, &frame);
                }
            }
            if let Some((number, frame)) = late.take() {
                self.frame(&frame);
                self.came(number, &frame);
            }
        }
        if let Some((number, frame)) = late {
            self.frame(&frame);
            self.came(number, &frame);
        }
    }

    /// Puts into a frame's header how many the front end has given up.
    fn tell(&self, frame: &mut FrameBytes) {
        let (head, _) = frame.split_at_mut(HEADER_LENGTH);
        let head: &mut [u8; HEADER_LENGTH] = head.try_into().expect("as long");
        let header = Header::decode(head).expect("a sound header");
        *head = Header {
            dropped: self.frames.given_up,
            ..header
        }
        .encode();
    }

    /// A frame came whole; the newest one's count of those given up is the link's.
    fn came(&mut self, number: u32, frame: &FrameBytes) {
        if self.frames.whole.last().is_none_or(|last| number > *last) {
            let head = frame.first_chunk().expect("as long");
            self.frames.told = Header::decode(head).expect("a sound header").dropped;
        }
        self.frames.whole.insert(number);
    }

    fn frame(&mut self, frame: &FrameBytes) {
        let (header, payload) = frame.split_at(HEADER_LENGTH);
        read_samples(payload.try_into().expect("as long"), &mut self.samples);
        let header = header.try_into().expect("as long");
        let _counted = self.receiver.frame(header, &mut self.samples, self.log);
    }

    /// Every counter is exact.
    fn check(&mut self) {
        let link = self.receiver.front_end().counters();
        assert_eq!(link.damaged(), self.frames.damaged, "damaged frames");
        assert_eq!(link.repeated, self.frames.repeated, "repeated frames");
        assert_eq!(
            link.ok + link.late,
            self.frames.whole.len() as u32,
            "whole frames"
        );
        assert_eq!(link.lost, self.frames.lost(), "lost frames");
        assert_eq!(
            link.overrun, self.frames.told,
            "frames that the front end gave up"
        );
        assert_eq!([link.foreign, link.stale, link.cut], [0; 3]);
        let counters = self.receiver.counters();
        assert_eq!(counters.records_damaged, self.records.damaged, "damaged records");
        assert_eq!(
            counters.records_repeated, self.records.repeated,
            "repeated records"
        );
        assert_eq!(counters.records_lost, self.records.lost(), "lost records");
        assert_eq!(
            self.receiver.downlink().sent_and_dropped()[1],
            0,
            "dropped packets"
        );
    }
}

/// Flies and checks what holds at every rate.
fn ride(rate: f64) {
    let flown = fly(rate);
    println!(
        "faults at {} %: {} points, {} of them further than {WRONG_M} m from every surface, worst {:.2} m; {} sweeps",
        100.0 * rate,
        flown.points,
        flown.wrong,
        flown.worst_m,
        flown.log.sweeps.len()
    );
    assert_eq!(flown.wrong, 0, "a wrong point was sent");
    assert!(flown.points > 5, "hardly a point was sent");
    // Sweeps that began after the last fault are whole, from the first on.
    let end_ns = (FAULTS_S[1] * 1e9) as u64;
    let after: Vec<_> = flown
        .log
        .sweeps
        .iter()
        .filter(|(_, at_ns, _)| *at_ns > end_ns)
        .collect();
    assert!(after.len() >= 9, "{after:?}");
    assert!(after.iter().all(|(_, _, beams)| *beams == 72), "{after:?}");
    let numbers: Vec<u32> = flown.log.sweeps.iter().map(|(number, ..)| *number).collect();
    assert!(
        numbers.windows(2).all(|pair| pair[1] == pair[0] + 1),
        "a sweep is missing: {numbers:?}"
    );
}

#[test]
fn without_faults() {
    ride(0.0);
}

#[test]
fn one_in_a_thousand() {
    ride(0.001);
}

#[test]
fn one_in_a_hundred() {
    ride(0.01);
}

#[test]
fn one_in_ten() {
    ride(0.1);
}
