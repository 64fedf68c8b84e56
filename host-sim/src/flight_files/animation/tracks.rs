//! What moves: the UAV with its tracks, the GMT, and the waves that made points.

use std::fmt::Write as _;

use super::keyframes::Keyframes;
use super::panel::Panel;
use crate::flight_files::page::plan::FASTEST_M_PER_S;
use crate::flight_log::{FlightLog, PointRecord};

/// Places of a track that are drawn at most.
const MOST_PLACES: usize = 240;
/// Length that every track is given, for its dash.
const DASH: f64 = 1000.0;

/// A place at a time, s and m.
type Place = (f64, [f64; 3]);

/// Tracks of one thing: it broke off where nothing is known, and where a list of places jumps.
pub(super) struct Tracks(Vec<Vec<Place>>);

impl Tracks {
    pub(super) fn new(places: impl ExactSizeIterator<Item = (f64, Option<[f64; 3]>)>) -> Self {
        let thin = places.len().div_ceil(MOST_PLACES).max(1);
        let last = places.len().saturating_sub(1);
        let mut runs: Vec<Vec<Place>> = vec![Vec::new()];
        for (k, (time_s, place)) in places.enumerate() {
            if k % thin != 0 && k != last {
                continue;
            }
            let before = runs.last().and_then(|run| run.last());
            let jumps = before.is_some_and(|(before_s, before)| {
                place.is_some_and(|place| {
                    let way_m = libm::hypot(place[0] - before[0], place[1] - before[1]);
                    way_m > FASTEST_M_PER_S * (time_s - before_s)
                })
            });
            if place.is_none() || jumps {
                runs.push(Vec::new());
            }
            if let (Some(place), Some(run)) = (place, runs.last_mut()) {
                run.push((time_s, place));
            }
        }
        runs.retain(|run| !run.is_empty());
        Self(runs)
    }

    /// Whether nothing is known of it.
    pub(super) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    fn places(&self) -> impl Iterator<Item = &Place> {
        self.0.iter().flatten()
    }

    /// Lines that grow with the flight.
    pub(super) fn lines(&self, panel: &Panel, class: &str, keyframes: &mut Keyframes) -> String {
        let mut body = String::new();
        for run in self.0.iter().filter(|run| run.len() > 1) {
            let (mut path, mut ways) = (String::new(), vec![0.0]);
            let at: Vec<[f64; 2]> = run.iter().map(|(_, place)| panel.at(*place)).collect();
            for (k, [x, y]) in at.iter().enumerate() {
                let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
                if k > 0 {
                    ways.push(ways[k - 1] + libm::hypot(x - at[k - 1][0], y - at[k - 1][1]));
                }
            }
            let whole = ways[run.len() - 1].max(1e-9);
            let left = run
                .iter()
                .zip(&ways)
                .map(|((time_s, _), way)| (*time_s, format!("{:.1}", DASH * (1.0 - way / whole))));
            let name = keyframes.through("stroke-dashoffset", left);
            let _ = write!(
                body,
                r#"<path class="track {class} move" style="animation-name:{name}" pathLength="{DASH}" d="{path}"/>"#
            );
        }
        body
    }

    /// A symbol that moves along them.
    pub(super) fn marker(&self, panel: &Panel, symbol: &str, keyframes: &mut Keyframes) -> String {
        let transform = |place: &[f64; 3]| {
            let [x, y] = panel.at(*place);
            format!("translate({x:.1}px,{y:.1}px)")
        };
        let Some((_, last)) = self.places().last() else {
            return String::new();
        };
        let steps = self.places().map(|(time_s, place)| (*time_s, transform(place)));
        let name = keyframes.through("transform", steps);
        format!(
            r##"<use href="#{symbol}" class="move" style="transform:{};animation-name:{name}"/>"##,
            transform(last)
        )
    }
}

/// The ways of the waves that made points, from the GMT over the reflections to the UAV as they were estimated, each in the moment of
/// its sweep.
pub(super) fn waves(log: &FlightLog, panel: &Panel, keyframes: &mut Keyframes) -> String {
    let mut points: Vec<&PointRecord> = log.points.iter().collect();
    points.sort_by_key(|point| (point.sweep, point.path, point.reflection));
    let mut body = String::new();
    for of_sweep in points.chunk_by(|a, b| a.sweep == b.sweep) {
        let ends = log.sweep_of(of_sweep[0]).and_then(|sweep| {
            let estimate = &sweep.estimate;
            Some((estimate.gmt_position_m?, estimate.pose?.position_m))
        });
        let Some((gmt_m, uav_m)) = ends else {
            continue;
        };
        let mut path = String::new();
        for reflections in of_sweep.chunk_by(|a, b| a.path == b.path) {
            let between = reflections.iter().map(|point| point.position_m);
            for (k, place) in [gmt_m].into_iter().chain(between).chain([uav_m]).enumerate() {
                let [x, y] = panel.at(place);
                let _ = write!(path, "{}{x:.1} {y:.1}", if k == 0 { 'M' } else { 'L' });
            }
        }
        let name = keyframes.flash(of_sweep[0].time_s);
        let _ = write!(
            body,
            r#"<path class="wave move" style="animation-name:{name}" d="{path}"/>"#
        );
    }
    body
}
