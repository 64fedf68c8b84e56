//! The GMT's transmit faces and its codebook of beams.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use cslam_core::geometry::{Direction, Gmt};
use nalgebra::Vector3;

use super::super::{C64, FACE_ELEMENTS, FACES};
use super::{element, face_axes, phasor, place};

/// Beams of a face: azimuths of equal steps in sine over +-60 deg, each at every elevation.
const AZIMUTHS: usize = 8;
const ELEVATIONS_DEG: [f64; 3] = [0.0, 12.0, 25.0];
const BEAMS_OF_FACE: usize = AZIMUTHS * ELEVATIONS_DEG.len();
/// Beams of the codebook.
pub(in crate::channel) const BEAMS: usize = FACES * BEAMS_OF_FACE;

/// One face of 8 x 8 elements half a wavelength apart, GMT frame. All faces share the GMT's position.
#[derive(Clone, Copy, Debug)]
pub(in crate::channel) struct Face {
    /// Outward normal.
    normal: Vector3<f64>,
    /// Unit vector along a row, horizontal. Columns run along z.
    tangent: Vector3<f64>,
}

impl Face {
    /// Face `index`, which looks at `index` times 120 deg.
    pub(in crate::channel) fn new(index: usize) -> Self {
        let (normal, tangent) = face_axes(TAU * (index as f64 / FACES as f64));
        Self { normal, tangent }
    }

    /// Direction cosines of `u` along row and column.
    pub(in crate::channel) fn cosines(&self, u: &Direction<Gmt, f64>) -> [f64; 2] {
        [self.tangent.dot(u.vector()), u.vector().z]
    }

    /// Amplitude of its elements towards `u`.
    pub(in crate::channel) fn amplitude(&self, u: &Direction<Gmt, f64>) -> f64 {
        element::of_gmt(u.vector(), &self.normal)
    }
}

/// Response of a face's elements for direction cosines, column-major: element 8 p + q has the phase `pi (n_p s_x + n_q
/// s_z)`.
pub(in crate::channel) fn response(cosines: [f64; 2]) -> [C64; FACE_ELEMENTS] {
    let line = |cosine: f64| -> [C64; 8] { std::array::from_fn(|n| phasor(PI * cosine * place(n))) };
    let (columns, rows) = (line(cosines[0]), line(cosines[1]));
    std::array::from_fn(|e| columns[e / 8] * rows[e % 8])
}

/// Face and direction cosines of beam `24 s + 3 k + e`: face s, azimuth k, elevation e.
pub(in crate::channel) fn beam(index: usize) -> (usize, [f64; 2]) {
    let within = index % BEAMS_OF_FACE;
    let (k, e) = (within / ELEVATIONS_DEG.len(), within % ELEVATIONS_DEG.len());
    let sine = libm::sin(FRAC_PI_3) * place(k) * (2.0 / AZIMUTHS as f64);
    let elevation_rad = ELEVATIONS_DEG[e].to_radians();
    let along_row = libm::sin(libm::asin(sine)) * libm::cos(elevation_rad);
    (index / BEAMS_OF_FACE, [along_row, libm::sin(elevation_rad)])
}
