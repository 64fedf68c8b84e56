//! The lines between the front end and the port, and who drives them: frames, each so many clocks of this and so many of that, and the
//! credit that READY is (docs/front-end.md sections 3 and 7).

use std::collections::VecDeque;

use cslam_core::signal::Iq;
use cslam_firmware::front_end::Header;

/// Clocks of a microsecond: PIXCLK is 40 MHz.
pub(crate) const CLOCKS_PER_US: u64 = 40;
/// Clocks that VSYNC is low for between two frames, at least.
pub(crate) const GAP: u64 = 16;
/// Clocks from READY at the pin to where the front end acts on it: its synchroniser.
const SYNCHRONISER: u64 = 3;

/// What the lines do for some clocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Run {
    pub(crate) vsync: bool,
    pub(crate) hsync: bool,
    pub(crate) clocks: u64,
}

/// A frame that waits to be handed over.
#[derive(Clone, Debug)]
pub(crate) struct Transfer {
    /// When the front end has it, clocks.
    pub(crate) from: u64,
    /// It is dropped when it has not begun by then, clocks.
    pub(crate) until: u64,
    pub(crate) header: Header,
    /// Which of the payloads.
    pub(crate) payload: usize,
    /// What the lines do.
    pub(crate) runs: Vec<Run>,
    /// The front end does not wait for READY.
    pub(crate) unbidden: bool,
}

/// A frame on the lines.
#[derive(Debug)]
struct Current {
    header: [u32; 16],
    payload: usize,
    runs: Vec<Run>,
    run: usize,
    /// Clocks of this run that have passed.
    passed: u64,
}

/// The front end's end of the lines.
#[derive(Debug)]
pub(crate) struct Driver {
    pub(crate) payloads: Vec<Vec<Iq>>,
    pub(crate) queue: VecDeque<Transfer>,
    /// Dropped, because nobody gave a credit in time.
    pub(crate) dropped: u32,
    current: Option<Current>,
    /// VSYNC has been low since, clocks.
    low_since: u64,
    ready: bool,
    credit: bool,
    /// READY on its way through the synchroniser: from when on, and the level.
    changes: VecDeque<(u64, bool)>,
}

impl Driver {
    pub(crate) fn new(payloads: Vec<Vec<Iq>>) -> Self {
        Self {
            payloads,
            queue: VecDeque::new(),
            dropped: 0,
            current: None,
            low_since: 0,
            ready: false,
            credit: false,
            changes: VecDeque::new(),
        }
    }

    /// The receiver sets READY.
    pub(crate) fn set_ready(&mut self, now: u64, high: bool) {
        self.changes.push_back((now + SYNCHRONISER, high));
    }

    /// The front end restarts: what READY has done before counts for nothing.
    pub(crate) fn forget_credit(&mut self) {
        self.credit = false;
    }

    /// VSYNC.
    pub(crate) fn on_lines(&self) -> bool {
        self.current
            .as_ref()
            .is_some_and(|current| current.runs[current.run].vsync)
    }

    fn current(&self) -> &Current {
        self.current.as_ref().expect("a frame is on the lines")
    }

    /// A word of the frame on the lines; beyond its end the payload begins anew.
    pub(crate) fn word(&self, index: usize) -> u32 {
        match index.checked_sub(16) {
            None => self.current().header[index],
            Some(index) => self.payload()[index % 16_384].word(),
        }
    }

    /// Number of the frame on the lines.
    pub(crate) fn sequence(&self) -> u32 {
        self.current().header[2]
    }

    /// Payload of the frame on the lines.
    pub(crate) fn payload(&self) -> &[Iq] {
        &self.payloads[self.current().payload]
    }

    /// What the lines do from `now` on, for at least one clock and at most until `end`.
    pub(crate) fn next(&mut self, now: u64, end: u64) -> Run {
        while let Some((_, high)) = self.changes.pop_front_if(|(at, _)| *at <= now) {
            // A rise is a credit, a fall takes it back.
            if high != self.ready {
                self.credit = high;
            }
            self.ready = high;
        }
        let end = self.changes.front().map_or(end, |(at, _)| end.min(*at));
        if self.current.is_none() {
            self.begin(now);
        }
        if let Some(current) = &self.current {
            let whole = current.runs[current.run];
            let clocks = (whole.clocks - current.passed).min(end - now);
            return Run { clocks, ..whole };
        }
        let end = match self.queue.front() {
            Some(next) if self.may_begin(next) => end.min(next.from.max(self.low_since + GAP)),
            _ => end,
        };
        Run {
            vsync: false,
            hsync: false,
            clocks: end - now,
        }
    }

    /// So many clocks of the run have passed.
    pub(crate) fn pass(&mut self, clocks: u64, now: u64) {
        let Some(current) = &mut self.current else {
            return;
        };
        current.passed += clocks;
        if current.passed == current.runs[current.run].clocks {
            (current.run, current.passed) = (current.run + 1, 0);
            if current.run == current.runs.len() {
                self.current = None;
                self.low_since = now;
            }
        }
    }

    fn may_begin(&self, next: &Transfer) -> bool {
        next.unbidden || self.ready && self.credit
    }

    /// Begins a frame if it may.
    fn begin(&mut self, now: u64) {
        while self.queue.pop_front_if(|next| next.until < now).is_some() {
            self.dropped += 1;
        }
        let Some(next) = self.queue.front() else { return };
        if !self.may_begin(next) || now < next.from.max(self.low_since + GAP) {
            return;
        }
        let next = self.queue.pop_front().expect("just seen");
        if !next.unbidden {
            self.credit = false;
        }
        let bytes = Header {
            dropped: self.dropped,
            ..next.header
        }
        .encode();
        let (words, _none_left) = bytes.as_chunks();
        let mut header = [0; 16];
        for (to, word) in header.iter_mut().zip(words) {
            *to = u32::from_le_bytes(*word);
        }
        self.current = Some(Current {
            header,
            payload: next.payload,
            runs: next.runs,
            run: 0,
            passed: 0,
        });
    }
}
