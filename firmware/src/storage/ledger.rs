//! Numbers that may be used once, over every reset: the counters of the link, the session of the front end.
//!
//! Each is set aside in the store before it is used, some way ahead so that the flash lasts. A start goes on behind all that was set
//! aside, so what was sent or taken before a loss of power is never sent or taken again, at whatever moment the power fails.

use cslam_core::telemetry::{Key, Opener, Sender, Uplink};

use super::erase::EraseInBackground;
use super::error::StorageError;
use super::settings::Settings;
use super::store::Store;

/// Packets of the downlink that are set aside at a time: a day of them.
pub const DOWNLINK_RESERVE: u32 = 1 << 20;
/// Packets of the uplink that are set aside at a time. Few, since a receiver that has lost its power refuses what is left of them: at
/// four packets per second (beacons and timing, twice each) that is 16 s at most, and a record a 16 s.
pub const UPLINK_RESERVE: u32 = 64;
/// Records that must fit at the start, so that an erase in flight is rare: two hours of uplink.
pub const ROOM: u32 = 512;
/// With fewer records left the next half is erased, in the background: eight minutes of uplink, for seconds of work.
pub const ROOM_IN_FLIGHT: u32 = 32;

/// The settings of a start, and the store that they lie in.
#[derive(Debug)]
pub struct Ledger<F> {
    store: Store<F>,
    settings: Settings,
    /// First counter of the downlink that this start may use.
    first: u32,
}

impl<F: EraseInBackground> Ledger<F> {
    /// Begins a start: a new session of the front end, and counters of the downlink. Those of the uplink are set aside when the first
    /// packet comes.
    ///
    /// # Errors
    /// [`StorageError`]: nothing may be sent or opened.
    pub fn begin(mut store: Store<F>) -> Result<Self, StorageError<F::Error>> {
        let mut settings = store.settings()?.clone();
        store.make_room(ROOM)?;
        let first = settings.downlink_counter;
        settings.session = settings.next_session();
        settings.downlink_counter = first.saturating_add(DOWNLINK_RESERVE);
        store.store(&settings)?;
        Ok(Self {
            store,
            settings,
            first,
        })
    }

    /// The settings as they are stored.
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// First counter of the downlink that this start may use. [`Sender::allow`] those up to `settings().downlink_counter`.
    pub const fn first_downlink(&self) -> u32 {
        self.first
    }

    /// What takes the packets from the ground: nothing that was taken before this start.
    #[must_use]
    pub fn opener(&self, key: &Key) -> Opener<Uplink> {
        let next = self.settings.uplink_counter;
        let mut opener = Opener::resume(self.settings.uav, key, next);
        opener.allow(next);
        opener
    }

    /// Sets uplink counters aside up to beyond `counter`, for [`Opener::open_reserving`]; `None` when that could not be stored.
    pub fn reserve_uplink(&mut self, counter: u32) -> Option<u32> {
        let limit = counter.saturating_add(UPLINK_RESERVE);
        let changed = Settings {
            uplink_counter: limit,
            ..self.settings.clone()
        };
        self.save(changed).ok().map(|()| limit)
    }

    /// Sets downlink counters aside when half of them are used.
    ///
    /// # Errors
    /// [`StorageError`]: the sender goes on to the limit that it has.
    pub fn renew_downlink(&mut self, sender: &mut Sender) -> Result<(), StorageError<F::Error>> {
        if sender.left() >= DOWNLINK_RESERVE / 2 {
            return Ok(());
        }
        let limit = sender.counter().saturating_add(DOWNLINK_RESERVE);
        self.save(Settings {
            downlink_counter: limit,
            ..self.settings.clone()
        })?;
        sender.allow(limit);
        Ok(())
    }

    /// The next session of the front end.
    ///
    /// # Errors
    /// [`StorageError`]: it must not be opened.
    pub fn next_session(&mut self) -> Result<u16, StorageError<F::Error>> {
        let session = self.settings.next_session();
        self.save(Settings {
            session,
            ..self.settings.clone()
        })?;
        Ok(session)
    }

    /// Gives back what was set aside and not used, before a reset that is meant: the next start refuses nothing. The sender sends no
    /// more, and nothing may be opened from here on.
    ///
    /// # Errors
    /// [`StorageError`]: it stays set aside.
    pub fn close(&mut self, sender: &mut Sender, next_uplink: u32) -> Result<(), StorageError<F::Error>> {
        let next = sender.counter();
        sender.allow(next);
        self.save(Settings {
            downlink_counter: next,
            uplink_counter: next_uplink,
            ..self.settings.clone()
        })
    }

    /// Sees to it that there is room, without ever waiting for an erase. Call it often. While one is under way, nothing can be set aside:
    /// [`StorageError::Busy`].
    ///
    /// # Errors
    /// As [`Store::tend`].
    pub fn tend(&mut self) -> Result<(), StorageError<F::Error>> {
        self.store.tend(ROOM_IN_FLIGHT)
    }

    fn save(&mut self, settings: Settings) -> Result<(), StorageError<F::Error>> {
        self.store.append(&settings)?;
        self.settings = settings;
        Ok(())
    }
}
