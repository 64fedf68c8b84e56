//! Lines of the log in a ring that a probe reads, as SEGGER's RTT lays it out.
//!
//! The program never waits for the probe: a line that finds no room is lost as a whole, and counted. What the probe finds is whole lines
//! in order, the first after a start among them when it comes late.

use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

/// The writing end of a ring.
#[derive(Debug)]
pub struct Lines<'a> {
    bytes: &'a [AtomicU8],
    /// Where the next line begins; the probe reads up to here.
    write: &'a AtomicU32,
    /// How far the probe has come. It writes this, so it may hold anything.
    read: &'a AtomicU32,
    /// Where the next byte of the line in hand goes.
    cursor: usize,
    fits: bool,
    lost: u32,
}

impl<'a> Lines<'a> {
    /// A ring, and the two places in it.
    #[must_use]
    pub const fn new(bytes: &'a [AtomicU8], write: &'a AtomicU32, read: &'a AtomicU32) -> Self {
        Self {
            bytes,
            write,
            read,
            cursor: 0,
            fits: false,
            lost: 0,
        }
    }

    /// Begins a line.
    pub fn begin(&mut self) {
        self.cursor = self.write.load(Ordering::Relaxed) as usize;
        self.fits = self.cursor < self.bytes.len();
    }

    /// Adds bytes to the line, none of them when there is no room for all.
    pub fn put(&mut self, bytes: &[u8]) {
        self.fits &= bytes.len() <= self.free(self.cursor);
        if !self.fits {
            return;
        }
        for byte in bytes {
            if let Some(place) = self.bytes.get(self.cursor) {
                place.store(*byte, Ordering::Relaxed);
            }
            self.cursor += 1;
            if self.cursor >= self.bytes.len() {
                self.cursor = 0;
            }
        }
    }

    /// Ends the line: the probe sees it now, or it is counted.
    pub fn end(&mut self) {
        if self.fits {
            self.write.store(self.cursor as u32, Ordering::Release);
        } else {
            self.give_up();
        }
    }

    /// Gives up the line in hand.
    pub fn give_up(&mut self) {
        self.fits = false;
        self.lost = self.lost.saturating_add(1);
    }

    /// Lines that were lost since the start.
    #[must_use]
    pub const fn lost(&self) -> u32 {
        self.lost
    }

    /// Bytes that the next line may have.
    #[must_use]
    pub fn room(&self) -> usize {
        self.free(self.write.load(Ordering::Relaxed) as usize)
    }

    /// Bytes from a place on that the probe has read; one always stays free, or a full ring would look like an empty one.
    fn free(&self, cursor: usize) -> usize {
        let (size, read) = (self.bytes.len(), self.read.load(Ordering::Acquire) as usize);
        if read >= size || cursor >= size {
            return 0;
        }
        if read > cursor {
            read - cursor - 1
        } else {
            size - cursor + read - 1
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::vec::Vec;

    use super::*;
    use crate::random::Random;

    const SIZE: usize = 64;

    fn line(lines: &mut Lines<'_>, parts: &[&[u8]]) {
        lines.begin();
        parts.iter().for_each(|part| lines.put(part));
        lines.end();
    }

    #[test]
    fn a_probe_that_stops_reading_costs_lines_and_no_time() {
        let bytes = [const { AtomicU8::new(0) }; SIZE];
        let (write, read) = (AtomicU32::new(0), AtomicU32::new(0));
        let mut lines = Lines::new(&bytes, &write, &read);
        // Nobody reads: six lines of ten bytes fit into 63, and all these calls come back.
        for _ in 0..1000 {
            line(&mut lines, &[&[7], &[8; 8], &[0]]);
        }
        assert_eq!(
            (write.load(Ordering::Relaxed), lines.lost(), lines.room()),
            (60, 994, 3)
        );
        // The probe goes on: so does the log.
        read.store(60, Ordering::Relaxed);
        line(&mut lines, &[&[1; 60]]);
        assert_eq!((write.load(Ordering::Relaxed), lines.lost()), (56, 994));
    }

    #[test]
    fn what_is_read_is_whole_lines_in_order() {
        let bytes = [const { AtomicU8::new(0) }; SIZE];
        let (write, read) = (AtomicU32::new(0), AtomicU32::new(0));
        let mut lines = Lines::new(&bytes, &write, &read);
        let mut random = Random::new(5);
        let (mut seen, mut sent) = (Vec::new(), 0u32);
        for number in 0..10_000u32 {
            // A number in four bytes, then as many of the same as the number says, in parts.
            let length = number as usize % 30;
            line(&mut lines, &[&number.to_le_bytes(), &[0xee; 30][..length]]);
            sent += 1;
            let mut at = read.load(Ordering::Relaxed) as usize;
            let end = write.load(Ordering::Relaxed) as usize;
            // Now and then the probe reads: all of it, or not yet.
            while at != end && random.below(3) > 0 {
                seen.push(bytes[at].load(Ordering::Relaxed));
                at = (at + 1) % SIZE;
                read.store(at as u32, Ordering::Relaxed);
            }
        }
        let (mut rest, mut received, mut last) = (seen.as_slice(), 0, None);
        while let Some((number, after)) = rest.split_first_chunk() {
            let number = u32::from_le_bytes(*number);
            assert!(last < Some(number), "{number} after {last:?}");
            last = Some(number);
            let length = number as usize % 30;
            if after.len() < length {
                break;
            }
            let (body, next) = after.split_at(length);
            assert!(
                body.iter().all(|byte| *byte == 0xee),
                "line {number} is not whole"
            );
            (rest, received) = (next, received + 1);
        }
        assert!(received > 1000 && lines.lost() > 1000);
        let waiting = sent - lines.lost() - received;
        assert!(
            waiting <= 16,
            "{waiting} lines are neither read, nor waiting, nor counted"
        );
    }

    #[test]
    fn a_probe_that_writes_nonsense_does_no_harm() {
        let bytes = [const { AtomicU8::new(0) }; SIZE];
        let (write, read) = (AtomicU32::new(0), AtomicU32::new(SIZE as u32));
        let mut lines = Lines::new(&bytes, &write, &read);
        line(&mut lines, &[&[1]]);
        read.store(u32::MAX, Ordering::Relaxed);
        line(&mut lines, &[&[1]]);
        read.store(0, Ordering::Relaxed);
        write.store(u32::MAX, Ordering::Relaxed);
        line(&mut lines, &[]);
        assert_eq!(lines.lost(), 3);
        write.store(0, Ordering::Relaxed);
        line(&mut lines, &[&[1; SIZE]]);
        line(&mut lines, &[&[1; SIZE - 1]]);
        assert_eq!((lines.lost(), write.load(Ordering::Relaxed)), (4, 63));
    }
}
