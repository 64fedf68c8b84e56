//! The link's protocol against a model of the front end, the camera port and its DMA that is exact to the clock: the machine that flies
//! ([`cslam_firmware::front_end::Capture`]), frames that come late, short, long, twice or not at all, and a processor that is busy.

mod lines;
mod port;
mod processor;
mod random;

use std::collections::BTreeSet;
use std::sync::OnceLock;

use cslam_core::ltd::Iq;
use cslam_firmware::front_end::{
    BEAMS, Block, Checksum, Counters, FRAME_LENGTH, FRAMES_PER_SWEEP, Header, Kind, SQUINT_SYMBOLS,
    SoftwareCrc, Status,
};

use lines::{CLOCKS_PER_US, Driver, Run, Transfer};
use port::World;
use processor::{Known, Processor, SESSION};
use random::Random;

const LENGTH: u64 = FRAME_LENGTH as u64;
const SECOND: u64 = 1_000_000 * CLOCKS_PER_US;
/// Two sweeps a second.
const PERIOD: u64 = SECOND / 2;
/// docs/front-end.md, PATIENCE.
const PATIENCE: u64 = 450_000 * CLOCKS_PER_US;

/// Four payloads, which frames have in turn, with their checksums.
fn known() -> &'static Known {
    static KNOWN: OnceLock<Known> = OnceLock::new();
    KNOWN.get_or_init(|| {
        let mut random = Random::new(1);
        let mut payload = || {
            let mut block: Box<Block> = vec![[Iq::ZERO; 512]; 32].try_into().expect("32 channels");
            block
                .as_flattened_mut()
                .fill_with(|| Iq::from_word(random.below(1 << 32) as u32));
            (block.as_flattened().to_vec(), SoftwareCrc.samples(&block))
        };
        Known((0..4).map(|_| payload()).collect())
    })
}

fn world() -> World {
    let payloads = known().0.iter().map(|(payload, _)| payload.clone()).collect();
    World::new(Driver::new(payloads))
}

/// What goes wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Fault {
    /// Nothing.
    Sound,
    /// It ends early, by a byte or by all of them.
    Short,
    /// It goes on beyond its end.
    Long,
    /// VSYNC does not fall before the next one.
    Merged,
    /// HSYNC falls in the middle of it, for longer than a frame may take.
    Stalled,
    /// It is captured and never sent.
    Missing,
    /// Newer ones come before it.
    Late,
    /// It is sent again.
    Doubled,
    /// It is sent again at once, without READY.
    DoubledUnbidden,
}

const FAULTS: [Fault; 8] = [
    Fault::Short,
    Fault::Long,
    Fault::Merged,
    Fault::Stalled,
    Fault::Missing,
    Fault::Late,
    Fault::Doubled,
    Fault::DoubledUnbidden,
];

/// So many clocks of data.
fn data(clocks: u64) -> Run {
    Run {
        vsync: true,
        hsync: true,
        clocks,
    }
}

/// So many clocks within a frame without data.
fn pause(clocks: u64) -> Run {
    Run {
        vsync: true,
        hsync: false,
        clocks,
    }
}

/// Frames of the front end, sweep by sweep.
struct Source {
    random: Random,
    /// One frame of so many has a fault; `u64::MAX` for none.
    one_in: u64,
    sequence: u32,
    /// Frames without a fault in a row.
    sound: u32,
    /// A late frame, and after how many others it goes.
    held_back: Option<(Transfer, u64)>,
    /// Of the late frames, those that a newer one was sent before.
    late: u32,
    newest: u32,
    /// Numbers of the frames that are sent as they should be.
    good: BTreeSet<u32>,
    faults: Vec<(u32, Fault)>,
}

impl Source {
    fn new(seed: u64, one_in: u64) -> Self {
        Self {
            random: Random::new(seed),
            one_in,
            sequence: 0,
            sound: 0,
            held_back: None,
            late: 0,
            newest: 0,
            good: BTreeSet::new(),
            faults: Vec::new(),
        }
    }

