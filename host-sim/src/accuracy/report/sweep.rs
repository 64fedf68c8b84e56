//! Whole sweeps.

use super::{Case, Report, Rows, Run, each, interval, millimetres, percent};
use crate::accuracy::{Mode, departures, false_alarms, scenes};

/// False alarms.
pub(super) fn noise(run: &Run<'_>, n: usize) -> Report {
    let header = [
        "noise, mode",
        "sweeps",
        "with a false path",
        "share",
        "95 % interval",
    ];
    let mut rows = Rows::new(Case::Noise, header);
    for (mode, _) in each(run.modes, 1) {
        let sweeps = if mode == Mode::Best { 10 * n } else { n };
        let r = false_alarms(mode, sweeps, run.seed);
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
        (run.tick)();
    }
    rows.done()
}

/// Nine paths over 30 dB.
pub(super) fn nine_paths(run: &Run<'_>, n: usize) -> Report {
    let mut rows = Rows::new(
        Case::Scenes,
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
    for (mode, i) in each(run.modes, 2) {
        let r = scenes(mode, [0.0, 20.0][i], n, run.seed);
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
        (run.tick)();
    }
    rows.done()
}

/// Angle of departure.
pub(super) fn departure(run: &Run<'_>, n: usize) -> Report {
    let header = [
        "departure, mode",
        "SNR dB",
        "rms deg",
        "median deg",
        "error / own sigma",
    ];
    let mut rows = Rows::new(Case::Departure, header);
    for (mode, i) in each(run.modes, 3) {
        let r = departures(mode, [0.0, 10.0, 20.0][i], n, run.seed);
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
        (run.tick)();
    }
    rows.done()
}
