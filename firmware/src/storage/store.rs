//! Finding the newest record, and writing the next.

use core::ops::Range;

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

/// What is known of the half that is not written to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Spare {
    /// Old records, or what an erase left that the power cut short.
    Used,
    /// The flash erases the sector at this offset, and may not be asked for anything.
    Erasing { sector: u32 },
    /// Erased since the start.
    Blank,
    /// It cannot be erased.
    Worn,
}

/// Records in a flash memory.
#[derive(Debug)]
pub struct Store<F> {
    pub(super) flash: F,
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
    pub(super) spare: Spare,
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
            spare: Spare::Used,
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

    /// Stores settings, and waits for an erase when there is no room: seconds. On an error the settings before are still there.
    ///
    /// # Errors
    /// [`StorageError::Flash`], [`StorageError::Worn`].
    pub fn store(&mut self, settings: &Settings) -> Result<(), StorageError<F::Error>> {
        match self.append(settings) {
            Err(StorageError::Busy) => {}
            stored => return stored,
        }
        let half = self.spare_half()?;
        self.flash
            .erase(half.start, half.end)
            .map_err(StorageError::Flash)?;
        self.spare = Spare::Blank;
        match self.append(settings) {
            Err(StorageError::Busy) => Err(StorageError::Worn),
            stored => stored,
        }
    }

    /// Stores settings if that takes no erase: what a receiver does that flies. On an error the settings before are still there.
    ///
    /// # Errors
    /// [`StorageError::Busy`] as long as [`Store::tend`] has not made room: try again. [`StorageError::Flash`], [`StorageError::Worn`].
    pub fn append(&mut self, settings: &Settings) -> Result<(), StorageError<F::Error>> {
        if matches!(self.spare, Spare::Erasing { .. }) {
            return Err(StorageError::Busy);
        }
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

    /// Offset of a blank slot: in this half, or the first of the other one when that has been erased.
    fn vacant(&mut self) -> Result<u32, StorageError<F::Error>> {
        let end = self.end();
        while self.next < end {
            if matches!(self.look(self.next), Slot::Blank) {
                return Ok(self.next);
            }
            self.next += STEP;
        }
        match self.spare {
            Spare::Blank => {
                self.next = self.spare_half()?.start;
                self.spare = Spare::Used;
                Ok(self.next)
            }
            Spare::Worn => Err(StorageError::Worn),
            Spare::Used | Spare::Erasing { .. } => Err(StorageError::Busy),
        }
    }

    /// The half that is not written to. Not when it holds what counts: then this one has no slot that can be written.
    pub(super) fn spare_half(&self) -> Result<Range<u32>, StorageError<F::Error>> {
        let start = if self.end() > self.half { 0 } else { self.half };
        let half = start..start + self.half;
        match self.newest_at {
            Some(at) if half.contains(&at) => Err(StorageError::Worn),
            _ => Ok(half),
        }
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
