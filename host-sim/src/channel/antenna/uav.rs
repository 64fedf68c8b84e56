//! The UAV's receive arrays.

use std::f64::consts::TAU;

use cslam_core::array::{UavArrayConfig, UavElement};
use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use super::super::C64;
use super::{element, face_axes, phasor, place};

/// One linear array, body frame.
#[derive(Clone, Copy, Debug)]
pub(in crate::channel) struct Array {
    /// Outward normal of its face.
    pub(in crate::channel) normal: Vector3<f64>,
    /// Unit vector along the elements.
    pub(in crate::channel) axis: Vector3<f64>,
    /// Centre, m.
    pub(in crate::channel) centre_m: Vector3<f64>,
}

/// The arrays, on faces at equal steps of azimuth from the nose on.
#[derive(Clone, Debug)]
pub(in crate::channel) struct UavArrays<const ARRAYS: usize> {
    pub(in crate::channel) arrays: [Array; ARRAYS],
    /// Phase from an element to the next per unit of `axis . u`, at the carrier, rad.
    phase_per_element_rad: f64,
    element: UavElement,
}

impl<const ARRAYS: usize> UavArrays<ARRAYS> {
    /// The arrays as they were meant: axes tilted in their faces, by atan(1/sqrt 2) the diagonals of a cube.
    pub(in crate::channel) fn nominal(config: &UavArrayConfig) -> Self {
        let (sine, cosine) = (libm::sin(config.tilt_rad), libm::cos(config.tilt_rad));
        Self {
            arrays: std::array::from_fn(|j| {
                let (normal, tangent) = face_axes(TAU * (j as f64 / ARRAYS as f64));
                Array {
                    normal,
                    axis: tangent * cosine + Vector3::z() * sine,
                    centre_m: normal * config.radius_m,
                }
            }),
            phase_per_element_rad: TAU * config.spacing_wavelengths,
            element: config.element,
        }
    }

    /// Per array, the phase from an element to the next for a wave from `u` at the carrier, rad: `pi axis . u` at half a
    /// wavelength.
    pub(in crate::channel) fn phase_step_rad(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays
            .map(|array| self.phase_per_element_rad * array.axis.dot(u.vector()))
    }

    /// Amplitude of each array's elements towards `u`.
    pub(in crate::channel) fn amplitude(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays
            .map(|array| element::of_uav(&self.element, u.vector(), &array.normal))
    }

    /// Per array, how much earlier than at the body origin a wave from `u` arrives, m: `centre . u`.
    pub(in crate::channel) fn lead_m(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays.map(|array| array.centre_m.dot(u.vector()))
    }
}

/// Steering of an array whose phase step is `step_rad`: `exp(+j n_i step)`, n_i = i - (ELEMENTS - 1)/2.
pub(in crate::channel) fn steering<const ELEMENTS: usize>(step_rad: f64) -> [C64; ELEMENTS] {
    std::array::from_fn(|i| phasor(step_rad * place(i, ELEMENTS)))
}
