//! Localization on an emulated Cortex-M7: a recorded flight in, every bit of the state after every sweep out, and the
//! instructions it took. Run with `CSLAM_ICOUNT=10` for counts (see `kernels_an500`); without, the counts mean nothing.
//!
//! Arguments: `46` or `58` states, the recording (format: [`cslam_firmware::flight_check`]), the file for the lines. Both
//! are files of the host, by semihosting. Exit code 0; 1 when the recording is not one; 2 for wrong arguments.
#![no_std]
#![no_main]

mod counts;
#[path = "../semihosting/lines.rs"]
mod lines;
#[path = "../semihosting/recording.rs"]
mod recording;
#[path = "../semihosting/words.rs"]
mod words;

use core::panic::PanicInfo;

use cortex_m_rt::entry;
use cslam_core::localization::Localizer;
use cslam_firmware::flight_check;
use defmt_semihosting as _;
use semihosting::process::exit;

use counts::Counts;
use lines::Lines;
use recording::Recording;
use words::words;

#[entry]
fn main() -> ! {
    let Some([states, recording, lines]) = words() else {
        usage()
    };
    let (Some(recording), Some(lines)) = (Recording::open(&recording), Lines::create(&lines)) else {
        usage()
    };
    let config = flight_check::config();
    match states.path().to_bytes() {
        b"46" => {
            let Some(place) = cortex_m::singleton!(: Option<Localizer<f32, 46>> = None) else {
                exit(101)
            };
            fly(place.insert(Localizer::new(&config, 0)), recording, lines)
        }
        b"58" => {
            let Some(place) = cortex_m::singleton!(: Option<Localizer<f32, 58>> = None) else {
                exit(101)
            };
            fly(place.insert(Localizer::new(&config, 0)), recording, lines)
        }
        _ => usage(),
    }
}

fn usage() -> ! {
    defmt::error!("three arguments are expected: 46 or 58, a recording, a file for the lines");
    exit(2)
}

fn fly<const N: usize>(localizer: &mut Localizer<f32, N>, mut recording: Recording, mut lines: Lines) -> ! {
    let mut counts = Counts::default();
    match flight_check::run(&mut recording, localizer, &mut counts, &mut lines) {
        Ok(sweeps) if lines.flush().is_ok() => {
            counts.print(N);
            defmt::println!("sweeps flown {=u32}", sweeps);
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
