//! Finding the newest record, and writing the next.

use embedded_storage::nor_flash::NorFlash;

use super::error::{RecordError, StorageError};
use super::record::{self, SLOT};
use super::settings::Settings;

/// Bytes of a slot as an offset.
const STEP: u32 = SLOT as u32;
/// Places that are tried for a record before the flash is called worn.
const ATTEMPTS: u32 = 4;

/// What is in a slot.
enum Slot {
    Blank,
    Sound(u32, Settings),
    Refused(RecordError),
}

/// Records in a flash memory.
#[derive(Debug)]
pub struct Store<F> {
    flash: F,
    /// Bytes of a half.
    half: u32,
    /// Offset of the next slot to write; at the end of a half when that is full.
    next: u32,
    number: u32,
    newest: Result<Settings, RecordError>,
    /// Where the newest sound record lies.
    newest_at: Option<u32>,
    blank: bool,
    refused: u32,
}

impl<F: NorFlash> Store<F> {
    /// Looks through a memory. What is damaged in it is passed over.
    ///
    /// # Errors
    /// [`StorageError::Geometry`].
    pub fn open(flash: F) -> Result<Self, StorageError<F::Error>> {
        let (capacity, sector) = (flash.capacity(), F::ERASE_SIZE);
        let fits = capacity > 0
            && capacity.is_multiple_of(2 * sector)
            && sector.is_multiple_of(SLOT)
            && SLOT.is_multiple_of(F::WRITE_SIZE)
            && SLOT.is_multiple_of(F::READ_SIZE);
        let Some(half) = u32::try_from(capacity / 2).ok().filter(|_| fits) else {
            return Err(StorageError::Geometry { capacity, sector });
        };
        let mut store = Self {
            flash,
            half,
            next: 0,
            number: 0,
            newest: Err(RecordError::Magic),
            newest_at: None,
            blank: true,
            refused: 0,
        };
        store.look_through();
        Ok(store)
    }

    /// The settings as last stored.
    ///
    /// # Errors
    /// [`StorageError::Empty`], [`StorageError::NoneSound`].
    pub fn settings(&self) -> Result<&Settings, StorageError<F::Error>> {
        self.newest.as_ref().map_err(|error| {
            if self.blank {
                StorageError::Empty
            } else {
                StorageError::NoneSound(*error)
            }
        })
    }

    /// Records that were found damaged, or of another version.
    pub const fn refused(&self) -> u32 {
        self.refused
    }

    /// Slots that are left in this half; some of them may turn out to be damaged.
    pub const fn left(&self) -> u32 {
        (self.end() - self.next) / STEP
    }

    /// Goes over to the other half when fewer than `slots` slots are left in this one. The erase takes seconds, so a receiver does this
    /// before it flies.
    ///
    /// # Errors
    /// As [`Store::store`]; also when there is nothing to take along.
    pub fn make_room(&mut self, slots: u32) -> Result<(), StorageError<F::Error>> {
        if self.left() >= slots {
            return Ok(());
        }
        let settings = self.settings()?.clone();
        self.next = self.end();
        self.store(&settings)
    }

    /// Stores settings. On an error the settings before are still there.
    ///
    /// # Errors
    /// [`StorageError::Flash`], [`StorageError::Worn`].
    pub fn store(&mut self, settings: &Settings) -> Result<(), StorageError<F::Error>> {
        let number = self.number.saturating_add(1);
        let slot = record::encode(number, settings);
        for _ in 0..ATTEMPTS {
            let at = self.vacant()?;
            self.next = at + STEP;
            self.blank = false;
            self.flash.write(at, &slot).map_err(StorageError::Flash)?;
            let mut written = [0; SLOT];
            if self.flash.read(at, &mut written).is_ok() && written == slot {
                self.number = number;
                self.newest = Ok(settings.clone());
                self.newest_at = Some(at);
                return Ok(());
            }
        }
        Err(StorageError::Worn)
    }

    /// End of the half that is written to.
    const fn end(&self) -> u32 {
        if self.next > self.half {
            2 * self.half
        } else {
            self.half
        }
    }

    /// Offset of a blank slot; the other half is erased when this one has none.
    fn vacant(&mut self) -> Result<u32, StorageError<F::Error>> {
        let end = self.end();
        while self.next < end {
            if matches!(self.look(self.next), Slot::Blank) {
                return Ok(self.next);
            }
            self.next += STEP;
        }
        let other = if end > self.half { 0 } else { self.half };
        let counts = |at: u32| (other..other + self.half).contains(&at);
        if self.newest_at.is_some_and(counts) {
            return Err(StorageError::Worn);
        }
        self.flash
            .erase(other, other + self.half)
            .map_err(StorageError::Flash)?;
        self.next = other;
        Ok(other)
    }

    fn look_through(&mut self) {
        let mut at = 0;
        while at < 2 * self.half {
            match self.look(at) {
                Slot::Blank => {}
                Slot::Sound(number, settings) => {
                    self.blank = false;
                    if self.newest.is_err() || number > self.number {
                        self.number = number;
                        self.newest = Ok(settings);
                        self.newest_at = Some(at);
                        self.next = at + STEP;
                    }
                }
                Slot::Refused(error) => {
                    self.blank = false;
                    self.refused = self.refused.saturating_add(1);
                    if self.newest.is_err() {
                        self.newest = Err(error);
                    }
                }
            }
            at += STEP;
        }
    }

    fn look(&mut self, at: u32) -> Slot {
        let mut slot = [0; SLOT];
        if self.flash.read(at, &mut slot).is_err() {
            return Slot::Refused(RecordError::Unreadable);
        }
        if slot == [0xff; SLOT] {
            return Slot::Blank;
        }
        match record::decode(&slot) {
            Ok((number, settings)) => Slot::Sound(number, settings),
            Err(error) => Slot::Refused(error),
        }
    }
}
