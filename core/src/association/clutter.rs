//! What a path may be beside a chain of known surfaces: one reflection off an unknown one (N), or anything else (U).
//!
//! ```text
//! log w(N) = log P'(1) + log share - log (4 pi L0) + log p_departure(closed form) + log open
//! log w(U) = log (P'(several) + density P(artefact)) - log (4 pi L0) - log 2 pi
//! ```
//! No other gate is needed: a poor pose widens S, the peak of N(r; S) falls, and U wins by itself. (Clutter and new-feature intensity of
//! belief-propagation SLAM, with the classifier as mark: Leitinger et al., arXiv 2211.09241.)

use super::config::AssociationConfig;
use super::hypotheses::Scene;
use super::likelihood::LOG_TWO_PI;
use super::measurement::Measurement;
use super::part::part;
use super::prior::{is_blocked, log_open, probability_of_order};
use crate::link_state::Probabilities;
use crate::paths::departure_outliers;
use crate::reflection::{Jacobians, point_covariance, vector_point};

/// Log weights of what is not in the store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Clutter {
    /// N; minus infinity when the path has no closed-form point.
    pub(super) new: f64,
    /// U.
    pub(super) unknown: f64,
    /// The way of N is blocked.
    pub(super) new_is_blocked: bool,
}

/// `4 pi L0` as a logarithm: unexplained paths come from any direction, over so many metres.
fn log_spread(config: &AssociationConfig) -> f64 {
    libm::log(4.0 * core::f64::consts::PI * f64::from(config.clutter_length_m))
}

/// Of a path.
pub(super) fn clutter<const N: usize>(
    scene: &Scene<'_, N>,
    measured: &Measurement,
    probabilities: Option<&Probabilities>,
) -> Clutter {
    let config = scene.config;
    let artefact = f64::from(probabilities.map_or(0.0, |p| p.artefact));
    let any_departure = if measured.departure.is_some() {
        LOG_TWO_PI
    } else {
        0.0
    };
    let several = probability_of_order(probabilities, 2, config);
    let unknown = libm::log(several + artefact * f64::from(config.artefact_density))
        - log_spread(config)
        - any_departure;
    let found = new(scene, measured);
    let blocked = found.is_some_and(|(_, blocked)| blocked);
    let new = found.map_or(f64::NEG_INFINITY, |(log_departure, blocked)| {
        let one = probability_of_order(probabilities, 1, config);
        libm::log(one * f64::from(config.unknown_share)) - log_spread(config)
            + log_departure
            + log_open(blocked, config)
    });
    Clutter {
        new,
        unknown,
        new_is_blocked: blocked,
    }
}

/// Log density of the departure towards the closed-form point, and whether the way over it is blocked.
fn new<const N: usize>(scene: &Scene<'_, N>, measured: &Measurement) -> Option<(f64, bool)> {
    let (uav, transmitter) = (scene.pose.position_m, scene.transmitter.position_m);
    let path = &measured.path;
    let baseline = uav - transmitter;
    let solution = vector_point(&baseline, path.aoa.vector(), path.c_tau_m)?;
    let point = uav + path.aoa.vector() * solution.distance_m;
    let blocked = is_blocked(&scene.known, [&transmitter, &uav], &[point], scene.config);
    let Some(departure) = measured.departure else {
        return Some((0.0, blocked));
    };
    let way = point - transmitter;
    let distance_m = way.norm();
    let towards = way.try_normalize(1e-6)?;
    let covariance = point_covariance(
        &Jacobians::at(&baseline, path, &solution),
        path,
        &part(&scene.pose.covariance, (0, 0)),
    );
    // Both tangents together, so half of it for one.
    let across_m2 = (covariance.trace() - towards.dot(&(covariance * towards))).max(0.0);
    let own = measured.noise.m44;
    let variance = own + 0.5 * across_m2 / (distance_m * distance_m);
    let off = (departure - towards).norm_squared();
    let in_beams = scene.transmitter.leaves_in_beams(&towards);
    let outliers = departure_outliers(measured.neighbourhood, in_beams, &scene.config.errors);
    let held = (1.0 - outliers) * libm::exp(-0.5 * off / variance) / variance;
    Some((libm::log(held + outliers) - LOG_TWO_PI, blocked))
}
