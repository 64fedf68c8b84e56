//! Room for the settings while the receiver flies: the half that is not in use is erased beside everything else.

use core::task::Poll;

use embedded_storage::nor_flash::NorFlash;

use super::error::StorageError;
use super::store::{Spare, Store};

/// A flash memory that erases by itself while the program goes on. Until it has ended, nothing else is asked of it.
pub trait EraseInBackground: NorFlash {
    /// Begins to erase the sector at an offset, and returns at once.
    ///
    /// # Errors
    /// When it did not begin.
    fn begin_erase(&mut self, sector: u32) -> Result<(), Self::Error>;

    /// Whether that has ended, and how.
    fn poll_erase(&mut self) -> Poll<Result<(), Self::Error>>;
}

impl<F: EraseInBackground> Store<F> {
    /// Sees to it that there is room: once fewer than `slots` slots are left in this half, the other one is erased, sector by sector. Call it
    /// often; it never waits.
    ///
    /// # Errors
    /// Once, when the other half cannot be erased, or holds what counts: from then on [`Store::append`] ends with this half.
    pub fn tend(&mut self, slots: u32) -> Result<(), StorageError<F::Error>> {
        if self.spare == Spare::Used && self.left() < slots {
            let half = self.spare_half();
            self.erase_from(half.map(|half| half.start))?;
        }
        while let Spare::Erasing { sector } = self.spare {
            let Poll::Ready(erased) = self.flash.poll_erase() else {
                return Ok(());
            };
            let next = sector.saturating_add(F::ERASE_SIZE as u32);
            self.erase_from(erased.map(|()| next).map_err(StorageError::Flash))?;
        }
        Ok(())
    }

    /// Begins to erase the sector at an offset, if that is still in the other half.
    fn erase_from(
        &mut self,
        sector: Result<u32, StorageError<F::Error>>,
    ) -> Result<(), StorageError<F::Error>> {
        let begun = sector.and_then(|sector| {
            if !self.spare_half()?.contains(&sector) {
                return Ok(Spare::Blank);
            }
            let begun = self.flash.begin_erase(sector).map_err(StorageError::Flash);
            begun.map(|()| Spare::Erasing { sector })
        });
        self.spare = *begun.as_ref().unwrap_or(&Spare::Worn);
        begun.map(|_| ())
    }
}