    /// Puts a sweep into the front end's memory.
    fn sweep(&mut self, sweep: u32, driver: &mut Driver) {
        // The last symbol has been on air.
        let from = u64::from(sweep) * PERIOD + 438 * CLOCKS_PER_US;
        for place in 0..FRAMES_PER_SWEEP {
            let (kind, index) = match place {
                0 => (Kind::Begin, BEAMS + SQUINT_SYMBOLS),
                _ if place <= BEAMS => (Kind::Beam, place - 1),
                _ => (Kind::Squint, place - 1 - BEAMS),
            };
            let payload = self.sequence as usize % 4;
            let header = Header {
                kind,
                session: SESSION,
                sequence: self.sequence,
                sweep,
                index,
                exponent: if kind == Kind::Begin { 0 } else { -38 },
                sweep_ns: u64::from(sweep) * 500_000_000,
                offset_ns: 4000 * u32::from(place),
                payload_checksum: if kind == Kind::Begin {
                    0
                } else {
                    known().0[payload].1
                },
                dropped: 0,
                status: Status(0),
            };
            self.sequence += 1;
            let transfer = Transfer {
                from,
                until: from + PATIENCE,
                header,
                payload,
                runs: self.sound_runs(),
                unbidden: false,
            };
            self.send(transfer, driver);
        }
        // The next sweep would find it too old.
        if let Some((late, _)) = self.held_back.take() {
            self.release(late, driver);
        }
    }

    /// A late frame goes at last.
    fn release(&mut self, late: Transfer, driver: &mut Driver) {
        self.late += u32::from(late.header.sequence < self.newest);
        driver.queue.push_back(late);
    }

    /// All of a frame, with pauses now and then, which begin at whole words.
    fn sound_runs(&mut self) -> Vec<Run> {
        let mut runs = Vec::new();
        let mut left = LENGTH;
        for _ in 0..self.random.below(4) {
            let clocks = 4 * self.random.below(left / 4);
            if clocks > 0 {
                runs.extend([data(clocks), pause(1 + self.random.below(2000))]);
                left -= clocks;
            }
        }
        runs.push(data(left));
        runs
    }

    /// Puts a frame into the queue, with what is wrong with it.
    fn send(&mut self, mut transfer: Transfer, driver: &mut Driver) {
        let number = transfer.header.sequence;
        let fault = self.fault();
        if fault != Fault::Sound {
            self.faults.push((number, fault));
        }
        let is_good = matches!(
            fault,
            Fault::Sound | Fault::Late | Fault::Doubled | Fault::DoubledUnbidden
        );
        if is_good {
            self.good.insert(number);
        }
        match fault {
            Fault::Sound => {}
            // A byte, a word, less than the port's FIFO, anything, nothing at all.
            Fault::Short => {
                let left = match self.random.below(5) {
                    0 => LENGTH - 4,
                    1 => LENGTH - 4 - self.random.below(16),
                    2 => 0,
                    _ => self.random.below(LENGTH - 4),
                };
                transfer.runs = if left == 0 {
                    vec![pause(100)]
                } else {
                    vec![data(left)]
                };
            }
            Fault::Long => {
                let more = match self.random.below(3) {
                    0 => 4,
                    1 => 4 + self.random.below(40),
                    _ => 4 + self.random.below(LENGTH),
                };
                transfer.runs = vec![data(LENGTH + more)];
            }
            Fault::Merged => transfer.runs = vec![data(2 * LENGTH)],
            Fault::Stalled => {
                let at = 4 + self.random.below(LENGTH - 8);
                let stall = (55_000 + self.random.below(20_000)) * CLOCKS_PER_US;
                transfer.runs = vec![data(at), pause(stall), data(LENGTH - at)];
            }
            Fault::Missing => return,
            Fault::Late => {
                self.held_back = Some((transfer, 1 + self.random.below(9)));
                return;
            }
            Fault::Doubled => driver.queue.push_back(transfer.clone()),
            Fault::DoubledUnbidden => {
                driver.queue.push_back(transfer.clone());
                transfer.unbidden = true;
            }
        }
        if is_good {
            self.newest = number;
        }
        driver.queue.push_back(transfer);
        if let Some((late, after)) = self.held_back.take() {
            if after > 1 {
                self.held_back = Some((late, after - 1));
            } else {
                self.release(late, driver);
            }
        }
    }

