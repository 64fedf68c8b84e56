//! `cslam reproduce training`: the paper's figure of loss and accuracy over the epochs, K = 9.

use std::io::Write;
use std::path::PathBuf;

use serde::Serialize;

use super::lscn::links;
use crate::commands::threads::Threads;
use crate::input::InputError;
use crate::lscn::curves;
use crate::lscn::errors::Errors;
use crate::lscn::protocol::SetName;
use crate::lscn::samples::{Samples, Task};
use crate::lscn::training::{self, Epoch, Settings};
use crate::progress;
use crate::table::Table;

/// Arguments of `cslam reproduce training`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Share of the paper's 28.8 million training links; 0.09 gives a million with a path
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
    let samples = |set, rate, seed| -> anyhow::Result<Samples> {
        let (links, _) = links(SCENE, set, rate, None, args.seed)?;
        Ok(Samples::of(&[links], TASK, &Errors::default(), seed, 1))
    };
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
    if let Some(parent) = args.out.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(|e| InputError::unwritable(parent, "cannot be made", &e))?;
    }
    let title = format!("the paper's network, K = 9, {} links", training.len());
    std::fs::write(&args.out, curves::svg(&title, &trained.curve)?)
        .map_err(|e| InputError::unwritable(&args.out, "cannot be written", &e))?;
    print(args, &trained.curve)
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
