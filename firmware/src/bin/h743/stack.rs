//! How deep the stack was: it was painted before `main`, and what has kept its paint was never used.

use core::ptr;

/// What cortex-m-rt paints with (its feature `paint-stack`).
const PAINT: u32 = 0xcccc_cccc;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Bytes of the stack that were never used.
pub(crate) fn free() -> u32 {
    let bottom = &raw const _stack_end as usize;
    let top = &raw const _stack_start as usize;
    let mut at = bottom;
    // SAFETY: from `_stack_end` up to `_stack_start` lies the stack, whole words of memory that may be read; nothing is in use below
    // the deepest point it has reached.
    while at < top && unsafe { ptr::read_volatile(at as *const u32) } == PAINT {
        at += 4;
    }
    (at - bottom) as u32
}
