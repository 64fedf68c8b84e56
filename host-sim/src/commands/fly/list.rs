//! A flight over a path list: what the receiver would measure on each link, drawn from standard deviations instead of samples.
//! The receiver is exactly the firmware's library half.

use std::path::Path;
use std::sync::atomic::Ordering;

use cslam_core::reflection::Form;
use cslam_firmware::measurement::{PathRecord, Record};
use cslam_firmware::receiver::{BoardMap, ReceiveError, Receiver, board_gates};

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

/// The scene that the bundled path list was traced in.
const BUNDLED_SCENE: &str = "outdoor_a";

/// Flies over a list.
pub(super) fn run(args: &Args, config: &Config, file: &Path) -> anyhow::Result<Flown> {
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
    let flight = fly(&links, config, args)?;
    let heard = downlink::decode(&flight.packets);
    let header = Header {
        mode: args.mode.name().into(),
        scene: list_name,
        seed: args.seed,
        planned_sweeps: links.len(),
        sweep_period_s: 1.0 / SWEEP_RATE_HZ,
        delay_cycle_m: None,
    };
    let log = path_flight::log(header, &flight.flown, &heard, flight.packets.len(), &flight.map);
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
}

fn fly<'a>(links: &'a [Link], config: &Config, args: &Args) -> anyhow::Result<Flight<'a>> {
    let interrupted = super::interrupted_flag();
    let form = if args.mode == Mode::Paper {
        Form::Paper
    } else {
        Form::Vector
    };
    let mut map = Box::new(BoardMap::new());
    let mut receiver = Receiver::new(&mut map, form, board_gates());
    let mut packets = Vec::new();
    let bar = progress::bar(links.len() as u64, "flying");
    let (mut flown, mut sent) = (Vec::with_capacity(links.len()), 0);
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
            receive(&mut receiver, Record::Path(record), &mut packets)?;
            sent += 1;
        }
        flown.push((link, sweep));
        bar.inc(1);
    }
    bar.finish_and_clear();
    receive(&mut receiver, Record::End { sent }, &mut packets)?;
    Ok(Flight { map, packets, flown })
}

/// Through the bytes of a record, as the chip gets it.
fn receive<const N: usize>(
    receiver: &mut Receiver<'_, N>,
    record: Record,
    packets: &mut Vec<u8>,
) -> anyhow::Result<()> {
    receiver
        .receive(&record.encode(), &mut Downlink(packets))
        .map(drop)
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
