//! The cases as tables, with the figures that path estimation must reach.

use serde::Serialize;
use serde_json::Value;

use super::{Mode, bounce, departures, detection, false_alarms, loss, pairs, scenes, single};
use crate::table::Table;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Case {
    /// One path at several SNRs: RMSE over the Cramer-Rao bound, and absolute errors
    Single,
    /// One weak path: how often it is found
    Detection,
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
    /// Angle of departure from the energies of the beams
    Departure,
}

/// Trials of the case in units of the command's `--trials`.
impl Case {
    fn trials(self, unit: usize) -> usize {
        match self {
            Self::Single | Self::Twin => 10 * unit,
            Self::Detection => 40 * unit,
            Self::Noise => 20 * unit,
            Self::Bounce => 2 * unit,
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

const SNR_DB: [f64; 9] = [-20.0, -18.0, -15.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0];
const WEAK_DB: [f64; 4] = [-24.0, -22.0, -20.0, -18.0];
const TWIN_DB: [f64; 6] = [-15.0, 0.0, 10.0, 20.0, 30.0, 40.0];
/// Separations of signal.md section 3.3: m, deg, and the share that its joint fit finds with equal power and at -10 dB.
const SEPARATIONS: [(f64, f64, [f64; 2]); 12] = [
    (0.3, 0.0, [1.00, 1.00]),
    (0.75, 0.0, [0.92, 1.00]),
    (1.5, 0.0, [0.96, 1.00]),
    (0.0, 5.0, [0.72, 0.60]),
    (0.0, 10.0, [0.60, 0.80]),
    (0.0, 15.0, [0.68, 0.84]),
    (0.0, 25.0, [0.88, 0.88]),
    (0.0, 40.0, [0.84, 1.00]),
    (0.6, 10.0, [0.96, 1.00]),
    (0.6, 22.0, [1.00, 1.00]),
    (1.5, 10.0, [1.00, 1.00]),
    (3.0, 10.0, [1.00, 1.00]),
];

impl Case {
    /// All cases, in the order of the report.
    pub const ALL: [Self; 8] = [
        Self::Single,
        Self::Detection,
        Self::Noise,
        Self::Twin,
        Self::Scenes,
        Self::Bounce,
        Self::Pairs,
        Self::Departure,
    ];

    /// Runs the case for each mode. `unit` scales the number of trials, `tick` is called after every row.
    pub fn run(self, modes: &[Mode], unit: usize, seed: u64, tick: impl Fn()) -> Report {
        let n = self.trials(unit);
        let each = |inputs: usize| modes.iter().flat_map(move |m| (0..inputs).map(move |i| (*m, i)));
        match self {
            Self::Single => {
                let mut rows = Rows::new(
                    self,
                    [
                        "one path, mode",
                        "SNR dB",
                        "detected",
                        "outliers",
                        "c tau RMSE/bound",
                        "angle 1",
                        "angle 2",
                        "NEES/3",
                        "c tau mm 50 % / RMSE",
                        "angle deg 50 % / RMSE",
                    ],
                );
                let mut worst = 0.0_f64;
                for (mode, i) in each(SNR_DB.len()) {
                    let r = single(mode, SNR_DB[i], n, seed);
                    if mode == Mode::Best && r.snr_db >= -15.0 {
                        worst = r.ratio.iter().fold(worst, |w, x| w.max(*x));
                    }
                    let mut cells = vec![
                        format!("{:.0}", r.snr_db),
                        percent(r.detected),
                        percent(r.outliers),
                    ];
                    cells.extend(r.ratio.map(figure));
                    cells.push(figure(r.nees));
                    cells.push(format!(
                        "{} / {}",
                        millimetres(r.range_m[0]),
                        millimetres(r.range_m[1])
                    ));
                    cells.push(format!("{:.3} / {:.3}", r.angle_deg[0], r.angle_deg[1]));
                    rows.add(mode, &r, cells);
                    tick();
                }
                if modes.contains(&Mode::Best) {
                    let what = "one path, -15 to 40 dB: RMSE over bound <= 1.10, each parameter";
                    rows.target(what, format!("{worst:.3}"), worst <= 1.10);
                }
                rows.done()
            }
            Self::Detection => {
                let header = [
                    "weak path, mode",
                    "SNR dB",
                    "trials",
                    "detected",
                    "95 % interval",
                    "within 1 m",
                ];
                let mut rows = Rows::new(self, header);
                for (mode, i) in each(WEAK_DB.len()) {
                    let r = detection(mode, WEAK_DB[i], n, seed);
                    let cells = vec![
                        format!("{:.0}", r.snr_db),
                        r.trials.to_string(),
                        percent(r.detected),
                        interval(r.interval),
                        percent(r.right_range),
                    ];
                    if mode == Mode::Best && r.snr_db == -20.0 {
                        let measured = format!("{:.3} ({})", r.detected, interval(r.interval));
                        rows.target("one path, -20 dB: detection >= 0.9", measured, r.detected >= 0.9);
                    }
                    rows.add(mode, &r, cells);
                    tick();
                }
                rows.done()
            }
            Self::Noise => {
                let header = [
                    "noise, mode",
                    "sweeps",
                    "with a false path",
                    "share",
                    "95 % interval",
                ];
                let mut rows = Rows::new(self, header);
                for (mode, _) in each(1) {
                    let r = false_alarms(mode, n, seed);
                    let share = r.sweeps_with_paths as f64 / r.sweeps as f64;
                    let cells = vec![
                        r.sweeps.to_string(),
                        r.sweeps_with_paths.to_string(),
                        percent(share),
                        interval(r.interval),
                    ];
                    if mode == Mode::Best {
                        let measured = format!("{share:.4} ({})", interval(r.interval));
                        rows.target("noise: false alarms <= 0.01 a sweep", measured, share <= 0.01);
                    }
                    rows.add(mode, &r, cells);
                    tick();
                }
                rows.done()
            }
            Self::Twin => {
                let mut rows = Rows::new(
                    self,
                    [
                        "fixed point, mode",
                        "SNR dB",
                        "trials",
                        "RMSE/bound",
                        "twin",
                        "loss",
                        "loss with converter",
                    ],
                );
                let mut worst = f64::NEG_INFINITY;
                for snr_db in TWIN_DB.into_iter().filter(|_| modes.contains(&Mode::Best)) {
                    let r = loss(snr_db, n, seed);
                    if snr_db <= 30.0 {
                        worst = worst.max(r.loss[0]);
                    }
                    let share =
                        |[value, sigma]: [f64; 2]| format!("{:+.2} +- {:.2} %", 100.0 * value, 100.0 * sigma);
                    let cells = vec![
                        format!("{snr_db:.0}"),
                        r.trials.to_string(),
                        figure(r.fixed),
                        figure(r.twin),
                        share(r.loss),
                        share(r.with_converter),
                    ];
                    rows.add(Mode::Best, &r, cells);
                    tick();
                }
                if modes.contains(&Mode::Best) {
                    let what = "fixed point against its float64 twin, up to 30 dB: RMSE loss <= 2 %";
                    rows.target(what, format!("{:.2} %", 100.0 * worst), worst <= 0.02);
                }
                rows.done()
            }
            Self::Scenes => {
                let mut rows = Rows::new(
                    self,
                    [
                        "nine paths, mode",
                        "SNR dB",
                        "scenes",
                        "0-10 dB down",
                        "10-20",
                        "20-30",
                        "false a scene",
                        "strongest right",
                        "its c tau mm",
                        "angle deg",
                    ],
                );
                for (mode, i) in each(2) {
                    let r = scenes(mode, [0.0, 20.0][i], n, seed);
                    let mut cells = vec![format!("{:.0}", r.snr_db), r.scenes.to_string()];
                    cells.extend(r.detected.map(|x| format!("{x:.3}")));
                    cells.push(format!("{:.3}", r.false_alarms));
                    cells.push(percent(r.strongest[0]));
                    cells.push(millimetres(r.strongest[1]));
                    cells.push(format!("{:.3}", r.strongest[2]));
                    if mode == Mode::Best && i == 1 {
                        let [a, b, c] = r.detected;
                        let what = "nine paths, 20 dB: detection >= 1.00 / 0.99 / 0.94";
                        rows.target(
                            what,
                            format!("{a:.3} / {b:.3} / {c:.3}"),
                            a >= 1.0 && b >= 0.99 && c >= 0.94,
                        );
                        let met = r.false_alarms <= 0.05;
                        rows.target(
                            "nine paths, 20 dB: false alarms <= 0.05 a scene",
                            format!("{:.3}", r.false_alarms),
                            met,
                        );
                    }
                    rows.add(mode, &r, cells);
                    tick();
                }
                rows.done()
            }
            Self::Bounce => {
                let mut rows = Rows::new(
                    self,
                    [
                        "LOS + bounce, mode",
                        "m",
                        "c tau mm 50 / 90 %",
                        "bound mm",
                        "angle deg 50 / 90 %",
                        "bound deg",
                    ],
                );
                for (mode, i) in each(3) {
                    let (distance_m, limit_m) = [(20.0, 2e-3), (50.0, 2e-3), (100.0, 4e-3)][i];
                    let r = bounce(mode, distance_m, n, seed);
                    let cells = vec![
                        format!("{distance_m:.0}"),
                        format!("{} / {}", millimetres(r.range_m[0]), millimetres(r.range_m[1])),
                        millimetres(r.bound[0]),
                        format!("{:.3} / {:.3}", r.angle_deg[0], r.angle_deg[1]),
                        format!("{:.3}", r.bound[1]),
                    ];
                    if mode == Mode::Best {
                        rows.target(
                            &format!(
                                "LOS beside its ground bounce, {distance_m:.0} m: median <= {:.0} mm, 0.03 deg",
                                1e3 * limit_m
                            ),
                            format!("{} mm, {:.3} deg", millimetres(r.range_m[0]), r.angle_deg[0]),
                            r.range_m[0] <= limit_m && r.angle_deg[0] <= 0.03,
                        );
                    }
                    rows.add(mode, &r, cells);
                    tick();
                }
                rows.done()
            }
            Self::Pairs => {
                let header = [
                    "pair, mode",
                    "apart m, deg",
                    "second dB",
                    "both found",
                    "joint fit of the design",
                    "possible by the bound",
                ];
                let mut rows = Rows::new(self, header);
                let (mut met, mut margin) = (0, f64::INFINITY);
                for (mode, i) in each(2 * SEPARATIONS.len()) {
                    let (apart_m, apart_deg, expected) = SEPARATIONS[i / 2];
                    let (second_db, expected) = ([0.0, -10.0][i % 2], expected[i % 2]);
                    let r = pairs(mode, apart_m, apart_deg, second_db, n, seed);
                    if mode == Mode::Best {
                        met += usize::from(r.both >= expected);
                        margin = margin.min(r.both - expected);
                    }
                    let cells = vec![
                        format!("{apart_m} m, {apart_deg} deg"),
                        format!("{second_db:.0}"),
                        format!("{:.2}", r.both),
                        format!("{expected:.2}"),
                        format!("{:.2}", r.possible),
                    ];
                    rows.add(mode, &r, cells);
                    tick();
                }
                if modes.contains(&Mode::Best) {
                    let all = 2 * SEPARATIONS.len();
                    let measured = format!("{met} of {all}, least margin {margin:+.2}");
                    rows.target(
                        "pairs: at least the joint column of the design",
                        measured,
                        met == all,
                    );
                }
                rows.done()
            }
            Self::Departure => {
                let header = [
                    "departure, mode",
                    "SNR dB",
                    "rms deg",
                    "median deg",
                    "error / own sigma",
                ];
                let mut rows = Rows::new(self, header);
                for (mode, i) in each(3) {
                    let r = departures(mode, [0.0, 10.0, 20.0][i], n, seed);
                    let cells = vec![
                        format!("{:.0}", r.snr_db),
                        format!("{:.3}", r.rms_deg),
                        format!("{:.3}", r.median_deg),
                        format!("{:.2}", r.honesty),
                    ];
                    if mode == Mode::Best && i == 1 {
                        let what = "angle of departure of the strongest path, 10 dB: <= 0.5 deg rms";
                        rows.target(what, format!("{:.3} deg", r.rms_deg), r.rms_deg <= 0.5);
                    }
                    rows.add(mode, &r, cells);
                    tick();
                }
                rows.done()
            }
        }
    }

    /// Rows of the case, for a progress bar.
    pub fn rows(self, modes: &[Mode]) -> usize {
        let each = match self {
            Self::Single => SNR_DB.len(),
            Self::Detection => WEAK_DB.len(),
            Self::Noise => 1,
            Self::Twin => return TWIN_DB.len() * usize::from(modes.contains(&Mode::Best)),
            Self::Scenes => 2,
            Self::Bounce | Self::Departure => 3,
            Self::Pairs => 2 * SEPARATIONS.len(),
        };
        each * modes.len()
    }
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
        let name = format!("{mode:?}").to_lowercase();
        let mut line = serde_json::json!({ "case": case, "mode": name });
        if let (Some(line), Ok(Value::Object(figures))) =
            (line.as_object_mut(), serde_json::to_value(figures))
        {
            line.extend(figures);
        }
        self.report.lines.push(line);
        self.report.table.row([name].into_iter().chain(cells));
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
