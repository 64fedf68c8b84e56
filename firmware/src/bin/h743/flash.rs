//! The settings' flash: the last two sectors of bank 2, so that the code in bank 1 runs on while they are written.

use core::arch::asm;
use core::ptr;
use core::task::Poll;

use cortex_m::peripheral::SCB;
use cslam_firmware::storage::EraseInBackground;
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
/// First address of bank 2 as an offset, and its number.
const BANK_OFFSET: u32 = 0x0010_0000;
const BANK: usize = 1;
const _: () = assert!(
    OFFSET >= BANK_OFFSET,
    "the settings are in the bank that the code is not in"
);

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
        // One that goes on in the background ends first.
        while self.poll_erase().is_pending() {}
        Ok(self.0.blocking_erase(OFFSET + from, OFFSET + to)?)
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len())?;
        Ok(self.0.blocking_write(OFFSET + offset, bytes)?)
    }
}

/// RM0433, section 4.3: each bank has a controller of its own, and while one erases, reads of the other bank go on: code and constants are
/// in bank 1 (memory.x). Only an access to bank 2 would wait.
impl EraseInBackground for SettingsFlash {
    fn begin_erase(&mut self, sector: u32) -> Result<(), FlashError> {
        /// What unlocks a controller, in this order (RM0433, FLASH_KEYR2).
        const KEYS: [u32; 2] = [0x4567_0123, 0xcdef_89ab];
        check_erase(self, sector, sector.saturating_add(SECTOR as u32))?;
        let bank = pac::FLASH.bank(BANK);
        if bank.cr().read().lock() {
            for key in KEYS {
                bank.keyr().write_value(key);
            }
        }
        clear_errors();
        bank.cr().modify(|w| {
            w.set_ser(true);
            w.set_snb(((OFFSET - BANK_OFFSET + sector) / SECTOR as u32) as u8);
        });
        bank.cr().modify(|w| w.set_start(true));
        cortex_m::asm::dsb();
        Ok(())
    }

    fn poll_erase(&mut self) -> Poll<Result<(), FlashError>> {
        let bank = pac::FLASH.bank(BANK);
        let status = bank.sr().read();
        if status.bsy() || status.qw() {
            return Poll::Pending;
        }
        bank.cr().modify(|w| w.set_ser(false));
        bank.cr().modify(|w| w.set_lock(true));
        clear_errors();
        if status.wrperr() || status.pgserr() || status.incerr() || status.operr() {
            return Poll::Ready(Err(FlashError::Controller));
        }
        Poll::Ready(Ok(()))
    }
}

/// Forgets what went wrong before: RM0433 wants that before an erase.
fn clear_errors() {
    pac::FLASH.bank(BANK).ccr().write(|w| {
        w.set_clr_wrperr(true);
        w.set_clr_pgserr(true);
        w.set_clr_incerr(true);
        w.set_clr_operr(true);
        w.set_clr_eop(true);
    });
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
