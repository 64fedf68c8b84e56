//! The time of the flight: figures that count, and a strip of link states under the error of the position.

use std::fmt::Write as _;

use super::keyframes::Keyframes;
use super::points::{self, MapPoint};
use crate::evaluation::Evaluation;
use crate::flight_log::{FlightLog, SweepRecord};

/// The figures change this often, of a flight of 1.
const READOUTS: u32 = 120;
/// Where the figures begin, and what they count.
const COUNTS: [(f64, &str); 4] = [
    (560.0, "time"),
    (662.0, "paths"),
    (762.0, "points"),
    (862.0, "surfaces"),
];
/// The strip: left, right, top of the error, bottom of the error, bottom of the states.
const LEFT: f64 = 150.0;
const RIGHT: f64 = 880.0;
const TOP: f64 = 494.0;
const FLOOR: f64 = 540.0;
const STATES: f64 = 552.0;
/// Places of the line of errors at most.
const MOST_PLACES: usize = 365;

/// Time, paths and points so far, in the upper right corner.
pub(super) fn readouts(log: &FlightLog, points: &[MapPoint], keyframes: &mut Keyframes) -> String {
    let (Some(first), Some(last)) = (log.sweeps.first(), log.sweeps.last()) else {
        return format!(
            r#"<text x="{RIGHT}" y="28" text-anchor="end" class="count">no sweep was flown</text>"#
        );
    };
    let mut body = String::new();
    let step_s = (last.time_s - first.time_s) / f64::from(READOUTS);
    let time_s = |k: u32| first.time_s + f64::from(k) * step_s;
    let steps = if step_s > 0.0 {
        0..=READOUTS
    } else {
        READOUTS..=READOUTS
    };
    for k in steps {
        let is_last = k == READOUTS;
        let now_s = if is_last { last.time_s } else { time_s(k) };
        let paths: usize = log
            .sweeps
            .iter()
            .take_while(|sweep| sweep.time_s <= now_s)
            .map(|sweep| sweep.estimate.paths.len())
            .sum();
        let name = keyframes.between(time_s(k), (!is_last).then(|| time_s(k + 1)));
        let so_far = points::until(points, now_s);
        let opacity = u8::from(is_last);
        let _ = write!(
            body,
            r#"<g class="step count" opacity="{opacity}" style="animation-name:{name}"><text x="{}" y="28">{now_s:.0} s</text><text x="{}" y="28">{paths}</text><text x="{}" y="28">{}</text><text x="{}" y="28">{}</text></g>"#,
            COUNTS[0].0,
            COUNTS[1].0,
            COUNTS[2].0,
            so_far.len(),
            COUNTS[3].0,
            points::surfaces(so_far)
        );
    }
    for (left, name) in COUNTS {
        let _ = write!(
            body,
            r#"<text x="{}" y="28" text-anchor="end" class="small">{name}</text>"#,
            left - 6.0
        );
    }
    body
}

/// The strip, with a mark that runs along it.
pub(super) fn strip(log: &FlightLog, evaluation: &Evaluation, keyframes: &mut Keyframes) -> String {
    let x = |share: f64| LEFT + (RIGHT - LEFT) * share;
    let mut body = String::new();
    let state = |sweep: &SweepRecord| sweep.estimate.link.map(|link| link.state.min(3));
    let mut from = LEFT;
    for run in log.sweeps.chunk_by(|a, b| state(a) == state(b)) {
        let to = x(keyframes.share(run[run.len() - 1].time_s));
        if let Some(state) = state(&run[0]) {
            let _ = write!(
                body,
                r#"<rect class="s{state}" x="{from:.1}" y="{FLOOR}" width="{:.1}" height="{}"/>"#,
                (to - from).max(0.5),
                STATES - FLOOR
            );
        }
        from = to;
    }
    body += &errors(evaluation, keyframes);
    body += &labels();
    if let (Some(first), Some(last)) = (log.sweeps.first(), log.sweeps.last()) {
        let places = [(first.time_s, LEFT), (last.time_s, RIGHT)];
        let steps = places.map(|(time_s, x)| (time_s, format!("translateX({x}px)")));
        let name = keyframes.through("transform", steps.into_iter());
        let _ = write!(
            body,
            r#"<path class="now move" style="transform:translateX({RIGHT}px);animation-name:{name}" d="M0 {TOP}V{}"/>"#,
            STATES + 4.0
        );
    }
    body
}

/// The error of the position over time, as high as its largest value.
fn errors(evaluation: &Evaluation, keyframes: &Keyframes) -> String {
    let errors: Vec<(f64, f64)> = evaluation
        .pose_errors
        .iter()
        .map(|error| (error.time_s, error.position_m.norm()))
        .collect();
    let largest_m = errors.iter().map(|(_, off_m)| *off_m).fold(0.0, f64::max);
    if largest_m <= 0.0 {
        return String::new();
    }
    let mut path = String::new();
    // The largest of each bunch: a peak must not vanish.
    for bunch in errors.chunks(errors.len().div_ceil(MOST_PLACES)) {
        if let Some((time_s, off_m)) = bunch.iter().max_by(|a, b| a.1.total_cmp(&b.1)) {
            let x = LEFT + (RIGHT - LEFT) * keyframes.share(*time_s);
            let y = FLOOR - 4.0 - (FLOOR - 4.0 - TOP) * off_m / largest_m;
            let _ = write!(path, "{}{x:.1} {y:.1}", if path.is_empty() { 'M' } else { 'L' });
        }
    }
    format!(
        r#"<path class="error" d="{path}"/><text class="small" x="20" y="{}">up to {largest_m:.1} m</text>"#,
        TOP + 26.0
    )
}

/// What the strip shows.
fn labels() -> String {
    const STATES_OF: [(u8, &str); 4] = [
        (1, "line of sight"),
        (2, "one reflection"),
        (3, "more"),
        (0, "outage"),
    ];
    let mut body = format!(
        r#"<text class="small" x="20" y="{}">position error</text><text class="small" x="20" y="{}">link state</text>"#,
        TOP + 10.0,
        STATES - 1.0
    );
    let mut x = LEFT;
    for (state, name) in STATES_OF {
        let _ = write!(
            body,
            r#"<rect class="s{state}" x="{x:.0}" y="{}" width="10" height="10"/><text class="small" x="{:.0}" y="{}">{name}</text>"#,
            STATES + 9.0,
            x + 15.0,
            STATES + 18.0
        );
        x += 40.0 + 7.0 * name.len() as f64;
    }
    body
}
