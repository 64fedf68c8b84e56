//! Frames to messages: what is genuine, and came for the first time.

use core::marker::PhantomData;

use super::bits::BitReader;
use super::window::Window;
use super::{Content, Frame, Key, Message, Packet, TelemetryError};

/// One more than the last counter.
const ALL: u64 = 1 << 32;

/// One end of a link, receiving messages of one direction: [`Message`] from a UAV or [`super::Uplink`] to it.
///
/// A packet is taken when it is of this link, its authentication code is right and its counter was not taken before. Packets may
/// overtake each other by up to [`super::REORDERING`]. Unsigned packets are refused.
#[derive(Clone, Debug)]
pub struct Opener<M = Message> {
    uav: u8,
    key: Option<Key>,
    window: Window,
    /// Counters from here on are not taken before they are set aside; 2^32 when all are taken at once.
    limit: u64,
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
            limit: ALL,
            direction: PhantomData,
        }
    }

    /// Sets the counter that this opener does not reach without asking, see [`Opener::open_reserving`]. Before the first call it takes
    /// every counter.
    pub fn allow(&mut self, limit: u32) {
        self.limit = u64::from(limit);
    }

    /// An opener without a key, which takes unsigned packets and no other: for links where nobody else can send. Anybody can
    /// forge what it takes.
    #[must_use]
    pub const fn unsigned(uav: u8) -> Self {
        Self {
            uav,
            key: None,
            window: Window::new(0),
            limit: ALL,
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
    /// [`TelemetryError::Forged`]; [`TelemetryError::Unreserved`]; [`TelemetryError::Replayed`] or [`TelemetryError::Stale`];
    /// [`TelemetryError::Content`].
    pub fn open(&mut self, frame: &Frame<'_>) -> Result<Packet<M>, TelemetryError> {
        self.open_reserving(frame, |_| None)
    }

    /// Takes a packet. When a genuine one has come to the limit of [`Opener::allow`], `reserve` is given its counter, and returns the
    /// next limit, beyond it, once that limit is where a reset does not reach it; `None` when it could not be stored. So no counter is
    /// taken that a start from the stored one would take again, whenever the power fails.
    ///
    /// # Errors
    /// As [`Opener::open`].
    pub fn open_reserving(
        &mut self,
        frame: &Frame<'_>,
        reserve: impl FnOnce(u32) -> Option<u32>,
    ) -> Result<Packet<M>, TelemetryError> {
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
        if u64::from(header.counter) >= self.limit {
            self.limit = reserve(header.counter)
                .map(u64::from)
                .filter(|limit| *limit > u64::from(header.counter))
                .ok_or(TelemetryError::Unreserved)?;
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
