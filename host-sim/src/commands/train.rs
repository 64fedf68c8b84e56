//! `cslam train`: from a data set to a float model.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::ValueEnum;
use cslam_core::link_state::Trees;
use serde::Serialize;

use crate::campaign::Lists;
use crate::commands::threads::Threads;
use crate::evaluation::PathStateFigures;
use crate::input::InputError;
use crate::link_state::calibration::{self, CalibrationError, most_likely};
use crate::link_state::errors::Errors;
use crate::link_state::flight_samples::FlightSamples;
use crate::link_state::float_model::{FloatModel, MAX_K};
use crate::link_state::links::Links;
use crate::link_state::samples::{Samples, Task};
use crate::link_state::training::{self, Epoch, Settings};
use crate::link_state::{boosting, curves, dataset};
use crate::progress;

/// Arguments of `cslam train`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which network
    #[arg(long, value_enum, default_value_t = KindName::Geometric)]
    kind: KindName,
    /// Number of strongest paths that the paper's network looks at
    #[arg(long, value_name = "K", default_value_t = 9,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=MAX_K as u64))]
    k: usize,
    /// Train the geometric network that does without angles of departure
    #[arg(long)]
    no_aod: bool,
    /// Data sets to train on: `cslam dataset`, of trees `cslam campaign --samples`
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    train: Vec<PathBuf>,
    /// Data sets that decide when to stop, and the temperature
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    validation: Vec<PathBuf>,
    /// Hidden layers, such as 32,32; the paper's are 10,50,100
    #[arg(long, value_name = "N,N", value_delimiter = ',', num_args = 1)]
    hidden: Option<Vec<usize>>,
    /// Most epochs
    #[arg(long, value_name = "N")]
    epochs: Option<usize>,
    /// Epochs without progress before training stops
    #[arg(long, value_name = "N")]
    patience: Option<usize>,
    /// Times that each training link is measured, each time with errors of its own
    #[arg(long, value_name = "N", default_value_t = 1,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=64))]
    draws: usize,
    /// Share of training links whose gains are not known, so that the network can do without
    #[arg(long, value_name = "SHARE", default_value_t = 0.1)]
    gain_unknown: f64,
    /// Trees of each class
    #[arg(long, value_name = "N", default_value_t = 40,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1000))]
    rounds: usize,
    /// Seed of measurement errors, initial weights and the order of samples
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Train on scenes that are flown to report (tests/seeds.toml) too
    #[arg(long)]
    any_scene: bool,
    #[command(flatten)]
    threads: Threads,
    /// Model file to write (.safetensors); the training curves go beside it (.svg)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum KindName {
    /// Geometric features, every path
    Geometric,
    /// The paper's: delay and direction of the K strongest paths, state of the link
    Paper,
    /// Trees for the receiver in flight, every path: data sets are samples of flights (`cslam campaign --samples`)
    Trees,
}

#[derive(Serialize)]
struct Report<'a> {
    training_samples: usize,
    validation_samples: usize,
    validation_accuracy: f64,
    validation_link_accuracy: f64,
    temperature: f32,
    expected_calibration_error: f64,
    elapsed_s: f64,
    epochs: &'a [Epoch],
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    args.threads.install(|| match args.kind {
        KindName::Paper => train(args, Task::Paper { k: args.k }),
        KindName::Geometric => {
            let departure = !args.no_aod;
            train(args, Task::Geometric { departure })
        }
        KindName::Trees => trees(args),
    })
}

fn train(args: &Args, task: Task) -> anyhow::Result<()> {
    let start = Instant::now();
    let settings = settings(args, task)?;
    let lists = Lists::of_the_repository()?;
    let read = |places: &[PathBuf]| -> Result<Vec<Links>, InputError> {
        let one = |place: &PathBuf| {
            let (description, links) = dataset::read(place)?;
            allow(args, &lists, &description.protocol.scene, place)?;
            Ok(links)
        };
        places.iter().map(one).collect()
    };
    let errors = Errors {
        gain_unknown: args.gain_unknown,
        ..Errors::default()
    };
    let training = Samples::of(&read(&args.train)?, task, &errors, args.seed, args.draws);
    // Other errors than those that were trained on, and every gain known.
    let validation = Samples::of(&read(&args.validation)?, task, &Errors::default(), !args.seed, 1);
    let bar = progress::bar(settings.epochs as u64, "epochs");
    let trained = training::train(task, &training, &validation, &settings, |epoch, _| {
        bar.inc(1);
        bar.set_message(format!("validation {:.4}", epoch.validation_accuracy));
        true
    })
    .map_err(InputError::new)?;
    bar.finish_and_clear();
    let logits = training::logits_of(&trained.model, &validation);
    let temperature = calibration::temperature(&logits, &validation.states);
    let model = trained
        .model
        .with_temperature(temperature)
        .map_err(InputError::new)?;
    write(args, task, &model, &trained.curve)?;
    let classified = || {
        logits
            .iter()
            .zip(&validation.states)
            .map(|(l, s)| most_likely(l) == *s)
    };
    let share = |right: usize, all: usize| right as f64 / all.max(1) as f64;
    let links = validation.strongest.iter().filter(|s| **s).count();
    let links_right = classified()
        .zip(&validation.strongest)
        .filter(|(right, strongest)| *right && **strongest);
    let report = Report {
        training_samples: training.len(),
        validation_samples: validation.len(),
        validation_accuracy: share(classified().filter(|r| *r).count(), validation.len()),
        validation_link_accuracy: share(links_right.count(), links),
        temperature,
        expected_calibration_error: CalibrationError::of(&logits, &validation.states, temperature).value(),
        elapsed_s: start.elapsed().as_secs_f64(),
        epochs: &trained.curve,
    };
    print(args, &report)
}

