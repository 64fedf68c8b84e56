//! `cslam classify`: the state of links, and how probable it is of every path that it was reflected once.

use std::io::Write;
use std::path::PathBuf;

use clap::ValueEnum;
use cslam_core::geometry::Position;
use cslam_core::link_state::{AcceptGate, Classifier, LinkState, PaperClassifier, Probabilities, Received};
use cslam_core::reflection::{Bounds, Ends, Form, Gates, Verdict, solve};
use serde::Serialize;

use crate::input::InputError;
use crate::link_state::judge::{Judge, received};
use crate::link_state::model_file::ModelFile;
use crate::link_state::shipped::Shipped;
use crate::measurement::{self, Sigmas};
use crate::paths::{self, Link};
use crate::progress;
use crate::table::Table;

/// Arguments of `cslam classify`.
#[derive(clap::Args, Debug)]
pub(crate) struct Args {
    /// Paths file (.jsonl or .jsonl.gz), one link a line, strongest path first
    #[arg(long, value_name = "FILE")]
    paths: PathBuf,
    /// Whose classifier: best looks at every path, paper at the link
    #[arg(long, value_enum, default_value_t = Mode::Best)]
    mode: Mode,
    /// Model file (.lscn) instead of the one that comes with the program: for paths with angle of departure, or the
    /// paper's
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// Model file (.lscn) for paths without angle of departure
    #[arg(long, value_name = "FILE")]
    model_without_departure: Option<PathBuf>,
    /// Do not use the angles of departure of the file
    #[arg(long)]
    ignore_aod: bool,
    /// Height of the ground, m: points under it are not accepted
    #[arg(long, value_name = "Z", allow_negative_numbers = true)]
    ground: Option<f32>,
    /// Bounds of the scene, m: points outside are not accepted
    #[arg(
        long,
        value_name = "X0,Y0,Z0,X1,Y1,Z1",
        value_delimiter = ',',
        num_args = 1,
        allow_hyphen_values = true
    )]
    bounds: Option<Vec<f32>>,
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
    /// Print one JSON object a link on standard output; the summary goes to standard error
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Mode {
    /// Geometric features, every path for itself
    Best,
    /// The paper's network: delay and direction of the strongest paths, state of the link
    Paper,
}

/// One line of `--json`.
#[derive(Serialize)]
struct Line {
    link: usize,
    state: u8,
    probabilities: Option<[f32; 3]>,
    paths: Vec<PathLine>,
}

#[derive(Serialize)]
struct PathLine {
    path: usize,
    /// For people; a line of JSON has the state of the link.
    #[serde(skip)]
    state: Option<LinkState>,
    /// None where the file's numbers are no measurement of a path.
    first_order: Option<f32>,
    accepted: bool,
}

pub(crate) fn run(args: &Args) -> anyhow::Result<()> {
    let links = paths::read(&args.paths)?;
    let sigmas = Sigmas {
        c_tau_m: args.range_sigma_m,
        aoa_deg: args.angle_sigma_deg,
        aod_deg: args.aod_sigma_deg,
        position_m: args.position_sigma_m,
    };
    sigmas
        .check()
        .map_err(|message| InputError::new(format!("standard deviation {message}")))?;
    let gate = gate(args)?;
    let shipped = Shipped::default();
    let read = |file: &Option<PathBuf>, shipped: ModelFile| match file {
        Some(file) => ModelFile::read(file),
        None => Ok(shipped),
    };
    if args.mode == Mode::Paper && args.model_without_departure.is_some() {
        return Err(
            InputError::new("--model-without-departure: the paper's mode has one model, --model").into(),
        );
    }
    let file = match args.mode {
        Mode::Best => read(&args.model, shipped.geometric)?,
        Mode::Paper => read(&args.model, shipped.paper)?,
    };
    let without = read(&args.model_without_departure, shipped.geometric_without_departure)?;
    let unfit = |e: &dyn std::fmt::Display| InputError::new(format!("--model: {e}"));
    let model = |file| ModelFile::model(file).map_err(|e| unfit(&e));
    let judge = match args.mode {
        Mode::Best => Judge::Best(Classifier::new(model(&file)?, model(&without)?).map_err(|e| unfit(&e))?),
        Mode::Paper => Judge::Paper(PaperClassifier::new(model(&file)?).map_err(|e| unfit(&e))?),
    };
    let mut out = std::io::BufWriter::new(std::io::stdout().lock());
    let mut tally = Tally::default();
    if !args.json {
        print_header(&mut out)?;
    }
    for (index, link) in links.iter().enumerate() {
        let line = classify(index, link, &judge, &gate, &sigmas, args.ignore_aod)
            .map_err(|why| InputError::in_file(&args.paths, format!("link {index}: {why}")))?;
        tally.add(link, &line);
        if args.json {
            serde_json::to_writer(&mut out, &line)?;
            writeln!(out)?;
        } else {
            print(&mut out, &line)?;
        }
    }
    if args.json {
        progress::note(&tally);
    } else {
        writeln!(out, "\n{tally}")?;
    }
    out.flush()?;
    Ok(())
}

fn gate(args: &Args) -> Result<AcceptGate, InputError> {
    let mut gate = AcceptGate::default();
    if args.ground.is_some_and(|z| !z.is_finite()) {
        return Err(InputError::new("--ground must be a finite height in m"));
    }
    gate.point.ground_z_m = args.ground;
    if let Some(values) = &args.bounds {
        let wrong =
            || InputError::new("--bounds wants six numbers X0,Y0,Z0,X1,Y1,Z1 with X0 < X1, Y0 < Y1, Z0 < Z1");
        let &[x0, y0, z0, x1, y1, z1] = values.as_slice() else {
            return Err(wrong());
        };
        if !(x0 < x1 && y0 < y1 && z0 < z1) {
            return Err(wrong());
        }
        let corner = |x, y, z| Position::new(x, y, z).map_err(|_| wrong());
        gate.point.bounds = Some(Bounds {
            min: corner(x0, y0, z0)?,
            max: corner(x1, y1, z1)?,
        });
    }
    Ok(gate)
}

