//! `cslam reproduce points`: the paper's table of reflection point errors.

use std::io::Write;

use cslam_core::geometry::Real;
use cslam_core::reflection::{Form, Gates};
use rayon::prelude::*;
use serde::Serialize;

use super::known_pose::{Arrays, KnownPose};
use super::link_state::links;
use super::selected::{Believed, FAR_M, Measured, measure};
use crate::channel::{ChannelConfig, Simulator};
use crate::commands::threads::Threads;
use crate::estimate::Mode;
use crate::link_state::protocol::SetName;
use crate::measurement::Sigmas;
use crate::paths::Link;
use crate::progress;
use crate::scene::Scene;
use crate::solve::{Settings, solve_all};
use crate::statistics::{quantile, rms};
use crate::table::Table;
use crate::tracer::{DEFAULT_MAX_ORDER, Tracer};

/// Arguments of `cslam reproduce points`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Links whose strongest path is of first order; the paper takes 10 000
    #[arg(long, value_name = "N", default_value_t = 10_000,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=200_000))]
    states: usize,
    /// Whose methods; all beside each other when absent
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// Errors of the arrays
    #[arg(long, value_enum, default_value_t = Arrays::Ideal)]
    arrays: Arrays,
    /// Seed of the positions and of all noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    threads: Threads,
    /// Print one JSON object a row on standard output instead of the table
    #[arg(long)]
    json: bool,
}

const SCENE: &str = "outdoor";
/// What the paper reports, m: with estimated and with true parameters.
const PRINTED_M: [f64; 2] = [0.2112, 4.65e-3];
/// Links drawn for each state that is wanted: one in 22 qualifies, outages included.
const LINKS_PER_STATE: f64 = 30.0;
/// Links whose results wait in memory.
const CHUNK: usize = 256;

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    args.threads.install(|| table(args))
}

/// Links of the scene whose strongest path is of first order, with every path, evenly from all places.
fn first_order_links(states: usize, seed: u64) -> anyhow::Result<Vec<Link>> {
    // 50 transmitters and 288 000 receivers.
    let rate = (states as f64 * LINKS_PER_STATE / 14.4e6).clamp(1e-5, 1.0);
    let (drawn, _) = links(SCENE, SetName::Test, rate, None, seed)?;
    let ends: Vec<[[f64; 3]; 2]> = drawn
        .iter()
        .filter(|link| link.paths().next().is_some_and(|path| path.order == 1))
        .map(|link| [link.tx_m, link.rx_m].map(|p| p.map(f64::from)))
        .collect();
    let count = states.min(ends.len());
    let chosen: Vec<[[f64; 3]; 2]> = (0..count).map(|i| ends[i * ends.len() / count]).collect();
    // Traced again in f64: a data set holds neither phases nor every digit.
    let scene = Scene::load(SCENE)?;
    let tracer = Tracer::new(&scene, DEFAULT_MAX_ORDER)
        .ok_or_else(|| anyhow::anyhow!("the tracer does not follow three reflections"))?;
    let mut all = Vec::with_capacity(count);
    for same in chosen.chunk_by(|a, b| a[0] == b[0]) {
        let tree = tracer.transmitter(same[0][0]);
        let traced = same.par_iter().map(|[_, rx]| tree.to_link(*rx, &tree.trace(*rx)));
        all.extend(traced.collect::<Vec<Link>>());
    }
    // Where two paths are equally strong to the last digit, rounding the places may change which comes first.
    all.retain(|link| link.paths.first().is_some_and(|path| path.order == Some(1)));
    Ok(all)
}

/// A row of the table.
#[derive(Serialize)]
struct Row {
    experiment: u8,
    what: String,
    states: usize,
    points: usize,
    /// Points of paths that were not reflected once; `None` where the truth has chosen the path.
    wrong_order: Option<usize>,
    /// Points more than [`FAR_M`] off.
    far: usize,
    median_m: Option<f64>,
    p95_m: Option<f64>,
    rmse_m: Option<f64>,
    /// The same of every other state and of the rest: how far it can be trusted.
    rmse_halves_m: [Option<f64>; 2],
    printed_m: f64,
}

impl Row {
    /// Of points that the receiver believes.
    fn believed(what: String, states: usize, points: &[Believed]) -> Self {
        let errors_m: Vec<f64> = points.iter().map(|point| point.error_m).collect();
        let wrong = points.iter().filter(|point| !point.first_order).count();
        Self {
            wrong_order: Some(wrong),
            ..Self::of(1, what, states, &errors_m)
        }
    }

    fn of(experiment: u8, what: impl Into<String>, states: usize, errors_m: &[f64]) -> Self {
        let half = |parity: usize| {
            rms(&errors_m
                .iter()
                .skip(parity)
                .step_by(2)
                .copied()
                .collect::<Vec<_>>())
        };
        Self {
            experiment,
            what: what.into(),
            states,
            points: errors_m.len(),
            wrong_order: None,
            far: errors_m.iter().filter(|error_m| **error_m > FAR_M).count(),
            median_m: quantile(errors_m, 0.5),
            p95_m: quantile(errors_m, 0.95),
            rmse_m: rms(errors_m),
            rmse_halves_m: [half(0), half(1)],
            printed_m: PRINTED_M[usize::from(experiment - 1)],
        }
    }
}

