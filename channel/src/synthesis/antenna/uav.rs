//! The UAV's receive arrays.

use std::f64::consts::TAU;

use cslam_core::array::{UavArrayConfig, UavElement, UavLayout};
use cslam_core::geometry::{Body, Direction};
use nalgebra::Vector3;

use super::{element, face_axes, place};

/// One linear array, body frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Array {
    /// Outward normal of its face.
    pub(crate) normal: Vector3<f64>,
    /// Unit vector along the elements.
    pub(crate) axis: Vector3<f64>,
    /// Centre, m.
    pub(crate) centre_m: Vector3<f64>,
}

/// The arrays, on faces at equal steps of azimuth from the nose on, or the rows of one planar array.
#[derive(Clone, Debug)]
pub(crate) struct UavArrays<const ARRAYS: usize> {
    pub(crate) arrays: [Array; ARRAYS],
    /// Of a planar array, unit vector from row to row.
    pub(crate) column: Option<Vector3<f64>>,
    /// Phase from an element to the next per unit of `axis . u`, at the carrier, rad.
    phase_per_element_rad: f64,
    element: UavElement,
}

impl<const ARRAYS: usize> UavArrays<ARRAYS> {
    /// The arrays as they were meant: axes tilted in their faces, by atan(1/sqrt 2) the diagonals of a cube.
    pub(crate) fn nominal(config: &UavArrayConfig) -> Self {
        let (sine, cosine) = (libm::sin(config.tilt_rad), libm::cos(config.tilt_rad));
        let array = |azimuth_rad: f64| {
            let (normal, tangent) = face_axes(azimuth_rad);
            Array {
                normal,
                axis: tangent * cosine + Vector3::z() * sine,
                centre_m: normal * config.radius_m,
            }
        };
        let (arrays, column) = match config.layout {
            UavLayout::Around => (
                std::array::from_fn(|j| array(TAU * (j as f64 / ARRAYS as f64))),
                None,
            ),
            UavLayout::Planar { azimuth_rad } => {
                // Rows count as one place for a delay: the aperture is far below what the band resolves.
                let row = array(azimuth_rad);
                ([row; ARRAYS], Some(row.normal.cross(&row.axis)))
            }
        };
        Self {
            arrays,
            column,
            phase_per_element_rad: TAU * config.spacing_wavelengths,
            element: config.element,
        }
    }

    /// Phase of each element at the carrier against the middle of its array, of a planar one against the middle of the whole, for a wave from
    /// `u`, rad: `n_i pi axis . u` at half a wavelength, n_i = i - (ELEMENTS - 1)/2.
    pub(crate) fn phase_rad<const ELEMENTS: usize>(
        &self,
        u: &Direction<Body, f64>,
    ) -> [[f64; ELEMENTS]; ARRAYS] {
        let step_rad = |axis: &Vector3<f64>| self.phase_per_element_rad * axis.dot(u.vector());
        let from_row_to_row_rad = self.column.as_ref().map_or(0.0, step_rad);
        std::array::from_fn(|j| {
            let along_rad = step_rad(&self.arrays[j].axis);
            let row_rad = place(j, ARRAYS) * from_row_to_row_rad;
            std::array::from_fn(|i| place(i, ELEMENTS) * along_rad + row_rad)
        })
    }

    /// Amplitude of each array's elements towards `u`.
    pub(crate) fn amplitude(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays
            .map(|array| element::of_uav(&self.element, u.vector(), &array.normal))
    }

    /// Per array, how much earlier than at the body origin a wave from `u` arrives, m: `centre . u`.
    pub(crate) fn lead_m(&self, u: &Direction<Body, f64>) -> [f64; ARRAYS] {
        self.arrays.map(|array| array.centre_m.dot(u.vector()))
    }
}
