//! What can be wrong with the sensor.

use core::fmt;

use super::registers::IDENTITY;

/// A sensor that does not do what it should; `E` is the bus's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ImuError<E> {
    /// A transfer failed.
    Bus(E),
    /// Another chip answers, or none.
    WhoAmI {
        /// Its answer; 0x00 and 0xff are a line that nobody drives.
        found: u8,
    },
    /// The reset has not ended in time.
    NoReset,
    /// A register does not hold what was written.
    Register {
        /// Bank of the register.
        bank: u8,
        /// Its place.
        register: u8,
        /// What was written.
        written: u8,
        /// What it holds.
        found: u8,
    },
    /// The chip has reset itself: its settings are gone.
    Restarted,
    /// The FIFO says that it holds more packets than it has room for.
    Count {
        /// Packets that it says it holds.
        found: u16,
    },
}

impl<E: fmt::Debug> fmt::Display for ImuError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(f, "IMU: a transfer failed ({error:?}): check SPI pins and DMA"),
            Self::WhoAmI {
                found: found @ (0x00 | 0xff),
            } => write!(
                f,
                "IMU: nobody answers (WHO_AM_I reads {found:#04x}): check supply, chip select and MISO"
            ),
            Self::WhoAmI { found } => write!(
                f,
                "IMU: WHO_AM_I reads {found:#04x}, expected {IDENTITY:#04x} (ICM-42688-P): another chip is fitted"
            ),
            Self::NoReset => f.write_str("IMU: the reset does not end: check its supply"),
            Self::Register {
                bank,
                register,
                written,
                found,
            } => write!(
                f,
                "IMU: register {register:#04x} of bank {bank} holds {found:#04x}, written was {written:#04x}: lower the SPI clock, check MOSI"
            ),
            Self::Restarted => {
                f.write_str("IMU: it has reset itself and must be started again: check its supply")
            }
            Self::Count { found } => write!(
                f,
                "IMU: the FIFO says {found} packets, it holds 102 at most: check MISO"
            ),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for ImuError<E> {}
