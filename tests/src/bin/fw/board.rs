//! The emulated board: its image, its memory, its process.

use std::fs::{self, File};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use anyhow::{Context, bail};
use cslam_firmware::front_end::FRAME_LENGTH;
use cslam_firmware::ring::{AccessError, Producer, SharedMemory};
use cslam_firmware::sensor_stream::{self, FRAMES_AT, RECORDS_AT};
use cslam_tests::{emulated_board, root};
use tempfile::TempDir;

use crate::arguments::Arguments;
use crate::cycles::build_plugin;

/// Length of the emulated board's PSRAM.
const PSRAM_LENGTH: usize = 16 * 1024 * 1024;
/// Slots of the rings: a sweep of frames, two seconds of records.
const FRAME_SLOTS: u32 = 128;
const RECORD_SLOTS: u32 = 4096;
/// Where the board's stack lies (`checks/memory/mps2-an500.x`). On an STM32H743 that is memory beside the caches.
const STACK: &str = "0x20080000-0x200a0000";
/// The file of a profile.
const PROFILE: &str = "profile";

/// Builds an image for the emulated board; cargo decides whether there is anything to do.
pub(crate) fn build(name: &str) -> anyhow::Result<PathBuf> {
    let output = emulated_board("build", name)
        .args(["--message-format", "json-render-diagnostics"])
        .stderr(Stdio::inherit())
        .output()
        .context("cargo does not start")?;
    if !output.status.success() {
        bail!("the image {name} does not build");
    }
    let text = String::from_utf8(output.stdout)?;
    text.lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter_map(|message| message["executable"].as_str().map(PathBuf::from))
        .next_back()
        .context("cargo names no executable")
}

/// Part of the file that QEMU maps as the board's PSRAM. Reads and writes of a file and a shared mapping of it are coherent.
#[derive(Debug)]
pub(crate) struct Memory {
    file: File,
    at: usize,
}

impl SharedMemory for Memory {
    fn size(&self) -> usize {
        PSRAM_LENGTH - self.at
    }

    fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), AccessError> {
        let at = (self.at + offset) as u64;
        self.file
            .read_exact_at(bytes, at)
            .map_err(|_| AccessError::Failed)
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), AccessError> {
        if bytes.len() > self.size().saturating_sub(offset) {
            return Err(AccessError::OutOfRange);
        }
        let at = (self.at + offset) as u64;
        self.file.write_all_at(bytes, at).map_err(|_| AccessError::Failed)
    }
}

/// What a run left behind.
pub(crate) struct Left {
    /// Bytes that came out of UART1.
    pub(crate) packets: Vec<u8>,
    /// Lines of every sweep and of the map.
    pub(crate) lines: String,
    /// Decoded log.
    pub(crate) log: String,
    /// How often each instruction was executed, if that was asked for.
    pub(crate) profile: Option<String>,
}

/// A running board. Dropping it ends it.
pub(crate) struct Board {
    child: Child,
    folder: TempDir,
    records: Producer<Memory, { sensor_stream::LENGTH }>,
    frames: Producer<Memory, FRAME_LENGTH>,
}

impl Board {
    /// Starts an image, for `limit_s` at most; with instructions counted, or each one's executions, or neither.
    pub(crate) fn start(image: &Path, arguments: &Arguments) -> anyhow::Result<Self> {
        let folder = tempfile::tempdir()?;
        let psram = folder.path().join("psram");
        let file = File::options()
            .read(true)
            .write(true)
            .create_new(true)
            .open(&psram)?;
        file.set_len(PSRAM_LENGTH as u64)?;
        let memory = |at| {
            let file = file.try_clone()?;
            Ok::<_, std::io::Error>(Memory { file, at })
        };
        let records = Producer::create(memory(RECORDS_AT)?, RECORD_SLOTS)?;
        let frames = Producer::create(memory(FRAMES_AT)?, FRAME_SLOTS)?;
        let log = File::create(folder.path().join("log"))?;
        let mut command = Command::new(root().join("checks/tools/qemu-run.sh"));
        command
            .arg("mps2-an500")
            .arg(image)
            .arg(folder.path().join("lines"))
            .env("CSLAM_RING_FILE", &psram)
            .env("CSLAM_UART1_FILE", folder.path().join("uart1"))
            .env("CSLAM_TIMEOUT_S", arguments.limit_s.to_string())
            .env_remove("CSLAM_ICOUNT")
            .env_remove("CSLAM_PLUGIN")
            .stdin(Stdio::null())
            .stdout(log.try_clone()?)
            .stderr(log);
        if arguments.count {
            command.env("CSLAM_ICOUNT", "10");
        }
        if arguments.profile {
            let [plugin, out] = ["profile.so", PROFILE].map(|name| folder.path().join(name));
            build_plugin(&plugin)?;
            let plugin = format!("{},out={},stack={STACK}", plugin.display(), out.display());
            command.env("CSLAM_PLUGIN", plugin);
        }
        Ok(Self {
            child: command.spawn().context("the runner script does not start")?,
            folder,
            records,
            frames,
        })
    }

    /// Hands over a record, waiting while the ring is full.
    pub(crate) fn record(&mut self, record: &[u8; sensor_stream::LENGTH]) -> anyhow::Result<()> {
        while !self.records.push(record)? {
            self.rest()?;
        }
        Ok(())
    }

    /// Hands over a frame, waiting while the ring is full.
    pub(crate) fn frame(&mut self, frame: &[u8; FRAME_LENGTH]) -> anyhow::Result<()> {
        while !self.frames.push(frame)? {
            self.rest()?;
        }
        Ok(())
    }

    /// Waits for the end of the run.
    pub(crate) fn wait(mut self) -> anyhow::Result<Left> {
        let status = self.child.wait()?;
        if !status.success() {
            bail!("the board ended with {status}:\n{}", self.log());
        }
        let read = |name| fs::read(self.folder.path().join(name)).with_context(|| format!("no file {name}"));
        Ok(Left {
            packets: read("uart1")?,
            lines: String::from_utf8(read("lines")?)?,
            log: self.log(),
            profile: fs::read_to_string(self.folder.path().join(PROFILE)).ok(),
        })
    }

    /// Waits a little for the board, if it still runs.
    fn rest(&mut self) -> anyhow::Result<()> {
        if let Some(status) = self.child.try_wait()? {
            bail!("the board ended early with {status}:\n{}", self.log());
        }
        std::thread::sleep(std::time::Duration::from_micros(200));
        Ok(())
    }

    fn log(&self) -> String {
        let bytes = fs::read(self.folder.path().join("log")).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        // The script ends the emulator when it is ended itself, and after its limit in any case.
        let _ended = self.child.kill();
        let _waited = self.child.wait();
    }
}
