//! `cslam reproduce beam-squint`: beam squint localization against its physical limit.

use serde::Serialize;

use crate::beam_squint::{Case, NearRow, Row, near, run as run_case};
use crate::progress;
use crate::table::Table;

/// Arguments of `cslam reproduce beam-squint`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Trials of each row
    #[arg(long, value_name = "N", default_value_t = 300)]
    trials: usize,
    /// Seed of all draws
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Print one JSON object a row on standard output instead of the tables
    #[arg(long)]
    json: bool,
}

const DISTANCES_M: [f64; 3] = [20.0, 50.0, 100.0];

/// Rows: name, what differs from the ideal case, and the figure asked of the faces' joined fits at each distance, m.
#[derive(Clone, Copy)]
struct Kind {
    name: &'static str,
    case: fn(Case) -> Case,
    most_m: Option<[f64; 3]>,
}

const KINDS: [Kind; 8] = [
    Kind {
        name: "ideal",
        case: |c| c,
        most_m: None,
    },
    Kind {
        name: "ideal, raster",
        case: |c| Case { raster: true, ..c },
        most_m: None,
    },
    Kind {
        name: "SNR -20 dB",
        case: |c| Case {
            snr_offset_db: -20.0,
            ..c
        },
        most_m: None,
    },
    Kind {
        name: "GMT errors",
        case: |c| Case {
            gmt_errors: true,
            ..c
        },
        most_m: Some([0.06, 0.15, 0.25]),
    },
    Kind {
        name: "bounce, ignored",
        case: |c| Case { bounce: true, ..c },
        most_m: None,
    },
    Kind {
        name: "bounce, nulled",
        case: |c| Case {
            bounce: true,
            null: true,
            ..c
        },
        most_m: Some([0.1, 0.2, 0.5]),
    },
    Kind {
        name: "same, GMT errors",
        case: |c| Case {
            bounce: true,
            null: true,
            gmt_errors: true,
            ..c
        },
        most_m: Some([0.1, 0.2, 0.5]),
    },
    Kind {
        name: "same, UAV errors too",
        case: |c| Case {
            bounce: true,
            null: true,
            gmt_errors: true,
            uav_errors: true,
            ..c
        },
        most_m: Some([0.1, 0.2, 0.5]),
    },
];

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let trials = args.trials.max(1);
    let rows: Vec<(Kind, usize)> = KINDS.iter().flat_map(|k| (0..3).map(|d| (*k, d))).collect();
    let near_rows = [10.0, 20.0, 50.0, 100.0];
    let bar = progress::bar((rows.len() + 3 * near_rows.len()) as u64, "trials");
    let print = |line: &str| bar.suspend(|| println!("{line}"));
    let mut table = Table::new([
        "rms 3-D position error, m",
        "distance",
        "bound",
        "fit",
        "fit/bound",
        "NEES/2",
        "joined",
        "at most",
        "NEES/2",
        "two faces",
        "parabola",
        "pick",
        "refused",
    ]);
    for (kind, d) in rows {
        let row = run_case(&(kind.case)(Case::ideal(DISTANCES_M[d])), trials, args.seed);
        bar.inc(1);
        if args.json {
            print(&json(kind.name, &row)?);
        } else {
            table.row(cells(&kind, d, &row));
        }
    }
    let mut near_table = Table::new([
        "near field, elements",
        "distance",
        "bound m",
        "fit m",
        "fit/bound",
        "pick m",
        "refused",
    ]);
    for distance_m in near_rows {
        let rows = [
            near::<64>(distance_m, trials, args.seed),
            near::<128>(distance_m, trials, args.seed),
            near::<256>(distance_m, trials, args.seed),
        ];
        for row in rows {
            bar.inc(1);
            if args.json {
                print(&json("near field", &row)?);
            } else {
                near_table.row(near_cells(&row));
            }
        }
    }
    bar.finish_and_clear();
    if !args.json {
        println!("{table}\n{near_table}");
    }
    Ok(())
}

/// A row with its name.
fn json(name: &str, row: &impl Serialize) -> serde_json::Result<String> {
    #[derive(Serialize)]
    struct Named<'a, R> {
        row: &'a str,
        #[serde(flatten)]
        figures: &'a R,
    }
    serde_json::to_string(&Named {
        row: name,
        figures: row,
    })
}

fn cells(kind: &Kind, distance: usize, row: &Row) -> Vec<String> {
    vec![
        kind.name.into(),
        format!("{:.0} m", row.case.distance_m),
        metres(row.bound_m),
        metres(row.fit_m),
        // Errors of calibration have no place in the bound.
        if kind.most_m.is_none() && !row.case.bounce {
            format!("{:.3}", row.fit_over_bound)
        } else {
            "-".into()
        },
        format!("{:.2}", row.fit_nees),
        metres(row.joined_m),
        kind.most_m
            .map_or("-".into(), |most| format!("{:.2}", most[distance])),
        format!("{:.2}", row.joined_nees),
        format!("{:.0} %", 100.0 * row.joined_share),
        metres(row.parabola_m),
        metres(row.pick_m),
        format!("{} of {}", row.refused, row.trials),
    ]
}

fn near_cells(row: &NearRow) -> Vec<String> {
    vec![
        row.elements.to_string(),
        format!("{:.0} m", row.distance_m),
        metres(row.bound_m),
        metres(row.fit_m),
        format!("{:.3}", row.fit_over_bound),
        metres(row.pick_m),
        format!("{} of {}", row.refused, row.trials),
    ]
}

/// Three significant digits.
fn metres(value: f64) -> String {
    if value.is_nan() {
        return "-".into();
    }
    let digits = (2.0 - libm::floor(libm::log10(value.max(1e-6)))).clamp(0.0, 6.0) as usize;
    format!("{value:.digits$}")
}
