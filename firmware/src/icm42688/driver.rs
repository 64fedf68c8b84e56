//! Start, and reading of the FIFO, over an asynchronous SPI device.
//!
//! Asynchronous, because a board's executor must not wait for a transfer; a blocking bus is made asynchronous by an adapter
//! (`embassy_embedded_hal::adapter::BlockingAsync`), while there is no way back. The crate `icm426xx` was looked at and
//! not taken: it gives floats of another rounding than the simulated sensor, reads the temperature as unsigned and at the scale of
//! the 8-bit packets, drops the overflow flag in its burst read, and knows no lost packets and no clock but the sensor's.
//!
//! Every transfer goes through the driver's own buffer. So where the driver lies decides what the DMA must reach, and
//! nothing on a stack or in a task does.

use embedded_hal_async::delay::DelayNs;
use embedded_hal_async::spi::SpiDevice;
use heapless::Vec;

use cslam_core::localization::ImuSample;

use super::error::ImuError;
use super::packet::{PACKET_LEN, PacketError, RawSample};
use super::registers::*;
use super::timebase::{Stamped, Timebase};

/// Packets of a transfer at most.
pub const BURST: usize = 8;
/// Packets that the FIFO holds, 2048 bytes.
const CAPACITY: u16 = 102;
/// Bytes before the packets: the register's place, status, count.
const PREFIX: usize = 4;

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

/// The sensor.
#[derive(Debug)]
pub struct Icm42688<SPI> {
    spi: SPI,
    buffer: [u8; PREFIX + BURST * PACKET_LEN],
    timebase: Timebase,
    /// Packets to ask for next.
    wanted: usize,
    counters: ImuCounters,
}

impl<SPI: SpiDevice> Icm42688<SPI> {
    /// A sensor that has not been started. SPI mode 0 or 3, at most 24 MHz.
    pub const fn new(spi: SPI) -> Self {
        Self {
            spi,
            buffer: [0; PREFIX + BURST * PACKET_LEN],
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

    /// What became of the packets so far.
    pub const fn counters(&self) -> ImuCounters {
        self.counters
    }

    /// Resets the sensor and starts it: 1 kHz, 20-bit packets, an edge on INT1 with every sample. Takes 50 ms. Also for a sensor
    /// that runs: its counters go on, its clock is learned anew.
    ///
    /// # Errors
    /// [`ImuError`]; the sensor is then in no known state, and may be started again.
    pub async fn start(&mut self, delay: &mut impl DelayNs) -> Result<(), ImuError<SPI::Error>> {
        self.timebase = Timebase::new();
        self.wanted = 1;
        self.write(REG_BANK_SEL, 0).await?;
        self.write(DEVICE_CONFIG, SOFT_RESET).await?;
        // The data sheet asks for 1 ms.
        delay.delay_ms(2).await;
        let found = self.read_register(WHO_AM_I).await?;
        if found != IDENTITY {
            return Err(ImuError::WhoAmI { found });
        }
        if self.read_register(INT_STATUS).await? & STATUS_RESET_DONE == 0 {
            return Err(ImuError::NoReset);
        }
        let mut chosen = 0;
        for (bank, register, value) in SETTINGS {
            if bank != chosen {
                self.write(REG_BANK_SEL, bank).await?;
                chosen = bank;
            }
            self.set(bank, register, value).await?;
        }
        self.set(0, PWR_MGMT0, LOW_NOISE).await?;
        // The gyroscope takes 30 ms to start, and must not be turned off before 45.
        delay.delay_ms(45).await;
        self.write(SIGNAL_PATH_RESET, FIFO_FLUSH).await?;
        self.set(0, FIFO_CONFIG, FIFO_STREAM).await
    }

    /// Reads what the FIFO holds, after an edge of INT1 at `edge_ns` by the UAV clock. `samples` is emptied first. `true`
    /// when there is more: read again at once, with the newest edge.
    ///
    /// # Errors
    /// [`ImuError::Bus`], [`ImuError::Count`], [`ImuError::Restarted`]: no sample is given then. What is wrong with single
    /// packets is counted.
    pub async fn read(&mut self, edge_ns: u64, samples: &mut Samples) -> Result<bool, ImuError<SPI::Error>> {
        samples.clear();
        let asked = self.wanted.clamp(1, BURST);
        let transfer = self.buffer.iter_mut().take(PREFIX + asked * PACKET_LEN);
        let length = transfer.map(|byte| *byte = 0).count();
        let [_, status, high, low] = self.transfer(INT_STATUS, length).await?;
        // All ones is what an open line reads.
        let count = u16::from_be_bytes([high, low]);
        if count > CAPACITY {
            return Err(ImuError::Count { found: count });
        }
        if status & STATUS_RESET_DONE != 0 {
            return Err(ImuError::Restarted);
        }
        if status & STATUS_FIFO_FULL != 0 {
            count_one(&mut self.counters.overflows);
        }
        let count = usize::from(count);
        let more = count > asked;
        let whole = self.take(asked.min(count), (!more).then_some(edge_ns), samples);
        self.wanted = count.saturating_sub(asked) + 1;
        if !whole {
            // Out of step: whatever is in there is of no use.
            count_one(&mut self.counters.flushes);
            self.wanted = 1;
            self.write(SIGNAL_PATH_RESET, FIFO_FLUSH).await?;
            return Ok(false);
        }
        Ok(more)
    }

    /// Takes the packets of the buffer. `false` when one was none.
    fn take(&mut self, packets: usize, edge_ns: Option<u64>, samples: &mut Samples) -> bool {
        let (all, _none_left) = self.buffer.split_at(PREFIX).1.as_chunks::<PACKET_LEN>();
        let mut whole = true;
        let mut raw: Vec<RawSample, BURST> = Vec::new();
        for packet in all.iter().take(packets) {
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
        let newest_us = raw.last().map_or(0, |sample| sample.time_us);
        for sample in &raw {
            let ahead_us = u32::from(newest_us.wrapping_sub(sample.time_us));
            match self.timebase.place(sample.time_us, ahead_us, edge_ns) {
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

    async fn set(&mut self, bank: u8, register: u8, written: u8) -> Result<(), ImuError<SPI::Error>> {
        self.write(register, written).await?;
        let found = self.read_register(register).await?;
        if found == written {
            Ok(())
        } else {
            Err(ImuError::Register {
                bank,
                register,
                written,
                found,
            })
        }
    }

    async fn write(&mut self, register: u8, value: u8) -> Result<(), ImuError<SPI::Error>> {
        let [_, second, ..] = &mut self.buffer;
        *second = value;
        self.transfer_raw(register, 2).await
    }

    async fn read_register(&mut self, register: u8) -> Result<u8, ImuError<SPI::Error>> {
        let [_, second, ..] = &mut self.buffer;
        *second = 0;
        let [_, value, ..] = self.transfer(register, 2).await?;
        Ok(value)
    }

    /// Reads `length - 1` bytes from a register on; gives the first bytes of the buffer.
    async fn transfer(&mut self, register: u8, length: usize) -> Result<[u8; PREFIX], ImuError<SPI::Error>> {
        self.transfer_raw(READ | register, length).await?;
        Ok(self.buffer.first_chunk().copied().unwrap_or_default())
    }

    async fn transfer_raw(&mut self, first: u8, length: usize) -> Result<(), ImuError<SPI::Error>> {
        let [place, ..] = &mut self.buffer;
        *place = first;
        let bytes = self.buffer.get_mut(..length).unwrap_or_default();
        self.spi.transfer_in_place(bytes).await.map_err(ImuError::Bus)
    }
}

fn count_one(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
