//! `cslam accuracy`: path estimation against its physical limit.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use anyhow::bail;

use crate::accuracy::{Case, Mode, Target};
use crate::input::limits::FIGURES;
use crate::input::read_text;
use crate::progress;
use crate::table::Table;

/// Arguments of `cslam accuracy`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which case; all when absent
    case: Option<Case>,
    /// Unit of the number of trials: scenes, pairs and departures of each row; bounces and sweeps of noise are twice, single
    /// paths ten times as many. Where the best mode must reach a figure: single paths forty, sweeps of noise twenty, paths at
    /// -20 dB two hundred times
    #[arg(long, value_name = "N", default_value_t = 100)]
    trials: usize,
    /// Whose estimator; all beside each other when absent
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// Seed of all draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
    /// Compare the tables with a file, byte for byte, and fail where they differ or where a figure asked for is not reached
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    check: Option<PathBuf>,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let expected = args
        .check
        .as_deref()
        .map(|file| read_text(file, &FIGURES))
        .transpose()?;
    let modes = args.mode.as_ref().map_or(&Mode::ALL[..], std::slice::from_ref);
    let cases: Vec<Case> = Case::ALL
        .into_iter()
        .filter(|case| args.case.is_none_or(|c| c == *case))
        .collect();
    let length: usize = cases.iter().map(|case| case.rows(modes)).sum();
    let bar = progress::bar(length as u64, "accuracy");
    let (mut text, mut targets) = (String::new(), Vec::new());
    for case in cases {
        let report = case.run(modes, args.trials.max(1), args.seed, || bar.inc(1));
        if args.json {
            bar.suspend(|| report.lines.iter().for_each(|line| println!("{line}")));
        } else if args.check.is_none() {
            bar.suspend(|| println!("{}", report.table));
        }
        writeln!(text, "{}", report.table)?;
        targets.extend(report.targets);
    }
    bar.finish_and_clear();
    let summary = summary(&targets);
    text += &summary;
    if !args.json && args.check.is_none() {
        print!("{summary}");
    }
    match (&args.check, expected) {
        (Some(file), Some(expected)) => check(file, &expected, &text, &targets),
        _ => Ok(()),
    }
}

fn summary(targets: &[Target]) -> String {
    if targets.is_empty() {
        return String::new();
    }
    let mut table = Table::new(["asked for", "measured", "reached"]);
    for target in targets {
        let met = if target.met { "yes" } else { "no" };
        table.row([target.what.as_str(), target.measured.as_str(), met]);
    }
    table.to_string()
}

fn check(file: &Path, expected: &str, text: &str, targets: &[Target]) -> anyhow::Result<()> {
    if let Some(missed) = targets.iter().find(|target| !target.met) {
        bail!("{}: measured {}", missed.what, missed.measured);
    }
    if text == expected {
        println!("{} figures as in {}", text.lines().count(), file.display());
        return Ok(());
    }
    let lines = expected.lines().zip(text.lines()).enumerate();
    let differing = lines.into_iter().find(|(_, (a, b))| a != b);
    let line = differing.map_or(expected.lines().count().min(text.lines().count()), |(i, _)| i);
    let at = |text: &str| text.lines().nth(line).unwrap_or("(nothing)").to_owned();
    bail!(
        "{}:{}: is \"{}\", measured \"{}\"",
        file.display(),
        line + 1,
        at(expected),
        at(text)
    )
}
