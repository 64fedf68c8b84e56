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

/// A key, its value, and the range it has to lie in, ends included.
type Figure = (&'static str, f32, [f32; 2]);

/// Positive numbers: the smallest one is above zero.
const POSITIVE: [f32; 2] = [f32::MIN_POSITIVE, f32::MAX];
/// Shares and probabilities that are neither zero nor one.
const SHARE: [f32; 2] = [f32::MIN_POSITIVE, 0.9999];
/// Probabilities more likely than not.
const LIKELY: [f32; 2] = [0.5, 0.9999];
/// Logarithms of probabilities.
const LOG: [f32; 2] = [-1000.0, 0.0];

impl AssociationFigures {
    /// For the flight code.
    pub fn config(&self) -> AssociationConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        let (a, e) = (&self.0, &self.0.errors);
        let mut figures = vec![
            ("network_doubt", a.network_doubt, [f32::MIN_POSITIVE, 0.3]),
            ("singles_offered", a.singles_offered, POSITIVE),
            ("offered_growth", a.offered_growth, POSITIVE),
            ("reach_per_m", a.reach_per_m, LOG),
            ("blocked", a.blocked, LOG),
            ("clear_m", a.clear_m, POSITIVE),
            ("unknown_share", a.unknown_share, SHARE),
            ("clutter_length_m", a.clutter_length_m, POSITIVE),
            ("artefact_density", a.artefact_density, POSITIVE),
            ("explained", a.explained, LIKELY),
            ("tentative", a.tentative, LIKELY),
            ("gate_sigmas", a.gate_sigmas, POSITIVE),
            ("errors.neighbour_m", e.neighbour_m, POSITIVE),
            ("errors.neighbour_rad", e.neighbour_rad, POSITIVE),
            ("errors.comparable_db", e.comparable_db, POSITIVE),
        ];
        figures.extend(e.delay_m.map(|value| ("errors.delay_m", value, POSITIVE)));
        figures.extend(e.arrival_rad.map(|value| ("errors.arrival_rad", value, POSITIVE)));
        figures.extend(
            e.departure_outliers
                .map(|value| ("errors.departure_outliers", value, SHARE)),
        );
        within(&figures)
    }
}

impl SurfaceFigures {
    /// For the flight code.
    pub fn config(&self) -> SurfaceConfig {
        self.0
    }

    pub(super) fn check(&self) -> Result<(), InputError> {
        let s = &self.0;
        let mut figures = vec![
            ("confirmed_probability", s.confirmed_probability, LIKELY),
            ("most_shift_m", s.most_shift_m, POSITIVE),
            ("lean_rad", s.lean_rad, POSITIVE),
            ("doubtful_log_odds", s.doubtful_log_odds, POSITIVE),
            ("same_m", s.same_m, POSITIVE),
            ("same_rad", s.same_rad, POSITIVE),
            ("reach_m", s.reach_m, POSITIVE),
            ("independent_m", s.independent_m, POSITIVE),
            ("detection", s.detection, SHARE),
            ("contradiction_log_odds", s.contradiction_log_odds, POSITIVE),
            ("least_shift_m", s.least_shift_m, POSITIVE),
            ("least_tilt_rad", s.least_tilt_rad, POSITIVE),
            ("ground_shift_m", s.ground_shift_m, POSITIVE),
            ("ground_tilt_rad", s.ground_tilt_rad, POSITIVE),
            ("most_point_m", s.most_point_m, POSITIVE),
        ];
        figures.extend(
            s.indistinct_shares
                .map(|value| ("indistinct_shares", value, SHARE)),
        );
        within(&figures)
    }
}

/// The first figure that is out of its range, or no number.
fn within(figures: &[Figure]) -> Result<(), InputError> {
    for &(key, value, [low, high]) in figures {
        if !(value.is_finite() && (low..=high).contains(&value)) {
            let expected = if low == f32::MIN_POSITIVE {
                if high == f32::MAX {
                    "a number above 0".to_owned()
                } else {
                    format!("above 0 to {high}")
                }
            } else {
                format!("{low} to {high}")
            };
            return Err(InputError::at_key(
                key,
                format!("is {value}, expected {expected}"),
            ));
        }
    }
    Ok(())
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
    network_doubt: f32,
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
    most_shift_m: f32,
    lean_rad: f32,
    doubtful_log_odds: f32,
    same_m: f32,
    same_rad: f32,
    reach_m: f32,
    independent_m: f32,
    indistinct_shares: [f32; 2],
    detection: f32,
    contradiction_log_odds: f32,
    least_shift_m: f32,
    least_tilt_rad: f32,
    ground_shift_m: f32,
    ground_tilt_rad: f32,
    most_point_m: f32,
}
