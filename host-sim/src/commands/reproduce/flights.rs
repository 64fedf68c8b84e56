//! `cslam reproduce flights`: whole flights from raw samples, both modes, and each stage of ours exchanged for the paper's.

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;

use crate::commands::fly::raw::fly_world;
use crate::commands::seeds::AnySeed;
use crate::config::{
    DepartureChoice, LinkStateChoice, LocalizationChoice, MappedChoice, Mode, ReceiverConfig,
};
use crate::estimate;
use crate::evaluation::{Evaluation, FirstOrderPaths, evaluate};
use crate::flight::FlightConfig;
use crate::flight_log::FlightLog;
use crate::input::InputError;
use crate::progress;
use crate::scene::Scene;
use crate::statistics;
use crate::table::Table;
use crate::world::{Profile, World, WorldConfig};

/// Arguments of `cslam reproduce flights`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which methods fly
    #[arg(value_enum, default_value_t = What::Modes)]
    what: What,
    /// Scene: outdoor, indoor, street, outdoor_a, city:SEED, or a file
    #[arg(long, value_name = "NAME|FILE", default_value = "outdoor")]
    scene: String,
    /// Flights, with one seed after the other
    #[arg(long, value_name = "N", default_value_t = 5)]
    flights: u64,
    /// Seed of the first flight
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    first_seed: u64,
    #[command(flatten)]
    any_seed: AnySeed,
    /// Length of a flight, s
    #[arg(long, value_name = "SECONDS", default_value_t = 120.0)]
    duration: f64,
    /// What the flights are planned for
    #[arg(long, value_enum, default_value_t = Planned::Sight)]
    planned: Planned,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Planned {
    /// The GMT in sight in 60 % of the sweeps, as any flight
    Sight,
    /// In sight in 60 to 80 %, one reflection in 70 % of the others, a start where the GMT's beams reach
    Reflections,
}

