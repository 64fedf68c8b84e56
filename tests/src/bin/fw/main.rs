//! `cargo fw`: the firmware, flown in the loop or put on a board.
//!
//! In the loop the host is the world: it flies the simulation, gives the emulated chip what its front end and its sensors would
//! deliver, and takes what it sends. Beside it the same application runs on the host, on the same bytes. What the two sent, where they
//! were, and what they mapped must be the same, bit for bit.

mod arguments;
mod board;
mod compare;
mod flash;
mod host;
mod world;

use std::process::ExitCode;

use arguments::{Arguments, Target};

fn main() -> ExitCode {
    let arguments = Arguments::read();
    let done = match arguments.board {
        Target::Emulated => fly(&arguments),
        Target::H743 => flash::flash(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("fw: {error:#}");
            ExitCode::from(if error.is::<compare::Difference>() { 1 } else { 2 })
        }
    }
}

/// Flies in the loop and compares.
fn fly(arguments: &Arguments) -> anyhow::Result<()> {
    let image = board::build("receiver-an500")?;
    let flown = world::fly(arguments, &image)?;
    println!("{}", flown.summary(arguments));
    for line in &flown.log {
        println!("{line}");
    }
    compare::compare(&flown)
}
