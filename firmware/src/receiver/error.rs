//! What stops a receiver.

use core::fmt;

use cslam_core::telemetry::TelemetryError;

use crate::ring::RingError;

/// A receiver that could not go on; `E` is the downlink's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ReceiveError<E> {
    /// The ring that measurements come through cannot be used.
    Ring(RingError),
    /// The downlink did not take a packet.
    Downlink(E),
    /// The downlink says that it wrote nothing, or more than it was given.
    DownlinkStuck,
    /// A packet could not be made.
    Encode(TelemetryError),
}

impl<E: fmt::Display> fmt::Display for ReceiveError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ring(error) => write!(f, "ring: {error}"),
            Self::Downlink(error) => write!(f, "downlink: {error}"),
            Self::DownlinkStuck => f.write_str("downlink: it does not take any bytes"),
            Self::Encode(error) => write!(f, "packet: {error}"),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for ReceiveError<E> {}

impl<E> From<RingError> for ReceiveError<E> {
    fn from(error: RingError) -> Self {
        Self::Ring(error)
    }
}
