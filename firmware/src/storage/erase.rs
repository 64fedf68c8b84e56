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
        let sector = match self.spare {
            Spare::Used if self.left() < slots => self.spare_half().map(|half| half.start),
            Spare::Erasing { sector } => match self.flash.poll_erase() {
                Poll::Pending => return Ok(()),
                Poll::Ready(Ok(())) => Ok(sector + F::ERASE_SIZE as u32),
                Poll::Ready(Err(error)) => Err(StorageError::Flash(error)),
            },
            _ => return Ok(()),
        };
        let begun = sector.and_then(|sector| {
            if !self.spare_half()?.contains(&sector) {
                return Ok(Spare::Blank);
            }
            let begun = self.flash.begin_erase(sector).map_err(StorageError::Flash);
            begun.map(|()| Spare::Erasing { sector })
        });
        match begun {
            Ok(spare) => self.spare = spare,
            Err(error) => {
                self.spare = Spare::Worn;
                return Err(error);
            }
        }
        Ok(())
    }
}
