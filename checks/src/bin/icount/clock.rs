//! The board's clock, which counts instructions under `CSLAM_ICOUNT=10`.

use core::ptr;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;

/// The counter now.
pub(crate) fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}

/// Instructions of so many ticks: one takes 2^10 ns, a tick 40 ns, so there are 25.6 ticks to an instruction.
pub(crate) fn instructions(ticks: u64) -> u64 {
    ticks * 10 / 256
}
