//! The settings' flash: the last two sectors of bank 2, so that the code in bank 1 runs on while they are written.

use core::arch::asm;
use core::ptr;

use cortex_m::peripheral::SCB;
use embassy_stm32::Peri;
use embassy_stm32::flash::{Blocking, Error, Flash, WRITE_SIZE};
use embassy_stm32::pac;
use embassy_stm32::peripherals::FLASH;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// First address, offset in the flash, and length.
pub(crate) const BASE: u32 = 0x0800_0000 + OFFSET;
const OFFSET: u32 = 0x001c_0000;
const SECTOR: usize = 128 * 1024;

/// What can fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub(crate) enum FlashError {
    /// Outside, or not aligned.
    Argument,
    /// The controller refused.
    Controller,
    /// A word without valid error correction: the power failed while it was written.
    Correction,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl From<NorFlashErrorKind> for FlashError {
    fn from(_: NorFlashErrorKind) -> Self {
        Self::Argument
    }
}

impl From<Error> for FlashError {
    fn from(_: Error) -> Self {
        Self::Controller
    }
}

/// The two sectors.
pub(crate) struct SettingsFlash(Flash<'static, Blocking>);

impl SettingsFlash {
    pub(crate) fn new(flash: Peri<'static, FLASH>) -> Self {
        Self(Flash::new_blocking(flash))
    }
}

impl ErrorType for SettingsFlash {
    type Error = FlashError;
}

impl ReadNorFlash for SettingsFlash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len())?;
        clear_correction_flags();
        for (address, word) in (BASE + offset..).step_by(4).zip(bytes.chunks_mut(4)) {
            let value = read_whatever_it_holds(address);
            word.copy_from_slice(value.to_le_bytes().get(..word.len()).unwrap_or_default());
        }
        let torn = pac::FLASH.bank(1).sr().read().dbeccerr();
        clear_correction_flags();
        if torn { Err(FlashError::Correction) } else { Ok(()) }
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl NorFlash for SettingsFlash {
    const WRITE_SIZE: usize = WRITE_SIZE;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to)?;
        Ok(self.0.blocking_erase(OFFSET + from, OFFSET + to)?)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        Ok(self.0.blocking_write(OFFSET + offset, bytes)?)
    }
}

/// A word that may have no valid correction: reading that is a bus fault, which would end the program at every start from then on. So
/// bus faults of data are ignored for the length of this read (Armv7-M manual, CCR.BFHFNMIGN); the controller's flag tells.
fn read_whatever_it_holds(address: u32) -> u32 {
    const BFHFNMIGN: u32 = 1 << 8;
    // SAFETY: `address` is an aligned word inside the two sectors (the caller has checked), which always exists. FAULTMASK and the flag in
    // CCR are set for this read alone, with nothing in between that could fault on purpose, and are put back.
    unsafe {
        let scb = &*SCB::PTR;
        asm!("cpsid f", options(nomem, nostack));
        scb.ccr.modify(|ccr| ccr | BFHFNMIGN);
        cortex_m::asm::dsb();
        let value = ptr::read_volatile(address as *const u32);
        cortex_m::asm::dsb();
        scb.ccr.modify(|ccr| ccr & !BFHFNMIGN);
        asm!("cpsie f", options(nomem, nostack));
        value
    }
}

fn clear_correction_flags() {
    pac::FLASH.bank(1).ccr().write(|w| {
        w.set_clr_dbeccerr(true);
        w.set_clr_sneccerr(true);
    });
}
