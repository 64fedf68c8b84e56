//! `cslam reproduce localization`: the pose over whole flights and at the end of planned outages, and what each aid is worth there; the pose
//! after starts, by phases of a flight, and with measurements that do not err.

mod flown;
mod limits;
mod outages;
mod phases;
mod rows;
mod starts;
mod whole;

use std::path::PathBuf;

use clap::ValueEnum;
use serde::Serialize;

use crate::commands::kept::Kept;
use crate::config::Config;
use crate::progress;
use crate::table::Table;
use crate::world::Profile;
use rows::ROWS;

/// Arguments of `cslam reproduce localization`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which table; all when absent
    part: Option<Part>,
    /// Flights through each scene: one number for each, the last one for those that follow too. Those that have no line of sight long enough
    /// before an outage are left out of its rows
    #[arg(long, value_name = "N", num_args = 1.., default_values_t = [12], value_parser = clap::value_parser!(u64).range(1..=10_000))]
    flights: Vec<u64>,
    /// Scenes: names or files
    #[arg(long = "scene", value_name = "SCENE", num_args = 1.., default_values_t = ["outdoor".to_owned()])]
    scenes: Vec<String>,
    /// Seed of the first flight of each scene; the others count up from it
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The world to fly in
    #[arg(long, value_enum, default_value_t)]
    world: Profile,
    /// Lengths of the outages, s
    #[arg(long, value_name = "SECONDS", num_args = 1.., default_values_t = [10.0, 20.0, 40.0, 60.0])]
    lengths: Vec<f64>,
    /// Keep what path estimation makes of each flight in this directory, as `cslam campaign --keep-paths` does: a flight whose paths lie there already
    /// is flown from them, in seconds
    #[arg(long, value_name = "DIR")]
    keep_paths: Option<PathBuf>,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Part {
    /// Whole flights: position, attitude, clock, honesty of the covariances
    Flights,
    /// Planned outages: the pose at their end
    Outages,
    /// Starts every ten seconds of each flight, a third of them without line of sight: time to the pose, its errors, false ones
    Starts,
    /// Phases of whole flights, in sight and in outages by what is taken in them: the share that each has of the errors, honesty of the covariances
    Phases,
    /// Whole flights with some of their measurements put right by the truth: what limits the pose
    Limits,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(length_s) = args.lengths.iter().find(|s| !(1.0..=600.0).contains(*s)) {
        anyhow::bail!("--lengths: expected 1 to 600 s, found {length_s}");
    }
    let wanted = |part: Part| args.part.is_none_or(|only| only == part);
    let config = Config::of(args.world);
    let scenes =
        (args.scenes.iter().map(|scene| config.world.scene(scene))).collect::<Result<Vec<_>, _>>()?;
    let lengths = if wanted(Part::Outages) {
        &args.lengths[..]
    } else {
        &[]
    };
    let rows = (usize::from(wanted(Part::Flights)) + lengths.len()) * ROWS.len();
    let rows = rows + usize::from(wanted(Part::Starts)) + usize::from(wanted(Part::Phases));
    let rows = rows + usize::from(wanted(Part::Limits)) * limits::COUNT;
    let planned = planned(&args.flights, scenes.len());
    let blocked = if lengths.is_empty() {
        0
    } else {
        planned.iter().sum()
    };
    let bar = progress::bar(planned.iter().sum::<u64>() + blocked + rows as u64, "flying");
    let kept = args.keep_paths.as_deref().map(Kept::new);
    let mut flights = Vec::new();
    for ((scene, name), count) in scenes.iter().zip(&args.scenes).zip(planned) {
        for seed in args.seed..args.seed + count {
            flights.push(flown::fly((scene, name), &config, seed, kept.as_ref())?);
            bar.inc(1);
        }
    }
    let whole = wanted(Part::Flights)
        .then(|| whole::fly(&flights, &bar))
        .transpose()?;
    let outages = outages::fly(&flights, lengths, &bar)?;
    let starts = wanted(Part::Starts)
        .then(|| starts::fly(&flights, &bar))
        .transpose()?;
    let phases = wanted(Part::Phases)
        .then(|| phases::fly(&flights, &bar))
        .transpose()?;
    let limits = wanted(Part::Limits)
        .then(|| limits::fly(&flights, &bar))
        .transpose()?;
    bar.finish_and_clear();
    if let Some(lines) = &whole {
        print(args.json, whole::HEADER, lines, whole::Line::cells)?;
    }
    if wanted(Part::Outages) {
        print(args.json, outages::HEADER, &outages, outages::Line::cells)?;
    }
    if let Some(lines) = &starts {
        print(args.json, starts::HEADER, lines, starts::Line::cells)?;
    }
    if let Some(lines) = &phases {
        print(args.json, phases::HEADER, lines, phases::Line::cells)?;
        if !args.json {
            println!("{}", phases::NOTE);
        }
    }
    if let Some(lines) = &limits {
        print(args.json, limits::HEADER, lines, whole::Line::cells)?;
    }
    Ok(())
}

/// Flights through each of so many scenes: the numbers that were told, the last one again for the scenes that follow.
fn planned(told: &[u64], scenes: usize) -> Vec<u64> {
    let last = told.last().copied().unwrap_or_default();
    let each = told.iter().copied().chain(std::iter::repeat(last));
    each.take(scenes).collect()
}

/// Figures of a cell, with so many digits; a dash for one that is not there.
fn figures(values: &[Option<f64>], digits: usize) -> String {
    let each = values
        .iter()
        .map(|value| value.map_or("-".into(), |value| format!("{value:.digits$}")));
    each.collect::<Vec<_>>().join(", ")
}

/// Prints the rows of a table.
fn print<L: Serialize, const N: usize>(
    json: bool,
    header: [&str; N],
    lines: &[L],
    cells: impl Fn(&L) -> Vec<String>,
) -> anyhow::Result<()> {
    if json {
        for line in lines {
            println!("{}", serde_json::to_string(line)?);
        }
        return Ok(());
    }
    let mut table = Table::new(header);
    for line in lines {
        table.row(cells(line));
    }
    println!("{table}");
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scenes_beyond_the_last_number_of_flights_have_as_many() {
        assert_eq!(planned(&[12, 6, 2], 5), [12, 6, 2, 2, 2]);
        assert_eq!(planned(&[12], 2), [12, 12]);
        assert_eq!(planned(&[12, 6], 1), [12]);
    }
}
