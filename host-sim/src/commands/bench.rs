//! `cslam bench`: how fast is the host side?

use std::time::{Duration, Instant};

use anyhow::Context;
use clap::ValueEnum;
use serde::Serialize;

use crate::channel::{self, ChannelConfig};
use crate::random::Stream;
use crate::scene::{Scene, Unevenness};
use crate::table::Table;
use crate::tracer::{DEFAULT_MAX_ORDER, Diffraction, Diffuse, Propagation, Tracer, for_each_link};
use crate::world::{Profile, World, WorldConfig};

/// Arguments of `cslam bench`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// What to time; trace, synth and world when absent
    what: Option<Subject>,
    /// Ground station: made-up UAVs that send to it
    #[cfg(feature = "ground")]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = clap::value_parser!(u8).range(1..))]
    uavs: u8,
    /// Ground station: for how long they send, s
    #[cfg(feature = "ground")]
    #[arg(long, value_name = "S", default_value_t = 60, value_parser = clap::value_parser!(u32).range(1..))]
    seconds: u32,
    /// Ground station: connections to its page on which nothing is sent
    #[cfg(feature = "ground")]
    #[arg(long, value_name = "N", default_value_t = 2000)]
    idle: usize,
    /// Ground station: connections to its page on which a request is sent byte by byte
    #[cfg(feature = "ground")]
    #[arg(long, value_name = "N", default_value_t = 200)]
    slow: usize,
    /// Uplink: hostile packets
    #[arg(long, value_name = "N", default_value_t = 10_000_000, value_parser = clap::value_parser!(u64).range(1..))]
    packets: u64,
    /// Print one JSON object a row on stdout instead of the table
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Subject {
    /// Ray tracing on the reference outdoor scene, order 3
    Trace,
    /// Synthesis of a sweep: 72 beams, 25 paths, the errors of the budget and every effect
    Synth,
    /// A sweep of a flight outdoors in the worlds `budget` and `real`: its paths, then paths, beams and beam squint symbols
    World,
    /// Uplink: hostile packets against the receiver in flight; ends with 1 when one was taken or the pose moved
    Uplink,
    /// Ground station: UAVs that send as much as their radios carry; ends with 1 when a packet was lost
    #[cfg(feature = "ground")]
    Ground,
}

/// A line of the table.
#[derive(Debug, Serialize)]
struct Row {
    name: String,
    threads: usize,
    value: f64,
    unit: &'static str,
}

/// Least time that a figure is averaged over.
const LEAST: Duration = Duration::from_millis(1500);

/// Transmitters and receivers, as many as in the reference list.
const TRANSMITTERS: usize = 10;
const RECEIVERS: usize = 200;
/// Of these, for what takes milliseconds a link.
const FEW_RECEIVERS: usize = 40;
const SEED: u64 = 1;

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    #[cfg(feature = "ground")]
    if args.what == Some(Subject::Ground) {
        return ground(args);
    }
    if args.what == Some(Subject::Uplink) {
        let figures = crate::uplink_attack::run(args.packets)?;
        if args.json {
            println!("{}", serde_json::to_string(&figures)?);
        } else {
            println!("{figures}");
        }
        anyhow::ensure!(figures.is_safe(), "a hostile packet was taken, or moved the pose");
        return Ok(());
    }
    let mut rows = Vec::new();
    if args.what.is_none_or(|what| what == Subject::Trace) {
        rows.extend(trace()?);
    }
    if args.what.is_none_or(|what| what == Subject::Synth) {
        rows.push(synth("errors of the budget", ChannelConfig::default()));
        rows.push(synth("every effect", ChannelConfig::real()));
    }
    if args.what.is_none_or(|what| what == Subject::World) {
        for profile in [Profile::Budget, Profile::Real] {
            rows.extend(world(profile)?);
        }
    }
    if args.json {
        for row in &rows {
            println!("{}", serde_json::to_string(row)?);
        }
    } else {
        let mut table = Table::new(["what", "threads", "figure", "unit"]);
        for row in &rows {
            let figure = format!("{:.1}", row.value);
            table.row([row.name.as_str(), &row.threads.to_string(), &figure, row.unit]);
        }
        print!("{table}");
    }
    Ok(())
}

/// What became of the packets of many UAVs in a ground station of its own process.
#[cfg(feature = "ground")]
fn ground(args: &Args) -> anyhow::Result<()> {
    let figures = crate::ground::load::run(args.uavs, args.seconds, args.idle, args.slow)?;
    if args.json {
        println!("{}", serde_json::to_string(&figures)?);
    } else {
        println!("{figures}");
    }
    anyhow::ensure!(figures.is_whole(), "packets were lost");
    Ok(())
}

