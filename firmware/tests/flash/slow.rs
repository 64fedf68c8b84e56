//! Erases that take their time.

use std::cell::Cell;
use std::task::Poll;

use cslam_firmware::storage::EraseInBackground;
use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};

use super::{Fault, Flash, SECTOR, WORD};

/// A flash memory that erases by itself: it takes so long, and is not to be touched meanwhile.
pub(crate) struct Slow<'a> {
    pub(crate) flash: &'a mut Flash<4>,
    pub(crate) now_ms: &'a Cell<u64>,
    /// The sector that is being erased, and until when.
    pub(crate) erasing: &'a Cell<Option<(u32, u64)>>,
    pub(crate) fails: bool,
}

/// 128 KiB of an STM32H743 take up to this long (data sheet, characteristics of the flash, at 8-bit parallelism).
pub(crate) const ERASE_MS: u64 = 4000;

impl Slow<'_> {
    fn touch(&self) {
        assert_eq!(
            self.erasing.get(),
            None,
            "an access while it erases stops the program"
        );
    }
}

impl ErrorType for Slow<'_> {
    type Error = Fault;
}

impl ReadNorFlash for Slow<'_> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        self.touch();
        (&mut *self.flash).read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.flash.bytes.len()
    }
}

impl NorFlash for Slow<'_> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        self.touch();
        self.now_ms.set(self.now_ms.get() + ERASE_MS);
        (&mut *self.flash).erase(from, to)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        self.touch();
        (&mut *self.flash).write(offset, bytes)
    }
}

impl EraseInBackground for Slow<'_> {
    fn begin_erase(&mut self, sector: u32) -> Result<(), Fault> {
        self.touch();
        self.erasing.set(Some((sector, self.now_ms.get() + ERASE_MS)));
        Ok(())
    }

    fn poll_erase(&mut self) -> Poll<Result<(), Fault>> {
        match self.erasing.get() {
            Some((_, until)) if self.now_ms.get() < until => return Poll::Pending,
            Some(_) if self.fails => {
                self.erasing.set(None);
                return Poll::Ready(Err(Fault::Power));
            }
            Some((sector, _)) => {
                self.erasing.set(None);
                (&mut *self.flash).erase(sector, sector + SECTOR as u32)?;
            }
            None => {}
        }
        Poll::Ready(Ok(()))
    }
}
