//! `cslam reproduce outages`: the pose at the end of planned outages, and what each aid is worth there.

use cslam_core::cslam::{Config as Receiver, HpcConfig, Localization};
use cslam_core::localization::hpc::Mode;
use cslam_core::lscn::{PaperClassifier, models};
use rayon::prelude::*;
use serde::Serialize;

use crate::config::Config;
use crate::kept_flight::{KeptFlight, OutageEnd, fly_outage, outage_start_s};
use crate::progress;
use crate::raw_flight::board_config;
use crate::statistics::{median, quantile};
use crate::table::Table;
use crate::world::Profile;

/// Arguments of `cslam reproduce outages`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Flights; those that have no line of sight long enough before an outage are left out
    #[arg(long, value_name = "N", default_value_t = 12, value_parser = clap::value_parser!(u64).range(1..=10_000))]
    flights: u64,
    /// Scene: a name or a file
    #[arg(long, value_name = "SCENE", default_value = "outdoor")]
    scene: String,
    /// Seed of the first flight; the others count up from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The world to fly in
    #[arg(long, value_enum, default_value_t = Profile::Budget)]
    world: Profile,
    /// Lengths of the outages, s
    #[arg(long, value_name = "SECONDS", num_args = 1.., default_values_t = [10.0, 20.0, 40.0, 60.0])]
    lengths: Vec<f64>,
    /// Print one JSON object a row on standard output instead of the table
    #[arg(long)]
    json: bool,
}

/// How the receiver is configured in a row.
type Row = (&'static str, fn(&mut Receiver<'static>) -> anyhow::Result<()>);

const ROWS: [Row; 6] = [
    ("all aids", |_| Ok(())),
    ("without reflections", |receiver| {
        receiver.map_aided = false;
        Ok(())
    }),
    ("without delta ranges", |receiver| {
        receiver.delta_ranges = false;
        Ok(())
    }),
    ("without both", |receiver| {
        (receiver.map_aided, receiver.delta_ranges) = (false, false);
        Ok(())
    }),
    ("HPC, velocity from fixes", |receiver| {
        hpc(receiver, Mode::VelocityFromFixes)
    }),
    ("HPC, literal", |receiver| hpc(receiver, Mode::Literal)),
];

/// The paper's calibration.
fn hpc(receiver: &mut Receiver<'static>, mode: Mode) -> anyhow::Result<()> {
    let network = PaperClassifier::new(models::paper()?)?;
    let config = HpcConfig {
        mode,
        ..HpcConfig::default()
    };
    receiver.localization = Localization::Hpc(config, network);
    Ok(())
}

/// A row of the table.
#[derive(Serialize)]
struct Line<'a> {
    outage_s: f64,
    row: &'a str,
    flights: usize,
    median_m: f64,
    ninety_m: f64,
    worst_m: f64,
    within_3_sigma: usize,
    false_sights: usize,
}

impl<'a> Line<'a> {
    fn of(outage_s: f64, row: &'a str, ends: &[OutageEnd]) -> Self {
        let errors: Vec<f64> = ends.iter().map(|end| end.error_m).collect();
        Self {
            outage_s,
            row,
            flights: ends.len(),
            median_m: median(&errors).unwrap_or(f64::NAN),
            ninety_m: quantile(&errors, 0.9).unwrap_or(f64::NAN),
            worst_m: quantile(&errors, 1.0).unwrap_or(f64::NAN),
            within_3_sigma: ends.iter().filter(|end| end.sigmas <= 3.0).count(),
            false_sights: ends.iter().map(|end| end.false_sights).sum(),
        }
    }

    fn cells(&self) -> Vec<String> {
        vec![
            format!("{} s, {}", self.outage_s, self.row),
            self.flights.to_string(),
            format!("{:.2}", self.median_m),
            format!("{:.2}", self.ninety_m),
            format!("{:.2}", self.worst_m),
            format!("{}/{}", self.within_3_sigma, self.flights),
            self.false_sights.to_string(),
        ]
    }
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(length_s) = args.lengths.iter().find(|s| !(1.0..=600.0).contains(*s)) {
        anyhow::bail!("--lengths: expected 1 to 600 s, found {length_s}");
    }
    let config = Config::of(args.world).world;
    let scene = config.scene(&args.scene)?;
    let rows = (args.lengths.len() * ROWS.len()) as u64;
    let bar = progress::bar(args.flights + rows, "flying");
    let flights = (args.seed..args.seed + args.flights)
        .map(|seed| {
            let kept = KeptFlight::fly(&scene, config.clone(), seed)?;
            bar.inc(1);
            Ok(kept)
        })
        .collect::<anyhow::Result<Vec<_>>>()?;
    let mut table = Table::new([
        "outage",
        "flights",
        "error at its end, m: median",
        "90 %",
        "most",
        "within 3 sigma",
        "false sights",
    ]);
    let mut lines = Vec::new();
    for &length_s in &args.lengths {
        let planned: Vec<_> = flights
            .iter()
            .filter_map(|flight| outage_start_s(flight, length_s).map(|start_s| (flight, start_s)))
            .collect();
        for (name, configure) in ROWS {
            let ends = planned
                .par_iter()
                .map(|(flight, start_s)| {
                    let mut receiver = board_config()?;
                    configure(&mut receiver)?;
                    fly_outage(flight, receiver, *start_s, length_s)
                })
                .collect::<anyhow::Result<Vec<_>>>()?;
            bar.inc(1);
            let line = Line::of(length_s, name, &ends);
            table.row(line.cells());
            lines.push(line);
        }
    }
    bar.finish_and_clear();
    if args.json {
        for line in &lines {
            println!("{}", serde_json::to_string(line)?);
        }
    } else {
        print!("{table}");
    }
    Ok(())
}