fn table(args: &Args) -> anyhow::Result<()> {
    let states = first_order_links(args.states, args.seed)?;
    let mut rows = exact(&states);
    let modes = args.mode.map_or_else(|| Mode::ALL.to_vec(), |mode| vec![mode]);
    rows.extend(measured(args, &states, &modes)?);
    let mut table = Table::new([
        "reflection points",
        "states",
        "points",
        "wrong order",
        "over 1 m",
        "median m",
        "p95 m",
        "RMSE m",
        "RMSE of halves m",
        "printed m",
    ]);
    for row in &rows {
        if args.json {
            writeln!(std::io::stdout(), "{}", serde_json::to_string(row)?)?;
            continue;
        }
        let metres = |m: Option<f64>| m.map_or_else(|| "-".into(), figure);
        table.row([
            format!("{}: {}", row.experiment, row.what),
            row.states.to_string(),
            row.points.to_string(),
            row.wrong_order
                .map_or_else(|| "-".into(), |wrong| wrong.to_string()),
            row.far.to_string(),
            metres(row.median_m),
            metres(row.p95_m),
            metres(row.rmse_m),
            row.rmse_halves_m.map(metres).join(" / "),
            figure(row.printed_m),
        ]);
    }
    if !args.json {
        writeln!(std::io::stdout(), "{table}")?;
    }
    Ok(())
}

/// Metres; small ones with an exponent.
fn figure(metres: f64) -> String {
    if metres < 0.01 {
        format!("{metres:.2e}")
    } else {
        format!("{metres:.4}")
    }
}

/// Experiment 2: the true delay and angles, every form and number type.
fn exact(states: &[Link]) -> Vec<Row> {
    let strongest: Vec<Link> = states
        .iter()
        .map(|link| Link {
            paths: link.paths.iter().take(1).cloned().collect(),
            ..link.clone()
        })
        .collect();
    vec![
        Row::of(
            2,
            "true parameters, vector form, f32 (flies)",
            states.len(),
            &solved::<f32>(&strongest, Form::Vector),
        ),
        Row::of(
            2,
            "true parameters, vector form, f64",
            states.len(),
            &solved::<f64>(&strongest, Form::Vector),
        ),
        Row::of(
            2,
            "true parameters, tan/cot form, f32",
            states.len(),
            &solved::<f32>(&strongest, Form::Paper),
        ),
        Row::of(
            2,
            "true parameters, tan/cot form, f64",
            states.len(),
            &solved::<f64>(&strongest, Form::Paper),
        ),
    ]
}

fn solved<T: Real>(links: &[Link], form: Form) -> Vec<f64> {
    let settings = Settings::<T> {
        form,
        gates: Gates::open(),
        sigmas: Sigmas::default(),
        use_aod: false,
    };
    solve_all(links, &settings)
        .filter_map(|solved| {
            let truth = links[solved.link].paths[solved.path].last_vertex?;
            let point = solved.point?;
            let squares: f64 = (0..3).map(|k| (point[k].to_f64() - truth[k]).powi(2)).sum();
            Some(squares.sqrt())
        })
        .collect()
}

/// Experiment 1: from raw samples, with the true pose.
fn measured(args: &Args, states: &[Link], modes: &[Mode]) -> anyhow::Result<Vec<Row>> {
    let config = ChannelConfig {
        impairments: args.arrays.impairments(),
        ..ChannelConfig::default()
    };
    let simulator = Simulator::new(config, args.seed);
    let receivers: Vec<KnownPose> = modes
        .iter()
        .map(|mode| KnownPose::new(*mode))
        .collect::<Result<_, _>>()?;
    let bar = progress::bar(states.len() as u64, "links");
    let mut results: Vec<Vec<Measured>> = Vec::with_capacity(states.len());
    for (chunk, some) in states.chunks(CHUNK).enumerate() {
        let part: Vec<anyhow::Result<Vec<Measured>>> = some
            .par_iter()
            .enumerate()
            .map_init(
                || {
                    receivers
                        .iter()
                        .map(|r| r.estimator(args.arrays))
                        .collect::<Vec<_>>()
                },
                |estimators, (place, link)| {
                    measure(
                        &simulator,
                        &receivers,
                        estimators,
                        link,
                        (chunk * CHUNK + place) as u32,
                    )
                },
            )
            .collect();
        for result in part {
            results.push(result?);
        }
        bar.inc(some.len() as u64);
    }
    bar.finish_and_clear();
    let mut rows = Vec::new();
    for (which, receiver) in receivers.iter().enumerate() {
        let of = |pick: &dyn Fn(&Measured) -> Option<f64>| -> Vec<f64> {
            results.iter().filter_map(|all| pick(all.get(which)?)).collect()
        };
        let mode = receiver.mode.name();
        let count = states.len();
        let mut by_truth = |what: &str, errors_m: &[f64]| {
            rows.push(Row::of(1, format!("{mode}, by truth: {what}"), count, errors_m));
        };
        by_truth("found", &of(&|m| m.error_m));
        by_truth("strongest estimate", &of(&|m| m.error_m.filter(|_| m.strongest)));
        by_truth("in the map", &of(&|m| m.accepted_m));
        let mine = || results.iter().filter_map(|all| all.get(which));
        let judged: Vec<Believed> = mine().filter_map(|m| m.judged).collect();
        let what = format!("{mode}, by receiver: strongest estimate, judged first order");
        rows.push(Row::believed(what, count, &judged));
        let mapped: Vec<Believed> = mine().flat_map(|m| m.mapped.clone()).collect();
        rows.push(Row::believed(
            format!("{mode}, by receiver: in the map"),
            count,
            &mapped,
        ));
    }
    Ok(rows)
}
