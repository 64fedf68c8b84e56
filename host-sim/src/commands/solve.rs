//! `cslam solve`: the reflection point of each path of a paths file.

use std::io::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use cslam_core::geometry::{Position, Real};
use cslam_core::reflection::{Bounds, Form, Gates};
use serde::Serialize;

use crate::input::InputError;
use crate::measurement::Sigmas;
use crate::paths::{self, Link};
use crate::progress;
use crate::solve::{Comparison, Settings, Solved, solve_all};
use crate::statistics::{quantile, rms};
use crate::table::Table;

/// Arguments of `cslam solve`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Paths file (.jsonl or .jsonl.gz), one link a line
    #[arg(long, value_name = "FILE")]
    paths: PathBuf,
    /// Print one JSON object a path on standard output; the summary goes to standard error
    #[arg(long)]
    json: bool,
    /// Closed form
    #[arg(long, value_enum, default_value_t = FormName::Vector)]
    form: FormName,
    /// Arithmetic
    #[arg(long, value_enum, default_value_t = Precision::F32)]
    precision: Precision,
    /// Open every gate that can be opened: solve whatever has a solution
    #[arg(long)]
    open_gates: bool,
    /// Do not use the angles of departure of the file
    #[arg(long)]
    ignore_aod: bool,
    /// Height of the ground, m: points under it are rejected
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    ground: Option<f64>,
    /// Bounds of the scene, m: points outside are rejected
    #[arg(
        long,
        value_name = "X0,Y0,Z0,X1,Y1,Z1",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    bounds: Option<Vec<f64>>,
    /// Standard deviation of c tau, m, for paths without covariance
    #[arg(long, value_name = "M", default_value_t = Sigmas::default().c_tau_m)]
    range_sigma_m: f64,
    /// Standard deviation of the angle of arrival, deg, for paths without covariance
    #[arg(long, value_name = "DEG", default_value_t = Sigmas::default().aoa_deg)]
    angle_sigma_deg: f64,
    /// Standard deviation of the angle of departure, deg, for paths without aod_sigma_rad
    #[arg(long, value_name = "DEG", default_value_t = Sigmas::default().aod_deg)]
    aod_sigma_deg: f64,
    /// Standard deviation of the UAV's position along each axis, m
    #[arg(long, value_name = "M", default_value_t = Sigmas::default().position_m)]
    position_sigma_m: f64,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum FormName {
    /// P = R + d u
    Vector,
    /// Equations geores_1 to geores_3 of the paper
    Paper,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Precision {
    /// As in flight
    F32,
    /// To see what single precision costs
    F64,
}

/// One line of `--json`.
#[derive(Serialize)]
struct Line<'a, T> {
    link: usize,
    path: usize,
    verdict: &'a str,
    point: Option<[T; 3]>,
    sigma_m: Option<T>,
    form: &'a str,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let links = paths::read(&args.paths)?;
    match args.precision {
        Precision::F32 => solve_and_print::<f32>(args, &links),
        Precision::F64 => solve_and_print::<f64>(args, &links),
    }
}

fn solve_and_print<T: Real + Serialize>(args: &Args, links: &[Link]) -> anyhow::Result<()> {
    let settings = settings::<T>(args)?;
    let mut comparison = Comparison::default();
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let form = match args.form {
        FormName::Vector => "vector",
        FormName::Paper => "paper",
    };
    if !args.json {
        writeln!(
            out,
            "{:>5} {:>4}  {:>28}  {:>8}  verdict",
            "link", "path", "point (m)", "sigma (m)"
        )?;
    }
    for solved in solve_all(links, &settings) {
        comparison.add(links, &solved);
        if args.json {
            let Solved {
                link,
                path,
                verdict,
                point,
                sigma_m,
            } = solved;
            serde_json::to_writer(
                &mut out,
                &Line {
                    link,
                    path,
                    verdict,
                    point,
                    sigma_m,
                    form,
                },
            )?;
            writeln!(out)?;
        } else {
            print_line(&mut out, &solved)?;
        }
    }
    out.flush()?;
    drop(out);
    if args.json {
        progress::note(format_args!("\n{}", summary(&comparison)));
    } else {
        println!("\n{}", summary(&comparison));
    }
    Ok(())
}

