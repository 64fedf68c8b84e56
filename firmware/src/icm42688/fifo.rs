//! What the FIFO answers, without the bus: packets to samples, every loss counted.

use cslam_core::inertial::ImuSample;
use heapless::Vec;

use super::packet::{PACKET_LEN, PacketError, RawSample};
use super::registers::{STATUS_FIFO_FULL, STATUS_RESET_DONE};
use super::timebase::{Stamped, Timebase};

/// Packets of a transfer at most.
pub const BURST: usize = 8;
/// Packets that the FIFO holds, 2048 bytes.
const CAPACITY: u16 = 102;
/// Bytes before the packets: the register's place, status, count.
pub(super) const PREFIX: usize = 4;
/// Bytes of a transfer at most.
pub const TRANSFER: usize = PREFIX + BURST * PACKET_LEN;

/// What became of the packets, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct ImuCounters {
    /// Samples given on.
    pub samples: u32,
    /// Samples that never came, by the stamps of those that did.
    pub lost: u32,
    /// Packets that came twice.
    pub repeated: u32,
    /// Packets that were none, or whose stamp made no sense. They are among the lost too.
    pub damaged: u32,
    /// Packets of a sensor that was still starting.
    pub not_ready: u32,
    /// Overflows of the FIFO.
    pub overflows: u32,
    /// Times the FIFO was emptied because it was out of step.
    pub flushes: u32,
}

/// Samples of one read, oldest first.
pub type Samples = Vec<ImuSample, BURST>;

/// What is to be done after an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Next {
    /// Nothing until the next edge.
    Wait,
    /// Read again at once: there is more.
    Again,
    /// Empty the FIFO: it is out of step.
    Flush,
    /// Start the sensor anew: it has reset itself.
    Restart,
    /// The answer is not one: the FIFO does not hold as many packets as it says.
    Count(u16),
}

/// The receiving end of the FIFO.
#[derive(Clone, Copy, Debug)]
pub struct Fifo {
    timebase: Timebase,
    /// Packets to ask for next.
    wanted: usize,
    counters: ImuCounters,
}

impl Fifo {
    /// A FIFO that has just been emptied.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            timebase: Timebase::new(),
            wanted: 1,
            counters: ImuCounters {
                samples: 0,
                lost: 0,
                repeated: 0,
                damaged: 0,
                not_ready: 0,
                overflows: 0,
                flushes: 0,
            },
        }
    }

    /// The sensor begins anew. Counters go on.
    pub(super) const fn restart(&mut self) {
        self.timebase = Timebase::new();
        self.wanted = 1;
    }

    /// What became of the packets so far.
    #[must_use]
    pub const fn counters(&self) -> ImuCounters {
        self.counters
    }

    /// Bytes to read next.
    #[must_use]
    pub fn request(&self) -> usize {
        PREFIX + self.wanted.clamp(1, BURST) * PACKET_LEN
    }

    /// Takes the answer to [`Fifo::request`]: its bytes, of which the first has no meaning, and the time of the last edge by the UAV
    /// clock, ns. `samples` is emptied first.
    pub fn answer(&mut self, bytes: &[u8; TRANSFER], edge_ns: u64, samples: &mut Samples) -> Next {
        samples.clear();
        let asked = self.wanted.clamp(1, BURST);
        let [_, status, high, low, packets @ ..] = bytes;
        // All ones is what an open line reads.
        let count = u16::from_be_bytes([*high, *low]);
        if count > CAPACITY {
            return Next::Count(count);
        }
        if status & STATUS_RESET_DONE != 0 {
            return Next::Restart;
        }
        if status & STATUS_FIFO_FULL != 0 {
            count_one(&mut self.counters.overflows);
        }
        let count = usize::from(count);
        let more = count > asked;
        let (packets, _none_left) = packets.as_chunks();
        let packets = packets.get(..asked.min(count)).unwrap_or_default();
        self.wanted = count.saturating_sub(asked) + 1;
        if !self.take(packets, (!more).then_some(edge_ns), samples) {
            // Whatever is in there is of no use.
            count_one(&mut self.counters.flushes);
            self.wanted = 1;
            return Next::Flush;
        }
        if more { Next::Again } else { Next::Wait }
    }

    /// Takes packets. `false` when one was none.
    fn take(&mut self, packets: &[[u8; PACKET_LEN]], edge_ns: Option<u64>, samples: &mut Samples) -> bool {
        let mut whole = true;
        let mut raw: Vec<RawSample, BURST> = Vec::new();
        for packet in packets {
            let counter = match RawSample::from_packet(packet) {
                Ok(sample) => {
                    let _room_for_all = raw.push(sample);
                    continue;
                }
                Err(PacketError::NotReady) => &mut self.counters.not_ready,
                Err(_) => {
                    whole = false;
                    &mut self.counters.damaged
                }
            };
            count_one(counter);
        }
        let newest = raw.last().map_or(0, |sample| sample.time_ticks);
        for sample in &raw {
            let ahead_ticks = newest.wrapping_sub(sample.time_ticks);
            match self.timebase.place(sample.time_ticks, ahead_ticks, edge_ns) {
                Stamped::At { time_ns, missing } => {
                    count_one(&mut self.counters.samples);
                    self.counters.lost = self.counters.lost.saturating_add(missing);
                    let _room_for_all = samples.push(sample.at(time_ns));
                }
                Stamped::Repeated => count_one(&mut self.counters.repeated),
                Stamped::Irregular => count_one(&mut self.counters.damaged),
            }
        }
        whole
    }
}

impl Default for Fifo {
    fn default() -> Self {
        Self::new()
    }
}

fn count_one(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
