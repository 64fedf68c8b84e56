//! Hostile packets against the receiver that flies, while it flies.
//!
//! Two receivers fly through the same samples. One of them hears, besides what the GMT says, what an attacker sends who knows
//! everything but the key. Neither its pose nor its clock may differ from the other one's by a bit.

use std::fmt;
use std::time::Instant;

use cslam_core::telemetry::{
    BeaconReport, Command, Key, MAX_FRAME, REORDERING, Sender, TimingReport, Uplink,
};
use cslam_firmware::sensor_stream::UAV;
use serde::Serialize;

use crate::flight::FlightConfig;
use crate::raw_flight::{BoardReceiver, Recorder, Source, hear, report, with_board_receiver};
use crate::scene::Scene;
use crate::sensors::Event;
use crate::table::Table;
use crate::world::{Profile, World, WorldConfig};

/// Length of the flight, s.
const FLIGHT_S: f64 = 14.0;
const SEED: u64 = 1;
/// First counter of the GMT: what it sent before was recorded by the attacker, and never came to the receiver.
const FIRST: u32 = 100_000;
/// Packets from before that are at hand.
const RECORDED: u32 = 4096;

/// What an attacker sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Right in every bit but the code: another key.
    Forged,
    /// Taken before.
    Replayed,
    /// Genuine, and held back for so long that newer ones have overtaken it.
    Stale,
    /// What the GMT said, with another time and another key.
    Shifted,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Forged, Self::Replayed, Self::Stale, Self::Shifted];
}

/// What came of it.
#[derive(Clone, Debug, Serialize)]
pub struct Figures {
    /// Packets of each kind, in the order of [`Kind::ALL`].
    pub packets: [u64; 4],
    /// Beacons, exchanges and commands that the attacked receiver took beyond those of the other.
    pub taken: u64,
    /// Packets that it refused and counted.
    pub refused: u64,
    /// Sweeps after which both poses and clocks were compared, and how many there were with a pose.
    pub compared: [u32; 2],
    /// Comparisons in which they differed.
    pub moved: u32,
    /// Time that the receiver took to refuse them, with the making of them, s.
    pub elapsed_s: f64,
}

impl Figures {
    /// Whether nothing was taken and nothing moved.
    #[must_use]
    pub fn is_safe(&self) -> bool {
        let sent: u64 = self.packets.iter().sum();
        self.taken == 0 && self.moved == 0 && self.refused == sent && self.compared[1] > 0
    }
}

impl fmt::Display for Figures {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut table = Table::new(["hostile packets", "sent"]);
        for (kind, packets) in ["forged", "replayed", "stale", "shifted in time"]
            .iter()
            .zip(self.packets)
        {
            table.row([(*kind).to_owned(), packets.to_string()]);
        }
        let sent: u64 = self.packets.iter().sum();
        table.row(["taken".to_owned(), self.taken.to_string()]);
        table.row(["refused and counted".to_owned(), self.refused.to_string()]);
        write!(
            f,
            "{table}pose and clock moved in {} of {} sweeps, {} of them with a pose; {:.1} s, {:.2} us a packet",
            self.moved,
            self.compared[0],
            self.compared[1],
            self.elapsed_s,
            1e6 * self.elapsed_s / sent.max(1) as f64
        )
    }
}

/// Flies, and sends so many hostile packets in between.
///
/// # Errors
/// When the world cannot be made.
pub fn run(packets: u64) -> anyhow::Result<Figures> {
    let scene = Scene::load("outdoor")?;
    let config = WorldConfig {
        flight: FlightConfig {
            duration_s: FLIGHT_S,
            ..FlightConfig::default()
        },
        ..WorldConfig::of(Profile::Budget)
    };
    let world = World::new(&scene, config, SEED)?;
    with_board_receiver(|left_alone| {
        with_board_receiver(|attacked| fly(&world, left_alone, attacked, packets))
    })
}