/// Whether the scene of a data set may be trained on.
fn allow(args: &Args, lists: &Lists, scene: &str, place: &Path) -> Result<(), InputError> {
    if args.any_scene {
        return Ok(());
    }
    lists.refuse_training(scene).map_err(|error| error.within(place))
}

/// Trains trees on samples of flights.
fn trees(args: &Args) -> anyhow::Result<()> {
    let start = Instant::now();
    let lists = Lists::of_the_repository()?;
    let read = |places: &[PathBuf]| -> Result<FlightSamples, InputError> {
        let mut all = FlightSamples::default();
        for place in places {
            let (origin, samples) = FlightSamples::read(place)?;
            allow(args, &lists, &origin.scene, place)?;
            all.append(samples);
        }
        Ok(all)
    };
    let (training, validation) = (read(&args.train)?, read(&args.validation)?);
    let settings = boosting::Settings {
        rounds: args.rounds,
        ..boosting::Settings::default()
    };
    let bar = progress::bar(settings.rounds as u64, "rounds");
    let mut boosted = boosting::train(&training, &settings, |_| bar.inc(1))?;
    bar.finish_and_clear();
    let sharpness = boosted.calibrate(&validation);
    let file = boosted.to_file()?;
    put(&args.out, &file)?;
    let model = Trees::parse(&file).map_err(|error| InputError::new(error.to_string()))?;
    let report = TreesReport {
        training_samples: training.len(),
        sharpness,
        training: boosting::judge(&model, &training)?,
        validation: boosting::judge(&model, &validation)?,
        bytes: file.len(),
        elapsed_s: start.elapsed().as_secs_f64(),
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string(&report)?)?;
        return Ok(());
    }
    let share = |share: Option<f64>| share.map_or("-".to_owned(), |share| format!("{share:.4}"));
    for (name, figures) in [("training", &report.training), ("validation", &report.validation)] {
        writeln!(
            out,
            "{name}, {} paths: right {}, strongest of a sweep {}; P(first order) >= .8 right {}, of all {}; calibration error {}",
            figures.paths,
            share(figures.right),
            share(figures.strongest_right),
            share(figures.sure_precision),
            share(figures.sure_recall),
            share(figures.calibration_error),
        )?;
    }
    writeln!(
        out,
        "{} trees, {} bytes, in {:.0} s; logits times {sharpness:.2} on validation; written {}",
        model.trees(),
        report.bytes,
        report.elapsed_s,
        args.out.display()
    )?;
    Ok(())
}

#[derive(Serialize)]
struct TreesReport {
    training_samples: usize,
    sharpness: f64,
    training: PathStateFigures,
    validation: PathStateFigures,
    bytes: usize,
    elapsed_s: f64,
}

fn settings(args: &Args, task: Task) -> Result<Settings, InputError> {
    let mut settings = Settings {
        seed: args.seed,
        ..Settings::of(task)
    };
    if let Some(hidden) = &args.hidden {
        if hidden.is_empty() || hidden.len() > 3 || hidden.iter().any(|n| !(1..=128).contains(n)) {
            return Err(InputError::new(
                "--hidden: expected one to three widths of 1 to 128, such as 32,32",
            ));
        }
        settings.hidden.clone_from(hidden);
    }
    if !(0.0..=1.0).contains(&args.gain_unknown) {
        return Err(InputError::new(format!(
            "--gain-unknown: expected 0 to 1, not {}",
            args.gain_unknown
        )));
    }
    settings.epochs = args.epochs.unwrap_or(settings.epochs).max(1);
    settings.patience = args.patience.unwrap_or(settings.patience).max(1);
    Ok(settings)
}

/// Writes a file, in a directory that is made when it is missing.
fn put(file: &Path, bytes: &[u8]) -> Result<(), InputError> {
    if let Some(parent) = file.parent().filter(|p| !p.as_os_str().is_empty()) {
        std::fs::create_dir_all(parent).map_err(|e| InputError::unwritable(parent, "cannot be made", &e))?;
    }
    std::fs::write(file, bytes).map_err(|e| InputError::unwritable(file, "cannot be written", &e))
}

fn write(args: &Args, task: Task, model: &FloatModel, curve: &[Epoch]) -> anyhow::Result<()> {
    put(&args.out, &model.to_bytes())?;
    let title = match task {
        Task::Paper { k } => format!("the paper's network, K = {k}"),
        Task::Geometric { departure: true } => "geometric network with angle of departure".into(),
        Task::Geometric { departure: false } => "geometric network without angle of departure".into(),
    };
    put(
        &args.out.with_extension("svg"),
        curves::svg(&title, curve)?.as_bytes(),
    )?;
    Ok(())
}

fn print(args: &Args, report: &Report<'_>) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string(report)?)?;
        return Ok(());
    }
    writeln!(
        out,
        "{} samples to train on, {} to validate; {} epochs in {:.0} s",
        report.training_samples,
        report.validation_samples,
        report.epochs.len(),
        report.elapsed_s
    )?;
    writeln!(
        out,
        "validation: link state {:.4}, all samples {:.4}; temperature {:.3}, calibration error {:.4}",
        report.validation_link_accuracy,
        report.validation_accuracy,
        report.temperature,
        report.expected_calibration_error
    )?;
    writeln!(out, "written {} and .svg", args.out.display())?;
    Ok(())
}
