//! What the image takes of the chip: static data, flash, and the stack, which was painted before `main`.

use core::ptr;

use cslam_core::beam_squint::BeamSquint;
use cslam_firmware::app::Map;
use cslam_firmware::front_end::{Block, FRAME_LENGTH};

use crate::{App, Best};

/// What cortex-m-rt paints with (its feature `paint-stack`).
const PAINT: u32 = 0xcccc_cccc;

unsafe extern "C" {
    static _stack_start: u32;
    static _stack_end: u32;
    static __vector_table: u32;
    static __sidata: u32;
    static __sdata: u32;
    static __edata: u32;
    static __ebss: u32;
}

/// The line of the stack that was used up to here, when path estimation has been built.
#[inline(never)]
pub(crate) fn print_built() {
    defmt::println!("bytes, stack to build path estimation: {=usize}", stack());
}

/// Lines of a table, `name: bytes`.
pub(crate) fn print() {
    for (part, bytes) in [
        ("path estimation", size_of::<Best>()),
        ("beam squint", size_of::<BeamSquint>()),
        ("map", size_of::<Map>()),
        (
            "filter, inertial unit, surfaces, link to the ground",
            size_of::<App>(),
        ),
        ("block that is worked on", size_of::<Block>()),
        ("frame that arrives", FRAME_LENGTH),
    ] {
        defmt::println!("bytes, {=str}: {=usize}", part, bytes);
    }
    let start = &raw const __sdata as usize;
    defmt::println!("bytes, static data: {=usize}", &raw const __ebss as usize - start);
    // Initial values of static data come last in flash.
    let initial = &raw const __edata as usize - start;
    let flash = &raw const __sidata as usize + initial - &raw const __vector_table as usize;
    defmt::println!("bytes, flash: {=usize}", flash);
    defmt::println!("bytes, stack: {=usize}", stack());
}

/// Bytes of the stack that were used.
fn stack() -> usize {
    let top = &raw const _stack_start as usize;
    let mut at = &raw const _stack_end as usize;
    // SAFETY: from `_stack_end` up to `_stack_start` lies the stack, whole words of memory that may be read; nothing is in use below
    // the deepest point it has reached.
    while at < top && unsafe { ptr::read_volatile(at as *const u32) } == PAINT {
        at += 4;
    }
    top - at
}
