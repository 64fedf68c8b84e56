//! The receiver on an emulated MPS2+ board with the AN500 image (Cortex-M7).
//!
//! Measurements come through a ring in the PSRAM, which the emulator shares with a process of the host; packets leave by
//! UART1; the log leaves by semihosting. Modes, by argument:
//!
//! - `self-test` (also without argument): the board is both ends of the ring, with one measurement of each outcome.
//! - `receive`: the host writes the ring. The run ends with the stream.
//! - `panic`, `fault`: ends that way, to see that whoever runs the board notices.
//!
//! Exit codes are those of [`exit::Exit`].
#![no_std]
#![no_main]

mod clock;
mod exit;
mod psram;
mod self_test;
mod uart;

use cortex_m_rt::entry;
use cslam_core::reflection::Form;
use cslam_core::telemetry::{Key, Sender};
use cslam_firmware::measurement;
use cslam_firmware::receiver::{BoardMap, ReceiveError, Receiver, Step, board_gates};
use cslam_firmware::ring::{Consumer, RingError};
use defmt_semihosting as _;
use embedded_io::Write as _;

use clock::Stopwatch;
use exit::{Exit, exit};
use psram::Psram;
use uart::Downlink;

/// How long the board waits for a ring and for each record, s.
const PATIENCE_S: u32 = 20;

/// Number of this UAV. The emulated board has no secret, so it signs with the published key.
const UAV: u8 = 1;

type Ring = Consumer<Psram, { measurement::LENGTH }>;

#[entry]
fn main() -> ! {
    let map = cortex_m::singleton!(: BoardMap = BoardMap::new());
    let Some(map) = map else {
        // `main` runs once, so this is the first and only time.
        exit(Exit::Panic)
    };
    let mut receiver = Receiver::new(map, Form::Vector, board_gates(), Sender::new(UAV, &Key::TEST, 0));
    let mut downlink = Downlink::enable();
    exit(match mode() {
        Mode::SelfTest => self_test::run(&mut receiver, &mut downlink),
        Mode::Receive => receive(&mut receiver, &mut downlink),
        Mode::Unknown => {
            defmt::error!("one argument is expected: self-test, receive, panic or fault");
            Exit::Usage
        }
        Mode::Panic => panic!("asked for"),
        Mode::Fault => cortex_m::asm::udf(),
    })
}

enum Mode {
    SelfTest,
    Receive,
    Panic,
    Fault,
    Unknown,
}

/// The mode that the arguments ask for; the first one is the program's name.
fn mode() -> Mode {
    let Ok(arguments) = semihosting::experimental::env::args::<256>() else {
        return Mode::Unknown;
    };
    let mut words = arguments.skip(1);
    match (words.next(), words.next()) {
        (None, _) | (Some(Ok("self-test")), None) => Mode::SelfTest,
        (Some(Ok("receive")), None) => Mode::Receive,
        (Some(Ok("panic")), None) => Mode::Panic,
        (Some(Ok("fault")), None) => Mode::Fault,
        _ => Mode::Unknown,
    }
}

/// Answers the host's stream until it ends.
fn receive<const N: usize>(receiver: &mut Receiver<'_, N>, downlink: &mut Downlink) -> Exit {
    let mut ring = match open() {
        Ok(ring) => ring,
        Err(RingError::NotReady) => return starved("ring"),
        Err(error) => return unusable(error),
    };
    defmt::info!("receiving");
    let mut idle = Stopwatch::start();
    loop {
        match receiver.step(&mut ring, downlink) {
            Ok(Step::Idle) if idle.has_run_s(PATIENCE_S) => return starved("record"),
            Ok(Step::Idle) => {}
            Ok(Step::Answered) => idle = Stopwatch::start(),
            Ok(Step::Damaged(error)) => {
                defmt::warn!("damaged record: {}", error);
                idle = Stopwatch::start();
            }
            Ok(Step::Ended) => break,
            Err(ReceiveError::Ring(error)) => return unusable(error),
            Err(error) => {
                defmt::error!("{}", defmt::Display2Format(&error));
                return Exit::Lost;
            }
        }
    }
    let Ok(()) = downlink.flush();
    report(receiver)
}

/// Waits for the host to make the ring.
fn open() -> Result<Ring, RingError> {
    let waiting = Stopwatch::start();
    loop {
        match Ring::open(Psram::from(0)) {
            Err(RingError::NotReady) if !waiting.has_run_s(PATIENCE_S) => {}
            result => return result,
        }
    }
}

/// Logs what became of everything, and says whether all of it arrived.
fn report<const N: usize>(receiver: &Receiver<'_, N>) -> Exit {
    let counters = receiver.counters();
    defmt::info!("{}", counters);
    defmt::info!(
        "map: {=usize} points, {}",
        receiver.map().len(),
        receiver.map().counters()
    );
    if counters.missing == 0 && counters.unsent == 0 {
        Exit::Done
    } else {
        Exit::Lost
    }
}

fn starved(of: &str) -> Exit {
    defmt::error!("no {=str} for {=u32} s", of, PATIENCE_S);
    Exit::Starved
}

fn unusable(error: RingError) -> Exit {
    defmt::error!("the ring cannot be used: {}", error);
    Exit::Ring
}
