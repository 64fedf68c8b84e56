//! The whole path estimator on an emulated Cortex-M7: recorded sweeps in, what it makes of them out, bit for bit, and the
//! instructions it took. Run with `CSLAM_ICOUNT=10` for counts (see `kernels_an500`); without, the counts mean nothing.
//!
//! Arguments: `best` or `paper`, the recording (format: [`cslam_firmware::sweep_check`]), the file for the lines. Both are
//! files of the host, by semihosting. Exit code 0; 1 when a recording is not one; 2 for wrong arguments.
#![no_std]
#![no_main]

mod files;

use core::panic::PanicInfo;
use core::ptr;

use cortex_m_rt::entry;
use cslam_core::ltd::{BeamReport, Estimator, EstimatorConfig, Iq, PaperEstimator, PathEstimator};
use cslam_core::waveform::SAMPLES;
use cslam_firmware::front_end_check::{Block, CHANNELS};
use cslam_firmware::sweep_check::{self, Observer, PATHS};
use defmt_semihosting as _;
use semihosting::process::exit;

use files::{Lines, Recording, words};

type Best = Estimator<4, 8, CHANNELS, 72, 3, 8, 8, 360, PATHS>;
type Paper = PaperEstimator<4, 8, CHANNELS, 72, PATHS>;

/// 32-bit up-counter of the board's FPGA, 25 MHz.
const COUNTER: usize = 0x4002_8018;

#[entry]
fn main() -> ! {
    let Some([mode, recording, lines]) = words() else {
        usage()
    };
    let config = EstimatorConfig::default();
    match mode.to_bytes() {
        b"best" => {
            let Some(estimator) = cortex_m::singleton!(: Best = Best::new(&config)) else {
                exit(101)
            };
            check(estimator, Recording::open(&recording), Lines::create(&lines))
        }
        b"paper" => {
            let Some(estimator) = cortex_m::singleton!(: Paper = Paper::new(&config)) else {
                exit(101)
            };
            check(estimator, Recording::open(&recording), Lines::create(&lines))
        }
        _ => usage(),
    }
}

fn usage() -> ! {
    defmt::error!("three arguments are expected: best or paper, a recording, a file for the lines");
    exit(2)
}

fn check(
    estimator: &mut dyn PathEstimator<CHANNELS, PATHS>,
    recording: Option<Recording>,
    lines: Option<Lines>,
) -> ! {
    let (Some(mut recording), Some(mut lines)) = (recording, lines) else {
        usage()
    };
    let Some(block) = cortex_m::singleton!(: Block = [[Iq::ZERO; SAMPLES]; CHANNELS]) else {
        exit(101)
    };
    let mut counter = Counter { sweep: 0 };
    match sweep_check::run(&mut recording, estimator, block, &mut counter, &mut lines) {
        Ok(sweeps) if lines.flush().is_ok() => {
            defmt::println!("sweeps: {=u32}", sweeps);
            exit(0)
        }
        _ => {
            defmt::error!("the recording is damaged, or a file cannot be used");
            exit(1)
        }
    }
}

/// Prints the instructions of every sweep.
struct Counter {
    sweep: u32,
}

impl Observer for Counter {
    fn push(&mut self, work: impl FnOnce() -> BeamReport) -> BeamReport {
        let (report, instructions) = measure(work);
        self.sweep += instructions;
        report
    }

    fn finish<R>(&mut self, work: impl FnOnce() -> R) -> R {
        let (result, instructions) = measure(work);
        defmt::println!("sweep: {=u32} + {=u32} at its end", self.sweep, instructions);
        self.sweep = 0;
        result
    }
}

/// Instructions of some work.
fn measure<R>(work: impl FnOnce() -> R) -> (R, u32) {
    let start = ticks();
    let result = work();
    let span = ticks().wrapping_sub(start);
    (result, (u64::from(span) * 10 / 256) as u32)
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
