//! Where the UAV's nose points: along its way, or at the GMT.

use core::f64::consts::PI;

use nalgebra::{Vector1, Vector3};
use serde::{Deserialize, Serialize};

use super::knots::{KNOT_S, SMOOTHING, smooth, still};
use super::{GmtTrack, Limits, Spline};

/// Below this horizontal speed, or this close above the GMT, the heading is held: m/s, m.
const HEADING_SPEED_M_PER_S: f64 = 0.3;
const HEADING_DISTANCE_M: f64 = 1.0;

/// Where the nose points.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Heading {
    /// Along the way: arrays all around the body hear everything.
    #[default]
    Along,
    /// At the GMT, as an array that hears what is before it wants.
    AtGmt,
}

/// The heading that follows the horizontal motion of these control points within the rate limit.
pub(super) fn along(control: &[Vector3<f64>], limits: &Limits) -> Option<Spline<1>> {
    let wanted = (0..control.len()).map(|k| {
        let after = control[(k + 1).min(control.len() - 1)];
        let way = (after - control[k.saturating_sub(1)]) / (2.0 * KNOT_S);
        (libm::hypot(way.x, way.y) > HEADING_SPEED_M_PER_S).then(|| libm::atan2(way.y, way.x))
    });
    within_rate(wanted.collect(), limits)
}

/// The heading that points from where the UAV is to the GMT within the rate limit; while the UAV rests, where the GMT is then.
pub(super) fn at_gmt(
    position_m: &Spline<3>,
    gmt: &GmtTrack,
    limits: &Limits,
    rest_s: f64,
) -> Option<Spline<1>> {
    let count = (position_m.duration_s() / KNOT_S) as usize + 6;
    let wanted = (0..count).map(|k| {
        // A control point counts most two knots before its own number.
        let time_s = KNOT_S * (k.max(still(rest_s)).saturating_sub(2)) as f64;
        let way = gmt.at(time_s).0 - position_m.at(time_s)[0];
        (libm::hypot(way.x, way.y) > HEADING_DISTANCE_M).then(|| libm::atan2(way.y, way.x))
    });
    within_rate(wanted.collect(), limits)
}

/// A smooth heading that turns as wanted, no faster than the limit allows, and is held where nothing is wanted.
fn within_rate(mut wanted: Vec<Option<f64>>, limits: &Limits) -> Option<Spline<1>> {
    let first = wanted.iter().flatten().next().copied().unwrap_or(0.0);
    let mut last = first;
    for heading in &mut wanted {
        let turn = heading.map_or(0.0, |h| h - last);
        last += turn - 2.0 * PI * libm::floor(turn / (2.0 * PI) + 0.5);
        *heading = Some(last);
    }
    let step = 0.9 * limits.heading_rate_dps * PI / 180.0 * KNOT_S;
    let mut held = first;
    let mut points: Vec<Vector1<f64>> = Vec::with_capacity(wanted.len());
    for wanted in wanted.into_iter().flatten() {
        held = wanted.clamp(held - step, held + step);
        points.push(Vector1::new(held));
    }
    for _ in 0..SMOOTHING {
        points = smooth(&points);
    }
    Spline::new(points, KNOT_S)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{FlightConfig, FlightPlan};
    use crate::scene::Scene;

    #[test]
    fn the_nose_points_at_the_gmt_and_rests_while_the_uav_does() {
        let scene = Scene::load("outdoor").expect("built in");
        let config = FlightConfig {
            duration_s: 40.0,
            ..FlightConfig::default()
        };
        let along = FlightPlan::plan(&scene, &config, 3).expect("a flight");
        let config = FlightConfig {
            heading: Heading::AtGmt,
            ..config
        };
        let plan = FlightPlan::plan(&scene, &config, 3).expect("the same flight");
        assert_eq!(plan.gmt(), along.gmt());
        let mut off_deg = Vec::new();
        for k in 0..400 {
            let time_s = 0.1 * f64::from(k);
            let at = plan.uav().at(time_s);
            assert_eq!(at.position_m, along.uav().at(time_s).position_m);
            if time_s < config.rest_s {
                assert!(at.rate_rad_per_s.norm() < 1e-12, "at rest");
            }
            let rate_dps = at.rate_rad_per_s.norm().to_degrees();
            assert!(rate_dps < config.limits.heading_rate_dps + 30.0, "{rate_dps}");
            let (nose, way) = (
                at.attitude * Vector3::x(),
                plan.gmt().at(time_s).0 - at.position_m,
            );
            let off = libm::atan2(nose.y, nose.x) - libm::atan2(way.y, way.x);
            off_deg.push(
                (off - 2.0 * PI * libm::floor(off / (2.0 * PI) + 0.5))
                    .abs()
                    .to_degrees(),
            );
        }
        off_deg.sort_by(f64::total_cmp);
        let (median, most) = (off_deg[200], off_deg[395]);
        assert!(median < 3.0 && most < 40.0, "{median} {most} degrees off the GMT");
    }
}
