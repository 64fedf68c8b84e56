//! Link states over time: one row of coloured cells for what was so, one for what the receiver said.

use std::fmt::Write as _;

use crate::flight_log::FlightLog;

const WIDTH: f64 = 520.0;
const LEFT: f64 = 84.0;
const RIGHT: f64 = 10.0;
const ROW: f64 = 22.0;
const GAP: f64 = 8.0;

/// Names of the states, by number.
pub(super) const STATES: [&str; 4] = ["outage", "line of sight", "first order", "higher order"];

/// The strips as SVG.
pub(super) fn svg(log: &FlightLog) -> String {
    let rows: [(&str, Vec<Option<usize>>); 3] = [
        (
            "true",
            log.sweeps
                .iter()
                .map(|s| s.truth.link_state().map(usize::from))
                .collect(),
        ),
        (
            "estimated",
            log.sweeps
                .iter()
                .map(|s| s.estimate.link.map(|l| usize::from(l.state.min(3))))
                .collect(),
        ),
        (
            "LOS used",
            log.sweeps
                .iter()
                .map(|s| s.estimate.los_used.then_some(1))
                .collect(),
        ),
    ];
    let mut body = String::new();
    for (row, (name, states)) in rows.iter().enumerate() {
        let top = row as f64 * (ROW + GAP);
        let _ = write!(
            body,
            r#"<text class="tick" x="{}" y="{:.1}" text-anchor="end">{name}</text><rect class="frame" x="{LEFT}" y="{top}" width="{}" height="{ROW}"/>"#,
            LEFT - 6.0,
            top + 15.0,
            WIDTH - LEFT - RIGHT,
        );
        body += &cells(states, top);
    }
    let bottom = rows.len() as f64 * (ROW + GAP);
    let end_s = log.sweeps.last().map_or(0.0, |s| s.time_s);
    format!(
        r#"<svg viewBox="0 0 {WIDTH} {:.0}" role="img" aria-label="Link state of every sweep, true and estimated">{body}<text class="tick" x="{LEFT}" y="{y:.1}">0</text><text class="tick" x="{:.1}" y="{y:.1}" text-anchor="end">{end_s:.0} s</text></svg>"#,
        bottom + 18.0,
        WIDTH - RIGHT,
        y = bottom + 8.0,
    )
}

/// Runs of the same state as one rectangle each.
fn cells(states: &[Option<usize>], top: f64) -> String {
    let mut out = String::new();
    let width = (WIDTH - LEFT - RIGHT) / states.len().max(1) as f64;
    let mut start = 0;
    while start < states.len() {
        let run = states[start..]
            .iter()
            .take_while(|s| **s == states[start])
            .count();
        if let Some(state) = states[start] {
            let _ = write!(
                out,
                r#"<rect class="state{state}" x="{:.2}" y="{top}" width="{:.2}" height="{ROW}"><title>{}, sweeps {start} to {}</title></rect>"#,
                LEFT + start as f64 * width,
                run as f64 * width,
                STATES[state],
                start + run - 1
            );
        }
        start += run;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_one_state_is_one_cell() {
        let drawn = cells(&[Some(1), Some(1), None, Some(3)], 0.0);
        assert_eq!(drawn.matches("<rect").count(), 2);
        assert!(
            drawn.contains("line of sight, sweeps 0 to 1") && drawn.contains("higher order, sweeps 3 to 3")
        );
        assert_eq!(cells(&[], 0.0), "");
    }
}
