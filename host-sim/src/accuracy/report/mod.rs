//! The cases as tables, with the figures that path estimation must reach.

mod beam;
mod close;
mod range_rates;
mod sweep;

use serde::Serialize;
use serde_json::Value;

use super::Mode;
use crate::table::Table;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Case {
    /// One path at several SNRs: RMSE over the Cramer-Rao bound, and absolute errors
    Single,
    /// One weak path: how often it is found
    Detection,
    /// One weak path in a flight, where beams take turns: how often it is found within three sweeps (best mode only)
    Revisit,
    /// How fast a path grows, told by its pilots
    RangeRates,
    /// Sweeps of noise alone
    Noise,
    /// Fixed point against the double-precision twin, paired trials (best mode only)
    Twin,
    /// Nine paths over 30 dB in a sweep of 72 beams
    Scenes,
    /// Line of sight beside a ground bounce
    Bounce,
    /// Two close paths in one beam
    Pairs,
    /// A corner above the ground: four paths within a tap
    Corner,
    /// Angle of departure from the energies of the beams
    Departure,
}

impl Case {
    /// Trials of the case in units of the command's `--trials`.
    fn trials(self, unit: usize) -> usize {
        match self {
            Self::Single | Self::Twin | Self::Detection | Self::Revisit | Self::RangeRates => 10 * unit,
            Self::Noise | Self::Bounce | Self::Corner => 2 * unit,
            Self::Scenes | Self::Pairs | Self::Departure => unit,
        }
    }
}

/// A figure that the best mode must reach.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Target {
    /// Of what, with the figure asked for.
    pub what: String,
    /// What was measured.
    pub measured: String,
    /// Whether it is reached.
    pub met: bool,
}

/// Rows of one case.
#[derive(Clone, Debug)]
pub struct Report {
    /// For people.
    pub table: Table,
    /// One object a row, with `case` and `mode`.
    pub lines: Vec<Value>,
    /// Figures to be reached.
    pub targets: Vec<Target>,
}

impl Case {
    /// All cases, in the order of the report.
    pub const ALL: [Self; 11] = [
        Self::Single,
        Self::Detection,
        Self::Revisit,
        Self::RangeRates,
        Self::Noise,
        Self::Twin,
        Self::Scenes,
        Self::Bounce,
        Self::Pairs,
        Self::Corner,
        Self::Departure,
    ];

    /// Runs the case for each mode. `unit` scales the number of trials, `tick` is called after every row.
    pub fn run(self, modes: &[Mode], unit: usize, seed: u64, tick: impl Fn()) -> Report {
        let n = self.trials(unit);
        let run = &Run {
            modes,
            seed,
            tick: &tick,
        };
        match self {
            Self::Single => beam::single_path(run, n),
            Self::Detection => beam::weak_path(run, n),
            Self::Revisit => beam::revisited(run, n),
            Self::RangeRates => range_rates::rates(run, n),
            Self::Noise => sweep::noise(run, n),
            Self::Twin => beam::fixed_point(run, n),
            Self::Scenes => sweep::nine_paths(run, n),
            Self::Bounce => close::ground_bounce(run, n),
            Self::Pairs => close::close_pairs(run, n),
            Self::Corner => close::corners(run, n),
            Self::Departure => sweep::departure(run, n),
        }
    }

    /// Rows of the case, for a progress bar.
    pub fn rows(self, modes: &[Mode]) -> usize {
        let each = match self {
            Self::Single => beam::SNR_DB.len(),
            Self::Detection => beam::WEAK_DB.len(),
            Self::Revisit => return usize::from(modes.contains(&Mode::Best)),
            Self::RangeRates => return usize::from(modes.contains(&Mode::Best)) * range_rates::ROWS.len(),
            Self::Noise => 1,
            Self::Twin => return beam::TWIN_DB.len() * usize::from(modes.contains(&Mode::Best)),
            Self::Scenes => 2,
            Self::Bounce | Self::Departure => 3,
            Self::Corner => close::CORNERS_M.len(),
            Self::Pairs => 2 * close::SEPARATIONS.len(),
        };
        each * modes.len()
    }
}

/// What the cases share.
struct Run<'a> {
    modes: &'a [Mode],
    seed: u64,
    tick: &'a dyn Fn(),
}

impl Run<'_> {
    fn best(&self) -> bool {
        self.modes.contains(&Mode::Best)
    }
}

/// Each mode with each of so many inputs.
fn each(modes: &[Mode], inputs: usize) -> impl Iterator<Item = (Mode, usize)> {
    modes
        .iter()
        .flat_map(move |mode| (0..inputs).map(move |i| (*mode, i)))
}

/// A report under way.
struct Rows {
    case: Case,
    report: Report,
}

impl Rows {
    fn new<const N: usize>(case: Case, header: [&str; N]) -> Self {
        let report = Report {
            table: Table::new(header),
            lines: Vec::new(),
            targets: Vec::new(),
        };
        Self { case, report }
    }

    fn add(&mut self, mode: Mode, figures: &impl Serialize, cells: Vec<String>) {
        let case = format!("{:?}", self.case).to_lowercase();
        let name = mode.name();
        let mut line = serde_json::json!({ "case": case, "mode": name });
        if let (Some(line), Ok(Value::Object(figures))) =
            (line.as_object_mut(), serde_json::to_value(figures))
        {
            line.extend(figures);
        }
        self.report.lines.push(line);
        self.report.table.row([name.to_owned()].into_iter().chain(cells));
    }

    fn target(&mut self, what: &str, measured: String, met: bool) {
        let what = what.to_owned();
        self.report.targets.push(Target { what, measured, met });
    }

    fn done(self) -> Report {
        self.report
    }
}

/// Three digits, or a dash where there is no figure.
fn figure(value: f64) -> String {
    if value.is_nan() {
        "-".into()
    } else {
        format!("{value:.3}")
    }
}

fn millimetres(metres: f64) -> String {
    if metres.is_nan() {
        "-".into()
    } else {
        format!("{:.2}", 1e3 * metres)
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{:.2} to {:.2} %", 100.0 * low, 100.0 * high)
}
