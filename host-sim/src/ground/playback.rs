//! A recorded stream of packets: played at the speed of its UAV's clock, or printed message by message.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
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

/// A file that was read.
#[derive(Clone, Debug)]
pub struct Playback {
    bytes: Vec<u8>,
    source: Source,
}

impl Playback {
    /// Reads a file.
    ///
    /// # Errors
    /// [`InputError`] naming the file when it cannot be read or is empty.
    pub fn open(file: &Path) -> Result<Self, InputError> {
        let bytes = read_bytes(file, &PACKETS)?;
        if bytes.is_empty() {
            return Err(InputError::in_file(file, "is empty, expected packets"));
        }
        let source = Source {
            input: format!("file {}", file.display()).into(),
            peer: None,
        };
        Ok(Self { bytes, source })
    }

    /// Name of the input.
    pub fn name(&self) -> &Arc<str> {
        &self.source.input
    }

    /// Frames, each with its closing zero; what follows the last zero is one as well.
    fn frames(&self) -> impl Iterator<Item = &[u8]> {
        self.bytes.split_inclusive(|byte| *byte == 0)
    }

    /// Plays it, `speed` times as fast as it was, at once when `speed` is 0, until the hub is stopped.
    pub fn play(&self, engine: &mut Engine, hub: &Hub, speed: f64) {
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
            let ahead_s = (time_s - start_s) / speed - start.elapsed().as_secs_f64();
            if ahead_s.abs() > LONGEST_PAUSE_S {
                due = None;
            } else if ahead_s > 0.0 {
                std::thread::sleep(Duration::from_secs_f64(ahead_s));
            }
        }
    }

    /// Prints every message as a line of JSON.
    ///
    /// # Errors
    /// [`InputError`] naming the file and what was wrong with the first frame, when there is no packet in it that can be taken;
    /// those of the output.
    pub fn print(&self, ears: &mut Ears, file: &Path, out: &mut impl Write) -> anyhow::Result<()> {
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
            Told::Refused(error) => *refused.entry(error.as_str()).or_default() += 1,
        });
        result?;
        if packets == 0 {
            let most = refused.iter().max_by_key(|(_, count)| **count);
            let why = most.map_or("there is no whole frame".into(), |(reason, count)| {
                format!("{count} frames, {reason}")
            });
            let message = format!("holds no packet that can be taken ({why})");
            return Err(InputError::in_file(file, message).into());
        }
        eprintln!("{}", json!({"packets": packets, "refused": refused}));
        Ok(())
    }
}
