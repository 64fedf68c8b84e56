//! One path in one beam.

use super::{Case, Report, Rows, Run, each, figure, interval, millimetres, percent};
use crate::accuracy::{Mode, detection, loss, revisit, single};

pub(super) const SNR_DB: [f64; 9] = [-20.0, -18.0, -15.0, -10.0, 0.0, 10.0, 20.0, 30.0, 40.0];
pub(super) const WEAK_DB: [f64; 4] = [-24.0, -22.0, -20.0, -18.0];
pub(super) const TWIN_DB: [f64; 6] = [-15.0, 0.0, 10.0, 20.0, 30.0, 40.0];
/// One path: RMSE over the bound, absolute errors.
pub(super) fn single_path(run: &Run<'_>, n: usize) -> Report {
    let mut rows = Rows::new(
        Case::Single,
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
    for (mode, i) in each(run.modes, SNR_DB.len()) {
        let trials = if mode == Mode::Best { 4 * n } else { n };
        let r = single(mode, SNR_DB[i], trials, run.seed);
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
        (run.tick)();
    }
    if run.best() {
        let what = "one path, -15 to 40 dB: RMSE over bound <= 1.10, each parameter";
        rows.target(what, format!("{worst:.3}"), worst <= 1.10);
    }
    rows.done()
}

/// One weak path: how often it is found.
pub(super) fn weak_path(run: &Run<'_>, n: usize) -> Report {
    let header = [
        "weak path, mode",
        "SNR dB",
        "trials",
        "detected",
        "95 % interval",
        "within 1 m",
    ];
    let mut rows = Rows::new(Case::Detection, header);
    for (mode, i) in each(run.modes, WEAK_DB.len()) {
        // The figure asked for lies near what is possible: many trials tell.
        let asked = mode == Mode::Best && WEAK_DB[i] == -20.0;
        let trials = if asked { 20 * n } else { n };
        let r = detection(mode, WEAK_DB[i], trials, run.seed);
        let cells = vec![
            format!("{:.0}", r.snr_db),
            r.trials.to_string(),
            percent(r.detected),
            interval(r.interval),
            percent(r.right_range),
        ];
        if asked {
            let measured = format!("{:.3} ({})", r.detected, interval(r.interval));
            rows.target("one path, -20 dB: detection >= 0.9", measured, r.detected >= 0.9);
        }
        rows.add(mode, &r, cells);
        (run.tick)();
    }
    rows.done()
}

/// One weak path in a flight, over three sweeps.
pub(super) fn revisited(run: &Run<'_>, n: usize) -> Report {
    let header = [
        "three sweeps, mode",
        "SNR dB",
        "elevation deg",
        "trials",
        "first / second / third",
        "one of three",
        "95 % interval",
        "possible: one look",
        "three",
        "their sum",
    ];
    let mut rows = Rows::new(Case::Revisit, header);
    if !run.best() {
        return rows.done();
    }
    let bands = revisit(-20.0, n, run.seed);
    for r in &bands {
        let [low, high] = r.elevation_deg;
        let mut cells = vec![
            format!("{:.0}", r.snr_db),
            format!("{low:.0} to {high:.0}"),
            r.trials.to_string(),
            r.by_sweep.map(percent).join(" / "),
            percent(r.detected),
            interval(r.interval),
        ];
        cells.extend(r.possible.map(percent));
        rows.add(Mode::Best, r, cells);
    }
    if let Some(all) = bands.first() {
        let [one_look, ..] = all.possible;
        let what = "one path, -20 dB, three sweeps: found >= 0.98, or what the energy of one look allows";
        let measured = format!("{:.3} ({}), {one_look:.3}", all.detected, interval(all.interval));
        rows.target(what, measured, all.detected >= one_look.min(0.98));
    }
    (run.tick)();
    rows.done()
}

/// Fixed point against the double-precision twin.
pub(super) fn fixed_point(run: &Run<'_>, n: usize) -> Report {
    let mut rows = Rows::new(
        Case::Twin,
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
    for snr_db in TWIN_DB.into_iter().filter(|_| run.best()) {
        let r = loss(snr_db, n, run.seed);
        if snr_db <= 30.0 {
            worst = worst.max(r.loss[0]);
        }
        let share = |[value, sigma]: [f64; 2]| format!("{:+.2} +- {:.2} %", 100.0 * value, 100.0 * sigma);
        let cells = vec![
            format!("{snr_db:.0}"),
            r.trials.to_string(),
            figure(r.fixed),
            figure(r.twin),
            share(r.loss),
            share(r.with_converter),
        ];
        rows.add(Mode::Best, &r, cells);
        (run.tick)();
    }
    if run.best() {
        let what = "fixed point against its float64 twin, up to 30 dB: RMSE loss <= 2 %";
        rows.target(what, format!("{:.2} %", 100.0 * worst), worst <= 0.02);
    }
    rows.done()
}
