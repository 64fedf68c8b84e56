//! A traced path and its form in the paths format.

use nalgebra::Complex;

use super::MAX_ORDER;
use crate::paths::LinkPath;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// One propagation path from a transmitter to a receiver.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedPath {
    pub(super) order: usize,
    pub(super) faces: [u32; MAX_ORDER],
    pub(super) vertices: [[f64; 3]; MAX_ORDER],
    pub(super) length_m: f64,
    pub(super) departure_rad: [f64; 2],
    pub(super) arrival_rad: [f64; 2],
    pub(super) gain: Complex<f64>,
}

impl TracedPath {
    /// Number of reflections; 0 is line of sight.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Indices of the reflecting faces in the scene, in the order that the wave meets them.
    pub fn faces(&self) -> &[u32] {
        &self.faces[..self.order]
    }

    /// All interaction points in the order that the wave meets them, world frame, m.
    pub fn vertices(&self) -> &[[f64; 3]] {
        &self.vertices[..self.order]
    }

    /// Length of the way, m.
    pub fn length_m(&self) -> f64 {
        self.length_m
    }

    /// Zenith and azimuth of departure: from the transmitter towards the first interaction, rad.
    pub fn departure_rad(&self) -> [f64; 2] {
        self.departure_rad
    }

    /// Zenith and azimuth of arrival: from the receiver towards the last interaction, rad.
    pub fn arrival_rad(&self) -> [f64; 2] {
        self.arrival_rad
    }

    /// Complex amplitude [re, im] for vertical half-wave dipoles, carrier phase excluded.
    pub fn gain(&self) -> [f64; 2] {
        [self.gain.re, self.gain.im]
    }

    /// The path as the paths format has it.
    pub fn to_link_path(&self) -> LinkPath {
        LinkPath {
            order: u8::try_from(self.order).ok(),
            delay_s: self.length_m / SPEED_OF_LIGHT_M_PER_S,
            aoa_zenith_rad: self.arrival_rad[0],
            aoa_azimuth_rad: self.arrival_rad[1],
            aod_zenith_rad: Some(self.departure_rad[0]),
            aod_azimuth_rad: Some(self.departure_rad[1]),
            aod_sigma_rad: None,
            gain: Some(self.gain()),
            first_vertex: self.vertices().first().copied(),
            last_vertex: self.vertices().last().copied(),
            snr_db: None,
            covariance: None,
            confirmed: None,
        }
    }
}
