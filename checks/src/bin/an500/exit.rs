//! How a run ends: exit codes, and the handlers for what must not happen.

use cortex_m_rt::{ExceptionFrame, exception};
use semihosting::process;

/// Exit code of the emulator.
#[derive(Clone, Copy)]
#[repr(i32)]
#[allow(dead_code, reason = "not every image ends in every way")]
pub(crate) enum Exit {
    /// All is as it should be.
    Done = 0,
    /// A check has failed, or what it was given is damaged.
    Failed = 1,
    /// The arguments are wrong.
    Usage = 2,
    /// The ring cannot be used.
    Ring = 3,
    /// What the flight came to could not be written.
    Lost = 5,
    /// A panic.
    Panic = 101,
    /// A fault of the processor.
    HardFault = 102,
}

/// Ends the run.
pub(crate) fn exit(code: Exit) -> ! {
    process::exit(code as i32)
}

#[panic_handler]
fn panic(info: &core::panic::PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(Exit::Panic)
}

/// defmt's own panics have been logged by defmt already.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    exit(Exit::Panic)
}

// SAFETY: a hard fault handler may be entered with the memory in any state. This one reads the frame that the hardware
// has just pushed, logs it, and ends the run; it relies on nothing else and never returns.
#[exception]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    defmt::error!(
        "hard fault at {=u32:#x}, called from {=u32:#x}",
        frame.pc(),
        frame.lr()
    );
    exit(Exit::HardFault)
}
