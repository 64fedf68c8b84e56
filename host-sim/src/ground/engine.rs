//! The thread on which packets come in: decodes them, keeps the state, records, passes on.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

use super::decode::{Ears, Told};
use super::hub::Hub;
use super::inputs::{Said, Source};
use super::mavlink;
use super::record::Recording;

/// How long nothing may come before heartbeats and the wish to end are looked at.
const PATIENCE: Duration = Duration::from_millis(50);

/// Ears and outputs of a station.
#[derive(Debug)]
pub struct Engine {
    hub: Arc<Hub>,
    ears: Ears,
    recording: Option<Recording>,
    /// Why nothing is recorded any more.
    recording_error: Option<io::Error>,
    mavlink: Option<mavlink::Out>,
}

/// The recording could not be written; the station goes on without it.
const RECORDING: &str = "recording";

impl Engine {
    /// An engine that keeps the state of a hub.
    pub fn new(
        hub: Arc<Hub>,
        ears: Ears,
        recording: Option<Recording>,
        mavlink: Option<mavlink::Out>,
    ) -> Self {
        Self {
            hub,
            ears,
            recording,
            recording_error: None,
            mavlink,
        }
    }

    /// Takes what inputs say until the hub is stopped; what is waiting then is taken as well.
    ///
    /// # Errors
    /// When the recording cannot be closed.
    pub fn run(mut self, said: &Receiver<Said>) -> anyhow::Result<()> {
        loop {
            match said.recv_timeout(PATIENCE) {
                Ok(said) => self.take(said),
                Err(RecvTimeoutError::Timeout) if self.hub.is_stopped() => break,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => break,
            }
            self.elapse();
        }
        self.finish()
    }

    /// Takes what an input says.
    pub fn take(&mut self, said: Said) {
        match said {
            Said::Bytes(source, bytes) => {
                self.push(&source, &bytes);
            }
            Said::Trouble(input, trouble) => self.hub.station().trouble(&input, trouble),
        }
    }

    /// Takes bytes of a source. Returns the last time of a UAV's clock that was in them, s.
    pub fn push(&mut self, source: &Source, bytes: &[u8]) -> Option<f64> {
        let now_s = self.hub.now_s();
        // First: what is taken below must not be known to anybody while what came long before it can still be lost.
        self.flush(now_s);
        let mut time_s = None;
        let hub = &self.hub;
        let (recording, mavlink) = (&mut self.recording, &mut self.mavlink);
        let mut trouble = None;
        hub.station().input(source.input(), bytes.len());
        self.ears.push(source, bytes, |told| match told {
            Told::Packet(heard, frame) => {
                time_s = heard.message.time_s().or(time_s);
                let is_news = hub.station().hear(heard, frame.len(), now_s);
                if let Some(mavlink) = mavlink.as_mut().filter(|_| is_news) {
                    mavlink.hear(heard, now_s);
                }
                let recorded = recording
                    .as_mut()
                    .map_or(Ok(()), |r| r.hear(heard, frame, hub.unix_ns(now_s)));
                if let Err(error) = recorded {
                    trouble = Some(error);
                }
            }
            Told::Refused(reason) => hub.station().refuse(reason),
        });
        if let Some(error) = trouble {
            self.give_up_recording(error);
        }
        time_s
    }

    /// A full disk must not end the flight's picture: the page says that nothing is recorded any more.
    fn give_up_recording(&mut self, error: io::Error) {
        self.recording = None;
        let trouble = format!("ended, cannot be written: {error}");
        eprintln!("cslam: recording {trouble}");
        self.hub.station().trouble(RECORDING, Some(trouble));
        self.recording_error = Some(error);
    }

    /// Sends and writes what is due; to be called several times per second.
    pub fn elapse(&mut self) {
        let now_s = self.hub.now_s();
        self.flush(now_s);
        if let Some(mavlink) = &mut self.mavlink {
            mavlink.elapse(now_s);
        }
    }

    fn flush(&mut self, now_s: f64) {
        if let Some(Err(error)) = self.recording.as_mut().map(|r| r.elapse(now_s)) {
            self.give_up_recording(error);
        }
    }

    /// Closes the recording.
    ///
    /// # Errors
    /// Those of its files, also when they ended it before.
    pub fn finish(self) -> anyhow::Result<()> {
        if let Some(error) = self.recording_error {
            return Err(anyhow::Error::new(error).context("the recording ended before the station"));
        }
        if let Some(recording) = self.recording {
            let time_ns = self.hub.unix_ns(self.hub.now_s());
            let cloud = self.hub.station().cloud().clone();
            recording.finish(&cloud, time_ns)?;
        }
        Ok(())
    }
}
