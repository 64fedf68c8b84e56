//! The log by RTT: a ring in memory that a probe reads while the program runs on.
//!
//! The usual logger waits, with interrupts off, for a probe that once asked it to and then stopped reading. This one never waits: see
//! [`Lines`]. Interrupts are off while a line is written, some microseconds.

use core::cell::UnsafeCell;
use core::sync::atomic::{AtomicU8, AtomicU32, Ordering};

use critical_section::RestoreState;
use cslam_firmware::log::Lines;
use defmt::Encoder;

/// Bytes of the ring.
const SIZE: usize = 1024;
/// A line about lost lines is shorter than this.
const NOTICE: usize = 32;

static RING: [AtomicU8; SIZE] = [const { AtomicU8::new(0) }; SIZE];
/// Lines that the log has said are lost.
static REPORTED: AtomicU32 = AtomicU32::new(0);

/// What a probe looks for: SEGGER's control block with one channel up and none down.
#[repr(C)]
struct ControlBlock {
    id: [u8; 16],
    up: u32,
    down: u32,
    name: *const u8,
    ring: *const AtomicU8,
    size: u32,
    write: AtomicU32,
    read: AtomicU32,
    /// How the probe would like a full ring to be treated. It is not asked.
    mode: AtomicU32,
}

// SAFETY: the pointers are to statics of bytes that are constant or atomic.
unsafe impl Sync for ControlBlock {}

/// The name is the one by which probes find it; nothing else of the program has it.
#[unsafe(no_mangle)]
static _SEGGER_RTT: ControlBlock = ControlBlock {
    id: *b"SEGGER RTT\0\0\0\0\0\0",
    up: 1,
    down: 0,
    name: c"defmt".as_ptr().cast(),
    ring: RING.as_ptr(),
    size: SIZE as u32,
    write: AtomicU32::new(0),
    read: AtomicU32::new(0),
    mode: AtomicU32::new(0),
};

struct Writer {
    lines: Lines<'static>,
    encoder: Encoder,
    /// How interrupts were before the line that is being written.
    before: Option<RestoreState>,
}

struct Shared(UnsafeCell<Writer>);

// SAFETY: only used with interrupts off, on the one core there is: by `with`, and by the logger between `acquire` and `release`.
unsafe impl Sync for Shared {}

static WRITER: Shared = Shared(UnsafeCell::new(Writer {
    lines: Lines::new(&RING, &_SEGGER_RTT.write, &_SEGGER_RTT.read),
    encoder: Encoder::new(),
    before: None,
}));

/// Says how many lines were lost when that has changed and there is room to say so.
pub(crate) fn report_losses() {
    let (lost, room) = critical_section::with(|_| {
        // SAFETY: interrupts are off, and this is not within a line.
        let writer = unsafe { &*WRITER.0.get() };
        (writer.lines.lost(), writer.lines.room())
    });
    if lost != REPORTED.load(Ordering::Relaxed) && room >= NOTICE {
        REPORTED.store(lost, Ordering::Relaxed);
        defmt::warn!("log: {=u32} lines lost, the probe did not read", lost);
    }
}

#[defmt::global_logger]
struct Logger;

// SAFETY: `acquire` turns interrupts off and `release` puts them back, so between them nobody else writes.
unsafe impl defmt::Logger for Logger {
    fn acquire() {
        // SAFETY: put back by `release`.
        let before = unsafe { critical_section::acquire() };
        // SAFETY: interrupts are off.
        let writer = unsafe { &mut *WRITER.0.get() };
        if writer.before.is_none() {
            writer.before = Some(before);
        } else {
            // A panic within a line: that one will not be finished.
            writer.lines.give_up();
        }
        writer.lines.begin();
        writer.encoder.start_frame(|bytes| writer.lines.put(bytes));
    }

    unsafe fn flush() {
        // Whoever reads does so in his own time.
    }

    unsafe fn release() {
        // SAFETY: interrupts are off since `acquire`.
        let writer = unsafe { &mut *WRITER.0.get() };
        writer.encoder.end_frame(|bytes| writer.lines.put(bytes));
        writer.lines.end();
        if let Some(before) = writer.before.take() {
            // SAFETY: what `acquire` of this line gave.
            unsafe { critical_section::release(before) };
        }
    }

    unsafe fn write(bytes: &[u8]) {
        // SAFETY: interrupts are off since `acquire`.
        let writer = unsafe { &mut *WRITER.0.get() };
        writer.encoder.write(bytes, |bytes| writer.lines.put(bytes));
    }
}
