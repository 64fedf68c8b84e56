//! Figures of the receiver's data association and of its surfaces, as a TOML file has them: those of the flight code, key by key.
//!
//! The structures below only tell the names. Were one of the flight code's fields missing here, this would not compile.

use cslam_core::association::AssociationConfig;
use cslam_core::paths::PathErrors;
use cslam_core::surfaces::SurfaceConfig;
use serde::{Deserialize, Serialize};

use crate::input::InputError;

/// Table `[receiver.association]`: which surfaces made a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct AssociationFigures(#[serde(with = "AssociationKeys")] AssociationConfig);

/// Table `[receiver.surfaces]`: what makes, confirms and ends a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(transparent)]
pub struct SurfaceFigures(#[serde(with = "SurfaceKeys")] SurfaceConfig);

impl AssociationFigures {
    /// For the flight code.
    pub fn config(&self) -> AssociationConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        Ok(self.0.check()?)
    }
}

impl SurfaceFigures {
    /// For the flight code.
    pub fn config(&self) -> SurfaceConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        Ok(self.0.check()?)
    }
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
    tentative: f32,
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
