//! `cslam reproduce attacks beacons`: beacons and two-way timing that lie.

use rayon::prelude::*;

use crate::kept_flight::{KeptFlight, LieFigures, SHOWN_SIGMAS, fly_lie};
use crate::progress;
use crate::raw_flight::board_config;
use crate::scene::Scene;
use crate::sensors::{BeaconFault, FaultsConfig, TimingFault};
use crate::statistics::median;
use crate::table::Table;
use crate::world::{Profile, WorldConfig};

/// Arguments of `cslam reproduce attacks beacons`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Flights a row
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u64).range(1..))]
    flights: u64,
    /// Seed of the first flight
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Length of a flight, s
    #[arg(long, value_name = "SECONDS", default_value_t = 90.0)]
    duration: f64,
    /// Fail when a beacon that lies, or timing that steps, is neither flagged within 5 s nor shown
    #[arg(long)]
    check: bool,
}

/// When a lie begins that does not begin with the flight, s.
const ONSET_S: f64 = 40.0;
/// A light-nanosecond, m.
const NS_M: f64 = 0.299_792_458;
/// A lie is flagged after this at the latest, s.
const FLAGGED_S: f64 = 5.0;
/// How well the operator knows where the GMT was set up, m.
const SETUP_M: f64 = 1.0;

/// A row of the table.
struct Row {
    name: String,
    faults: FaultsConfig,
    onset_s: f64,
    setup_m: Option<f64>,
    /// Whether it is one of those that must be flagged or shown.
    promised: bool,
}

impl Row {
    fn new(name: String, onset_s: f64, setup_m: Option<f64>, promised: bool) -> Self {
        Self {
            name,
            faults: FaultsConfig::default(),
            onset_s,
            setup_m,
            promised,
        }
    }

    /// A beacon that is off by `offset_m`, and more by `drift_m_per_s`, in a direction across the map.
    fn beacon(mut self, offset_m: f64, drift_m_per_s: f64) -> Self {
        let along = [0.6, 0.8, 0.0];
        self.faults.beacon.push(BeaconFault {
            start_s: self.onset_s,
            duration_s: 1e9,
            offset_m: along.map(|c| c * offset_m),
            drift_m_per_s: along.map(|c| c * drift_m_per_s),
        });
        self
    }

    fn timing(mut self, offset_m: f64, drift_m_per_s: f64) -> Self {
        self.faults.timing.push(TimingFault {
            start_s: self.onset_s,
            duration_s: 1e9,
            offset_ns: offset_m / NS_M,
            drift_ns_per_s: drift_m_per_s / NS_M,
        });
        self
    }
}

fn rows() -> Vec<Row> {
    let mut rows = vec![
        Row::new("no lie".into(), ONSET_S, None, false),
        Row::new("no lie, place of set-up known".into(), 0.0, Some(SETUP_M), false),
        Row::new(
            "beacon 20 m off from the start, place of set-up known".into(),
            0.0,
            Some(SETUP_M),
            true,
        )
        .beacon(20.0, 0.0),
        Row::new(
            "beacon 20 m off from the start, not known".into(),
            0.0,
            None,
            false,
        )
        .beacon(20.0, 0.0),
    ];
    for offset_m in [1.0, 5.0, 20.0, 100.0] {
        let name = format!("beacon steps by {offset_m} m");
        rows.push(Row::new(name, ONSET_S, None, true).beacon(offset_m, 0.0));
    }
    for drift in [0.02, 0.05, 0.1, 0.5, 2.0, 10.0] {
        let name = format!("beacon creeps by {drift} m/s");
        // To 20 m in the flight.
        rows.push(Row::new(name, ONSET_S, None, true).beacon(0.0, drift));
    }
    rows.push(Row::new("timing 20 m off from the start".into(), 0.0, None, false).timing(20.0, 0.0));
    for offset_m in [1.0, 20.0, 200.0] {
        let name = format!("timing steps by {offset_m} m");
        rows.push(Row::new(name, ONSET_S, None, true).timing(offset_m, 0.0));
    }
    for drift in [0.5, 2.0, 10.0] {
        let name = format!("timing runs off by {drift} m/s");
        rows.push(Row::new(name, ONSET_S, None, false).timing(0.0, drift));
    }
    rows
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let scene = Scene::load("outdoor")?;
    let mut config = WorldConfig::of(Profile::Budget);
    config.flight.duration_s = args.duration;
    let rows = rows();
    let bar = progress::bar((1 + rows.len() as u64) * args.flights, "flying");
    let seeds = args.seed..args.seed + args.flights;
    let flights = KeptFlight::fly_each(&scene, &config, seeds, || bar.inc(1))?;
    let mut table = Table::new([
        "lie",
        "flights flagged",
        "after, median s",
        "max s",
        "worst error, median m",
        "max m",
        "in sigmas, median",
        "max",
        "beyond 3 sigmas, no flag, %",
    ]);
    let mut broken = Vec::new();
    for row in &rows {
        let flown = flights
            .par_iter()
            .map(|flight| {
                let figures = fly_lie(flight, board_config()?, &row.faults, row.onset_s, row.setup_m)?;
                bar.inc(1);
                Ok(figures)
            })
            .collect::<anyhow::Result<Vec<LieFigures>>>()?;
        let summary = Summary::of(&flown);
        if row.promised && !summary.is_kept() {
            broken.push(row.name.clone());
        }
        table.row(summary.cells(&row.name));
    }
    bar.finish_and_clear();
    print!("{table}");
    if args.check && !broken.is_empty() {
        anyhow::bail!(
            "neither flagged within {FLAGGED_S} s nor shown: {}",
            broken.join("; ")
        );
    }
    Ok(())
}

/// The flights of a row.
struct Summary {
    flights: usize,
    after_s: Vec<f64>,
    worst_m: Vec<f64>,
    worst_sigmas: Vec<f64>,
    silent: f64,
}

impl Summary {
    fn of(flown: &[LieFigures]) -> Self {
        let sweeps: usize = flown.iter().map(|f| f.sweeps).sum();
        let silent: usize = flown.iter().map(|f| f.silent).sum();
        Self {
            flights: flown.len(),
            after_s: flown.iter().filter_map(|f| f.flagged_after_s).collect(),
            worst_m: flown.iter().map(|f| f.worst_m).collect(),
            worst_sigmas: flown.iter().map(|f| f.worst_sigmas).collect(),
            silent: silent as f64 / sweeps.max(1) as f64,
        }
    }

    /// Every flight is flagged in time, or its error shows in sigma.
    fn is_kept(&self) -> bool {
        let in_time = self.after_s.iter().filter(|after| **after <= FLAGGED_S).count();
        in_time == self.flights || greatest(&self.worst_sigmas) <= SHOWN_SIGMAS
    }

    fn cells(&self, name: &str) -> Vec<String> {
        let or_none = |value: Option<f64>| value.map_or("-".into(), |value| format!("{value:.1}"));
        let flagged = self.after_s.len();
        vec![
            name.into(),
            format!("{flagged}/{}", self.flights),
            or_none(median(&self.after_s)),
            or_none((flagged > 0).then(|| greatest(&self.after_s))),
            format!("{:.2}", median(&self.worst_m).unwrap_or(f64::NAN)),
            format!("{:.2}", greatest(&self.worst_m)),
            format!("{:.1}", median(&self.worst_sigmas).unwrap_or(f64::NAN)),
            format!("{:.1}", greatest(&self.worst_sigmas)),
            format!("{:.1}", 100.0 * self.silent),
        ]
    }
}

fn greatest(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