    /// What is wrong with the next frame. Faults stand apart, so that each can be told from its neighbours.
    fn fault(&mut self) -> Fault {
        self.sound += 1;
        if self.one_in == u64::MAX || self.sound < 12 || self.random.below(self.one_in) > 0 {
            return Fault::Sound;
        }
        self.sound = 0;
        FAULTS[self.random.below(FAULTS.len() as u64) as usize]
    }

    fn count(&self, fault: Fault) -> u32 {
        self.faults.iter().filter(|(_, which)| *which == fault).count() as u32
    }
}

/// What the receiver does with a frame: a third of a millisecond, and up to 0.3 s at the end of a sweep.
fn work(header: &Header, random: &mut Random) -> u64 {
    let us = match (header.kind, header.index) {
        (Kind::Begin, _) => 20,
        (Kind::Squint, 32) => 100_000 + random.below(150_000),
        _ => 320,
    };
    us * CLOCKS_PER_US
}

/// Flies so many sweeps.
fn fly(sweeps: u32, source: &mut Source, processor: &mut Processor) {
    processor.work = work;
    for sweep in 0..sweeps {
        source.sweep(sweep, &mut processor.world.driver);
        processor.run(u64::from(sweep + 1) * PERIOD);
    }
    processor.run(u64::from(sweeps + 1) * PERIOD);
    assert!(processor.world.driver.queue.is_empty(), "frames are left");
}

#[test]
fn ten_minutes_of_sweeps_with_late_short_doubled_and_missing_frames_lose_no_good_one() {
    const SWEEPS: u32 = 1200;
    let mut source = Source::new(3, 40);
    let mut processor = Processor::new(world(), known().clone(), 4);
    fly(SWEEPS, &mut source, &mut processor);

    let received: BTreeSet<u32> = processor.received.iter().copied().collect();
    let lost: Vec<u32> = source.good.difference(&received).copied().collect();
    println!(
        "{SWEEPS} sweeps, {} frames, {} of them good: {} good frames lost; {:?}",
        source.sequence,
        source.good.len(),
        lost.len(),
        processor.front_end.counters(),
    );
    let kinds = ["Short", "Long", "Overrun", "Stalled"];
    println!(
        "cuts: {:?}",
        kinds.map(|k| processor
            .cuts
            .iter()
            .filter(|c| format!("{c:?}").starts_with(k))
            .count())
    );
    for fault in FAULTS {
        println!("{fault:?}: {}", source.count(fault));
        assert!(source.count(fault) > 100, "{fault:?} is hardly tried");
    }
    assert!(lost.is_empty(), "{} lost: {lost:?}", lost.len());
    assert_eq!(
        received.len(),
        processor.received.len(),
        "a frame was given on twice"
    );
    assert_eq!(received, source.good, "a frame that was not whole was given on");
    let cut = [Fault::Short, Fault::Long, Fault::Merged, Fault::Stalled].map(|fault| source.count(fault));
    let expected = Counters {
        ok: source.good.len() as u32 - source.late,
        late: source.late,
        lost: source.sequence - source.good.len() as u32,
        repeated: source.count(Fault::Doubled),
        cut: cut.iter().sum(),
        ..Counters::default()
    };
    assert_eq!(processor.front_end.counters(), expected);
    assert_eq!(processor.world.driver.dropped, 0);
}
