//! The front end's registers (docs/front-end.md section 4), over an SPI device: mode 0, at most 20 MHz.
//!
//! A transfer has six bytes: the register's number, with the top bit set to read; a byte of pause; the value, low byte
//! first.

use core::fmt;

use embedded_hal_async::spi::SpiDevice;

use super::header::Status;
use super::kind::VERSION;
use super::{BEAMS, PILOT_BEAMS, SQUINT_SYMBOLS};

const READ: u8 = 0x80;
const ID: u8 = 0x00;
const FORMAT: u8 = 0x01;
const CONTROL: u8 = 0x02;
const SESSION: u8 = 0x03;
const PLAN: u8 = 0x04;
const TIME_LOW: u8 = 0x05;
const TIME_HIGH: u8 = 0x06;
const PATIENCE_US: u8 = 0x07;
const STATUS: u8 = 0x08;
const LOADED: u8 = 0x09;
const PILOTS: u8 = 0x0C;

/// What ID reads: `CSFE`.
const IDENTITY: u32 = u32::from_le_bytes(*b"CSFE");
/// CONTROL: frames are captured and handed over.
const RUN: u32 = 1;

/// Bytes of a transfer.
const LENGTH: usize = 6;

/// A front end that does not keep to the contract; `E` is the bus's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ControlError<E> {
    /// A transfer failed.
    Bus(E),
    /// Something else answers, or nothing.
    Identity {
        /// What the identity register reads.
        found: u32,
    },
    /// It hands over frames of another version: those of version 1 have no pilots and no register for them.
    Format {
        /// Version found.
        found: u32,
    },
    /// A register does not hold what was written.
    Register {
        /// Its number.
        register: u8,
        /// What was written.
        written: u32,
        /// What it holds.
        found: u32,
    },
    /// It has not loaded the time: no edge came on SYNC.
    NoSync,
}

impl<E: fmt::Debug> fmt::Display for ControlError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(
                f,
                "front end: a transfer failed ({error:?}): check the pins of its SPI"
            ),
            Self::Identity {
                found: found @ (0 | u32::MAX),
            } => write!(
                f,
                "front end: nobody answers (ID reads {found:#010x}): check supply, bitstream and chip select"
            ),
            Self::Identity { found } => write!(
                f,
                "front end: ID reads {found:#010x}, expected {IDENTITY:#010x}: it runs another bitstream"
            ),
            Self::Format { found } => write!(
                f,
                "front end: frames of version {found}, expected {VERSION}: it runs a bitstream of another release"
            ),
            Self::Register {
                register,
                written,
                found,
            } => write!(
                f,
                "front end: register {register:#04x} holds {found:#010x}, written was {written:#010x}: lower the SPI clock"
            ),
            Self::NoSync => f.write_str("front end: no edge has come on SYNC: check the line"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for ControlError<E> {}

/// The registers.
#[derive(Debug)]
pub struct Control<SPI> {
    spi: SPI,
    /// Where the driver lies decides what the DMA must reach: all transfers go through here.
    buffer: [u8; LENGTH],
}

impl<SPI: SpiDevice> Control<SPI> {
    /// A front end of which nothing is known.
    pub const fn new(spi: SPI) -> Self {
        Self {
            spi,
            buffer: [0; LENGTH],
        }
    }

    /// Stops the front end and readies it for a session; its clock will read `sync_ns` at the next edge of SYNC. Give that edge, then
    /// call [`Control::run`].
    ///
    /// # Errors
    /// Any [`ControlError`] but [`ControlError::NoSync`].
    pub async fn prepare(
        &mut self,
        session: u16,
        sync_ns: u64,
        patience_us: u32,
    ) -> Result<(), ControlError<SPI::Error>> {
        let found = self.read(ID).await?;
        if found != IDENTITY {
            return Err(ControlError::Identity { found });
        }
        let found = self.read(FORMAT).await?;
        if found != u32::from(VERSION) {
            return Err(ControlError::Format { found });
        }
        let plan = u32::from(BEAMS) | u32::from(SQUINT_SYMBOLS) << 16;
        let settings = [
            (CONTROL, 0),
            (SESSION, u32::from(session)),
            (PLAN, plan),
            (PILOTS, u32::from(PILOT_BEAMS)),
            (PATIENCE_US, patience_us),
            (TIME_LOW, sync_ns as u32),
            (TIME_HIGH, (sync_ns >> 32) as u32),
        ];
        for (register, value) in settings {
            self.set(register, value).await?;
        }
        Ok(())
    }

    /// Lets frames come.
    ///
    /// # Errors
    /// [`ControlError::NoSync`] when the edge has not been seen; [`ControlError::Bus`], [`ControlError::Register`].
    pub async fn run(&mut self) -> Result<(), ControlError<SPI::Error>> {
        if self.read(LOADED).await? != 1 {
            return Err(ControlError::NoSync);
        }
        self.set(CONTROL, RUN).await
    }

    /// State of the front end, with or without frames.
    ///
    /// # Errors
    /// [`ControlError::Bus`].
    pub async fn status(&mut self) -> Result<Status, ControlError<SPI::Error>> {
        Ok(Status(self.read(STATUS).await? as u16))
    }

    async fn set(&mut self, register: u8, written: u32) -> Result<(), ControlError<SPI::Error>> {
        self.transfer(register, written).await?;
        let found = self.read(register).await?;
        if found == written {
            Ok(())
        } else {
            Err(ControlError::Register {
                register,
                written,
                found,
            })
        }
    }

    async fn read(&mut self, register: u8) -> Result<u32, ControlError<SPI::Error>> {
        self.transfer(register | READ, 0).await
    }

    async fn transfer(&mut self, first: u8, value: u32) -> Result<u32, ControlError<SPI::Error>> {
        let [a, b, c, d] = value.to_le_bytes();
        self.buffer = [first, 0, a, b, c, d];
        self.spi
            .transfer_in_place(&mut self.buffer)
            .await
            .map_err(ControlError::Bus)?;
        let [_, _, value @ ..] = self.buffer;
        Ok(u32::from_le_bytes(value))
    }
}
