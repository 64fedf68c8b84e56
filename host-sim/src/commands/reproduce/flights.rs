//! `cslam reproduce flights`: whole flights from raw samples, both modes, and each stage of ours exchanged for the paper's.

mod figures;

use std::sync::atomic::AtomicBool;

use clap::ValueEnum;

use self::figures::FIGURES;
use crate::commands::fly::raw::{Hooks, fly_world};
use crate::commands::seeds::AnySeed;
use crate::config::{
    DepartureChoice, LinkStateChoice, LocalizationChoice, MappedChoice, Mode, ReceiverConfig,
};
use crate::estimate;
use crate::evaluation::{FirstOrderPaths, evaluate};
use crate::flight::FlightConfig;
use crate::input::InputError;
use crate::progress;
use crate::raw_flight::Swept;
use crate::scene::Scene;
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
            let hooks = Hooks {
                interrupted: &never,
                swept: |_: &Swept<'_>| bar.inc(1),
                sent: |_: u64, _: &[u8]| {},
            };
            let (mut log, _) = fly_world(setup, &args.scene, world, *seed, planned, hooks)?;
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
