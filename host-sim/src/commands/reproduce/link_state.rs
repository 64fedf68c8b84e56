//! `cslam reproduce link-state`: link state classification, the paper's and ours.

use std::io::Write;
use std::path::PathBuf;

use cslam_core::geometry::Position;
use cslam_core::link_state::{AcceptGate, Classifier};
use cslam_core::reflection::Bounds;
use serde::Serialize;

use crate::commands::threads::Threads;
use crate::input::InputError;
use crate::link_state::calibration::most_likely;
use crate::link_state::errors::Errors;
use crate::link_state::float_model::FloatModel;
use crate::link_state::links::Links;
use crate::link_state::protocol::{Protocol, SetName, Source};
use crate::link_state::quantise::{self, Quantised, largest_activations};
use crate::link_state::samples::{Samples, Task};
use crate::link_state::scores::{MapScore, Scores, Subject};
use crate::link_state::shipped::{Shipped, float_geometric, read_float_geometric};
use crate::link_state::training::{self, Settings};
use crate::progress;
use crate::scene::Scene;
use crate::statistics::quantile;
use crate::table::Table;

/// Arguments of `cslam reproduce link-state`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Share of the paper's 28.8 million training links; 0.09 gives a million with a path
    #[arg(long, value_name = "R", default_value_t = 0.09)]
    rate: f64,
    /// Only score the models that come with the program, train nothing
    #[arg(long)]
    no_training: bool,
    /// Score the models of a directory instead, .lscn and .safetensors as host-sim/models/make.sh makes them
    #[arg(long, value_name = "DIR")]
    models: Option<PathBuf>,
    /// Seed of sampling, measurement errors and training
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

/// Values of K in the paper's figure.
const PAPER_K: [usize; 5] = [1, 3, 5, 9, 15];
/// What the paper reports for K = 9, training and validation.
const PRINTED: (usize, [f64; 2]) = (9, [0.935, 0.830]);
/// Scenes that no network was trained on.
const UNSEEN: [&str; 4] = ["outdoor_a", "city:7", "city:8", "street"];
/// Samples that set the range of activations.
const CALIBRATION_SAMPLES: usize = 20_000;
/// Figures are of other errors than training and temperature.
const FIGURE_SEED: u64 = 0xf16;

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    args.threads.install(|| {
        if !args.no_training {
            paper(args)?;
        }
        geometric(args)
    })
}

/// Links of a scene. `permittivity` as in [`Protocol`].
pub(super) fn links(
    scene: &str,
    set: SetName,
    rate: f64,
    permittivity: Option<[f64; 2]>,
    seed: u64,
) -> Result<(Links, Scene), InputError> {
    let built = Scene::load(scene)?;
    let protocol = Protocol {
        scene: scene.into(),
        set,
        transmitters: set.transmitters(),
        step_m: 1.0,
        rate,
        permittivity,
        seed,
    };
    let source = Source::new(&protocol, &built).map_err(InputError::new)?;
    let bar = progress::bar(source.all_links(), "links");
    let links = source.links(0..source.all_links(), |done| bar.inc(done));
    bar.finish_and_clear();
    drop(source);
    Ok((links, built))
}

#[derive(Serialize)]
struct PaperRow {
    k: usize,
    training_links: usize,
    training: f64,
    validation: f64,
    unseen_outdoor_a: f64,
    unseen_city_7: f64,
    float_sample: f64,
    int8_sample: f64,
    epochs: usize,
}

