//! `cargo fw`: the firmware, flown in the loop or put on a board.
//!
//! In the loop the host is the world: it flies the simulation, gives the emulated chip what its front end and its sensors would
//! deliver, and takes what it sends. Beside it the same application runs on the host, on the same bytes. What the two sent, where they
//! were, and what they mapped must be the same, bit for bit.

mod arguments;
mod board;
mod budget;
mod compare;
mod cycles;
mod flash;
mod host;
mod world;

use std::process::ExitCode;

use arguments::{Arguments, Target};

fn main() -> ExitCode {
    let arguments = Arguments::read();
    let done = match arguments.board {
        Target::Emulated if !arguments.flights.is_empty() => fly_each(&arguments),
        Target::Emulated => fly(&arguments),
        Target::H743 => flash::flash(),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("fw: {error:#}");
            ExitCode::from(
                if error.is::<compare::Difference>() || error.is::<budget::Excess>() {
                    1
                } else {
                    2
                },
            )
        }
    }
}

/// Flies several in the loop, compares each, and counts.
fn fly_each(arguments: &Arguments) -> anyhow::Result<()> {
    let image = board::build("receiver-an500")?;
    let mut logs = Vec::new();
    for flight in &arguments.flights {
        let one = Arguments {
            scene: flight.scene.clone(),
            seed: flight.seed,
            count: true,
            ..arguments.clone()
        };
        let flown = world::fly(&one, &image)?;
        eprintln!("{}", flown.summary(&one));
        compare::compare(&flown)?;
        logs.push((format!("{} {}", flight.scene, flight.seed), flown.board.log));
    }
    budget::flights(arguments.world, &logs)
}

/// Flies in the loop and compares.
fn fly(arguments: &Arguments) -> anyhow::Result<()> {
    let image = board::build("receiver-an500")?;
    let flown = world::fly(arguments, &image)?;
    println!("{}", flown.summary(arguments));
    compare::compare(&flown)?;
    budget::memory(&flown.board.log)?;
    if arguments.count {
        budget::time(arguments, &flown.board.log)?;
    }
    if let Some(profile) = &flown.board.profile {
        cycles::report(arguments, profile)?;
    }
    Ok(())
}
