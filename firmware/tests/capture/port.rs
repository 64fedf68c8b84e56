//! The camera port (DCMI) and its DMA stream, clock by clock of PIXCLK, after the STM32H743's reference manual (RM0433):
//!
//! - Snapshot mode: once CAPTURE is set the port waits for VSYNC to go from "no data" to "data", takes that frame, and clears CAPTURE at its
//!   end. A frame that is on the lines when CAPTURE is set is not taken.
//! - Bytes are taken at edges of PIXCLK with both VSYNC and HSYNC at "data", and packed into words, the first byte lowest. Words go through
//!   a FIFO of four, from which each asks for the DMA.
//! - A word that finds the FIFO full is an overrun: its flag is set, the frame is lost, CAPTURE is cleared.
//! - The end of a frame that was taken sets the frame's flag, however many words it had. Bytes short of a word are not handed on; since the
//!   manual says so of JPEG alone, the model can also fill such a word up.
//! - The DMA writes as many words as it was told, then stops; it says nothing of a frame that was shorter: the rest is just missing.
//!
//! In between anything that happens, clocks are passed at once; `one_clock_at_a_time_or_many_at_once` shows that this is the same.

use std::collections::VecDeque;

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{Block, FRAME_WORDS, HEADER_LENGTH, Look, Port};

use crate::lines::Driver;

/// Clocks from a word in the FIFO to that word in memory: 12 cycles of the 240 MHz bus.
const FETCH: u64 = 2;
/// Clocks that an access of the processor to a register takes.
const ACCESS: u64 = 4;

/// A buffer of a frame.
#[derive(Clone, Debug)]
pub(crate) struct Buffer {
    pub(crate) header: [u8; HEADER_LENGTH],
    pub(crate) samples: Box<Block>,
}

impl Buffer {
    pub(crate) fn new() -> Self {
        Self {
            header: [0; HEADER_LENGTH],
            samples: vec![[Iq::ZERO; 512]; 32].try_into().expect("32 channels"),
        }
    }

    fn set(&mut self, index: usize, word: u32) {
        match index.checked_sub(HEADER_LENGTH / 4) {
            None => self.header[4 * index..][..4].copy_from_slice(&word.to_le_bytes()),
            Some(index) => self.samples.as_flattened_mut()[index] = Iq::from_word(word),
        }
    }
}

/// Front end, port, DMA, memory.
#[derive(Debug)]
pub(crate) struct World {
    pub(crate) now: u64,
    pub(crate) driver: Driver,
    /// The buffer that the DMA was pointed at.
    pub(crate) buffer: Buffer,
    /// The port calls the processor.
    pub(crate) interrupt: Option<u64>,
    /// The bus is somebody else's until then.
    pub(crate) bus_taken_until: u64,
    /// The bus is somebody else's for so many clocks towards the end of each frame.
    pub(crate) bus_taken_at_end: u64,
    /// Frames that overran because it was.
    pub(crate) lost_to_the_bus: Vec<u32>,
    /// Words that the port's FIFO holds.
    pub(crate) fifo_words: usize,
    /// A word that is not full at the end of a frame is filled up and handed on.
    pub(crate) fills_up: bool,
    /// CAPTURE, and whether its frame has begun.
    capture: bool,
    taking: bool,
    vsync: bool,
    ended: bool,
    overrun: bool,
    /// Bytes of the word in hand, and the words before it.
    bytes: u64,
    words: usize,
    /// Index of a word in its frame, the word, and when it came.
    fifo: VecDeque<(u32, u64)>,
    dma: bool,
    missing: u32,
}

impl World {
    pub(crate) fn new(driver: Driver) -> Self {
        Self {
            now: 0,
            driver,
            buffer: Buffer::new(),
            interrupt: None,
            bus_taken_until: 0,
            bus_taken_at_end: 0,
            lost_to_the_bus: Vec::new(),
            fifo_words: 4,
            fills_up: false,
            capture: false,
            taking: false,
            vsync: false,
            ended: false,
            overrun: false,
            bytes: 0,
            words: 0,
            fifo: VecDeque::new(),
            dma: false,
            missing: FRAME_WORDS,
        }
    }

    /// Lets clocks pass until `end`.
    pub(crate) fn advance(&mut self, end: u64) {
        self.pass(end, false);
    }

    /// Lets clocks pass until `end`, or until the port calls.
    pub(crate) fn advance_to_call(&mut self, end: u64) {
        self.pass(end, true);
    }

