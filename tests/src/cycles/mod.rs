//! From instructions to cycles of a Cortex-M7: what is known of its timing, and what a profile of the emulated board comes to by it.
//!
//! Arm publishes no table of cycles for this processor. What stands here is from
//! - Arm's Cortex-M7 technical reference manual (DDI 0489): in order, two instructions a cycle at most;
//! - Arm's model of it in LLVM, `llvm/lib/Target/ARM/ARMScheduleM7.td`: units, latencies, what is issued alone;
//! - measurements on an STM32H743, <https://github.com/jnk0le/random>, notes on the pipeline of the Cortex-M7: double precision, stores,
//!   lists of registers, branches.
//!
//! Where they differ, the least takes the smaller figure and the most the larger one. docs/performance.md, "Cycles" has them in a table.

pub mod block;
pub mod instruction;
pub mod profile;
