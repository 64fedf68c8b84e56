//! The whole path estimator on an emulated Cortex-M7: recorded sweeps in, what it makes of them out, bit for bit, and the
//! instructions that each stage of it took: lines `sweep INDEX, STAGE: instructions`. Run with `CSLAM_ICOUNT=10` for counts (see `checks_an500`); without, the counts mean nothing.
//!
//! Arguments: `best` or `paper`, the recording (format: [`cslam_firmware::sweep_check`]), the file for the lines. Both are
//! files of the host, by semihosting. Exit code 0; 1 when a recording is not one; 2 for wrong arguments.
#![no_std]
#![no_main]

#[path = "../icount/clock.rs"]
mod clock;
mod counter;
#[path = "../semihosting/lines.rs"]
mod lines;
#[path = "../semihosting/recording.rs"]
mod recording;
#[path = "../icount/stages.rs"]
mod stages;
#[path = "../semihosting/words.rs"]
mod words;

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cslam_checks::sweep;
use cslam_core::paths::{EstimatorConfig, PathEstimator};
use cslam_core::profile::quad_4x8_gmt_72::{CHANNELS, PATHS};
use cslam_core::profile::{PaperFlightEstimator, Samples};
use cslam_core::signal::{Iq, SAMPLES};
use defmt_semihosting as _;
use semihosting::process::exit;

use counter::Counter;
use lines::Lines;
use recording::Recording;
use stages::Stages;
use words::words;

type Best = cslam_firmware::app::Best<&'static Stages>;

#[entry]
fn main() -> ! {
    let Some([mode, recording, lines]) = words() else {
        usage()
    };
    let Some(stages) = cortex_m::singleton!(: Stages = Stages::new()) else {
        exit(101)
    };
    let config = EstimatorConfig::single_sweeps();
    let estimator: &mut dyn PathEstimator<CHANNELS, PATHS> = match mode.path().to_bytes() {
        b"best" => match cortex_m::singleton!(: Best = Best::with_meter(&config, stages)) {
            Some(estimator) => estimator,
            None => exit(101),
        },
        b"paper" => match cortex_m::singleton!(: PaperFlightEstimator = PaperFlightEstimator::new(&config)) {
            Some(estimator) => estimator,
            None => exit(101),
        },
        _ => usage(),
    };
    let (Some(recording), Some(lines)) = (Recording::open(&recording), Lines::create(&lines)) else {
        usage()
    };
    check(estimator, stages, recording, lines)
}

fn usage() -> ! {
    defmt::error!("three arguments are expected: best or paper, a recording, a file for the lines");
    exit(2)
}

fn check(
    estimator: &mut dyn PathEstimator<CHANNELS, PATHS>,
    stages: &'static Stages,
    mut recording: Recording,
    mut lines: Lines,
) -> ! {
    let Some(block) = cortex_m::singleton!(: Samples = [[Iq::ZERO; SAMPLES]; CHANNELS]) else {
        exit(101)
    };
    let mut counter = Counter { stages, sweep: 0 };
    match sweep::run(&mut recording, estimator, block, &mut counter, &mut lines) {
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

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    defmt::error!("{}", defmt::Display2Format(info));
    exit(101)
}
