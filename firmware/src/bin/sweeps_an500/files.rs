//! Files of the host, by semihosting.

use core::ffi::CStr;
use core::fmt;

use embedded_io::{ErrorKind, ErrorType, Read};
use semihosting::fs::File;
use semihosting::io::{Read as _, Write as _};

/// Longest argument, its final zero included.
const LONGEST: usize = 256;

/// An argument as semihosting takes it.
pub(crate) struct Word([u8; LONGEST]);

impl Word {
    fn new(text: &str) -> Option<Self> {
        let mut bytes = [0; LONGEST];
        // One zero stays at the end.
        bytes
            .get_mut(..LONGEST - 1)?
            .get_mut(..text.len())?
            .copy_from_slice(text.as_bytes());
        Some(Self(bytes))
    }

    fn path(&self) -> &CStr {
        CStr::from_bytes_until_nul(&self.0).unwrap_or(c"")
    }

    pub(crate) fn to_bytes(&self) -> &[u8] {
        self.path().to_bytes()
    }
}

/// The arguments behind the program's name, if they are `N`.
pub(crate) fn words<const N: usize>() -> Option<[Word; N]> {
    let arguments = semihosting::experimental::env::args::<{ 4 * LONGEST }>().ok()?;
    let mut words = heapless::Vec::<Word, N>::new();
    for word in arguments.skip(1) {
        words.push(Word::new(word.ok()?)?).ok()?;
    }
    words.into_array().ok()
}

/// A file that is read.
pub(crate) struct Recording(File);

impl Recording {
    pub(crate) fn open(path: &Word) -> Option<Self> {
        File::open(path.path()).ok().map(Self)
    }
}

impl ErrorType for Recording {
    type Error = ErrorKind;
}

impl Read for Recording {
    fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        self.0.read(bytes).map_err(|_| ErrorKind::Other)
    }
}

/// A file that takes lines. Written in pieces: a call of the emulator costs more than a line.
pub(crate) struct Lines {
    file: File,
    buffer: [u8; 512],
    used: usize,
}

impl Lines {
    pub(crate) fn create(path: &Word) -> Option<Self> {
        let file = File::create(path.path()).ok()?;
        Some(Self {
            file,
            buffer: [0; 512],
            used: 0,
        })
    }

    pub(crate) fn flush(&mut self) -> fmt::Result {
        let pending = self.buffer.get(..self.used).unwrap_or_default();
        self.used = 0;
        self.file.write_all(pending).map_err(|_| fmt::Error)
    }
}

impl fmt::Write for Lines {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        for byte in text.bytes() {
            if self.used == self.buffer.len() {
                self.flush()?;
            }
            if let Some(slot) = self.buffer.get_mut(self.used) {
                *slot = byte;
                self.used += 1;
            }
        }
        Ok(())
    }
}
