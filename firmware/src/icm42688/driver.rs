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

use super::error::ImuError;
use super::fifo::{Fifo, ImuCounters, Next, PREFIX, Samples, TRANSFER};
use super::registers::*;

/// The sensor.
#[derive(Debug)]
pub struct Icm42688<SPI> {
    spi: SPI,
    buffer: [u8; TRANSFER],
    fifo: Fifo,
}

impl<SPI: SpiDevice> Icm42688<SPI> {
    /// A sensor that has not been started. SPI mode 0 or 3, at most 24 MHz.
    pub const fn new(spi: SPI) -> Self {
        Self {
            spi,
            buffer: [0; TRANSFER],
            fifo: Fifo::new(),
        }
    }

    /// What became of the packets so far.
    pub const fn counters(&self) -> ImuCounters {
        self.fifo.counters()
    }

    /// Resets the sensor and starts it: 1 kHz, 20-bit packets, an edge on INT1 with every sample. Takes 50 ms. Also for a sensor
    /// that runs: its counters go on, its clock is learned anew.
    ///
    /// # Errors
    /// [`ImuError`]; the sensor is then in no known state, and may be started again.
    pub async fn start(&mut self, delay: &mut impl DelayNs) -> Result<(), ImuError<SPI::Error>> {
        self.fifo.restart();
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
        let length = self.fifo.request();
        self.buffer = [0; TRANSFER];
        self.transfer(INT_STATUS, length).await?;
        match self.fifo.answer(&self.buffer, edge_ns, samples) {
            Next::Wait => Ok(false),
            Next::Again => Ok(true),
            Next::Flush => {
                self.write(SIGNAL_PATH_RESET, FIFO_FLUSH).await?;
                Ok(false)
            }
            Next::Restart => Err(ImuError::Restarted),
            Next::Count(found) => Err(ImuError::Count { found }),
        }
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
