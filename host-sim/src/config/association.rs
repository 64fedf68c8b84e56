//! Figures of the receiver's data association and of its surfaces, as a TOML file has them: those of the flight code, key by key.
//!
//! The structures below only tell the names. Were one of the flight code's fields missing here, this would not compile.

use cslam_core::association::AssociationConfig;
use cslam_core::paths::PathErrors;
use cslam_core::surfaces::SurfaceConfig;
use serde::{Deserialize, Serialize};

use crate::input::{InputError, above_zero, within};

/// Table `[receiver.association]`: which surfaces made a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AssociationFigures(#[serde(with = "AssociationKeys")] AssociationConfig);

/// Table `[receiver.surfaces]`: what makes, confirms and ends a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SurfaceFigures(#[serde(with = "SurfaceKeys")] SurfaceConfig);

/// Most that a share or a probability may be.
pub const MOST_SHARE: f32 = 0.9999;
/// Least logarithm of a probability.
const LEAST_LOG: f32 = -1000.0;

impl AssociationFigures {
    /// For the flight code.
    pub fn config(&self) -> AssociationConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        let (a, e) = (&self.0, &self.0.errors);
        let mut above = vec![
            ("classifier_doubt", a.classifier_doubt),
            ("singles_offered", a.singles_offered),
            ("offered_growth", a.offered_growth),
            ("clear_m", a.clear_m),
            ("unknown_share", a.unknown_share),
            ("clutter_length_m", a.clutter_length_m),
            ("artefact_density", a.artefact_density),
            ("gate_sigmas", a.gate_sigmas),
            ("errors.neighbour_m", e.neighbour_m),
            ("errors.neighbour_rad", e.neighbour_rad),
            ("errors.comparable_db", e.comparable_db),
        ];
        above.extend(e.delay_m.map(|value| ("errors.delay_m", value)));
        above.extend(e.arrival_rad.map(|value| ("errors.arrival_rad", value)));
        above.extend(
            e.departure_outliers
                .map(|value| ("errors.departure_outliers", value)),
        );
        all_above_zero(&above)?;
        within(&[
            ("classifier_doubt", a.classifier_doubt, 0.0, 0.3),
            ("reach_per_m", a.reach_per_m, LEAST_LOG, 0.0),
            ("blocked", a.blocked, LEAST_LOG, 0.0),
            ("unknown_share", a.unknown_share, 0.0, MOST_SHARE),
            ("explained", a.explained, 0.5, MOST_SHARE),
        ])?;
        within(
            &e.departure_outliers
                .map(|value| ("errors.departure_outliers", value, 0.0, MOST_SHARE)),
        )
    }
}

impl SurfaceFigures {
    /// For the flight code.
    pub fn config(&self) -> SurfaceConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        let s = &self.0;
        let above = [
            ("lean_rad", s.lean_rad),
            ("doubtful_log_odds", s.doubtful_log_odds),
            ("same_m", s.same_m),
            ("reach_m", s.reach_m),
            ("independent_m", s.independent_m),
            ("detection", s.detection),
            ("indistinct_share", s.indistinct_share),
            ("contradiction_log_odds", s.contradiction_log_odds),
            ("alike_sightings", s.alike_sightings),
            ("least_shift_m", s.least_shift_m),
            ("least_tilt_rad", s.least_tilt_rad),
            ("ground_shift_m", s.ground_shift_m),
            ("ground_tilt_rad", s.ground_tilt_rad),
            ("most_point_m", s.most_point_m),
        ];
        all_above_zero(&above)?;
        within(&[
            ("confirmed_probability", s.confirmed_probability, 0.5, MOST_SHARE),
            ("detection", s.detection, 0.0, MOST_SHARE),
            ("indistinct_share", s.indistinct_share, 0.0, MOST_SHARE),
        ])
    }
}

/// As [`above_zero`], in single precision.
fn all_above_zero(figures: &[(&str, f32)]) -> Result<(), InputError> {
    let figures: Vec<_> = figures
        .iter()
        .map(|(key, value)| (*key, f64::from(*value)))
        .collect();
    above_zero(&figures)
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "AssociationConfig",
    default = "AssociationConfig::default",
    deny_unknown_fields
)]
struct AssociationKeys {
    #[serde(with = "PathErrorKeys")]
    errors: PathErrors,
    classifier_doubt: f32,
    singles_offered: f32,
    offered_growth: f32,
    reach_per_m: f32,
    blocked: f32,
    clear_m: f32,
    unknown_share: f32,
    clutter_length_m: f32,
    artefact_density: f32,
    explained: f32,
    gate_sigmas: f32,
    weighings: u16,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PathErrors", default = "PathErrors::default", deny_unknown_fields)]
struct PathErrorKeys {
    delay_m: [f32; 2],
    arrival_rad: [f32; 2],
    departure_outliers: [f32; 3],
    neighbour_m: f32,
    neighbour_rad: f32,
    comparable_db: f32,
}

#[derive(Serialize, Deserialize)]
#[serde(
    remote = "SurfaceConfig",
    default = "SurfaceConfig::default",
    deny_unknown_fields
)]
struct SurfaceKeys {
    confirmed_probability: f32,
    lean_rad: f32,
    doubtful_log_odds: f32,
    same_m: f32,
    reach_m: f32,
    independent_m: f32,
    indistinct_share: f32,
    detection: f32,
    contradiction_log_odds: f32,
    alike_sightings: f32,
    least_shift_m: f32,
    least_tilt_rad: f32,
    ground_shift_m: f32,
    ground_tilt_rad: f32,
    most_point_m: f32,
}
