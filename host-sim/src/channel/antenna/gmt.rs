//! The GMT's transmit faces and its codebook of beams.

use std::f64::consts::{FRAC_PI_3, PI, TAU};

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
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

/// One face of 8 x 8 elements half a wavelength apart, GMT frame. As they were meant, all faces share the GMT's position.
#[derive(Clone, Copy, Debug)]
pub(in crate::channel) struct Face {
    /// Outward normal.
    normal: Vector3<f64>,
    /// Unit vectors along a row, horizontal, and along a column, z, as they were meant.
    tangent: Vector3<f64>,
    column: Vector3<f64>,
    /// Centre, m.
    centre_m: Vector3<f64>,
}

impl Face {
    /// Face `index`, which looks at `index` times 120 deg.
    pub(in crate::channel) fn new(index: usize) -> Self {
        let (normal, tangent) = face_axes(TAU * (index as f64 / FACES as f64));
        Self {
            normal,
            tangent,
            column: Vector3::z(),
            centre_m: Vector3::zeros(),
        }
    }

    /// The face turned by a small angle (rad, about each axis) and with its centre elsewhere.
    pub(in crate::channel) fn moved(self, turn_rad: &Vector3<f64>, centre_m: &Vector3<f64>) -> Self {
        // Vectors that are not turned keep their bits.
        let turned = |v: Vector3<f64>| match *turn_rad == Vector3::zeros() {
            true => v,
            false => (v + turn_rad.cross(&v)).normalize(),
        };
        Self {
            normal: turned(self.normal),
            tangent: turned(self.tangent),
            column: turned(self.column),
            centre_m: self.centre_m + centre_m,
        }
    }

    /// How much earlier than the GMT's position a wave towards `u` leaves from its centre, s.
    pub(in crate::channel) fn lead_s(&self, u: &Direction<Gmt, f64>) -> f64 {
        self.centre_m.dot(u.vector()) / SPEED_OF_LIGHT_M_PER_S
    }

    /// Direction cosines of `u` along row and column.
    pub(in crate::channel) fn cosines(&self, u: &Direction<Gmt, f64>) -> [f64; 2] {
        [self.tangent.dot(u.vector()), self.column.dot(u.vector())]
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
