//! What feeds the receiver: sweeps of frames, some of them faulty, as a front end sends them.

use super::*;

/// What goes wrong with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Fault {
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

pub(super) const FAULTS: [Fault; 8] = [
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
pub(super) fn data(clocks: u64) -> Run {
    Run {
        vsync: true,
        hsync: true,
        clocks,
    }
}

/// So many clocks within a frame without data.
pub(super) fn pause(clocks: u64) -> Run {
    Run {
        vsync: true,
        hsync: false,
        clocks,
    }
}

/// Frames of the front end, sweep by sweep.
pub(super) struct Source {
    random: Random,
    /// One frame of so many has a fault; `u64::MAX` for none.
    one_in: u64,
    pub(super) sequence: u32,
    /// Frames without a fault in a row.
    pub(super) sound: u32,
    /// A late frame, and after how many others it goes.
    held_back: Option<(Transfer, u64)>,
    /// Of the late frames, those that a newer one was sent before.
    pub(super) late: u32,
    newest: u32,
    /// Numbers of the frames that are sent as they should be.
    pub(super) good: BTreeSet<u32>,
    faults: Vec<(u32, Fault)>,
}

impl Source {
    pub(super) fn new(seed: u64, one_in: u64) -> Self {
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
    pub(super) fn sweep(&mut self, sweep: u32, driver: &mut Driver) {
        for place in 0..FRAMES_PER_SWEEP {
            // From when on it can be handed over, us after the sweep began: all symbols have been on air, and all second pilots.
            let ((kind, index), from_us) = match place {
                0 => ((Kind::Begin, FRAMES_PER_SWEEP - 1), 438),
                _ if place <= BEAMS => ((Kind::Beam, place - 1), 438),
                _ if place < FRAMES_PER_SWEEP - SQUINT_SYMBOLS => (pilot(place - 1 - BEAMS), 5300),
                _ => ((Kind::Squint, place + SQUINT_SYMBOLS - FRAMES_PER_SWEEP), 438),
            };
            let from = u64::from(sweep) * PERIOD + from_us * CLOCKS_PER_US;
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
                powers: false,
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
    pub(super) fn release(&mut self, late: Transfer, driver: &mut Driver) {
        self.late += u32::from(late.header.sequence < self.newest);
        driver.queue.push_back(late);
    }

    /// All of a frame, with pauses now and then, which begin at whole words.
    pub(super) fn sound_runs(&mut self) -> Vec<Run> {
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
    pub(super) fn send(&mut self, mut transfer: Transfer, driver: &mut Driver) {
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
            // Less than a word, about the port's FIFO, nothing at all, anything.
            Fault::Short => {
                let is_begin = transfer.header.kind == Kind::Begin;
                let left = match self.random.below(6) {
                    // What a begin has there is filler.
                    0 if !is_begin => LENGTH - 1 - self.random.below(3),
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
    pub(super) fn fault(&mut self) -> Fault {
        self.sound += 1;
        if self.one_in == u64::MAX || self.sound < 12 || self.random.below(self.one_in) > 0 {
            return Fault::Sound;
        }
        self.sound = 0;
        FAULTS[self.random.below(FAULTS.len() as u64) as usize]
    }

    pub(super) fn count(&self, fault: Fault) -> u32 {
        self.faults.iter().filter(|(_, which)| *which == fault).count() as u32
    }
}

/// A pilot by its place behind the beams: of each beam the first one and then the second.
fn pilot(place: u16) -> (Kind, u16) {
    (
        Kind::Pilot,
        place / PILOTS_OF_A_BEAM + place % PILOTS_OF_A_BEAM * BEAMS,
    )
}

/// What the receiver does with a frame: a third of a millisecond, and up to 0.3 s at the end of a sweep.
pub(super) fn work(header: &Header, random: &mut Random) -> u64 {
    let us = match (header.kind, header.index) {
        (Kind::Begin, _) => 20,
        (Kind::Squint, 32) => 100_000 + random.below(150_000),
        _ => 320,
    };
    us * CLOCKS_PER_US
}
