//! Instructions of some work, as the board's clock counts them under `CSLAM_ICOUNT=10`.

use crate::clock::{instructions, ticks};

/// Instructions between two readings of the clock.
pub(crate) fn between(start: u32, end: u32) -> u32 {
    instructions(u64::from(end.wrapping_sub(start))) as u32
}

/// What some work gives, and its instructions.
#[inline(never)]
pub(crate) fn measure<R>(work: impl FnOnce() -> R) -> (R, u32) {
    let start = ticks();
    let result = work();
    let end = ticks();
    (result, between(start, end))
}

/// The same with a line, `name: instructions`, behind the name of a set.
pub(crate) fn report<R>(set: &str, name: &str, work: impl FnOnce() -> R) -> R {
    let (result, instructions) = measure(work);
    defmt::println!("{=str}{=str}: {=u32}", set, name, instructions);
    result
}
