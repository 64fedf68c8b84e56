//! How fast paths grow.

use super::{Case, Report, Rows, Run, figure, percent};
use crate::accuracy::range_rates::Heard;
use crate::accuracy::{Mode, range_rates};

/// What is heard, at which SNR, dB.
pub(super) const ROWS: [(Heard, f64); 11] = [
    (Heard::Alone, -20.0),
    (Heard::Alone, -10.0),
    (Heard::Alone, 0.0),
    (Heard::Alone, 10.0),
    (Heard::Alone, 20.0),
    (Heard::Oscillators, -10.0),
    (Heard::Oscillators, 0.0),
    (Heard::Oscillators, 20.0),
    (Heard::BesideAnother, 0.0),
    (Heard::BesideAnother, 10.0),
    (Heard::BesideAnother, 20.0),
];

/// Rates of one path by its pilots.
pub(super) fn rates(run: &Run<'_>, n: usize) -> Report {
    let header = [
        "range rate, mode",
        "SNR dB",
        "heard",
        "told",
        "error mm/s 50 / 90 %",
        "RMSE/bound",
        "NEES",
    ];
    let mut rows = Rows::new(Case::RangeRates, header);
    if !run.best() {
        return rows.done();
    }
    let (mut worst, mut least) = (0.0_f64, 1.0_f64);
    for (heard, snr_db) in ROWS {
        let r = range_rates(heard, snr_db, n, run.seed);
        if heard == Heard::Alone && snr_db <= 10.0 {
            (worst, least) = (worst.max(r.ratio), least.min(r.told));
        }
        let [half, most] = r.error_m_per_s.map(|m_per_s| format!("{:.1}", 1e3 * m_per_s));
        let cells = vec![
            format!("{snr_db:.0}"),
            heard.name().to_owned(),
            percent(r.told),
            format!("{half} / {most}"),
            figure(r.ratio),
            figure(r.nees),
        ];
        rows.add(Mode::Best, &r, cells);
        (run.tick)();
    }
    let what = "range rate of one path, -20 to 10 dB: told >= 0.95, RMSE over bound <= 1.15";
    let measured = format!("{least:.3}, {worst:.3}");
    rows.target(what, measured, least >= 0.95 && worst <= 1.15);
    rows.done()
}
