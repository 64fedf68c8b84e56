//! `cslam reproduce link`: the paper's worked example, one link with its 25 strongest paths.

use std::io::Write;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use serde::Serialize;

use super::known_pose::{Arrays, KnownPose, Perceived, error_m, nearest};
use crate::channel::{ChannelConfig, Instant, Simulator};
use crate::estimate::Mode;
use crate::input::InputError;
use crate::paths::{Link, LinkPath};
use crate::scene::Scene;
use crate::table::Table;
use crate::tracer::{MAX_ORDER, Tracer};

/// Arguments of `cslam reproduce link`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Scene
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Place of the GMT, m
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, allow_hyphen_values = true,
          default_values_t = GMT_M)]
    tx: Vec<f64>,
    /// Place of the UAV, m
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', num_args = 1, allow_hyphen_values = true,
          default_values_t = UAV_M)]
    rx: Vec<f64>,
    /// Most reflections of a path
    #[arg(long, value_name = "N", default_value_t = 5,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=MAX_ORDER as u64))]
    max_order: usize,
    /// Strongest paths that are listed and sent
    #[arg(long, value_name = "N", default_value_t = 25,
          value_parser = clap::builder::RangedU64ValueParser::<usize>::new().range(1..=1000))]
    paths: usize,
    /// Errors of the arrays
    #[arg(long, value_enum, default_value_t = Arrays::Ideal)]
    arrays: Arrays,
    /// Seed of all noise
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

/// A link of the outdoor scene like the paper's: both ends 2 m up and 26 m apart, no line of sight, the strongest path off
/// one wall.
const GMT_M: [f64; 3] = [56.24, 72.24, 2.0];
const UAV_M: [f64; 3] = [82.5, 70.5, 2.0];
/// What the paper prints for its own link: error of the point from estimated and from true parameters, m.
const PRINTED_M: [f64; 2] = [0.12, 0.0];

/// What one mode makes of the link.
#[derive(Serialize)]
struct Result {
    mode: &'static str,
    /// Line of sight, first order, higher order, of the strongest estimated path.
    probabilities: Option<[f32; 3]>,
    /// The estimates, strongest first.
    paths: Vec<Estimate>,
}

#[derive(Serialize)]
struct Estimate {
    /// Number of the true path that is within 1 m and 3 degrees, from 1.
    truth: Option<usize>,
    c_tau_m: f32,
    aoa_deg: [f32; 2],
    aod_deg: Option<[f32; 2]>,
    first_order: Option<f32>,
    in_map: bool,
    point_m: Option<[f32; 3]>,
    /// Distance of the point to the last reflection of the true path, m.
    error_m: Option<f64>,
}

#[derive(Serialize)]
struct Report<'a> {
    link: &'a Link,
    results: &'a [Result],
    printed_error_m: [f64; 2],
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let scene = Scene::load(&args.scene)?;
    let place = |option: &str, values: &[f64]| -> anyhow::Result<[f64; 3]> {
        let wrong = || {
            InputError::new(format!(
                "{option}: expected x,y,z in metres, outside of every building"
            ))
        };
        let point: [f64; 3] = values.try_into().map_err(|_| wrong())?;
        let sound = point.iter().all(|c| c.is_finite()) && !scene.inside_solid(point);
        sound.then_some(point).ok_or_else(|| wrong().into())
    };
    let (tx, rx) = (place("--tx", &args.tx)?, place("--rx", &args.rx)?);
    let tracer = Tracer::new(&scene, args.max_order)
        .ok_or_else(|| InputError::new(format!("--max-order: expected at most {MAX_ORDER}")))?;
    let tree = tracer.transmitter(tx);
    let mut link = tree.to_link(rx, &tree.trace(rx));
    link.paths.truncate(args.paths);
    let results = Mode::ALL
        .into_iter()
        .map(|mode| heard(args, mode, &link))
        .collect::<anyhow::Result<Vec<Result>>>()?;
    if args.json {
        let report = Report {
            link: &link,
            results: &results,
            printed_error_m: PRINTED_M,
        };
        writeln!(std::io::stdout(), "{}", serde_json::to_string(&report)?)?;
        return Ok(());
    }
    print(&link, &results)
}

fn heard(args: &Args, mode: Mode, link: &Link) -> anyhow::Result<Result> {
    let config = ChannelConfig {
        impairments: args.arrays.impairments(),
        ..ChannelConfig::default()
    };
    let instant = Instant::at_rest();
    let mut sweep = Simulator::new(config, args.seed)
        .sweep(link, &instant, 0)
        .map_err(|e| InputError::new(e.to_string()))?;
    let receiver = KnownPose::new(mode)?;
    let mut estimator = receiver.estimator(args.arrays);
    let perceived = receiver.perceive(estimator.as_mut(), &mut sweep, link, &instant)?;
    let truths: Vec<Option<usize>> = (0..link.paths.len())
        .map(|i| nearest(&perceived, link, i))
        .collect();
    let probabilities = perceived.probabilities.first().copied().flatten();
    Ok(Result {
        mode: mode.name(),
        probabilities: probabilities.map(|p| p.to_array()),
        paths: (0..perceived.paths.len())
            .map(|place| estimate(&receiver, &perceived, link, &truths, place))
            .collect(),
    })
}

