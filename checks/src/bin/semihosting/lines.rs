//! A file of the host that takes lines, by semihosting.

use core::fmt;

use semihosting::fs::File;
use semihosting::io::Write as _;

use crate::words::Word;

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
