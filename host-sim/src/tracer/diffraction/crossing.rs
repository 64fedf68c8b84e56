//! Where a wave bends about an edge: the point of Keller's cone, and how the wave spreads through it.

use core::f64::consts::PI;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

use crate::tracer::LEAST_DISTANCE_M;
use crate::tracer::edges::{AboutEdge, Wedge};
use crate::tracer::utd::Incidence;

/// How a wave bends from one place about an edge to another.
pub(super) struct Crossing {
    /// Where on the edge, m along it.
    pub(super) at_m: f64,
    /// Lengths and angles there.
    pub(super) incidence: Incidence,
    /// Spreading of the wave, unfolded.
    pub(super) spread: f64,
}

impl Crossing {
    /// The crossing from a source at an angle about the edge to a receiver, if it is at a place that is allowed.
    pub(super) fn of(
        wedge: &Wedge,
        source: &AboutEdge,
        phi_in_rad: f64,
        receiver: &AboutEdge,
        frequency_hz: f64,
        allowed: impl Fn(f64) -> bool,
    ) -> Option<Self> {
        let off_m = source.off_m + receiver.off_m;
        let at_m = (source.along_m * receiver.off_m + receiver.along_m * source.off_m) / off_m;
        if !allowed(at_m) {
            return None;
        }
        let hypotenuse = |a: f64, b: f64| (a * a + b * b).sqrt();
        let before_m = hypotenuse(source.off_m, at_m - source.along_m);
        let behind_m = hypotenuse(receiver.off_m, receiver.along_m - at_m);
        if before_m.min(behind_m) < LEAST_DISTANCE_M {
            return None;
        }
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / frequency_hz;
        Some(Self {
            at_m,
            incidence: Incidence {
                n: wedge.exterior_rad / PI,
                k_rad_per_m: 2.0 * PI / wavelength_m,
                sin_beta: off_m / (before_m + behind_m),
                before_m,
                behind_m,
                phi_in_rad,
                phi_out_rad: receiver.angle_rad(),
            },
            spread: wavelength_m / (4.0 * PI) / (before_m * behind_m * (before_m + behind_m)).sqrt(),
        })
    }
}
