//! From instructions to cycles of a Cortex-M7: what is known of its timing, and what a profile of the emulated board comes to by it.
//!
//! Arm publishes no table of cycles for this processor. What stands here is from
//! - Arm's Cortex-M7 technical reference manual (DDI 0489): in order, two instructions a cycle at most, one unit of floating point;
//! - Arm's model of it in LLVM, `llvm/lib/Target/ARM/ARMScheduleM7.td`: units, latencies, what is issued alone;
//! - measurements on an STM32H730 at 480 MHz, <https://www.quinapalus.com/cm7cycles.html>;
//! - measurements on an STM32H743, <https://github.com/jnk0le/random> (`pipeline_cycle_test`), for double precision and stores.
//!
//! Where they differ, the lower bound takes the smaller figure and the upper bound the larger one.

pub mod block;
pub mod instruction;
pub mod profile;