    fn pass(&mut self, end: u64, stops: bool) {
        while self.now < end {
            let run = self.driver.next(self.now, end);
            self.edge(run.vsync);
            if stops && self.interrupt.is_some() {
                return;
            }
            let before = self.now;
            if self.taking && run.hsync {
                self.take(run.clocks);
            } else {
                self.now += run.clocks;
            }
            self.driver.pass(self.now - before, self.now);
            self.fetch();
        }
    }

    /// What the registers say.
    pub(crate) fn seen(&self) -> Look {
        Look {
            missing: self.missing,
            on_lines: self.driver.on_lines(),
            ended: self.ended,
            overrun: self.overrun,
            unfetched: !self.fifo.is_empty(),
        }
    }

    /// VSYNC as the port sees it at this clock.
    fn edge(&mut self, vsync: bool) {
        let rises = vsync && !self.vsync;
        let falls = !vsync && self.vsync;
        self.vsync = vsync;
        if rises && self.capture {
            self.taking = true;
            (self.bytes, self.words) = (0, 0);
        }
        if falls && self.taking {
            self.taking = false;
            self.capture = false;
            self.ended = true;
            self.interrupt.get_or_insert(self.now);
            if self.fills_up && self.bytes > 0 {
                self.fifo.push_back((0, self.now));
            }
        }
    }

    /// Takes a byte at each of so many clocks.
    fn take(&mut self, clocks: u64) {
        let end = self.now + clocks;
        // As long as the bus is free each word is in memory before the next one comes: all but the last few at once.
        let whole = (self.bytes + clocks) / 4;
        let fits = whole.saturating_sub(2).min(u64::from(self.missing));
        if self.fifo.is_empty() && self.dma && self.now >= self.bus_taken_until && fits > 16 {
            self.copy(fits as usize);
            self.now += 4 * fits - self.bytes;
            self.bytes = 0;
        }
        while self.now < end {
            let clocks = (4 - self.bytes).min(end - self.now);
            self.now += clocks;
            self.bytes += clocks;
            if self.bytes < 4 {
                return;
            }
            self.bytes = 0;
            self.fetch();
            if self.fifo.len() == self.fifo_words {
                self.overrun = true;
                if self.missing > 0 {
                    self.lost_to_the_bus.push(self.driver.sequence());
                }
                self.capture = false;
                self.taking = false;
                self.interrupt.get_or_insert(self.now);
                return;
            }
            self.fifo.push_back((self.driver.word(self.words), self.now));
            self.words += 1;
            if self.words == FRAME_WORDS as usize - 1 {
                self.bus_taken_until = self.bus_taken_until.max(self.now + self.bus_taken_at_end);
            }
        }
    }

    /// So many words, from the lines to memory: where a word lies in its frame it lies in the buffer.
    fn copy(&mut self, words: usize) {
        let from = (FRAME_WORDS - self.missing) as usize;
        assert_eq!(from, self.words, "a word was skipped");
        for index in from..(from + words).min(16) {
            self.buffer.set(index, self.driver.word(index));
        }
        let samples = from.max(16) - 16..(from + words).max(16) - 16;
        self.buffer.samples.as_flattened_mut()[samples.clone()]
            .copy_from_slice(&self.driver.payload()[samples]);
        self.words += words;
        self.missing -= words as u32;
    }

    /// The DMA fetches what it can by now.
    fn fetch(&mut self) {
        while let Some((word, came)) = self.fifo.front().copied() {
            let at = came.max(self.bus_taken_until) + FETCH;
            if !self.dma || self.missing == 0 || at > self.now {
                return;
            }
            self.fifo.pop_front();
            self.buffer.set((FRAME_WORDS - self.missing) as usize, word);
            self.missing -= 1;
        }
    }
}

/// What the board's registers are to the machine. Each access takes its time, in which the lines go on.
impl Port for World {
    fn arm(&mut self) {
        self.advance(self.now + 10 * ACCESS);
        self.fifo.clear();
        (self.ended, self.overrun, self.interrupt) = (false, false, None);
        self.missing = FRAME_WORDS;
        self.dma = true;
        self.advance(self.now + ACCESS);
        self.capture = true;
    }

    fn disarm(&mut self) {
        self.advance(self.now + ACCESS);
        (self.capture, self.taking, self.dma) = (false, false, false);
        self.fifo.clear();
        self.advance(self.now + 2 * ACCESS);
    }

    fn ready(&mut self, high: bool) {
        self.driver.set_ready(self.now, high);
        self.advance(self.now + ACCESS);
    }

    fn look(&mut self) -> Look {
        let look = self.seen();
        self.advance(self.now + 4 * ACCESS);
        look
    }
}
