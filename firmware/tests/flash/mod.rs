//! A NOR flash whose power can fail at every byte.

#[allow(dead_code, reason = "each test binary uses its own part of this module")]
pub(crate) mod slow;

use std::ops::Range;
use std::task::Poll;

use cslam_firmware::storage::EraseInBackground;
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

pub(crate) const SECTOR: usize = 512;
pub(crate) const WORD: usize = 32;

/// Why an access fails.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Fault {
    /// Outside, or not aligned.
    Argument(NorFlashErrorKind),
    /// The power is gone.
    Power,
    /// A word without valid error correction.
    Correction,
}

impl NorFlashError for Fault {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Argument(kind) => *kind,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// Flash as in an STM32H743: words of 32 bytes that are written once, and whose correction is invalid when the power fails in
/// between. `power` is the number of bytes that it still lasts; an erase takes one for each byte too.
#[derive(Clone)]
pub(crate) struct Flash<const SECTORS: usize> {
    pub(crate) bytes: Vec<u8>,
    written: Vec<bool>,
    torn: Vec<bool>,
    pub(crate) power: usize,
    pub(crate) erases: usize,
    /// Words that hold nothing any more.
    pub(crate) worn: Vec<bool>,
    pub(crate) torn_words_fail: bool,
}

impl<const SECTORS: usize> Flash<SECTORS> {
    pub(crate) fn new() -> Self {
        let words = SECTORS * SECTOR / WORD;
        Self {
            bytes: vec![0xff; SECTORS * SECTOR],
            written: vec![false; words],
            torn: vec![false; words],
            power: usize::MAX,
            erases: 0,
            worn: vec![false; words],
            torn_words_fail: true,
        }
    }

    /// An erase is cut short: what is not erased yet is anything.
    pub(crate) fn tear(&mut self, range: Range<usize>) {
        for at in range {
            self.bytes[at] = self.bytes[at].wrapping_mul(167) ^ at as u8;
            self.torn[at / WORD] = true;
        }
    }
}

impl<const SECTORS: usize> ErrorType for &mut Flash<SECTORS> {
    type Error = Fault;
}

impl<const SECTORS: usize> ReadNorFlash for &mut Flash<SECTORS> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Fault> {
        check_read(self, offset, bytes.len()).map_err(Fault::Argument)?;
        let range = offset as usize..offset as usize + bytes.len();
        let words = range.start / WORD..range.end.div_ceil(WORD);
        if self.torn_words_fail && self.torn[words].contains(&true) {
            return Err(Fault::Correction);
        }
        bytes.copy_from_slice(&self.bytes[range]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl<const SECTORS: usize> NorFlash for &mut Flash<SECTORS> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Fault> {
        check_erase(self, from, to).map_err(Fault::Argument)?;
        self.erases += 1;
        for at in from as usize..to as usize {
            if self.power == 0 {
                self.tear(at..to as usize);
                return Err(Fault::Power);
            }
            self.power -= 1;
            self.bytes[at] = 0xff;
            self.written[at / WORD] = false;
            self.torn[at / WORD] = false;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Fault> {
        check_write(self, offset, bytes.len()).map_err(Fault::Argument)?;
        for (at, byte) in (offset as usize..).zip(bytes) {
            let word = at / WORD;
            if at % WORD == 0 {
                assert!(
                    !self.written[word],
                    "word {word} is written twice without an erase"
                );
            }
            if self.power == 0 {
                if at % WORD != 0 {
                    self.torn[word] = true;
                }
                return Err(Fault::Power);
            }
            self.power -= 1;
            self.written[word] = true;
            self.bytes[at] = if self.worn[word] { 0x55 } else { *byte };
        }
        Ok(())
    }
}

/// At once.
impl<const SECTORS: usize> EraseInBackground for &mut Flash<SECTORS> {
    fn begin_erase(&mut self, sector: u32) -> Result<(), Fault> {
        self.erase(sector, sector + SECTOR as u32)
    }

    fn poll_erase(&mut self) -> Poll<Result<(), Fault>> {
        Poll::Ready(Ok(()))
    }
}
