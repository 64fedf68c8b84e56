//! `cslam estimate`: the core's path estimation on recordings.

use std::io::Write;
use std::path::{Path, PathBuf};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::paths::EstimatedPath;
use rayon::prelude::*;
use serde::Serialize;

use crate::estimate::{Axes, Estimate, Mode, estimate};
use crate::input::InputError;
use crate::table::Table;
use crate::{progress, sigmf};

/// Arguments of `cslam estimate`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Recordings: NAME, NAME.sigmf-meta or NAME.sigmf-data
    #[arg(value_name = "NAME.sigmf-meta", required = true)]
    recordings: Vec<PathBuf>,
    /// Whose estimator
    #[arg(long, value_enum, default_value_t = Mode::Best)]
    mode: Mode,
    /// Azimuth at which the first face of the GMT looks, deg: turns angles of departure into the world frame
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    gmt_heading_deg: f64,
    /// Print one JSON object a recording on standard output (paths format) instead of tables
    #[arg(long)]
    json: bool,
    /// Print lines of numbers with a header line, a recording after the other: the paths as the receiver has them, angles of arrival as
    /// unit vectors in body axes. The examples in Rust, C and Python print the same characters
    #[arg(long, conflicts_with = "json")]
    csv: bool,
}

/// A line of `--json`.
#[derive(Serialize)]
struct Line<'a> {
    recording: &'a PathBuf,
    #[serde(flatten)]
    estimate: &'a Estimate,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    if !args.gmt_heading_deg.is_finite() {
        return Err(InputError::new("--gmt-heading-deg must be a finite angle").into());
    }
    let bar = progress::bar(args.recordings.len() as u64, "estimate");
    // In the order of the arguments, whatever the number of threads; the first faulty recording is the one named.
    let estimates: Vec<Result<Estimate, InputError>> = args
        .recordings
        .par_iter()
        .map(|name| {
            let mut recording = sigmf::read(name)?;
            let found = estimate(&mut recording, args.mode, args.gmt_heading_deg.to_radians());
            bar.inc(1);
            found.map_err(|message| InputError::in_file(&sigmf::files(name).0, message))
        })
        .collect();
    bar.finish_and_clear();
    let estimates = estimates.into_iter().collect::<Result<Vec<_>, _>>()?;
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    for (recording, estimate) in args.recordings.iter().zip(&estimates) {
        if args.json {
            let line = serde_json::to_string(&Line { recording, estimate })?;
            writeln!(out, "{line}")?;
        } else if args.csv {
            writeln!(out, "{}", EstimatedPath::COLUMNS)?;
            for path in &estimate.paths {
                writeln!(out, "{}", path.found)?;
            }
        } else {
            print(&mut out, recording, estimate)?;
        }
        if estimate.clips > 0 {
            eprintln!(
                "{}: {} values clipped in the transforms, the paths may be too weak",
                recording.display(),
                estimate.clips
            );
        }
    }
    out.flush()?;
    Ok(())
}

fn print(out: &mut impl Write, recording: &Path, estimate: &Estimate) -> std::io::Result<()> {
    let axes = match estimate.frame {
        Axes::World => "world",
        Axes::Body => "body",
    };
    writeln!(
        out,
        "{}: {} paths in {} of {} beams, angles in {axes} axes",
        recording.display(),
        estimate.paths.len(),
        estimate.beams,
        sigmf::Codebook::Beams.len()
    )?;
    let mut table = Table::new([
        "path",
        "c tau m",
        "+-",
        "zenith deg",
        "azimuth deg",
        "+-",
        "AoD zenith",
        "azimuth",
        "+-",
        "beam",
        "SNR dB",
    ]);
    for (index, p) in estimate.paths.iter().enumerate() {
        let [range, e1, e2] = std::array::from_fn(|i| p.covariance[i][i]);
        let degrees = |rad: Option<f64>, digits: usize| {
            rad.map_or_else(|| "-".into(), |rad| format!("{:.digits$}", rad.to_degrees()))
        };
        table.row([
            index.to_string(),
            format!("{:.4}", p.delay_s * SPEED_OF_LIGHT_M_PER_S),
            format!("{:.4}", range.sqrt()),
            degrees(Some(p.aoa_zenith_rad), 3),
            degrees(Some(p.aoa_azimuth_rad), 3),
            degrees(Some((0.5 * (e1 + e2)).sqrt()), 3),
            degrees(p.aod_zenith_rad, 2),
            degrees(p.aod_azimuth_rad, 2),
            degrees(p.aod_sigma_rad, 2),
            p.beam.to_string(),
            format!("{:.1}", p.snr_db),
        ]);
    }
    writeln!(out, "{table}")
}
