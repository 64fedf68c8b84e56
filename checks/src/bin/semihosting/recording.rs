//! Files of the host that are read, by semihosting.

use embedded_io::{ErrorKind, ErrorType, Read};
use semihosting::fs::File;
use semihosting::io::Read as _;

use crate::words::Word;

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
