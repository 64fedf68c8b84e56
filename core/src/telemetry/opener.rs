//! Frames to messages: what is genuine, and came for the first time.

use core::marker::PhantomData;

use super::bits::BitReader;
use super::window::Window;
use super::{Content, Frame, Key, Message, Packet, TelemetryError};

/// One end of a link, receiving messages of one direction: [`Message`] from a UAV or [`super::Uplink`] to it.
///
/// A packet is taken when it is of this link, its authentication code is right and its counter was not taken before. Packets may
/// overtake each other by up to [`super::REORDERING`]. Unsigned packets are refused.
#[derive(Clone, Debug)]
pub struct Opener<M = Message> {
    uav: u8,
    key: Option<Key>,
    window: Window,
    direction: PhantomData<fn() -> M>,
}

impl<M: Content> Opener<M> {
    /// An opener for the link of UAV number `uav` that has heard nothing yet.
    ///
    /// It would also take what was recorded before it began: where that matters, store [`Opener::next`] and go on with
    /// [`Opener::resume`].
    #[must_use]
    pub fn new(uav: u8, key: &Key) -> Self {
        Self::resume(uav, key, 0)
    }

    /// An opener that refuses every counter before `next`, the stored [`Opener::next`] of one before it.
    #[must_use]
    pub fn resume(uav: u8, key: &Key, next: u32) -> Self {
        Self {
            uav,
            key: Some(key.clone()),
            window: Window::new(next),
            direction: PhantomData,
        }
    }

    /// An opener without a key, which takes unsigned packets and no other: for links where nobody else can send. Anybody can
    /// forge what it takes.
    #[must_use]
    pub const fn unsigned(uav: u8) -> Self {
        Self {
            uav,
            key: None,
            window: Window::new(0),
            direction: PhantomData,
        }
    }

    /// Number of the UAV.
    #[must_use]
    pub fn uav(&self) -> u8 {
        self.uav
    }

    /// One more than the highest counter taken.
    #[must_use]
    pub fn next(&self) -> u32 {
        self.window.next()
    }

    /// Takes a packet.
    ///
    /// # Errors
    /// In this order: [`TelemetryError::WrongLink`]; [`TelemetryError::Unsigned`], [`TelemetryError::KeyMissing`] or
    /// [`TelemetryError::Forged`]; [`TelemetryError::Replayed`] or [`TelemetryError::Stale`]; [`TelemetryError::Content`].
    pub fn open(&mut self, frame: &Frame<'_>) -> Result<Packet<M>, TelemetryError> {
        let header = frame.header;
        if header.direction != M::DIRECTION || header.uav != self.uav {
            return Err(TelemetryError::WrongLink);
        }
        match (&self.key, &frame.tag) {
            (Some(key), Some(tag)) if key.verifies(frame.authenticated, tag) => {}
            (Some(_), Some(_)) => return Err(TelemetryError::Forged),
            (Some(_), None) => return Err(TelemetryError::Unsigned),
            (None, Some(_)) => return Err(TelemetryError::KeyMissing),
            (None, None) => {}
        }
        self.window.take(header.counter)?;
        let mut reader = BitReader::new(frame.body);
        let message = M::read(header.kind, &mut reader).ok_or(TelemetryError::Content)?;
        reader.finish().ok_or(TelemetryError::Content)?;
        Ok(Packet {
            uav: header.uav,
            counter: header.counter,
            signed: header.signed,
            message,
        })
    }
}
