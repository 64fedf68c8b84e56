//! `cslam quantize`: from a float network to the model file that flies.

use std::path::PathBuf;

use serde::Serialize;

use crate::input::InputError;
use crate::link_state::dataset;
use crate::link_state::errors::Errors;
use crate::link_state::float_model::{FloatModel, Kind};
use crate::link_state::links::Links;
use crate::link_state::quantise::{self, Quantised, largest_activations};
use crate::link_state::samples::{Samples, Task};
use crate::table::Table;

/// Arguments of `cslam quantize`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Float network (.safetensors) as `cslam train` writes it; docs/link-state.md says what is in it
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// Data sets whose links, measured with errors, set the ranges of activations and check the result
    #[arg(long, value_name = "DIR", num_args = 1.., required = true)]
    calibration: Vec<PathBuf>,
    /// Most samples that are looked at, evenly taken from all
    #[arg(long, value_name = "N", default_value_t = 50_000,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..))]
    samples: usize,
    /// Seed of the measurement errors
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Model file to write (.lscn)
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Result<'a> {
    bytes: usize,
    #[serde(flatten)]
    report: &'a quantise::Report,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let model = FloatModel::read(&args.model)?;
    let task = task(&model).map_err(|message| InputError::in_file(&args.model, message))?;
    let sets: Vec<Links> = args
        .calibration
        .iter()
        .map(|place| dataset::read(place).map(|(_, links)| links))
        .collect::<std::result::Result<_, _>>()?;
    let samples = Samples::of(&sets, task, &Errors::default(), args.seed, 1);
    if samples.is_empty() {
        return Err(InputError::new("--calibration: no link has a path that gives a sample").into());
    }
    let chosen = || {
        let step = samples.len().div_ceil(args.samples);
        (0..samples.len()).step_by(step)
    };
    let largest = largest_activations(&model, chosen().map(|i| samples.row(i)));
    let unfit = |message| InputError::in_file(&args.model, message);
    let quantised = Quantised::new(&model, &largest).map_err(unfit)?;
    let file = quantised.to_file().map_err(unfit)?;
    std::fs::write(&args.out, file.bytes())
        .map_err(|e| InputError::unwritable(&args.out, "cannot be written", &e))?;
    let labelled = chosen().map(|i| (samples.row(i), samples.states[i]));
    let report = quantise::report(&model, &quantised, labelled);
    print(args, file.bytes().len(), &report)
}

/// The samples that a network takes, by the names of its inputs.
fn task(model: &FloatModel) -> std::result::Result<Task, String> {
    let candidates = match model.kind() {
        Kind::Paper { k } => vec![Task::Paper { k }],
        Kind::Geometric => [true, false]
            .map(|departure| Task::Geometric { departure })
            .into(),
    };
    let found = candidates.iter().find(|task| task.names() == model.inputs());
    found.copied().ok_or_else(|| {
        let names: Vec<String> = candidates.iter().map(|task| task.names().join(",")).collect();
        format!("metadata inputs: expected {}", names.join(" or "))
    })
}

fn print(args: &Args, bytes: usize, report: &quantise::Report) -> anyhow::Result<()> {
    if args.json {
        println!("{}", serde_json::to_string(&Result { bytes, report })?);
        return Ok(());
    }
    let mut layers = Table::new(["layer", "signal to noise", "clipped"]);
    for layer in &report.layers {
        let clipped = layer
            .clipped
            .map_or_else(|| "-".into(), |share| format!("{:.3} %", 100.0 * share));
        layers.row([layer.layer.clone(), format!("{:.1} dB", layer.sqnr_db), clipped]);
    }
    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let mut answers = Table::new(["samples", &report.samples.to_string()]);
    answers.row(["float accuracy", &percent(report.float_accuracy)]);
    answers.row(["int8 accuracy", &percent(report.int8_accuracy)]);
    let gap = 100.0 * (report.int8_accuracy - report.float_accuracy);
    answers.row(["int8 - float", &format!("{gap:+.2} points")]);
    answers.row(["same answer", &percent(report.agreement)]);
    println!("{layers}\n{answers}\n{}: {bytes} bytes", args.out.display());
    Ok(())
}