fn paper(args: &Args) -> anyhow::Result<()> {
    let seed = args.seed;
    let set = |scene, set, rate| links(scene, set, rate, None, seed).map(|(links, _)| links);
    let training_links = [set("outdoor", SetName::Train, args.rate)?];
    let validation_links = [set("outdoor", SetName::Validation, 0.01)?];
    let unseen_links = [
        [set("outdoor_a", SetName::Test, 0.006)?],
        [set("city:7", SetName::Test, 0.004)?],
    ];
    let mut table = Table::new([
        "paper's network",
        "training",
        "printed",
        "validation",
        "printed",
        "unseen outdoor_a",
        "unseen city:7",
        "float",
        "int8",
    ]);
    for k in PAPER_K {
        let task = Task::Paper { k };
        let samples = |links: &[Links], seed| Samples::of(links, task, &Errors::default(), seed, 1);
        let (train, validation) = (samples(&training_links, seed), samples(&validation_links, !seed));
        let settings = Settings {
            seed,
            ..Settings::of(task)
        };
        let bar = progress::bar(settings.epochs as u64, "epochs");
        let trained = training::train(task, &train, &validation, &settings, |_, _| {
            bar.inc(1);
            true
        })
        .map_err(InputError::new)?;
        bar.finish_and_clear();
        let accuracy = |samples: &Samples| accuracy(&trained.model, samples);
        let unseen: Vec<f64> = unseen_links
            .iter()
            .map(|links| accuracy(&samples(links, FIGURE_SEED)))
            .collect();
        let quantised = quantised(&trained.model, &train, &validation)?;
        let row = PaperRow {
            k,
            training_links: train.len(),
            training: accuracy(&train),
            validation: accuracy(&validation),
            unseen_outdoor_a: unseen[0],
            unseen_city_7: unseen[1],
            float_sample: quantised.float_accuracy,
            int8_sample: quantised.int8_accuracy,
            epochs: trained.curve.len(),
        };
        if args.json {
            writeln!(std::io::stdout(), "{}", serde_json::to_string(&row)?)?;
            continue;
        }
        let printed = |i: usize| {
            if k == PRINTED.0 {
                three(PRINTED.1[i])
            } else {
                "-".into()
            }
        };
        table.row([
            format!("K = {k}"),
            three(row.training),
            printed(0),
            three(row.validation),
            printed(1),
            three(row.unseen_outdoor_a),
            three(row.unseen_city_7),
            format!("{:.4}", row.float_sample),
            format!("{:.4}", row.int8_sample),
        ]);
    }
    if !args.json {
        writeln!(std::io::stdout(), "{table}")?;
    }
    Ok(())
}

fn three(share: f64) -> String {
    format!("{share:.3}")
}

fn accuracy(model: &FloatModel, samples: &Samples) -> f64 {
    let logits = training::logits_of(model, samples);
    let right = logits
        .iter()
        .zip(&samples.states)
        .filter(|(l, s)| most_likely(l) == **s);
    right.count() as f64 / samples.len().max(1) as f64
}

/// Rounds a network with activations of the training samples, and compares it on validation samples.
fn quantised(model: &FloatModel, train: &Samples, validation: &Samples) -> anyhow::Result<quantise::Report> {
    let some = |samples: &Samples| {
        let step = samples.len().div_ceil(CALIBRATION_SAMPLES).max(1);
        (0..samples.len()).step_by(step).collect::<Vec<usize>>()
    };
    let largest = largest_activations(model, some(train).into_iter().map(|i| train.row(i)));
    let quantised = Quantised::new(model, &largest).map_err(InputError::new)?;
    let checked = some(validation)
        .into_iter()
        .map(|i| (validation.row(i), validation.states[i]));
    Ok(quantise::report(model, &quantised, checked))
}

#[derive(Serialize)]
struct GeometricRow {
    scene: String,
    departure: bool,
    links: usize,
    link_state_int8: f64,
    link_state_float: f64,
    paths_int8: f64,
    link_ece: f64,
    paths_ece: f64,
    strongest: MapRow,
    all_paths: MapRow,
}

#[derive(Serialize)]
struct MapRow {
    precision: f64,
    recall: f64,
    error_p50_m: Option<f64>,
    error_p95_m: Option<f64>,
}

impl MapRow {
    fn of(score: &MapScore) -> Self {
        Self {
            precision: score.precision.value(),
            recall: score.recall.value(),
            error_p50_m: quantile(&score.errors_m, 0.5),
            error_p95_m: quantile(&score.errors_m, 0.95),
        }
    }

    fn cells(&self) -> [String; 4] {
        let metres = |m: Option<f64>| m.map_or_else(|| "-".into(), |m| format!("{m:.2}"));
        [
            three(self.precision),
            three(self.recall),
            metres(self.error_p50_m),
            metres(self.error_p95_m),
        ]
    }
}