/// Links per second, image trees included, by number of threads; what a tree costs; and a link once the tree is there.
fn trace() -> anyhow::Result<Vec<Row>> {
    let scene = Scene::load("outdoor_a")?;
    let mut random = Stream::new(SEED, 0);
    let mut free_point = |height_m: Option<f64>| loop {
        let [x, y, z] = [120.0, 120.0, 20.0].map(|size_m| size_m * random.uniform());
        let point = [x, y, height_m.unwrap_or(z)];
        if !scene.inside_solid(point) {
            return point;
        }
    };
    let transmitters: Vec<[f64; 3]> = (0..TRANSMITTERS).map(|_| free_point(Some(2.0))).collect();
    let receivers: Vec<[f64; 3]> = (0..RECEIVERS).map(|_| free_point(None)).collect();
    let tracer = Tracer::new(&scene, DEFAULT_MAX_ORDER).context("order out of range")?;
    let diffracting = Propagation {
        diffraction: Some(Diffraction::default()),
        ..Propagation::default()
    };
    let scattering = Propagation {
        diffuse: Some(Diffuse::default()),
        ..diffracting
    };
    let uneven = Scene::load("outdoor_a")?.with_unevenness(Unevenness::real());
    let few = &receivers[..FEW_RECEIVERS];
    let mut rows = Vec::new();
    for (what, scene, propagation, receivers) in [
        ("trace", &scene, Propagation::default(), receivers.as_slice()),
        ("trace --diffraction", &scene, diffracting, &receivers),
        (
            "trace --diffraction --relief 0.15 --panels",
            &uneven,
            diffracting,
            &receivers,
        ),
        ("trace --diffraction --diffuse", &scene, scattering, few),
        (
            "trace --diffraction --diffuse --relief 0.15 --panels",
            &uneven,
            scattering,
            few,
        ),
    ] {
        let tracer = Tracer::with(scene, DEFAULT_MAX_ORDER, propagation).context("order out of range")?;
        rows.extend(links(what, &tracer, &transmitters, receivers)?);
    }
    let row = |name: String, threads: usize, value: f64, unit: &'static str| Row {
        name,
        threads,
        value,
        unit,
    };
    let mut images = 0;
    let seconds = timed(|| {
        images = transmitters
            .iter()
            .map(|tx| tracer.transmitter(*tx).images())
            .sum();
        Ok(())
    })?;
    let trees = TRANSMITTERS as f64;
    rows.push(row(
        format!("image tree, {:.0} images", images as f64 / trees),
        1,
        1e6 * seconds / trees,
        "us",
    ));
    let grown: Vec<_> = transmitters.iter().map(|tx| tracer.transmitter(*tx)).collect();
    let seconds = timed(|| {
        for tree in &grown {
            for rx in &receivers {
                std::hint::black_box(tree.trace(*rx));
            }
        }
        Ok(())
    })?;
    rows.push(row(
        "link, tree at hand".into(),
        1,
        1e6 * seconds / (trees * RECEIVERS as f64),
        "us",
    ));
    Ok(rows)
}

/// Links per second of a tracer, trees included, by number of threads.
fn links(
    what: &str,
    tracer: &Tracer<'_>,
    transmitters: &[[f64; 3]],
    receivers: &[[f64; 3]],
) -> anyhow::Result<Vec<Row>> {
    let available = std::thread::available_parallelism().map_or(1, usize::from);
    let mut rows: Vec<Row> = Vec::new();
    for threads in [1, 2, available] {
        if threads > available || rows.iter().any(|r| r.threads == threads) {
            continue;
        }
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        let mut paths = 0;
        let seconds = pool.install(|| {
            timed(|| {
                paths = 0;
                let count = |count: usize| {
                    paths += count;
                    Ok::<(), anyhow::Error>(())
                };
                for_each_link(tracer, transmitters, receivers, |_, _, found| found.len(), count)
            })
        })?;
        let links = (transmitters.len() * receivers.len()) as f64;
        rows.push(Row {
            name: format!(
                "{what}, {} x {} links of outdoor_a, {paths} paths, trees included",
                transmitters.len(),
                receivers.len()
            ),
            threads,
            value: links / seconds,
            unit: "links/s",
        });
    }
    Ok(rows)
}

/// Median time of a sweep.
fn synth(what: &str, config: ChannelConfig) -> Row {
    let speed = channel::bench::synth(config, 25, 41);
    Row {
        name: format!(
            "sweep, {} beams x 32 x 512, {} paths, {what}, median of {} ({:.1} to {:.1})",
            speed.beams, speed.paths, speed.sweeps, speed.fastest_ms, speed.longest_ms
        ),
        threads: 1,
        value: speed.median_ms,
        unit: "ms",
    }
}

/// Sweeps that are timed, evenly over a flight of two minutes.
const SWEEPS: u32 = 24;

fn world(profile: Profile) -> anyhow::Result<[Row; 2]> {
    let config = WorldConfig::of(profile);
    let scene = config.scene("outdoor")?;
    let world = World::new(&scene, config, SEED)?;
    let (mut paths_ms, mut sweep_ms) = (Vec::new(), Vec::new());
    for k in 0..SWEEPS {
        let number = k * world.sweeps() / SWEEPS;
        let truth = world.flight().sweep_truth(number);
        let start = Instant::now();
        std::hint::black_box(world.link(&truth));
        paths_ms.push(start.elapsed().as_secs_f64() * 1e3);
        let start = Instant::now();
        std::hint::black_box(world.sweep(number)?);
        sweep_ms.push(start.elapsed().as_secs_f64() * 1e3);
    }
    let row = |what: &str, mut times_ms: Vec<f64>| {
        times_ms.sort_by(f64::total_cmp);
        let quantile = |share: f64| times_ms[(share * (times_ms.len() - 1) as f64) as usize];
        Row {
            name: format!(
                "{what}, world {}, median of {SWEEPS} ({:.1} to {:.1})",
                profile.name(),
                quantile(0.0),
                quantile(1.0)
            ),
            threads: 1,
            value: quantile(0.5),
            unit: "ms",
        }
    };
    Ok([row("paths of a sweep", paths_ms), row("sweep", sweep_ms)])
}

/// Seconds that one run takes, averaged over as many as fill [`LEAST`], after one that warms up.
fn timed(mut work: impl FnMut() -> anyhow::Result<()>) -> anyhow::Result<f64> {
    work()?;
    let start = Instant::now();
    let mut runs = 0;
    while start.elapsed() < LEAST {
        work()?;
        runs += 1;
    }
    Ok(start.elapsed().as_secs_f64() / f64::from(runs))
}