fn print_line<T: Real>(out: &mut impl Write, solved: &Solved<T>) -> std::io::Result<()> {
    let point = solved.point.map(|p| p.map(T::to_f64));
    let point = point.map_or_else(|| "-".into(), |[x, y, z]| format!("{x:.3} {y:.3} {z:.3}"));
    let sigma = solved
        .sigma_m
        .map_or_else(|| "-".into(), |s| format!("{:.3}", s.to_f64()));
    writeln!(
        out,
        "{:>5} {:>4}  {point:>28}  {sigma:>9}  {}",
        solved.link, solved.path, solved.verdict
    )
}

fn settings<T: Real>(args: &Args) -> Result<Settings<T>, InputError> {
    let sigmas = Sigmas {
        c_tau_m: args.range_sigma_m,
        aoa_deg: args.angle_sigma_deg,
        aod_deg: args.aod_sigma_deg,
        position_m: args.position_sigma_m,
    };
    sigmas
        .check()
        .map_err(|message| InputError::new(format!("standard deviation {message}")))?;
    let mut gates = if args.open_gates {
        Gates::open()
    } else {
        Gates::default()
    };
    if args.ground.is_some_and(|z| !z.is_finite()) {
        return Err(InputError::new("--ground must be a finite height in m"));
    }
    gates.ground_z_m = args.ground.map(T::of);
    gates.bounds = args.bounds.as_deref().map(bounds).transpose()?;
    let form = match args.form {
        FormName::Vector => Form::Vector,
        FormName::Paper => Form::Paper,
    };
    Ok(Settings {
        form,
        gates,
        sigmas,
        use_aod: !args.ignore_aod,
    })
}

fn bounds<T: Real>(values: &[f64]) -> Result<Bounds<T>, InputError> {
    let wrong =
        || InputError::new("--bounds wants six numbers X0,Y0,Z0,X1,Y1,Z1 with X0 < X1, Y0 < Y1, Z0 < Z1");
    let &[x0, y0, z0, x1, y1, z1] = values else {
        return Err(wrong());
    };
    if !(x0 < x1 && y0 < y1 && z0 < z1) {
        return Err(wrong());
    }
    let corner = |x, y, z| Position::new(T::of(x), T::of(y), T::of(z)).map_err(|_| wrong());
    Ok(Bounds {
        min: corner(x0, y0, z0)?,
        max: corner(x1, y1, z1)?,
    })
}

fn summary(comparison: &Comparison) -> String {
    let mut table = Table::new([
        "verdict", "LOS", "order 1", "order 2", "order 3+", "unknown", "all",
    ]);
    for (verdict, counts) in &comparison.verdicts {
        let all: usize = counts.iter().sum();
        let numbers = counts.iter().chain([&all]).map(ToString::to_string);
        table.row([(*verdict).to_owned()].into_iter().chain(numbers));
    }
    let mut text = table.to_string();
    let (higher, caught) = comparison.higher_order_caught();
    if higher > 0 {
        let share = 100.0 * caught as f64 / higher as f64;
        text += &format!("higher-order paths caught: {caught} of {higher} ({share:.1} %)\n");
    }
    let accepted = comparison.errors_above_1m_excess_m.len();
    for (what, errors) in [
        ("accepted first-order points".to_owned(), &comparison.errors_m),
        (
            format!(
                "... with over 1 m excess ({accepted} of {})",
                comparison.first_order_above_1m_excess
            ),
            &comparison.errors_above_1m_excess_m,
        ),
    ] {
        if let (Some(rms), Some(median), Some(largest)) =
            (rms(errors), quantile(errors, 0.5), quantile(errors, 1.0))
        {
            text += &format!(
                "{what}: error against last_vertex rms {:.4} mm, median {:.4} mm, largest {:.4} mm\n",
                rms * 1e3,
                median * 1e3,
                largest * 1e3
            );
        }
    }
    text
}
