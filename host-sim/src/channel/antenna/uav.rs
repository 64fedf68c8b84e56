//! The UAV's receive arrays.

use std::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use super::super::{ARRAYS, C64, ELEMENTS};
use super::{element, face_axes, phasor, place};

/// Distance of an array's centre from the body origin, m.
const RADIUS_M: f64 = 0.2;

/// One linear array of eight elements half a wavelength apart, body frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::channel) struct Array {
    /// Outward normal of its face.
    pub(in crate::channel) normal: Vector3<f64>,
    /// Unit vector along the elements.
    pub(in crate::channel) axis: Vector3<f64>,
    /// Centre, m.
    pub(in crate::channel) centre_m: Vector3<f64>,
}

/// The four arrays, on the faces at azimuth 0, 90, 180 and 270 deg.
#[derive(Clone, Debug)]
pub(in crate::channel) struct UavArrays(pub(in crate::channel) [Array; ARRAYS]);

impl UavArrays {
    /// The arrays as they were meant: axes tilted by atan(1/sqrt 2) in their faces, the diagonals of a cube.
    pub(in crate::channel) fn nominal() -> Self {
        let tilt_rad = libm::atan(FRAC_1_SQRT_2);
        let (sine, cosine) = (libm::sin(tilt_rad), libm::cos(tilt_rad));
        Self(std::array::from_fn(|j| {
            let (normal, tangent) = face_axes(TAU * (j as f64 / ARRAYS as f64));
            Array {
                normal,
                axis: tangent * cosine + Vector3::z() * sine,
                centre_m: normal * RADIUS_M,
            }
        }))
    }

    /// Per array, the phase from an element to the next for a wave from `u` at the carrier, rad: `pi axis . u`.
    pub(in crate::channel) fn phase_step_rad(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.0.map(|array| PI * array.axis.dot(u.vector()))
    }

    /// Steering of an array whose phase step is `step_rad`: `exp(+j n_i step)`, n_i = i - 3.5.
    pub(in crate::channel) fn steering(step_rad: f64) -> [C64; ELEMENTS] {
        std::array::from_fn(|i| phasor(step_rad * place(i)))
    }

    /// Amplitude of each array's elements towards `u`.
    pub(in crate::channel) fn amplitude(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.0.map(|array| element::of_uav(u.vector(), &array.normal))
    }

    /// Per array, how much earlier than at the body origin a wave from `u` arrives, m: `centre . u`.
    pub(in crate::channel) fn lead_m(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.0.map(|array| array.centre_m.dot(u.vector()))
    }
}