fn classify(
    index: usize,
    link: &Link,
    judge: &Judge<'_>,
    gate: &AcceptGate,
    sigmas: &Sigmas,
    ignore_aod: bool,
) -> Result<Line, String> {
    let ends: Ends = measurement::ends(link, sigmas).map_err(|e| e.to_string())?;
    let paths = link.paths.iter().enumerate().map(|(j, path)| {
        let mut measured = measurement::path(path, sigmas).map_err(|e| format!("path {j}: {e}"))?;
        if ignore_aod {
            measured.aod = None;
        }
        Ok(received(measured, path))
    });
    let paths: Vec<Received> = paths.collect::<Result<_, String>>()?;
    let judged = judge.link(&ends, &paths)?;
    let lines = judged
        .paths
        .iter()
        .zip(&paths)
        .enumerate()
        .map(|(path, (p, received))| PathLine {
            path,
            state: p.map(|p| p.state()),
            first_order: p.map(|p| p.first_order),
            accepted: p.is_some_and(|p| match judge {
                Judge::Best(_) => {
                    p.is_first_order(gate.min_probability) && has_point(&ends, received, &gate.point)
                }
                // The paper maps the strongest path of a first-order link, and knows nothing of the others.
                Judge::Paper(_) => p.is_first_order(0.0) && has_point(&ends, received, &Gates::open()),
            }),
        });
    Ok(Line {
        link: index,
        state: judged.link.map_or(LinkState::Outage, |p| p.state()) as u8,
        probabilities: judged.link.map(Probabilities::to_array),
        paths: lines.collect(),
    })
}

/// Whether the closed form has a point that passes the gates.
fn has_point(ends: &Ends, received: &Received, gates: &Gates) -> bool {
    matches!(
        solve(ends, &received.path, Form::Vector, gates),
        Ok(Verdict::Accepted(_))
    )
}

/// What stands over the lines of [`print`].
fn print_header(out: &mut impl Write) -> std::io::Result<()> {
    writeln!(
        out,
        "{:>5} {:>4}  {:<13}  {:>16}  map",
        "link", "path", "state", "P(first order)"
    )
}

/// A link for people: a line a path, or one for an outage.
fn print(out: &mut impl Write, line: &Line) -> std::io::Result<()> {
    let link = line.link;
    if line.paths.is_empty() {
        return writeln!(out, "{link:>5} {:>4}  {:<13}  {:>16}  -", "-", STATES[0], "-");
    }
    for path in &line.paths {
        let state = path.state.map_or("-", |state| STATES[state as usize]);
        let probability = path
            .first_order
            .map_or_else(|| "-".to_owned(), |p| format!("{p:.3}"));
        let map = if path.accepted { "accepted" } else { "-" };
        writeln!(
            out,
            "{link:>5} {:>4}  {state:<13}  {probability:>16}  {map}",
            path.path
        )?;
    }
    Ok(())
}

const STATES: [&str; 4] = ["outage", "line of sight", "first order", "higher order"];

/// What came out, and how it compares where the file knows the orders.
#[derive(Default)]
struct Tally {
    /// True state (0..=3) by found state.
    links: [[usize; 4]; 4],
    unknown: [usize; 4],
    accepted: usize,
    accepted_first: usize,
    first: usize,
    known: bool,
}

impl Tally {
    fn add(&mut self, link: &Link, line: &Line) {
        let found = usize::from(line.state.min(3));
        let class = |order: Option<u8>| order.map(|order| usize::from(order.min(2)) + 1);
        let truth = match link.paths.first() {
            None => Some(0),
            Some(path) => class(path.order),
        };
        match truth {
            Some(truth) => self.links[truth][found] += 1,
            None => self.unknown[found] += 1,
        }
        for (path, line) in link.paths.iter().zip(&line.paths) {
            let first = path.order == Some(1);
            self.known |= path.order.is_some();
            self.first += usize::from(first);
            self.accepted += usize::from(line.accepted);
            self.accepted_first += usize::from(line.accepted && first);
        }
    }
}

impl std::fmt::Display for Tally {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut table = Table::new(["true state", STATES[0], STATES[1], STATES[2], STATES[3]]);
        let rows = STATES
            .iter()
            .zip(&self.links)
            .chain([(&"unknown", &self.unknown)]);
        for (name, counts) in rows.filter(|(_, counts)| counts.iter().any(|n| *n > 0)) {
            table.row(
                [(*name).to_owned()]
                    .into_iter()
                    .chain(counts.iter().map(ToString::to_string)),
            );
        }
        write!(f, "{table}")?;
        let heard: usize = self.links[1..].iter().flatten().sum();
        let right: usize = (1..4).map(|i| self.links[i][i]).sum();
        if heard > 0 {
            writeln!(
                f,
                "links with a path classified rightly: {right} of {heard} ({:.1} %)",
                100.0 * right as f64 / heard as f64
            )?;
        }
        write!(f, "accepted for the map: {} paths", self.accepted)?;
        if self.known {
            write!(
                f,
                ", {} of correct order ({:.1} %); {} first-order paths in all",
                self.accepted_first,
                100.0 * self.accepted_first as f64 / self.accepted.max(1) as f64,
                self.first
            )?;
        }
        Ok(())
    }
}