fn estimate(
    receiver: &KnownPose,
    perceived: &Perceived,
    link: &Link,
    truths: &[Option<usize>],
    place: usize,
) -> Estimate {
    let path = &perceived.paths[place].path;
    // The strongest of the true paths that lie there.
    let truth = truths.iter().position(|nearest| *nearest == Some(place));
    let point = receiver.solve(perceived, place);
    let last = truth.and_then(|truth| link.paths[truth].last_vertex);
    Estimate {
        truth: truth.map(|truth| truth + 1),
        c_tau_m: path.c_tau_m,
        aoa_deg: [path.aoa.zenith_rad(), path.aoa.azimuth_rad()].map(f32::to_degrees),
        aod_deg: path
            .aod
            .map(|aod| [aod.direction.zenith_rad(), aod.direction.azimuth_rad()].map(f32::to_degrees)),
        first_order: perceived.probabilities[place].map(|p| p.first_order),
        in_map: receiver.outcome(perceived, place).is_ok(),
        point_m: point.map(|point| point.position.to_array()),
        error_m: point.zip(last).map(|(point, last)| error_m(&point, last)),
    }
}

fn print(link: &Link, results: &[Result]) -> anyhow::Result<()> {
    let mut out = std::io::stdout().lock();
    let [tx, rx] = [link.tx, link.rx].map(coordinates);
    writeln!(out, "GMT {tx}, UAV {rx}\n")?;
    let mut table = Table::new([
        "path",
        "order",
        "delay ns",
        "c tau m",
        "gain dB",
        "AoA deg",
        "AoD deg",
        "last point m",
    ]);
    for (index, path) in link.paths.iter().enumerate() {
        table.row(row(index, path));
    }
    writeln!(out, "{table}")?;
    for result in results {
        let mut table = Table::new([
            format!("estimate, {}", result.mode).as_str(),
            "path",
            "c tau m",
            "AoA deg",
            "AoD deg",
            "p(first)",
            "in map",
            "point m",
            "error m",
        ]);
        for (place, path) in result.paths.iter().enumerate() {
            table.row(cells(place, path));
        }
        writeln!(out, "{table}")?;
        if let Some([los, first, higher]) = result.probabilities {
            writeln!(
                out,
                "link state, {}: line of sight {los:.3}, first order {first:.3}, higher order {higher:.3}\n",
                result.mode
            )?;
        }
    }
    writeln!(
        out,
        "the paper's link, in a scene that is not published: error {} m estimated, {} m true parameters",
        PRINTED_M[0], PRINTED_M[1]
    )?;
    Ok(())
}

fn row(index: usize, path: &LinkPath) -> [String; 8] {
    let gain_db = path.gain_db();
    let aod = path.aod_zenith_rad.zip(path.aod_azimuth_rad);
    [
        (index + 1).to_string(),
        path.order.map_or_else(|| "-".into(), |order| order.to_string()),
        format!("{:.2}", path.delay_s * 1e9),
        format!("{:.2}", path.delay_s * SPEED_OF_LIGHT_M_PER_S),
        gain_db.map_or_else(|| "-".into(), |db| format!("{db:.1}")),
        pair([
            path.aoa_zenith_rad.to_degrees(),
            path.aoa_azimuth_rad.to_degrees(),
        ]),
        aod.map_or_else(|| "-".into(), |(z, a)| pair([z.to_degrees(), a.to_degrees()])),
        path.last_vertex.map_or_else(|| "-".into(), coordinates),
    ]
}

fn cells(place: usize, path: &Estimate) -> [String; 9] {
    let dash = || "-".to_owned();
    [
        (place + 1).to_string(),
        path.truth.map_or_else(dash, |truth| truth.to_string()),
        format!("{:.2}", path.c_tau_m),
        pair(path.aoa_deg.map(f64::from)),
        path.aod_deg.map_or_else(dash, |aod| pair(aod.map(f64::from))),
        path.first_order.map_or_else(dash, |p| format!("{p:.3}")),
        if path.in_map { "yes" } else { "no" }.into(),
        path.point_m.map_or_else(dash, |p| coordinates(p.map(f64::from))),
        path.error_m.map_or_else(dash, |m| format!("{m:.3}")),
    ]
}

fn pair([zenith, azimuth]: [f64; 2]) -> String {
    format!("{zenith:.1}, {azimuth:.1}")
}

fn coordinates([x, y, z]: [f64; 3]) -> String {
    format!("{x:.2}, {y:.2}, {z:.2}")
}
