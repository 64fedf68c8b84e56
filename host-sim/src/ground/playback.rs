//! A recorded stream of packets: played at the speed of its UAV's clock, or printed message by message.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::json;

use super::decode::{Ears, Told};
use super::engine::Engine;
use super::hub::Hub;
use super::inputs::Source;
use crate::input::limits::PACKETS;
use crate::input::{InputError, read_bytes};

/// Longest pause in a recording that is played as it was, s.
const LONGEST_PAUSE_S: f64 = 5.0;

/// Time between two looks at the wish to end, and at a file that may have grown.
const PATIENCE: Duration = Duration::from_millis(50);

/// A file that was read.
#[derive(Debug)]
pub struct Playback {
    path: PathBuf,
    /// At the end of what was read.
    file: File,
    bytes: Vec<u8>,
    source: Source,
}

/// How a file is played.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// How many times as fast as it was; 0 for at once.
    pub speed: f64,
    /// Whether what is appended to the file is played as well, until the station is stopped.
    pub follow: bool,
}

impl Playback {
    /// Reads a file.
    ///
    /// # Errors
    /// [`InputError`] naming the file when it cannot be read or is longer than is read.
    pub fn open(path: &Path) -> Result<Self, InputError> {
        let bytes = read_bytes(path, &PACKETS)?;
        let end = SeekFrom::Start(bytes.len() as u64);
        let file = File::open(path)
            .and_then(|mut file| file.seek(end).map(|_| file))
            .map_err(|e| InputError::in_file(path, format!("cannot be read: {e}")))?;
        Ok(Self {
            path: path.to_owned(),
            file,
            bytes,
            source: Source::Stream(format!("file {}", path.display()).into()),
        })
    }

    /// Name of the input.
    pub fn name(&self) -> &Arc<str> {
        self.source.input()
    }

    /// Frames, each with its closing zero; what follows the last zero is one as well.
    fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes.split_inclusive(|byte| *byte == 0)
    }

    /// Plays it until its end, or until the hub is stopped.
    ///
    /// # Errors
    /// [`InputError`] naming the file when it ended and nothing in it could be taken; those of reading what was appended.
    pub fn play(&mut self, engine: &mut Engine, hub: &Hub, pace: Pace) -> anyhow::Result<()> {
        self.play_read(engine, hub, pace.speed);
        if pace.follow {
            return self.play_appended(engine, hub);
        }
        let station = hub.station();
        if station.uavs().is_empty() && !hub.is_stopped() {
            return Err(self.nothing_taken(station.refused()).into());
        }
        Ok(())
    }

    /// Plays what was read when it was opened.
    fn play_read(&self, engine: &mut Engine, hub: &Hub, speed: f64) {
        let mut due: Option<(Instant, f64)> = None;
        for frame in self.frames() {
            if hub.is_stopped() {
                return;
            }
            let Some(time_s) = engine.push(&self.source, frame) else {
                continue;
            };
            engine.elapse();
            if speed <= 0.0 {
                continue;
            }
            // Several UAVs have several clocks; a jump of more than a pause begins anew.
            let (start, start_s) = *due.get_or_insert((Instant::now(), time_s));
            let ahead_s = || (time_s - start_s) / speed - start.elapsed().as_secs_f64();
            if ahead_s().abs() > LONGEST_PAUSE_S {
                due = None;
                continue;
            }
            while ahead_s() > 0.0 && !hub.is_stopped() {
                thread::sleep(PATIENCE.min(Duration::from_secs_f64(ahead_s().max(0.0))));
                engine.elapse();
            }
        }
    }

    /// Plays what somebody appends.
    fn play_appended(&mut self, engine: &mut Engine, hub: &Hub) -> anyhow::Result<()> {
        let mut chunk = vec![0; 1 << 16];
        while !hub.is_stopped() {
            let length = self.file.read(&mut chunk)?;
            if length == 0 {
                thread::sleep(PATIENCE);
            } else {
                engine.push(&self.source, chunk.get(..length).unwrap_or_default());
            }
            engine.elapse();
        }
        Ok(())
    }

    /// What was wrong with the frames, most of all.
    fn nothing_taken(&self, refused: &BTreeMap<&'static str, u64>) -> InputError {
        let most = refused.iter().max_by_key(|(_, count)| **count);
        let why = most.map_or("there is no whole frame".into(), |(reason, count)| {
            format!("{count} frames, {reason}")
        });
        InputError::in_file(&self.path, format!("holds no packet that can be taken ({why})"))
    }

    /// Prints every message as a line of JSON.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what was wrong with the first frame, when there is no packet in it that can be taken;
    /// those of the output.
    pub fn print(&self, ears: &mut Ears, out: &mut impl Write) -> anyhow::Result<()> {
        let mut packets = 0_u64;
        let mut refused: BTreeMap<&'static str, u64> = BTreeMap::new();
        let mut result = Ok(());
        ears.push(&self.source, &self.bytes, |told| match told {
            Told::Packet(heard, _) => {
                packets += 1;
                if result.is_ok() {
                    result = serde_json::to_writer(&mut *out, heard)
                        .map_err(anyhow::Error::from)
                        .and_then(|()| Ok(writeln!(out)?));
                }
            }
            Told::Refused(reason) => *refused.entry(reason).or_default() += 1,
        });
        result?;
        if packets == 0 {
            return Err(self.nothing_taken(&refused).into());
        }
        eprintln!("{}", json!({"packets": packets, "refused": refused}));
        Ok(())
    }
}
