//! Instruction counts of the path estimator's kernels on an emulated Cortex-M7, and their equality with the portable
//! form. Run with `CSLAM_ICOUNT=10`: the emulator's clock then advances 1024 ns an instruction, so that the board's
//! 25 MHz counter gives instructions = ticks / 25.6. These are instructions, not cycles.
//!
//! One line a kernel, `name instructions`, then one line a block, `block index digest clips unexamined exponent`. Exit code 0
//! unless the assembly and the portable form differ.
#![no_std]
#![no_main]

use core::hint::black_box;
use core::panic::PanicInfo;
use core::ptr;

use cortex_m_rt::entry;
use cslam_core::ltd::kernels::{Kernels, Native, Portable};
use cslam_core::ltd::{Channel, Correlator, Detector, Iq, Workspace};
use cslam_core::waveform::{SAMPLES, Waveform};
use cslam_firmware::front_end::{Checksum, SoftwareCrc};
use cslam_firmware::front_end_check::{self as check, BLOCKS, Block, CHANNELS, SUBSET};
use defmt_semihosting as _;
use semihosting::process::exit;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;
/// A block like those of a receiver whose gain control works: two paths well over the noise, 12 bits, near -12 dB of full
/// scale. Not noise: a path gathers its energy in few words of the last stages, where it might meet a limit.
const NOMINAL: u32 = 31;
/// A tone at the strongest level, another in each channel.
const JAMMED: u32 = 10;
/// Noise far below the level of the gain control.
const WEAK: u32 = 20;

#[entry]
fn main() -> ! {
    let buffers = cortex_m::singleton!(: (Block, Workspace, Workspace) = ([[Iq::ZERO; SAMPLES]; CHANNELS], Workspace::new(), Workspace::new()));
    let Some((block, work, other)) = buffers else {
        exit(101)
    };
    let waveform = Waveform::default();
    let native = Correlator::<Native>::new(&waveform);
    let portable = Correlator::<Portable>::new(&waveform);

    count("empty", || ());
    costs("", &native, block, work);
    irregular_costs(&native, block, work);
    black_box(report("", "checksum of a frame, 64 KiB", || {
        SoftwareCrc.samples(black_box(block))
    }));
    costs("portable ", &portable, block, work);

    let mut equal = true;
    for index in 0..BLOCKS {
        let outcome = check::run(&native, block, index, work);
        defmt::println!("block {=u32} {}", index, defmt::Display2Format(&outcome));
        if check::run(&portable, block, index, other) != outcome {
            equal = false;
            defmt::println!("block {=u32}: the portable form differs", index);
        }
    }
    exit(i32::from(!equal))
}

/// Counts every kernel of a set on a nominal block.
fn costs<K: Kernels>(set: &str, correlator: &Correlator<K>, block: &mut Block, work: &mut Workspace) {
    check::fill(block, NOMINAL);
    let mut spectrum: Channel = [Iq::ZERO; SAMPLES];
    if let Some(channel) = block.first() {
        report(set, "fft 512", || {
            correlator.spectrum(black_box(channel), black_box(&mut spectrum), work)
        });
    }
    let beam = report(set, "level, 32 channels", || {
        correlator.level(check::as_captured(black_box(block), NOMINAL))
    });
    let detector = Detector::new(SUBSET.len(), 1e-2, 72 * 256);
    let folded = report(set, "detect, 8 channels folded", || {
        correlator.detect(black_box(&beam), &SUBSET, work)
    });
    black_box(report(set, "median and peak, 256 taps", || {
        detector.peak(black_box(folded.profile))
    }));
    let taps = report(set, "correlate, 32 channels", || {
        correlator.correlate(black_box(beam), work)
    });
    let detector = Detector::new(CHANNELS, 1e-2, 72 * 512);
    black_box(report(set, "median and peak, 512 taps", || {
        detector.peak(black_box(taps.profile()))
    }));
    black_box(taps.into_block());
}

/// Counts what is dear only for captures that are not regular.
fn irregular_costs<K: Kernels>(correlator: &Correlator<K>, block: &mut Block, work: &mut Workspace) {
    check::fill(block, JAMMED);
    let beam = correlator.level(check::as_captured(block, JAMMED));
    black_box(report("", "correlate, a tone clips in every channel", || {
        correlator.correlate(black_box(beam), work)
    }));
    check::fill(block, WEAK);
    black_box(report("", "level, 32 channels, with a shift", || {
        correlator.level(check::as_captured(black_box(block), WEAK))
    }));
}

/// Instructions of a kernel in a set, printed.
fn report<R>(set: &str, name: &str, kernel: impl FnOnce() -> R) -> R {
    let (result, instructions) = measure(kernel);
    defmt::println!("{=str}{=str}: {=u32}", set, name, instructions);
    result
}

/// Instructions of a kernel.
#[inline(never)]
fn measure<R>(kernel: impl FnOnce() -> R) -> (R, u32) {
    let start = ticks();
    let result = kernel();
    let span = ticks().wrapping_sub(start);
    (result, (u64::from(span) * 10 / 256) as u32)
}

fn count(name: &str, kernel: impl FnOnce()) {
    report("", name, kernel);
}

fn ticks() -> u32 {
    // SAFETY: an aligned 32-bit register that exists on this board and that reading does not change.
    unsafe { ptr::read_volatile(COUNTER as *const u32) }
}

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(101)
}
