//! Time: the free-running counter of the board's FPGA (Arm AN500, FPGA system control).

use core::ptr;

/// 32-bit up-counter at 25 MHz; it wraps after 171 s.
const COUNTER: usize = 0x4002_8018;
const TICKS_PER_S: u32 = 25_000_000;

/// Measures a span of time, at most 171 s.
pub(crate) struct Stopwatch {
    start: u32,
}

impl Stopwatch {
    /// Starts now.
    pub(crate) fn start() -> Self {
        Self { start: ticks() }
    }

    /// Whether this many seconds have passed.
    pub(crate) fn has_run_s(&self, seconds: u32) -> bool {
        ticks().wrapping_sub(self.start) >= seconds.saturating_mul(TICKS_PER_S)
    }
}

fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}
