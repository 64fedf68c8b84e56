//! `cslam reproduce training`: the paper's figure of loss and accuracy over the epochs, K = 9.

use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::lines;
use crate::commands::threads::Threads;
use crate::input::InputError;
use crate::link_state::errors::Errors;
use crate::link_state::protocol::{Protocol, SetName, Source};
use crate::link_state::samples::{Samples, Task};
use crate::link_state::training::{self, Epoch, Settings};
use crate::link_state::{curves, dataset};
use crate::progress;
use crate::scene::Scene;
use crate::table::Table;

/// Arguments of `cslam reproduce training`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Share of the paper's 28.8 million training links, 1 for all; 0.09 gives a million with a path
    #[arg(long, value_name = "R", default_value_t = 0.09)]
    rate: f64,
    /// Most epochs; training ends earlier when validation stops getting better
    #[arg(long, value_name = "N", default_value_t = 20,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1000))]
    epochs: usize,
    /// Seed of sampling, measurement errors and training
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
    /// File for the plot (.svg)
    #[arg(long, value_name = "FILE", default_value = "out/training.svg")]
    out: PathBuf,
    /// Print one JSON object an epoch on standard output instead of the table
    #[arg(long)]
    json: bool,
}

const SCENE: &str = "outdoor";
const TASK: Task = Task::Paper { k: 9 };
/// Parts in which a set is made; the samples are the same for any number.
const SHARDS: usize = 64;
/// Where the paper's curves end: accuracy in training and validation.
const PRINTED: [f64; 2] = [0.935, 0.830];
/// Validation links at the paper's full training rate have this share of it.
const VALIDATION_SHARE: f64 = 1.0 / 9.0;

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if !(args.rate > 0.0 && args.rate <= 1.0) {
        return Err(InputError::new(format!(
            "--rate: expected more than 0 and at most 1, not {}",
            args.rate
        ))
        .into());
    }
    args.threads.install(|| train(args))
}

#[derive(Serialize)]
struct Row<'a> {
    #[serde(flatten)]
    epoch: &'a Epoch,
    best: bool,
}

fn train(args: &Args) -> anyhow::Result<()> {
    let scene = Scene::load(SCENE)?;
    let samples = |set, rate, seed| samples(args, &scene, set, rate, seed);
    let training = samples(SetName::Train, args.rate, args.seed)?;
    let validation = samples(SetName::Validation, args.rate * VALIDATION_SHARE, !args.seed)?;
    let settings = Settings {
        seed: args.seed,
        epochs: args.epochs,
        ..Settings::of(TASK)
    };
    let bar = progress::bar(settings.epochs as u64, "epochs");
    let trained = training::train(TASK, &training, &validation, &settings, |_, _| {
        bar.inc(1);
        true
    })
    .map_err(InputError::new)?;
    bar.finish_and_clear();
    let title = format!("the paper's network, K = 9, {} links", training.len());
    lines::write(&args.out, &curves::svg(&title, &trained.curve)?)?;
    print(args, &trained.curve)
}

/// Samples of a set, measured shard by shard: of the whole set's 28.8 million links only what the network looks at stays in memory,
/// 1.2 GB.
fn samples(args: &Args, scene: &Scene, set: SetName, rate: f64, seed: u64) -> anyhow::Result<Samples> {
    let protocol = Protocol {
        scene: SCENE.into(),
        set,
        transmitters: set.transmitters(),
        step_m: 1.0,
        rate,
        permittivity: None,
        seed: args.seed,
    };
    let source = Source::new(&protocol, scene).map_err(InputError::new)?;
    let all = source.all_links();
    let bar = progress::bar(all, "links");
    let mut samples = Samples {
        width: TASK.inputs(),
        ..Samples::default()
    };
    for shard in 0..SHARDS {
        let links = source.links(dataset::range(all, shard, SHARDS), |done| bar.inc(done));
        samples.append(Samples::of(&[links], TASK, &Errors::default(), seed, 1));
    }
    bar.finish_and_clear();
    Ok(samples)
}

fn print(args: &Args, curve: &[Epoch]) -> anyhow::Result<()> {
    let best = curve
        .iter()
        .min_by(|a, b| a.validation_loss.total_cmp(&b.validation_loss));
    let best = best.map_or(0, |epoch| epoch.epoch);
    let mut out = std::io::stdout().lock();
    let mut table = Table::new([
        "epoch",
        "training loss",
        "validation",
        "training accuracy",
        "validation",
    ]);
    for epoch in curve {
        let kept = epoch.epoch == best;
        if args.json {
            writeln!(out, "{}", serde_json::to_string(&Row { epoch, best: kept })?)?;
            continue;
        }
        table.row([
            format!("{}{}", epoch.epoch, if kept { " (kept)" } else { "" }),
            format!("{:.4}", epoch.training_loss),
            format!("{:.4}", epoch.validation_loss),
            format!("{:.4}", epoch.training_accuracy),
            format!("{:.4}", epoch.validation_accuracy),
        ]);
    }
    if !args.json {
        let [training, validation] = PRINTED;
        table.row([
            "printed".into(),
            "-".into(),
            "-".into(),
            format!("{training:.3}"),
            format!("{validation:.3}"),
        ]);
        writeln!(out, "{table}plot: {}", args.out.display())?;
    }
    Ok(())
}
