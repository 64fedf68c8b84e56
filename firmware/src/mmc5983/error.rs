//! What can be wrong with the magnetometer.

use core::fmt;

use super::IDENTITY;

/// A sensor that does not do what it should; `E` is the bus's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum MagnetometerError<E> {
    /// A transfer failed, or nobody has the sensor's address.
    Bus(E),
    /// Another chip answers.
    Identity {
        /// Its answer.
        found: u8,
    },
    /// The factory's trim was not read after the reset.
    NoTrim,
    /// A measurement does not end.
    NotMeasured,
    /// An axis is at the end of its range: a magnet is near.
    Saturated {
        /// Codes x, y, z.
        codes: [u32; 3],
    },
}

impl<E: fmt::Debug> fmt::Display for MagnetometerError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Bus(error) => write!(
                f,
                "magnetometer: nobody answers ({error:?}): check its supply, SDA, SCL and their pull-ups"
            ),
            Self::Identity { found } => write!(
                f,
                "magnetometer: the product ID reads {found:#04x}, expected {IDENTITY:#04x} (MMC5983MA): another chip is fitted"
            ),
            Self::NoTrim => f.write_str("magnetometer: its trim was not read: check its supply"),
            Self::NotMeasured => f.write_str("magnetometer: a measurement does not end: check its supply"),
            Self::Saturated { codes: [x, y, z] } => write!(
                f,
                "magnetometer: at the end of its range (codes {x}, {y}, {z}): a magnet is near"
            ),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for MagnetometerError<E> {}
