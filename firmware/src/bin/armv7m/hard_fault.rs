//! The entry of a fault, on a stack that may have no room left: the handler's own accesses must not fail, or the processor locks up
//! and no record is left.
//!
//! Whoever uses this provides `fn faulted(&Fault) -> !` in the crate's root, and the linker script `_stack_start` and `_stack_end`.

use core::arch::global_asm;

use cortex_m::peripheral::SCB;
use cslam_firmware::fault::{Cause, FaultStack};

/// What the processor knows about a fault.
pub(crate) struct Fault {
    pub(crate) cause: Cause,
    /// Of the code that failed; 0 when the processor could not push them.
    pub(crate) program_counter: u32,
    pub(crate) link_register: u32,
    /// CFSR.
    pub(crate) status: u32,
}

// With less than a KiB left, the handler gets the whole stack: what lies at its top is of no use any more. Every level of the program runs
// on the main stack, so that is where the frame lies.
global_asm!(
    ".section .HardFault.entry, \"ax\"",
    ".global HardFault",
    ".type HardFault, %function",
    ".thumb_func",
    "HardFault:",
    "    mrs r0, MSP",
    "    ldr r1, =_stack_end",
    "    add r2, r1, #1024",
    "    cmp r0, r2",
    "    bhs 1f",
    "    ldr r2, =_stack_start",
    "    msr MSP, r2",
    "1:  b hard_fault",
    ".ltorg",
    ".size HardFault, . - HardFault",
);

/// Takes the fault apart. `pointer` is the stack pointer after the processor's frame.
#[unsafe(no_mangle)]
extern "C" fn hard_fault(pointer: u32, bottom: u32) -> ! {
    let stack = FaultStack { bottom, pointer };
    // SAFETY: registers that reading does not change.
    let (status, addresses) = unsafe {
        let scb = &*SCB::PTR;
        (scb.cfsr.read(), [scb.mmfar.read(), scb.bfar.read()])
    };
    let [program_counter, link_register] = if stack.holds_frame(status) {
        // SAFETY: the processor has pushed r0 to r3, r12, lr, pc and xpsr there. The entry has left them alone: it moves to the top of the stack
        // only from its bottom.
        unsafe {
            let frame = pointer as *const u32;
            [frame.add(6).read(), frame.add(5).read()]
        }
    } else {
        [0; 2]
    };
    super::faulted(&Fault {
        cause: stack.cause(status, addresses),
        program_counter,
        link_register,
        status,
    })
}
