//! Link state by rules of geometry: the fallback that needs no model, and the yardstick of the networks.
//!
//! A path without excess delay that comes from where the GMT stands is the line of sight. A path whose solved point lies
//! where the wave left towards is of first order (docs/link-state.md). Everything else is of higher order.

use crate::geometry::{Direction, World};
use crate::link_state::Probabilities;
use crate::path::Path;
use crate::reflection::{Ends, vector_point};

/// Limits of the rules.
/// Given: docs/signal-model.md; rules are a baseline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    /// Excess delay up to which a path may be the line of sight, m, and in its standard deviations; the larger counts.
    pub los_excess_m: f32,
    /// See [`Rules::los_excess_m`].
    pub los_excess_sigmas: f32,
    /// Angle off the direction to the GMT up to which a path may be the line of sight, rad.
    pub los_angle_rad: f32,
    /// Angle between the direction of departure and that of the solved point up to which a path may be of first order, rad.
    pub departure_angle_rad: f32,
}

impl Default for Rules {
    /// 1 m or 3.5 sigma and 8 degrees (u.b/|b| < -0.99, docs/signal-model.md, "Reflection point"); 6 degrees.
    fn default() -> Self {
        Self {
            los_excess_m: 1.0,
            los_excess_sigmas: 3.5,
            los_angle_rad: 0.1415,
            departure_angle_rad: 0.1047,
        }
    }
}

/// One state for sure.
const LINE_OF_SIGHT: Probabilities = Probabilities {
    los: 1.0,
    first_order: 0.0,
    higher_order: 0.0,
    artefact: 0.0,
};
const FIRST_ORDER: Probabilities = Probabilities {
    los: 0.0,
    first_order: 1.0,
    higher_order: 0.0,
    artefact: 0.0,
};
const HIGHER_ORDER: Probabilities = Probabilities {
    los: 0.0,
    first_order: 0.0,
    higher_order: 1.0,
    artefact: 0.0,
};

impl Rules {
    /// What a path is, for sure. A path without angle of departure cannot be told to be of first order.
    pub(super) fn path(&self, ends: &Ends, path: &Path<World>) -> Probabilities {
        let baseline = ends.uav.from_origin(&ends.gmt);
        let length_m = baseline.norm();
        let Ok(towards_gmt) = Direction::<World>::from_vector(-baseline) else {
            return HIGHER_ORDER;
        };
        let along = baseline / length_m;
        let variance = path.covariance.m11 + along.dot(&(ends.uav_covariance * along));
        let excess_m = path.c_tau_m - length_m;
        let limit_m = (self.los_excess_sigmas * libm::sqrtf(variance.max(0.0))).max(self.los_excess_m);
        if excess_m.abs() < limit_m && towards_gmt.angle_to_rad(&path.aoa) < self.los_angle_rad {
            return LINE_OF_SIGHT;
        }
        let agrees = vector_point(&baseline, path.aoa.vector(), path.c_tau_m)
            .and_then(|solution| {
                Direction::<World>::from_vector(baseline + path.aoa.vector() * solution.distance_m).ok()
            })
            .zip(path.aod)
            .is_some_and(|(point, aod)| point.angle_to_rad(&aod.direction) < self.departure_angle_rad);
        if excess_m > 0.0 && agrees {
            FIRST_ORDER
        } else {
            HIGHER_ORDER
        }
    }
}
