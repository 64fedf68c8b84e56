//! The host's side of the shared memory: a file that QEMU maps. Reads and writes of a file and a shared mapping of it
//! are coherent, so no mapping is needed here.

use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::sync::Arc;

use cslam_firmware::measurement::LENGTH;
use cslam_firmware::ring::{AccessError, Producer, SharedMemory};

/// Length of the emulated board's PSRAM.
const PSRAM_LENGTH: usize = 16 * 1024 * 1024;

/// A view of the file.
#[derive(Debug)]
pub(crate) struct RingFile(Arc<File>);

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
        Self(Arc::new(file))
    }

    /// Another view of the same file.
    pub(crate) fn view(&self) -> Self {
        Self(Arc::clone(&self.0))
    }

    /// Makes the ring that the board reads.
    pub(crate) fn producer(memory: Self, slots: u32) -> Producer<Self, LENGTH> {
        Producer::create(memory, slots).expect("the ring fits the memory")
    }
}

impl SharedMemory for RingFile {
    fn size(&self) -> usize {
        PSRAM_LENGTH
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        self.0
            .read_exact_at(bytes, offset as u64)
            .map_err(|_| AccessError::Failed)
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        if bytes.len() > PSRAM_LENGTH.saturating_sub(offset) {
            return Err(AccessError::OutOfRange);
        }
        self.0
            .write_all_at(bytes, offset as u64)
            .map_err(|_| AccessError::Failed)
    }
}
