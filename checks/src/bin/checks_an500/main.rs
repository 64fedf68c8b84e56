//! What is checked and counted on an emulated MPS2+ board with the AN500 image (Cortex-M7), one check a run. Run with `CSLAM_ICOUNT=10` for
//! counts: the emulator's clock then advances 1024 ns an instruction, so that the board's 25 MHz counter gives instructions = ticks / 25.6.
//! These are instructions, not cycles; without it the counts mean nothing.
//!
//! Arguments:
//!
//! - `kernels`: the path estimator's kernels ([`kernels`]).
//! - `networks`: the link state networks ([`networks`]).
//! - `association`: data association ([`association`]).
//! - `panic`, `fault`: ends that way, to see that whoever runs the board notices.
//!
//! Exit codes are those of `exit.rs`. The whole path estimator has an image of its own, `sweeps-an500`: beside the
//! others' static data it would have no room for its stack.
#![no_std]
#![no_main]

mod association;
#[path = "../icount/clock.rs"]
mod clock;
#[path = "../an500/exit.rs"]
mod exit;
mod kernels;
#[path = "../icount/measure.rs"]
mod measure;
mod networks;
mod rivals;
#[path = "../semihosting/words.rs"]
mod words;

use cortex_m_rt::entry;
use defmt_semihosting as _;

use exit::{Exit, exit};
use words::words;

#[entry]
fn main() -> ! {
    let outcome = if let Some([check]) = words() {
        match check.path().to_bytes() {
            b"kernels" => kernels::run(),
            b"networks" => networks::run(),
            b"association" => association::run(),
            b"panic" => panic!("asked for"),
            b"fault" => cortex_m::asm::udf(),
            _ => Err(Exit::Usage),
        }
    } else {
        Err(Exit::Usage)
    };
    exit(match outcome {
        Ok(()) => Exit::Done,
        Err(Exit::Usage) => {
            defmt::error!("expected: kernels, networks, association, panic or fault");
            Exit::Usage
        }
        Err(other) => other,
    })
}
