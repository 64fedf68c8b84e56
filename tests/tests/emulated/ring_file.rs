//! The host's side of the shared memory: a file that QEMU maps. Reads and writes of a file and a shared mapping of it
//! are coherent, so no mapping is needed here.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use cslam_firmware::ring::{AccessError, SharedMemory};

/// Length of the emulated board's PSRAM.
const PSRAM_LENGTH: usize = 16 * 1024 * 1024;

/// A view of the file from some place on.
#[derive(Debug)]
pub(crate) struct RingFile {
    file: Arc<File>,
    at: usize,
}

impl RingFile {
    /// Makes the file, all zero.
    pub(crate) fn make(path: &Path) -> Self {
        let file = File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(path)
            .expect("a new file");
        file.set_len(PSRAM_LENGTH as u64).expect("a sparse file");
        let file = Arc::new(file);
        Self { file, at: 0 }
    }

    /// Another view of the same file, from `at` on.
    pub(crate) fn from(&self, at: usize) -> Self {
        let file = Arc::clone(&self.file);
        Self { file, at }
    }
}

impl SharedMemory for RingFile {
    fn size(&self) -> usize {
        PSRAM_LENGTH - self.at
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        self.file
            .read_exact_at(bytes, (self.at + offset) as u64)
            .map_err(|_| AccessError::Failed)
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        if bytes.len() > self.size().saturating_sub(offset) {
            return Err(AccessError::OutOfRange);
        }
        self.file
            .write_all_at(bytes, (self.at + offset) as u64)
            .map_err(|_| AccessError::Failed)
    }
}
