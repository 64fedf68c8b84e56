//! A flight over a path list: what the receiver would measure on each link, drawn from standard deviations instead of samples.
//! The receiver is exactly the firmware's library half.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use cslam_core::reflection::Form;
use cslam_core::telemetry::{Key, Sender};
use cslam_firmware::measurement::{PathRecord, Record};
use cslam_firmware::receiver::{Answer, BoardMap, ReceiveError, Receiver, Step, board_gates};

use super::{Args, Config, Flown, Mode, SWEEP_RATE_HZ};
use crate::evaluation::downlink;
use crate::flight_log::Header;
use crate::input::InputError;
use crate::path_flight::{self, Sweep, measure};
use crate::paths::{self, Link};
use crate::progress;
use crate::scene::Scene;

/// Name that stands for the bundled path list.
pub(super) const BUNDLED: &str = "bundled";

/// Number of the UAV in its packets, signed with the published key.
const UAV: u8 = 1;

/// The scene that the bundled path list was traced in.
const BUNDLED_SCENE: &str = "outdoor_a";

/// Flies over a list.
pub(super) fn run(
    args: &Args,
    config: &Config,
    file: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Flown> {
    // The surfaces behind a list are known for the bundled one, or when they are named.
    let (list_name, mut links, list_scene) = if file.as_os_str() == BUNDLED {
        (BUNDLED_SCENE.to_owned(), paths::bundled()?, Some(BUNDLED_SCENE))
    } else {
        (file.display().to_string(), paths::read(file)?, None)
    };
    let scene = args
        .scene
        .as_deref()
        .or(list_scene)
        .map(Scene::load)
        .transpose()?;
    links.truncate(args.steps.unwrap_or(usize::MAX));
    if links.is_empty() {
        return Err(InputError::new("nothing to fly: the path list is empty, or --steps is 0").into());
    }
    super::make_directory(&args.out)?;
    let flight = fly(&links, config, args, interrupted)?;
    let heard = downlink::decode(&flight.packets, UAV, &Key::TEST);
    let header = Header {
        mode: args.mode.name().into(),
        scene: list_name,
        seed: args.seed,
        planned_sweeps: links.len(),
        sweep_period_s: 1.0 / SWEEP_RATE_HZ,
        delay_cycle_m: None,
    };
    let log = path_flight::log(header, &flight.flown, &flight.answers, heard.traffic, &flight.map);
    Ok(Flown {
        log,
        scene,
        packets: flight.packets,
    })
}

/// A flight, or as much of it as was flown before an interrupt.
struct Flight<'a> {
    map: Box<BoardMap>,
    packets: Vec<u8>,
    /// What was measured on each link.
    flown: Vec<(&'a Link, Sweep)>,
    /// What became of it.
    answers: Vec<Answer>,
}

fn fly<'a>(
    links: &'a [Link],
    config: &Config,
    args: &Args,
    interrupted: &AtomicBool,
) -> anyhow::Result<Flight<'a>> {
    let form = if args.mode == Mode::Paper {
        Form::Paper
    } else {
        Form::Vector
    };
    let mut map = Box::new(BoardMap::new());
    let mut receiver = Receiver::new(&mut map, form, board_gates(), Sender::new(UAV, &Key::TEST, 0));
    let mut packets = Vec::new();
    let bar = progress::bar(links.len() as u64, "flying");
    let (mut flown, mut answers) = (Vec::with_capacity(links.len()), Vec::new());
    for (index, link) in links.iter().enumerate() {
        if interrupted.load(Ordering::Relaxed) {
            bar.abandon();
            break;
        }
        let sweep = measure(
            index as u32,
            link,
            &config.errors,
            args.seed,
            args.mode == Mode::Paper,
        )
        .map_err(|e| InputError::new(format!("link {index} of the path list: {e}")))?;
        for (path, number) in sweep.paths.iter().zip(0..=u8::MAX) {
            let record = PathRecord::new(sweep.link, number, &sweep.ends, path);
            if receive(&mut receiver, Record::Path(record), &mut packets)? == Step::Answered {
                answers.extend(receiver.answer());
            }
        }
        flown.push((link, sweep));
        bar.inc(1);
    }
    bar.finish_and_clear();
    let sent = u32::try_from(answers.len())?;
    receive(&mut receiver, Record::End { sent }, &mut packets)?;
    Ok(Flight {
        map,
        packets,
        flown,
        answers,
    })
}

/// Through the bytes of a record, as the chip gets it.
fn receive<const N: usize>(
    receiver: &mut Receiver<'_, N>,
    record: Record,
    packets: &mut Vec<u8>,
) -> anyhow::Result<Step> {
    receiver
        .receive(&record.encode(), &mut Downlink(packets))
        .map_err(|e| match e {
            ReceiveError::Downlink(never) => match never {},
            other => anyhow::anyhow!("the receiver stopped: {other}"),
        })
}

/// A downlink that remembers everything.
struct Downlink<'a>(&'a mut Vec<u8>);

impl embedded_io::ErrorType for Downlink<'_> {
    type Error = std::convert::Infallible;
}

impl embedded_io::Write for Downlink<'_> {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Self::Error> {
        self.0.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