impl Planned {
    fn config(self) -> FlightConfig {
        match self {
            Self::Sight => FlightConfig::default(),
            Self::Reflections => FlightConfig::covered(),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum What {
    /// Ours, and the paper's
    Modes,
    /// Ours with one stage at a time exchanged for the paper's
    Ablation,
    /// Ours, and what became of the true paths of one reflection
    Losses,
}

/// A way to fly, and its name.
fn setups(what: What) -> Vec<(&'static str, ReceiverConfig)> {
    let of = ReceiverConfig::of;
    let without = |change: fn(&mut ReceiverConfig)| {
        let mut setup = of(Mode::Best);
        change(&mut setup);
        setup
    };
    match what {
        What::Losses => vec![("best", of(Mode::Best))],
        What::Modes => {
            // The kindest reading of what the paper leaves open.
            let mut kind = of(Mode::Paper);
            kind.estimator = Some(estimate::Mode::PaperInterpolated);
            kind.localization = Some(LocalizationChoice::Baseline);
            vec![
                ("best", of(Mode::Best)),
                ("paper", of(Mode::Paper)),
                ("paper, delays interpolated, velocity of fixes", kind),
            ]
        }
        What::Ablation => vec![
            ("ours in every stage", of(Mode::Best)),
            (
                "paper's path estimation",
                without(|s| s.estimator = Some(estimate::Mode::Paper)),
            ),
            (
                "the same, delays interpolated",
                without(|s| s.estimator = Some(estimate::Mode::PaperInterpolated)),
            ),
            (
                "paper's link state",
                without(|s| s.link_state = Some(LinkStateChoice::Paper)),
            ),
            (
                "rules for link state",
                without(|s| s.link_state = Some(LinkStateChoice::Rules)),
            ),
            (
                "first-order paths only",
                without(|s| s.mapped = Some(MappedChoice::FirstOrder)),
            ),
            (
                "strongest path only",
                without(|s| s.mapped = Some(MappedChoice::Strongest)),
            ),
            (
                "no delta ranges",
                without(|s| s.localization = Some(LocalizationChoice::FilterNoDeltaRanges)),
            ),
            (
                "paper's HPC",
                without(|s| s.localization = Some(LocalizationChoice::BaselineLiteral)),
            ),
            (
                "paper's HPC, velocity of fixes",
                without(|s| s.localization = Some(LocalizationChoice::Baseline)),
            ),
            (
                "strongest subcarrier of squint",
                without(|s| s.departures = Some(DepartureChoice::Pick)),
            ),
            (
                "no beam squint",
                without(|s| s.departures = Some(DepartureChoice::Beams)),
            ),
            ("paper's in every stage", of(Mode::Paper)),
        ],
    }
}

/// A figure of a flight: its name, and how those of several flights become one.
struct Figure {
    name: &'static str,
    join: fn(&[f64]) -> Option<f64>,
    decimals: usize,
    of: fn(&FlightLog, &Evaluation) -> Option<f64>,
}

fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// Orders of the true paths of each sweep.
fn orders(log: &FlightLog) -> impl Iterator<Item = Vec<u8>> {
    log.sweeps
        .iter()
        .filter_map(|sweep| sweep.truth.link.as_ref())
        .map(|link| link.paths.iter().filter_map(|path| path.order).collect())
}

/// Share of sweeps for which `holds` is true of the orders of their true paths, of those for which `among` is, %.
fn share(log: &FlightLog, among: fn(&[u8]) -> bool, holds: fn(&[u8]) -> bool) -> Option<f64> {
    let held: Vec<f64> = orders(log)
        .filter(|orders| among(orders))
        .map(|orders| f64::from(u8::from(holds(&orders))))
        .collect();
    mean(&held).map(|share| 100.0 * share)
}

/// Points a sweep that could be accepted: true paths of one reflection, over the sweeps with any.
fn present(log: &FlightLog) -> Option<f64> {
    let counts: Vec<f64> = orders(log)
        .map(|orders| orders.iter().filter(|order| **order == 1).count() as f64)
        .filter(|count| *count > 0.0)
        .collect();
    mean(&counts)
}

const FIGURES: [Figure; 17] = [
    Figure {
        name: "sweeps with line of sight, %",
        join: mean,
        decimals: 0,
        of: |log, _| share(log, |_| true, |orders| orders.contains(&0)),
    },
    Figure {
        name: "NLOS sweeps with a first-order path, %",
        join: mean,
        decimals: 0,
        of: |log, _| share(log, |orders| !orders.contains(&0), |orders| orders.contains(&1)),
    },
    Figure {
        name: "correct reflection order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision.map(|share| 100.0 * share),
    },
    Figure {
        name: "correct, presumed first order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision_first_order.map(|share| 100.0 * share),
    },
    Figure {
        name: "correct, presumed higher order, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.precision_higher_order.map(|share| 100.0 * share),
    },
    Figure {
        name: "map to true surface, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.map.surface_median_m,
    },
    Figure {
        name: "map to true surface, rms, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.map.surface_rmse_m,
    },
    Figure {
        name: "error of points of correct order, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.map.point_median_m,
    },
    Figure {
        name: "points per sweep with a first-order path",
        join: mean,
        decimals: 2,
        of: |_, e| e.map.accepted_per_sweep,
    },
    Figure {
        name: "of these, first order",
        join: mean,
        decimals: 2,
        of: |_, e| e.map.accepted_first_order_per_sweep,
    },
    Figure {
        name: "true first-order paths in such a sweep",
        join: mean,
        decimals: 2,
        of: |log, _| present(log),
    },
    Figure {
        name: "lit walls mapped within 0.5 m, %",
        join: mean,
        decimals: 1,
        of: |_, e| e.map.completeness_0p5m.map(|share| 100.0 * share),
    },
    Figure {
        name: "position error, rms, whole flight, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.position_rmse_m,
    },
    Figure {
        name: "position error, median, m",
        join: mean,
        decimals: 3,
        of: |_, e| e.trajectory.position_median_m,
    },
    Figure {
        name: "position error, rms, settled, m",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.settled_position_rmse_m,
    },
    Figure {
        name: "attitude error, rms, deg",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.trajectory.attitude_rmse_deg,
    },
    Figure {
        name: "clock error, rms, ns",
        join: statistics::rms,
        decimals: 3,
        of: |_, e| e.clock.rmse_ns,
    },
];

/// What became of the true paths of one reflection, flight by flight and of all, % of them.
fn losses(mut columns: Vec<String>, flights: &[FirstOrderPaths]) -> Table {
    if let Some(first) = columns.first_mut() {
        *first = "true first-order paths, seed".into();
    }
    let paths: Vec<usize> = flights.iter().map(|flight| flight.paths).collect();
    let mut table = Table::new(columns);
    let mut row = |name: &str, numbers: &[String]| {
        table.row(core::iter::once(name.to_owned()).chain(numbers.iter().cloned()));
    };
    let all: usize = paths.iter().sum();
    let counts = paths.iter().chain([&all]);
    row(
        "number",
        &counts.clone().map(ToString::to_string).collect::<Vec<_>>(),
    );
    let names = FirstOrderPaths::default().rows();
    for (index, (name, _)) in names.iter().enumerate() {
        let of_flights: Vec<usize> = flights.iter().map(|flight| flight.rows()[index].1).collect();
        let sum = of_flights.iter().sum();
        let percent = |(part, whole): (&usize, &usize)| match whole {
            0 => "-".to_owned(),
            _ => format!("{:.1}", 100.0 * *part as f64 / *whole as f64),
        };
        let numbers = of_flights.iter().chain([&sum]).zip(counts.clone()).map(percent);
        row(&format!("{name}, %"), &numbers.collect::<Vec<_>>());
    }
    table
}

pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if args.flights == 0 {
        return Err(InputError::new("nothing to fly: --flights is 0").into());
    }
    args.any_seed
        .check_seeds(&args.scene, args.first_seed, args.flights)?;
    let scene = Scene::load(&args.scene)?;
    let config = WorldConfig {
        flight: FlightConfig {
            duration_s: args.duration,
            ..args.planned.config()
        },
        ..WorldConfig::of(Profile::Budget)
    };
    let setups = setups(args.what);
    let worlds = (args.first_seed..args.first_seed.saturating_add(args.flights))
        .map(|seed| Ok((seed, World::new(&scene, config.clone(), seed)?)))
        .collect::<Result<Vec<_>, InputError>>()?;
    let sweeps: u64 = worlds.iter().map(|(_, world)| u64::from(world.sweeps())).sum();
    let bar = progress::bar(sweeps * setups.len() as u64, "flying");
    let never = AtomicBool::new(false);
    for (name, setup) in &setups {
        let mut columns = vec![format!("{} over {}, seed", name, args.scene)];
        columns.extend(worlds.iter().map(|(seed, _)| seed.to_string()));
        columns.push("all".into());
        let mut values = vec![Vec::new(); FIGURES.len()];
        let mut first_order = Vec::new();
        for (seed, world) in &worlds {
            let planned = usize::try_from(world.sweeps())?;
            let swept = || bar.inc(1);
            let (mut log, _) = fly_world(
                setup,
                &args.scene,
                world,
                *seed,
                planned,
                &never,
                swept,
                |_, _| {},
            )?;
            let evaluation = evaluate(&mut log, Some(&scene));
            for (of_figure, figure) in values.iter_mut().zip(&FIGURES) {
                of_figure.push((figure.of)(&log, &evaluation));
            }
            first_order.push(evaluation.map.first_order);
        }
        let mut table = Table::new(columns.clone());
        for (of_figure, figure) in values.iter().zip(&FIGURES) {
            let known: Vec<f64> = of_figure.iter().copied().flatten().collect();
            let all = (figure.join)(&known);
            let text = |value: &Option<f64>| {
                value.map_or_else(|| "-".to_owned(), |value| format!("{value:.*}", figure.decimals))
            };
            let mut row = vec![figure.name.to_owned()];
            row.extend(of_figure.iter().map(text));
            row.push(text(&all));
            table.row(row);
        }
        bar.suspend(|| println!("{table}"));
        if args.what == What::Losses {
            let table = losses(columns, &first_order);
            bar.suspend(|| println!("{table}"));
        }
    }
    bar.finish_and_clear();
    println!("all: rms of the rms figures, mean of the others, over the flights that have one");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn losses_are_shares_of_each_flight_and_of_all() {
        let flight = |paths, accepted, no_pose| FirstOrderPaths {
            paths,
            accepted,
            no_pose,
            ..FirstOrderPaths::default()
        };
        let columns = ["", "1", "2", "3", "all"].map(String::from).to_vec();
        let table = losses(columns, &[flight(10, 9, 1), flight(0, 0, 0), flight(30, 10, 20)]).to_string();
        let row = |name: &str| -> Vec<String> {
            let line = table.lines().find(|line| line.starts_with(name)).expect("a row");
            line[name.len()..].split_whitespace().map(String::from).collect()
        };
        assert_eq!(row("number"), ["10", "0", "30", "40"]);
        assert_eq!(row("accepted, %"), ["90.0", "-", "33.3", "47.5"]);
        assert_eq!(row("no pose, %"), ["10.0", "-", "66.7", "52.5"]);
    }
}