fn fly(
    world: &World<'_>,
    left_alone: &mut BoardReceiver<'_>,
    attacked: &mut BoardReceiver<'_>,
    packets: u64,
) -> anyhow::Result<Figures> {
    let mut gmt = Sender::new(UAV, &Key::TEST, FIRST);
    let mut attacker = Attacker::new()?;
    let mut recorder = Recorder::default();
    let mut figures = Figures {
        packets: [0; 4],
        taken: 0,
        refused: 0,
        compared: [0; 2],
        moved: 0,
        elapsed_s: 0.0,
    };
    let sweeps = u64::from(world.sweeps());
    for stamped in world.flight().events() {
        let at = stamped.uav_time_ns;
        let said = match &stamped.event {
            Event::Beacon(said) => Some(Uplink::Beacon(report(said))),
            Event::Timing(sample) => Some(Uplink::Timing(TimingReport {
                time_ns: at,
                clock_offset_s: sample.clock_offset_s,
            })),
            _ => None,
        };
        if let Some(said) = said {
            let mut buffer = [0; MAX_FRAME];
            let frame = gmt.encode(&said, &mut buffer)?;
            left_alone.uplink(at, frame, |_| None, &mut ());
            attacked.uplink(at, frame, |_| None, &mut ());
            attacker.heard(&said, frame);
        } else if let Some(record) = recorder.record(&stamped) {
            let record = record.encode();
            let _counted = left_alone.record(&record, &mut ());
            let _counted = attacked.record(&record, &mut ());
        }
        let Event::Sweep { sweep } = stamped.event else {
            continue;
        };
        let mut heard = Source::sweep(world, sweep)?;
        // Samples are worked on in place.
        hear(left_alone, &mut heard.clone(), sweep, at, &mut ());
        hear(attacked, &mut heard, sweep, at, &mut ());
        let (done, sweep) = (figures.packets.iter().sum::<u64>(), u64::from(sweep));
        let due = packets * (sweep + 1) / sweeps - done;
        let began = Instant::now();
        for number in done..done + due {
            let kind = (number % 4) as usize;
            let frame = attacker.frame(Kind::ALL[kind], number, at, gmt.counter());
            attacked.uplink(at, &frame, |_| None, &mut ());
            figures.packets[kind] += 1;
        }
        figures.elapsed_s += began.elapsed().as_secs_f64();
        let [here, there] = [&*left_alone, &*attacked].map(|receiver| {
            let pose = receiver.cslam().pose();
            let clock_m = pose
                .as_ref()
                .and_then(|pose| receiver.cslam().clock_offset_m(pose));
            (pose, clock_m, receiver.cslam().health())
        });
        figures.compared[0] += 1;
        figures.compared[1] += u32::from(here.0.is_some());
        figures.moved += u32::from(here != there);
    }
    let [here, there] = [&*left_alone, &*attacked].map(|receiver| *receiver.counters());
    let taken = |counters: &cslam_firmware::app::Counters| {
        u64::from(counters.beacons) + u64::from(counters.timing) + u64::from(counters.commands)
    };
    figures.taken = taken(&there) - taken(&here);
    figures.refused = u64::from(there.uplink_unsigned) + u64::from(there.uplink_replayed);
    Ok(figures)
}

/// Knows everything but the key.
struct Attacker {
    stale: Vec<Vec<u8>>,
    taken: Vec<Vec<u8>>,
    last: Uplink,
}

impl Attacker {
    fn new() -> anyhow::Result<Self> {
        let mut gmt = Sender::new(UAV, &Key::TEST, FIRST - RECORDED - REORDERING);
        let stale = (0..RECORDED).map(|number| {
            let said = hostile(u64::from(number), 1_000_000_000);
            Ok(gmt.encode(&said, &mut [0; MAX_FRAME])?.to_vec())
        });
        let stale = stale.collect::<anyhow::Result<Vec<_>>>()?;
        Ok(Self {
            taken: stale.clone(),
            stale,
            last: Uplink::Command(Command::SendConfig),
        })
    }

    /// Sees what goes over the air.
    fn heard(&mut self, said: &Uplink, frame: &[u8]) {
        if self.taken.first() == self.stale.first() {
            self.taken.clear();
        }
        self.taken.push(frame.to_vec());
        self.last = *said;
    }

    /// The frame of hostile packet `number` at a time; the GMT goes on with counter `next`.
    fn frame(&self, kind: Kind, number: u64, at_ns: u64, next: u32) -> Vec<u8> {
        let among = |frames: &[Vec<u8>]| frames[(number / 4) as usize % frames.len()].clone();
        let said = match kind {
            Kind::Replayed => return among(&self.taken),
            Kind::Stale => return among(&self.stale),
            Kind::Forged => hostile(number / 4, at_ns),
            Kind::Shifted => shifted(&self.last, number, at_ns),
        };
        let key = Key::new(core::array::from_fn(|place| (number >> (place % 8)) as u8));
        let mut forger = Sender::new(UAV, &key, next.wrapping_add((number % 1000) as u32));
        let mut buffer = [0; MAX_FRAME];
        forger.encode(&said, &mut buffer).unwrap_or(&[]).to_vec()
    }
}

/// What an attacker would like the UAV to hear.
fn hostile(number: u64, at_ns: u64) -> Uplink {
    match number % 3 {
        0 => Uplink::Beacon(BeaconReport {
            sweep: (number % 100) as u32,
            position_m: [20.0, 20.0, 2.0],
            sigma_m: 0.01,
            heading_pitch_roll_rad: [1.0, 0.0, 0.0],
            sweeps_per_stop: 2,
        }),
        1 => Uplink::Timing(TimingReport {
            time_ns: at_ns + number % 1000,
            clock_offset_s: 1e-6,
        }),
        _ => Uplink::Command(Command::Reboot),
    }
}

/// What was said, at another time: up to an hour before or after.
fn shifted(said: &Uplink, number: u64, at_ns: u64) -> Uplink {
    match said {
        Uplink::Timing(timing) => Uplink::Timing(TimingReport {
            time_ns: (at_ns + number.wrapping_mul(7_919) % 7_200_000_000_000)
                .saturating_sub(3_600_000_000_000),
            ..*timing
        }),
        Uplink::Beacon(beacon) => Uplink::Beacon(BeaconReport {
            sweep: beacon
                .sweep
                .wrapping_add((number % 7200) as u32)
                .wrapping_sub(3600),
            ..*beacon
        }),
        other => *other,
    }
}
