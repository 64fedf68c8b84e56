//! `cslam accuracy`: path estimation against its physical limit.

use clap::ValueEnum;
use serde::Serialize;

use crate::accuracy::{Mode, bounce, departures, false_alarms, pairs, scenes, single};
use crate::progress;
use crate::table::Table;

/// Arguments of `cslam accuracy`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Which case; all when absent
    case: Option<Case>,
    /// Trials of each row; scenes and sweeps of noise are a tenth and ten times as many
    #[arg(long, value_name = "N", default_value_t = 300)]
    trials: usize,
    /// Whose estimator
    #[arg(long, value_enum, default_value_t = Mode::Best)]
    mode: Mode,
    /// Seed of all draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Case {
    /// One path at several SNRs: RMSE over the Cramer-Rao bound
    Single,
    /// Sweeps of noise alone
    Noise,
    /// Nine paths over 30 dB in a sweep of 72 beams
    Scenes,
    /// Line of sight beside a ground bounce
    Bounce,
    /// Two close paths in one beam
    Pairs,
    /// Angle of departure from the energies of the beams
    Departure,
}

const SNR_DB: [f64; 9] = [-20.0, -18.0, -15.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0];

/// Separations of signal.md section 3.3: m, deg.
const SEPARATIONS: [(f64, f64); 12] = [
    (0.3, 0.0),
    (0.75, 0.0),
    (1.5, 0.0),
    (0.0, 5.0),
    (0.0, 10.0),
    (0.0, 15.0),
    (0.0, 25.0),
    (0.0, 40.0),
    (0.6, 10.0),
    (0.6, 22.0),
    (1.5, 10.0),
    (3.0, 10.0),
];

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let (mode, trials, seed) = (args.mode, args.trials.max(1), args.seed);
    let scene_count = (trials / 10).max(1);
    let cases = Case::value_variants()
        .iter()
        .filter(|case| args.case.is_none_or(|c| c == **case));
    for case in cases {
        match case {
            Case::Single => print(
                args,
                &SNR_DB,
                single_header(),
                |&snr| single(mode, snr, trials, seed),
                |r| {
                    let mut row = vec![
                        format!("{:.0}", r.snr_db),
                        percent(r.detected),
                        percent(r.outliers),
                    ];
                    row.extend(r.ratio.map(figure));
                    row.push(figure(r.nees));
                    row
                },
            )?,
            Case::Noise => print(
                args,
                &[()],
                ["sweeps of noise", "with a false path"],
                |()| false_alarms(mode, 10 * trials, seed),
                |r| vec![r.sweeps.to_string(), r.sweeps_with_paths.to_string()],
            )?,
            Case::Scenes => print(
                args,
                &[0.0, 20.0],
                scenes_header(),
                |&snr| scenes(mode, snr, scene_count, seed),
                |r| {
                    let mut row = vec![format!("{:.0}", r.snr_db), r.scenes.to_string()];
                    row.extend(r.detected.map(|x| format!("{x:.3}")));
                    row.push(format!("{:.3}", r.false_alarms));
                    row.push(percent(r.strongest[0]));
                    row
                },
            )?,
            Case::Bounce => print(
                args,
                &[20.0, 50.0, 100.0],
                bounce_header(),
                |&d| bounce(mode, d, trials, seed),
                |r| {
                    vec![
                        format!("{:.0}", r.distance_m),
                        format!("{:.2} / {:.2}", 1e3 * r.range_m[0], 1e3 * r.range_m[1]),
                        format!("{:.2}", 1e3 * r.bound[0]),
                        format!("{:.3} / {:.3}", r.angle_deg[0], r.angle_deg[1]),
                        format!("{:.3}", r.bound[1]),
                    ]
                },
            )?,
            Case::Pairs => {
                let rows: Vec<_> = SEPARATIONS.iter().flat_map(|&s| [(s, 0.0), (s, -10.0)]).collect();
                let header = ["apart m, deg", "second dB", "both found", "possible by the bound"];
                print(
                    args,
                    &rows,
                    header,
                    |&((m, deg), db)| pairs(mode, m, deg, db, trials, seed),
                    |r| {
                        let apart = format!("{} m, {} deg", r.apart_m, r.apart_deg);
                        vec![
                            apart,
                            format!("{:.0}", r.second_db),
                            format!("{:.2}", r.both),
                            format!("{:.2}", r.possible),
                        ]
                    },
                )?;
            }
            Case::Departure => print(
                args,
                &[0.0, 10.0, 20.0],
                ["SNR dB", "rms deg", "median deg", "error / own sigma"],
                |&snr| departures(mode, snr, trials, seed),
                |r| {
                    vec![
                        format!("{:.0}", r.snr_db),
                        format!("{:.3}", r.rms_deg),
                        format!("{:.3}", r.median_deg),
                        format!("{:.2}", r.honesty),
                    ]
                },
            )?,
        }
    }
    Ok(())
}

fn single_header() -> [&'static str; 7] {
    [
        "one path, SNR dB",
        "detected",
        "outliers",
        "c tau RMSE/bound",
        "angle 1",
        "angle 2",
        "NEES/3",
    ]
}

fn scenes_header() -> [&'static str; 7] {
    [
        "nine paths, SNR dB",
        "scenes",
        "0-10 dB down",
        "10-20",
        "20-30",
        "false a scene",
        "strongest right",
    ]
}

fn bounce_header() -> [&'static str; 5] {
    [
        "LOS + bounce, m",
        "c tau mm 50 / 90 %",
        "bound mm",
        "angle deg 50 / 90 %",
        "bound deg",
    ]
}

/// Three digits, or a dash where there is no figure.
fn figure(value: f64) -> String {
    if value.is_nan() {
        "-".into()
    } else {
        format!("{value:.3}")
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// Runs the rows of a case and prints each as a line of JSON, or all as a table.
fn print<I, R: Serialize, const N: usize>(
    args: &Args,
    inputs: &[I],
    header: [&str; N],
    run: impl Fn(&I) -> R,
    cells: impl Fn(&R) -> Vec<String>,
) -> anyhow::Result<()> {
    let bar = progress::bar(inputs.len() as u64, "accuracy");
    let mut table = Table::new(header);
    for input in inputs {
        let result = run(input);
        bar.inc(1);
        if args.json {
            bar.suspend(|| serde_json::to_string(&result).map(|line| println!("{line}")))?;
        } else {
            table.row(cells(&result));
        }
    }
    bar.finish_and_clear();
    if !args.json {
        println!("{table}");
    }
    Ok(())
}
