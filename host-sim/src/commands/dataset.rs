//! `cslam dataset`: ray-traced links for training and for figures.

use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use crate::commands::shard::OneOf;
use crate::commands::threads::Threads;
use crate::input::InputError;
use crate::input::limits::DATASET_SHARDS;
use crate::link_state::dataset::{self, Description};
use crate::link_state::links::Links;
use crate::link_state::protocol::{Protocol, SetName, Source};
use crate::progress;
use crate::scene::Scene;

/// Arguments of `cslam dataset`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene: outdoor, indoor, street, outdoor_a, city:SEED, indoor:SEED, or a file (.json, .obj, .ply)
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Which set: each has transmitters of its own
    #[arg(long, value_enum, default_value_t = SetName::Train)]
    set: SetName,
    /// Number of transmitters; 100 for train, 50 for validation and test when absent
    #[arg(long, value_name = "N")]
    transmitters: Option<usize>,
    /// Step of the receiver grid in all three directions, m
    #[arg(long, value_name = "M", default_value_t = 1.0)]
    step: f64,
    /// Share of all links that is taken, 1 for all
    #[arg(long, value_name = "R", default_value_t = 0.01)]
    rate: f64,
    /// Relative permittivity of all faces, drawn anew for every link; the scene's own when absent
    #[arg(long, value_name = "LEAST,MOST", value_delimiter = ',', num_args = 1)]
    permittivity: Option<Vec<f64>>,
    /// Number of shards
    #[arg(long, value_name = "N", default_value_t = 8, conflicts_with = "shard",
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=DATASET_SHARDS as u64))]
    shards: usize,
    /// Make only shard I of N, counted from 0: the same bytes as a run with --shards N makes for it
    #[arg(long, value_name = "I/N")]
    shard: Option<String>,
    /// Seed of transmitters, sampling and materials
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
    /// Directory of the data set
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Print the counts as JSON
    #[arg(long)]
    json: bool,
}

/// What a run made.
#[derive(Debug, Default, Serialize)]
struct Counts {
    links: usize,
    outages: usize,
    line_of_sight: usize,
    first_order: usize,
    higher_order: usize,
    paths: usize,
}

impl Counts {
    fn add(&mut self, links: &Links) {
        self.links += links.len();
        self.paths += links.c_tau_m.len();
        for link in links.iter() {
            match link.paths().next().map(|strongest| strongest.class()) {
                None => self.outages += 1,
                Some(0) => self.line_of_sight += 1,
                Some(1) => self.first_order += 1,
                Some(_) => self.higher_order += 1,
            }
        }
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let scene = Scene::load(&args.scene)?;
    let permittivity = match args.permittivity.as_deref() {
        None => None,
        Some(&[least, most]) => Some([least, most]),
        Some(_) => return Err(InputError::new("--permittivity: expected LEAST,MOST").into()),
    };
    let protocol = Protocol {
        scene: args.scene.clone(),
        set: args.set,
        transmitters: args.transmitters.unwrap_or(args.set.transmitters()),
        step_m: args.step,
        rate: args.rate,
        permittivity,
        seed: args.seed,
    };
    let (chosen, shards) = match &args.shard {
        Some(text) => {
            let OneOf { shard, shards } = OneOf::parse(text, DATASET_SHARDS)?;
            (shard..shard + 1, shards)
        }
        None => (0..args.shards, args.shards),
    };
    let counts = args.threads.install(|| -> anyhow::Result<Counts> {
        let source = Source::new(&protocol, &scene).map_err(InputError::new)?;
        Description::new(&protocol, &source, shards).write(&args.out)?;
        make(&source, &args.out, chosen, shards)
    })?;
    report(args, &counts)
}

fn make(
    source: &Source<'_>,
    out: &Path,
    chosen: std::ops::Range<usize>,
    shards: usize,
) -> anyhow::Result<Counts> {
    let all = source.all_links();
    let bar = progress::bar(
        chosen
            .clone()
            .map(|s| dataset::range(all, s, shards))
            .map(|r| r.end - r.start)
            .sum(),
        "links",
    );
    let mut counts = Counts::default();
    for shard in chosen {
        let links = source.links(dataset::range(all, shard, shards), |done| bar.inc(done));
        dataset::write_shard(out, shard, shards, &links)?;
        counts.add(&links);
    }
    bar.finish_and_clear();
    Ok(counts)
}

fn report(args: &Args, counts: &Counts) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string(counts)?)?;
        return Ok(());
    }
    let heard = counts.links - counts.outages;
    let share = |n: usize| 100.0 * n as f64 / heard.max(1) as f64;
    writeln!(
        out,
        "{} links in {}: {heard} with a path ({} paths), {} outages",
        counts.links,
        args.out.display(),
        counts.paths,
        counts.outages
    )?;
    writeln!(
        out,
        "strongest path: line of sight {:.1} %, first order {:.1} %, higher order {:.1} %",
        share(counts.line_of_sight),
        share(counts.first_order),
        share(counts.higher_order)
    )?;
    Ok(())
}
