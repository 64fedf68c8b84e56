//! The end of a program: what went wrong is written where a reset does not clear it, then the chip resets.

use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU8, Ordering};

use cortex_m::peripheral::SCB;
use cslam_core::telemetry::ResetCause;
use cslam_firmware::fault::{Cause, FaultRecord, WORDS};
use cslam_firmware::supervisor::Hung;
use embassy_stm32::pac;

use crate::hard_fault::Fault;

/// Stage that the receiver is at, for the record.
pub(crate) static STAGE: AtomicU8 = AtomicU8::new(0);

/// At the top of the DTCM, above the stack: not cached, not cleared at the start, out of reach of a stack that is too deep.
#[unsafe(link_section = ".fault")]
static mut RECORD: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

/// Takes the record that the program before this one left behind.
pub(crate) fn take() -> Option<FaultRecord> {
    let place = (&raw mut RECORD).cast::<[u32; WORDS]>();
    // SAFETY: the place is only used here, at the start, and by `end`, which does not return: never by two at a time. Whatever it holds is a
    // value of integers; volatile, because it was written by another run of the program.
    let words = unsafe { place.read_volatile() };
    // SAFETY: as above.
    unsafe { place.write_volatile([0; WORDS]) };
    FaultRecord::from_words(&words)
}

/// Writes the record and resets.
fn end(record: &FaultRecord) -> ! {
    let place = (&raw mut RECORD).cast::<[u32; WORDS]>();
    cortex_m::interrupt::disable();
    // SAFETY: interrupts are off and this does not return, so nobody else uses the place.
    unsafe { place.write_volatile(record.to_words()) };
    cortex_m::asm::dsb();
    SCB::sys_reset()
}

fn record(cause: Cause) -> FaultRecord {
    FaultRecord {
        cause,
        program_counter: 0,
        link_register: 0,
        status: 0,
        stage: STAGE.load(Ordering::Relaxed),
        // The time driver runs as soon as anything does that can fail.
        uptime_ms: embassy_time::Instant::now().as_millis() as u32,
    }
}

/// Ends the program because a task hangs.
pub(crate) fn hang(hung: Hung) -> ! {
    defmt::error!("{}", defmt::Display2Format(&hung));
    end(&FaultRecord {
        program_counter: u32::from(hung.index),
        ..record(Cause::Hang)
    })
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    end(&record(Cause::Panic))
}

/// defmt's own panics have been logged by defmt already.
#[defmt::panic_handler]
fn defmt_panic() -> ! {
    end(&record(Cause::Panic))
}

/// Ends the program because of a fault.
pub(crate) fn faulted(fault: &Fault) -> ! {
    end(&FaultRecord {
        program_counter: fault.program_counter,
        link_register: fault.link_register,
        status: fault.status,
        ..record(fault.cause)
    })
}

/// Ends the program because it has no clock that can be trusted.
pub(crate) fn clock_lost() -> ! {
    end(&record(Cause::Clock))
}

/// Why the chip began anew, by its own flags, which are cleared.
pub(crate) fn reset_cause(record: Option<&FaultRecord>) -> ResetCause {
    let flags = pac::RCC.rsr().read();
    pac::RCC.rsr().modify(|w| w.set_rmvf(true));
    match record {
        Some(record) => record.reset_cause(),
        None if flags.iwdg1rstf() => ResetCause::Watchdog,
        None if flags.porrstf() => ResetCause::PowerOn,
        None if flags.borrstf() => ResetCause::BrownOut,
        None if flags.sftrstf() => ResetCause::Command,
        None if flags.pinrstf() => ResetCause::Pin,
        None => ResetCause::Unknown,
    }
}