impl GeometricRow {
    fn of(scene: &str, departure: bool, scores: &Scores) -> Self {
        Self {
            scene: scene.into(),
            departure,
            links: scores.links.all,
            link_state_int8: scores.links.value(),
            link_state_float: scores.links_float.value(),
            paths_int8: scores.paths.value(),
            link_ece: scores.links_calibration.value(),
            paths_ece: scores.paths_calibration.value(),
            strongest: MapRow::of(&scores.strongest_map),
            all_paths: MapRow::of(&scores.map),
        }
    }
}

fn geometric(args: &Args) -> anyhow::Result<()> {
    let broken = |e: &dyn std::fmt::Display| anyhow::anyhow!("a model is broken: {e}");
    let (shipped, floats) = match &args.models {
        Some(place) => (Shipped::read(place)?, read_float_geometric(place)?),
        None => (Shipped::default(), float_geometric().map_err(|e| broken(&e))?),
    };
    let with = shipped.geometric.model().map_err(|e| broken(&e))?;
    let without = shipped
        .geometric_without_departure
        .model()
        .map_err(|e| broken(&e))?;
    let classifier = Classifier::new(with, without).map_err(|e| broken(&e))?;
    let mut sets = vec![(
        "validation, outdoor".to_owned(),
        "outdoor",
        SetName::Validation,
        0.006,
    )];
    for scene in UNSEEN {
        let rate = if scene == "street" { 0.01 } else { 0.004 };
        sets.push((format!("unseen, {scene}"), scene, SetName::Test, rate));
    }
    sets.push(("unseen floor, indoor".to_owned(), "indoor", SetName::Test, 0.5));
    let mut states = Table::new([
        "geometric network",
        "AoD",
        "links",
        "link state int8",
        "float",
        "every path int8",
        "ECE links",
        "ECE paths",
    ]);
    let mut maps = Table::new([
        "map",
        "AoD",
        "strongest: precision",
        "recall",
        "p50 m",
        "p95 m",
        "every path: precision",
        "recall",
        "p50 m",
        "p95 m",
    ]);
    let mut rows = Vec::new();
    let mut unseen = [Scores::default(), Scores::default()];
    for (name, scene, set, rate) in &sets {
        let (links, built) = links(scene, *set, *rate, Some([2.0, 20.0]), args.seed)?;
        let gate = gate_in(&built)?;
        for (index, departure) in [true, false].into_iter().enumerate() {
            let float = &floats[index];
            let errors = Errors::default();
            let subject = Subject {
                classifier: &classifier,
                float,
                departure,
                gate: &gate,
                errors: &errors,
            };
            let scores = subject.score(&links, args.seed ^ FIGURE_SEED);
            if UNSEEN.contains(scene) {
                unseen[index].append(&scores);
            }
            rows.push(GeometricRow::of(name, departure, &scores));
        }
    }
    for (index, departure) in [true, false].into_iter().enumerate() {
        rows.push(GeometricRow::of(
            "unseen, all outdoor scenes",
            departure,
            &unseen[index],
        ));
    }
    for row in &rows {
        if args.json {
            writeln!(std::io::stdout(), "{}", serde_json::to_string(row)?)?;
            continue;
        }
        let start = || {
            [
                row.scene.clone(),
                if row.departure { "yes" } else { "no" }.to_owned(),
            ]
        };
        states.row(start().into_iter().chain([
            row.links.to_string(),
            format!("{:.4}", row.link_state_int8),
            format!("{:.4}", row.link_state_float),
            format!("{:.4}", row.paths_int8),
            format!("{:.4}", row.link_ece),
            format!("{:.4}", row.paths_ece),
        ]));
        maps.row(
            start()
                .into_iter()
                .chain(row.strongest.cells())
                .chain(row.all_paths.cells()),
        );
    }
    if !args.json {
        writeln!(std::io::stdout(), "{states}\n{maps}")?;
    }
    Ok(())
}

/// The gate as it is shipped, in the box of the scene and above its ground.
fn gate_in(scene: &Scene) -> anyhow::Result<AcceptGate> {
    let bounds = scene.bounds();
    let corner = |p: [f64; 3]| Position::new(p[0] as f32, p[1] as f32, p[2] as f32);
    let mut gate = AcceptGate::default();
    gate.point.ground_z_m = Some(bounds.min_m[2] as f32);
    gate.point.bounds = Some(Bounds {
        min: corner(bounds.min_m)?,
        max: corner(bounds.max_m)?,
    });
    Ok(gate)
}
