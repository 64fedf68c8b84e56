//! What runs on the processor: the task that offers buffers, which is [`Capture`] and what the board puts around it, and the receiver below
//! it, which is busy for as long as work takes. Between them go three buffers, as on the board.

use std::collections::VecDeque;

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{
    Block, Capture, Checksum, Content, Cut, FrameError, FrontEnd, Header, Kind, SoftwareCrc, Step,
};

use crate::lines::CLOCKS_PER_US;
use crate::port::{Buffer, World};
use crate::random::Random;

/// Session of the link.
pub(crate) const SESSION: u16 = 7;
/// Buffers that go round.
const BUFFERS: usize = 3;

/// Knows the payloads that there are, so that every sample of every frame is compared, and cheaply.
#[derive(Clone, Debug)]
pub(crate) struct Known(pub(crate) Vec<(Vec<Iq>, u32)>);

impl Checksum for Known {
    fn samples(&mut self, samples: &Block) -> u32 {
        let known = self
            .0
            .iter()
            .find(|(payload, _)| payload == samples.as_flattened());
        known.map_or_else(|| SoftwareCrc.samples(samples), |(_, checksum)| *checksum)
    }
}

/// Board, both tasks.
pub(crate) struct Processor {
    pub(crate) world: World,
    pub(crate) front_end: FrontEnd<Known>,
    /// Numbers of the frames that came through, in order.
    pub(crate) received: Vec<u32>,
    pub(crate) cuts: Vec<Cut>,
    /// How long the receiver is busy with a frame, clocks.
    pub(crate) work: fn(&Header, &mut Random) -> u64,
    /// What the receiver does beside, and how long that takes: given the time, clocks.
    pub(crate) chores: Box<dyn FnMut(u64) -> u64>,
    /// When the bus is somebody else's next, and for how long, clocks from now.
    pub(crate) bus_taken: fn(&mut Random) -> Option<(u64, u64)>,
    bus_at: (u64, u64),
    random: Random,
    free: Vec<Buffer>,
    filled: VecDeque<Buffer>,
    capture: Option<Capture>,
    wake: u64,
    held: Option<Buffer>,
    receiver_at: u64,
}

impl Processor {
    pub(crate) fn new(world: World, known: Known, seed: u64) -> Self {
        Self {
            world,
            front_end: FrontEnd::new(known, SESSION),
            received: Vec::new(),
            cuts: Vec::new(),
            work: |_, _| 400 * CLOCKS_PER_US,
            chores: Box::new(|_| 0),
            bus_taken: |_| None,
            bus_at: (0, 0),
            random: Random::new(seed),
            free: vec![Buffer::new(); BUFFERS],
            filled: VecDeque::new(),
            capture: None,
            wake: 0,
            held: None,
            receiver_at: 0,
        }
    }

    /// From a reason to run until the task runs: interrupts above it, critical sections; now and then much longer.
    fn latency(&mut self) -> u64 {
        let longest_us = if self.random.below(1000) == 0 { 300 } else { 10 };
        CLOCKS_PER_US + self.random.below(longest_us * CLOCKS_PER_US)
    }

    /// Lets the board run until `end`, clocks.
    pub(crate) fn run(&mut self, end: u64) {
        while self.world.now < end {
            if self.capture.is_none() && self.wake == u64::MAX && !self.free.is_empty() {
                self.wake = self.world.now + self.latency();
            }
            let receiver_at = if self.held.is_some() || !self.filled.is_empty() {
                self.receiver_at
            } else {
                u64::MAX
            };
            if self.world.now >= self.bus_at.0 {
                self.world.bus_taken_until = self.world.now + self.bus_at.1;
                let next = (self.bus_taken)(&mut self.random);
                self.bus_at = next.map_or((u64::MAX, 0), |(from, clocks)| (self.world.now + from, clocks));
            }
            let next = self.wake.min(receiver_at).min(self.bus_at.0);
            self.world.advance_to_call(end.min(next));
            if let Some(called) = self.world.interrupt.take() {
                let latency = self.latency();
                self.wake = self.wake.min(called + latency);
            }
            if self.world.now >= self.wake {
                self.capture();
            }
            if self.world.now >= receiver_at {
                self.receive();
            }
        }
    }

    /// The task of the capture, until it waits.
    fn capture(&mut self) {
        self.wake = u64::MAX;
        let mut capture = match self.capture.take() {
            Some(capture) => capture,
            None => {
                let Some(buffer) = self.free.pop() else { return };
                self.world.buffer = buffer;
                let now_us = self.world.now / CLOCKS_PER_US;
                Capture::offer(&mut self.world, now_us)
            }
        };
        let now_us = self.world.now / CLOCKS_PER_US;
        let step = capture.step(&mut self.world, now_us);
        if let Step::Wait { until_us } = step {
            self.capture = Some(capture);
            self.wake = (until_us * CLOCKS_PER_US).max(self.world.now) + self.latency();
            return;
        }
        let buffer = core::mem::replace(&mut self.world.buffer, Buffer::new());
        match step {
            Step::Cut(cut) => {
                self.cuts.push(cut);
                self.front_end.cut();
                self.free.push(buffer);
            }
            _ => self.filled.push_back(buffer),
        }
    }

    /// The receiver takes the next frame, or gives the last one back.
    fn receive(&mut self) {
        if let Some(buffer) = self.held.take() {
            self.free.push(buffer);
            return;
        }
        let Some(mut buffer) = self.filled.pop_front() else {
            return;
        };
        let work = match self.front_end.receive(&buffer.header, &mut buffer.samples) {
            Ok(frame) => {
                let sampled = match frame.content {
                    Content::Begin { .. } => None,
                    Content::Beam(block) => Some((Kind::Beam, block.beam)),
                    Content::Pilot(block) => Some((Kind::Pilot, block.beam)),
                    Content::Squint(block) => Some((Kind::Squint, block.beam)),
                };
                if let Some(sampled) = sampled {
                    assert_eq!(sampled, (frame.header.kind, frame.header.index));
                }
                self.received.push(frame.header.sequence);
                (self.work)(&frame.header, &mut self.random)
            }
            Err(FrameError::Repeated { .. } | FrameError::PayloadChecksum { .. }) => 300 * CLOCKS_PER_US,
            Err(error) => panic!("{error}"),
        };
        self.held = Some(buffer);
        self.receiver_at = self.world.now + work + (self.chores)(self.world.now);
    }
}
