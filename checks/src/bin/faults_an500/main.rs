//! What happens when something that cannot happen does, on the emulated board: a record is left behind, the board resets, and the next
//! start tells the ground.
//!
//! Argument: `panic`, `fault`, `hang` or `overflow`. The first start ends that way. The second finds the record, sends it on UART1 as the
//! receiver would, signed, and ends the run. Exit codes: 0 told; 1 the record is not that of the argument; 2 wrong argument.
#![no_std]
#![no_main]

#[path = "../../../../firmware/src/bin/armv7m/hard_fault.rs"]
mod hard_fault;
#[path = "../../../../firmware/src/bin/armv7m/protect.rs"]
mod protect;
#[path = "../an500/uart.rs"]
mod uart;
#[path = "../semihosting/words.rs"]
mod words;

use core::hint::black_box;
use core::mem::MaybeUninit;
use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use cslam_core::telemetry::{Event, EventReport, Key, MAX_FRAME, Message, Sender};
use cslam_firmware::fault::{Cause, FaultRecord, WORDS};
use cslam_firmware::mpu::{Kind, Region};
use cslam_firmware::sensor_stream::UAV;
use cslam_firmware::supervisor::{Progress, Supervisor, Watched};
use defmt_semihosting as _;
use embedded_io::Write as _;
use semihosting::process::exit;

use hard_fault::Fault;
use protect::protect;
use words::words;

/// Not cleared at the start.
#[unsafe(link_section = ".uninit.fault")]
static mut RECORD: MaybeUninit<[u32; WORDS]> = MaybeUninit::uninit();

/// Time by the system timer, ms.
static UPTIME_MS: AtomicU32 = AtomicU32::new(0);
/// Stage that is at work: here the number of the argument.
static STAGE: AtomicU32 = AtomicU32::new(0);
/// Two tasks: one that goes round, and one that may hang.
static LIVELY: Progress = Progress::new();
static TESTED: Progress = Progress::new();

/// Clock of the processor, and how often the timer interrupts, Hz.
const CLOCK_HZ: u32 = 25_000_000;
const TICK_HZ: u32 = 1000;
/// What the program touches. Of the 512 KiB below the stack it uses the lower half; the rest is left out, so that there is nothing
/// below the stack, as on the flight board.
const REGIONS: [Region; 4] = [
    Region::new(0x0000_0000, 21, Kind::Code),
    Region::new(0x2000_0000, 18, Kind::Data),
    Region::new(0x2008_0000, 17, Kind::Data),
    Region::new(0x4000_0000, 29, Kind::Device),
];

/// A task that stands still for so long hangs.
const DEADLINE_NS: u64 = 50_000_000;

#[entry]
fn main() -> ! {
    let Some([mode]) = words() else { usage() };
    let (stage, cause) = match mode.path().to_bytes() {
        b"panic" => (1, Cause::Panic),
        b"fault" => (2, Cause::HardFault),
        b"hang" => (3, Cause::Hang),
        b"overflow" => (4, Cause::StackOverflow),
        _ => usage(),
    };
    if let Some(record) = take() {
        tell(&record);
        let right = record.cause == cause && record.stage == stage;
        exit(i32::from(!right))
    }
    STAGE.store(u32::from(stage), Ordering::Relaxed);
    let Some(mut core) = cortex_m::Peripherals::take() else {
        usage()
    };
    // SAFETY: flash, the lower half of the static memory, where all of it lies, the stack, and the peripherals.
    unsafe { protect(&mut core.MPU, &REGIONS) };
    let mut timer = core.SYST;
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(CLOCK_HZ / TICK_HZ - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
    // As long as it goes round, nothing happens.
    while UPTIME_MS.load(Ordering::Relaxed) < 2 * (DEADLINE_NS / 1_000_000) as u32 {
        TESTED.mark();
    }
    match cause {
        Cause::Panic => panic!("asked for"),
        Cause::HardFault => cortex_m::asm::udf(),
        Cause::Hang => loop {
            cortex_m::asm::nop();
        },
        Cause::StackOverflow => exit(deeper(0) as i32),
        // Not among the arguments.
        Cause::Clock => usage(),
    }
}

/// Calls itself until the stack is used up.
#[inline(never)]
fn deeper(depth: u32) -> u32 {
    let frame = black_box([depth; 64]);
    if black_box(depth) == u32::MAX {
        return 0;
    }
    deeper(depth + 1).wrapping_add(black_box(&frame).iter().sum())
}

fn usage() -> ! {
    defmt::error!("one argument is expected: panic, fault, hang or overflow");
    exit(2)
}

/// Tells the ground and the log what the program before left behind.
fn tell(record: &FaultRecord) {
    defmt::error!("the program before ended: {}", defmt::Display2Format(record));
    let report = EventReport {
        time_ns: 0,
        event: Event::Reset(record.report()),
    };
    let mut frame = [0; MAX_FRAME];
    let mut sender = Sender::new(UAV, &Key::TEST, 0);
    if let Ok(bytes) = sender.encode(&Message::Event(report), &mut frame) {
        let mut downlink = uart::Downlink::enable();
        let Ok(_all) = downlink.write(bytes);
        let Ok(()) = downlink.flush();
    }
}

/// Takes the record, if there is one.
fn take() -> Option<FaultRecord> {
    let place = (&raw mut RECORD).cast::<[u32; WORDS]>();
    // SAFETY: used here, before any interrupt is on, and by `end`, which does not return: never by two at a time. Any words are valid;
    // volatile, because another run of the program wrote them.
    let words = unsafe { place.read_volatile() };
    // SAFETY: as above.
    unsafe { place.write_volatile([0; WORDS]) };
    FaultRecord::from_words(&words)
}

/// Leaves a record behind and resets.
fn end(record: &FaultRecord) -> ! {
    cortex_m::interrupt::disable();
    let place = (&raw mut RECORD).cast::<[u32; WORDS]>();
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
        stage: STAGE.load(Ordering::Relaxed) as u8,
        uptime_ms: UPTIME_MS.load(Ordering::Relaxed),
    }
}

/// The supervisor's place: above every task.
#[exception]
fn SysTick() {
    static mut SUPERVISOR: Option<Supervisor<'static, 2>> = None;
    let uptime_ms = UPTIME_MS.load(Ordering::Relaxed).wrapping_add(1);
    UPTIME_MS.store(uptime_ms, Ordering::Relaxed);
    LIVELY.mark();
    let now_ns = u64::from(uptime_ms) * 1_000_000;
    let watched = |name, progress| Watched {
        name,
        progress,
        deadline_ns: DEADLINE_NS,
    };
    let supervisor = SUPERVISOR.get_or_insert_with(|| {
        Supervisor::new([watched("lively", &LIVELY), watched("tested", &TESTED)], now_ns)
    });
    if let Err(hung) = supervisor.check(now_ns) {
        defmt::error!("{}", defmt::Display2Format(&hung));
        end(&FaultRecord {
            program_counter: u32::from(hung.index),
            ..record(Cause::Hang)
        })
    }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    end(&record(Cause::Panic))
}

fn faulted(fault: &Fault) -> ! {
    end(&FaultRecord {
        program_counter: fault.program_counter,
        link_register: fault.link_register,
        status: fault.status,
        ..record(fault.cause)
    })
}
