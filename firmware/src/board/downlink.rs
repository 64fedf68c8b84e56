//! Whole frames to the ground.

use core::fmt;

use embedded_io_async::Write;

/// A frame that did not leave; `E` is the writer's error.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DownlinkError<E> {
    /// The writer failed.
    Write(E),
    /// The writer says that it took nothing, or more than it was given.
    Stuck,
}

impl<E: fmt::Debug> fmt::Display for DownlinkError<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Write(error) => write!(f, "downlink: {error:?}: check the radio's cable and baud rate"),
            Self::Stuck => f.write_str("downlink: it takes no bytes: check the radio's flow control"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for DownlinkError<E> {}

/// A way to the ground.
pub trait Downlink {
    /// What can fail; says what to do.
    type Error: fmt::Debug + fmt::Display;

    /// Sends a frame; returns when it has been taken over, not when it has left.
    ///
    /// # Errors
    /// When it was not taken, or only in part: the ground finds the next frame's beginning by itself.
    async fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error>;
}

impl<W: Write> Downlink for W {
    type Error = DownlinkError<W::Error>;

    async fn send(&mut self, frame: &[u8]) -> Result<(), Self::Error> {
        let mut rest = frame;
        // The trait's own `write_all` panics when a driver says that it took nothing.
        while !rest.is_empty() {
            let taken = self.write(rest).await.map_err(DownlinkError::Write)?;
            rest = match rest.get(taken..) {
                Some(after) if taken > 0 => after,
                _ => return Err(DownlinkError::Stuck),
            };
        }
        Ok(())
    }
}
