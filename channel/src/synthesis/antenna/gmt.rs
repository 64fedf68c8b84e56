//! The GMT's transmit faces and its codebook of beams.

use std::f64::consts::TAU;

use cslam_core::array::GmtElement;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, Gmt};
use nalgebra::Vector3;

use super::super::C64;
use super::super::radio::{BeamGrid, GmtCounts, Radio};
use super::{element, face_axes, phasor, place};

/// One face of elements in columns and rows, GMT frame. As they were meant, all faces share the GMT's position.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Face {
    /// Outward normal.
    normal: Vector3<f64>,
    /// Unit vectors along a row, horizontal, and along a column, z, as they were meant.
    tangent: Vector3<f64>,
    column: Vector3<f64>,
    /// Centre, m.
    centre_m: Vector3<f64>,
    counts: GmtCounts,
    /// Phase from an element to the next per unit of direction cosine, at the carrier, rad.
    phase_per_element_rad: f64,
    element: GmtElement,
}

impl Face {
    /// Face `index` of a radio: they look at equal steps of azimuth.
    pub(crate) fn new(radio: &Radio, index: usize) -> Self {
        let (normal, tangent) = face_axes(TAU * (index as f64 / radio.gmt.faces as f64));
        Self {
            normal,
            tangent,
            column: Vector3::z(),
            centre_m: Vector3::zeros(),
            counts: radio.gmt,
            phase_per_element_rad: TAU * radio.gmt_arrays.spacing_wavelengths,
            element: radio.gmt_arrays.element,
        }
    }

    /// The face turned by a small angle (rad, about each axis) and with its centre elsewhere.
    pub(crate) fn moved(self, turn_rad: &Vector3<f64>, centre_m: &Vector3<f64>) -> Self {
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
            ..self
        }
    }

    /// How much earlier than the GMT's position a wave towards `u` leaves from its centre, s.
    pub(crate) fn lead_s(&self, u: &Direction<Gmt, f64>) -> f64 {
        self.centre_m.dot(u.vector()) / SPEED_OF_LIGHT_M_PER_S
    }

    /// Direction cosines of `u` along row and column.
    pub(crate) fn cosines(&self, u: &Direction<Gmt, f64>) -> [f64; 2] {
        [self.tangent.dot(u.vector()), self.column.dot(u.vector())]
    }

    /// Amplitude of its elements towards `u`.
    pub(crate) fn amplitude(&self, u: &Direction<Gmt, f64>) -> f64 {
        element::of_gmt(&self.element, u.vector(), &self.normal)
    }
    /// Places of element `e` along row and column, in spacings from the centre: column-major, `rows p + q`.
    pub(crate) fn place(&self, e: usize) -> [f64; 2] {
        let GmtCounts { columns, rows, .. } = self.counts;
        [place(e / rows, columns), place(e % rows, rows)]
    }

    /// Phase from an element to the next per unit of direction cosine, at the carrier, rad.
    pub(crate) fn phase_per_element_rad(&self) -> f64 {
        self.phase_per_element_rad
    }

    /// Response of its elements for direction cosines: element `rows p + q` has the phase `pi (n_p s_x + n_q s_z)` where they
    /// are half a wavelength apart.
    pub(crate) fn response(&self, cosines: [f64; 2]) -> Vec<C64> {
        let GmtCounts { columns, rows, .. } = self.counts;
        let line = |cosine: f64, count: usize| -> Vec<C64> {
            let phase_rad = |n| self.phase_per_element_rad * cosine * place(n, count);
            (0..count).map(|n| phasor(phase_rad(n))).collect()
        };
        let (along_row, along_column) = (line(cosines[0], columns), line(cosines[1], rows));
        let column = |p: &C64| along_column.iter().map(|q| p * q).collect::<Vec<_>>();
        along_row.iter().flat_map(column).collect()
    }

    /// Its codeword for direction cosines, `conj(v)/|v|`.
    pub(crate) fn codeword(&self, cosines: [f64; 2]) -> Vec<C64> {
        let size = (self.counts.elements() as f64).sqrt();
        let response = self.response(cosines);
        response.iter().map(|v| v.conj() / size).collect()
    }
}

/// Face and direction cosines of a beam: azimuth by azimuth of a face, each at every elevation.
pub(crate) fn beam(grid: &BeamGrid, index: usize) -> (usize, [f64; 2]) {
    let within = index % grid.of_face();
    let elevations = grid.elevations_rad.len();
    let (k, e) = (within / elevations, within % elevations);
    let sine = libm::sin(grid.sector_rad) * place(k, grid.azimuths) * (2.0 / grid.azimuths as f64);
    let elevation_rad = grid.elevations_rad[e];
    let along_row = libm::sin(libm::asin(sine)) * libm::cos(elevation_rad);
    (index / grid.of_face(), [along_row, libm::sin(elevation_rad)])
}
