//! A flight over a path list: of a traced one what the receiver would measure on each link, drawn from standard deviations instead
//! of samples; of a measured one what it says.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use cslam_core::link_state::{Classifier, PaperClassifier, models};
use cslam_core::receiver::{Config as Receiver, LinkStates, Mapped};
use cslam_core::telemetry::{Key, Sender};

use super::raw::Logs;
use super::{Args, Flown};
use crate::config::{Config, Mode};
use crate::evaluation::downlink;
use crate::flight_log::Header;
use crate::input::InputError;
use crate::link_state::judge::Judge;
use crate::path_flight::{self, ListMap, ListReceiver, Methods, Times, as_measured, bundled, measure};
use crate::paths::{self, Link};
use crate::progress;
use crate::scene::Scene;

/// Name that stands for the bundled path list.
pub(super) const BUNDLED: &str = "bundled";

/// Number of the UAV in its packets, signed with the published key.
const UAV: u8 = 1;

/// The scene that the bundled path list was traced in.
const BUNDLED_SCENE: &str = "outdoor_a";

/// Most paths of a link: what a report numbers.
const MOST_PATHS: usize = 255;

/// Flies over a list.
pub(super) fn run(
    args: &Args,
    config: &Config,
    file: &Path,
    interrupted: &AtomicBool,
) -> anyhow::Result<Flown> {
    // The surfaces behind a list are known for the bundled one, or when they are named.
    let (list_name, mut links, list_scene) = if file.as_os_str() == BUNDLED {
        (BUNDLED_SCENE.to_owned(), bundled()?, Some(BUNDLED_SCENE))
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
    let times = Times::new(&links)?;
    let out = super::result_directory(args)?;
    if paths::are_measured(&links) {
        progress::note(
            "a measured list: no errors are added, [path_errors] stands for what its lines do not say",
        );
    }
    let flight = fly(&links, &times, config, args, interrupted)?;
    let heard = downlink::decode(&flight.packets, UAV, &Key::TEST);
    let header = Header {
        mode: config.receiver.mode.name().into(),
        scene: list_name,
        world: None,
        seed: args.seed,
        planned_sweeps: links.len(),
        sweep_period_s: times.period_s(),
        delay_cycle_m: None,
    };
    let log = path_flight::log(header, &flight.flown, &times, &heard, &flight.map);
    Ok(Flown {
        logs: Logs {
            log,
            packets: flight.packets,
            smoothed: None,
        },
        scene,
        imu: Vec::new(),
        out,
    })
}

/// A flight, or as much of it as was flown before an interrupt.
struct Flight<'a> {
    map: Box<ListMap>,
    packets: Vec<u8>,
    flown: Vec<path_flight::Flown<'a>>,
}

fn fly<'a>(
    links: &'a [Link],
    times: &Times,
    config: &Config,
    args: &Args,
    interrupted: &AtomicBool,
) -> anyhow::Result<Flight<'a>> {
    let are_measured = paths::are_measured(links);
    let mut receiver = ListReceiver::new(methods(config.receiver.mode)?, Sender::new(UAV, &Key::TEST, 0));
    let bar = progress::bar(links.len() as u64, "flying");
    let mut flown = Vec::with_capacity(links.len());
    for (index, link) in links.iter().enumerate() {
        if interrupted.load(Ordering::Relaxed) {
            bar.abandon();
            break;
        }
        let wrong = |why: String| InputError::new(format!("link {index} of the path list: {why}"));
        if link.paths.len() > MOST_PATHS {
            return Err(wrong(format!(
                "{} paths, expected at most {MOST_PATHS}",
                link.paths.len()
            ))
            .into());
        }
        let sweep = if are_measured {
            as_measured(u32::try_from(index)?, link, &config.path_errors)
        } else {
            measure(u32::try_from(index)?, link, &config.path_errors, args.seed)
        };
        let sweep = sweep.map_err(|e| wrong(e.to_string()))?;
        // Whole: not negative, and within what a packet holds.
        let time_ns = (times.of(index) * 1e9) as u64;
        let answered = receiver.hear(link, &sweep, time_ns).map_err(wrong)?;
        flown.push(path_flight::Flown {
            link,
            sweep,
            answered,
        });
        bar.inc(1);
    }
    bar.finish_and_clear();
    let (map, packets) = receiver.end()?;
    Ok(Flight { map, packets, flown })
}

/// The methods of a mode: those of a flight from raw samples, less what wants a pose to estimate.
fn methods(mode: Mode) -> anyhow::Result<Methods<'static>> {
    let (judge, receiver) = match mode {
        Mode::Best => {
            let classifier = Classifier::new(models::geometric()?, models::geometric_without_departure()?)?;
            let receiver = Receiver::best(LinkStates::Geometric(classifier));
            (Judge::Best(classifier), receiver)
        }
        Mode::Paper => {
            let classifier = PaperClassifier::new(models::paper()?)?;
            (Judge::Paper(classifier), Receiver::paper(classifier))
        }
    };
    Ok(Methods {
        judge,
        accept: receiver.accept,
        form: receiver.form,
        strongest_only: receiver.mapped == Mapped::Strongest,
    })
}
