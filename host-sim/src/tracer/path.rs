//! A traced path and its form in the paths format.

use core::cmp::Ordering;

use nalgebra::Complex;

use super::MAX_ORDER;
use super::angles::zenith_azimuth;
use crate::paths::{Kind, LinkPath};
use crate::scene::Vec3;
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;

/// Paths of one kind whose interaction points all agree to this are one, m: they met where two coplanar faces share an
/// edge, or where faces of touching solids coincide.
const SAME_PATH_M: f64 = 1e-6;

/// An interaction: where, and off which face, none for an edge.
pub(super) struct Place {
    pub(super) point: Vec3,
    pub(super) face: Option<u32>,
}

/// One propagation path from a transmitter to a receiver.
#[derive(Clone, Debug, PartialEq)]
pub struct TracedPath {
    pub(super) kind: Kind,
    pub(super) order: usize,
    /// Number of faces among the interactions.
    pub(super) reflecting: usize,
    pub(super) faces: [u32; MAX_ORDER],
    pub(super) vertices: [[f64; 3]; MAX_ORDER],
    pub(super) length_m: f64,
    pub(super) departure_rad: [f64; 2],
    pub(super) arrival_rad: [f64; 2],
    pub(super) gain: Complex<f64>,
    /// Of its horizontal component, on the scale of `gain`: reflections and thin walls make one. None is told of other kinds.
    pub(super) across: Complex<f64>,
    /// Place among the scene's wedges of the edge that diffracts it.
    pub(super) wedge: Option<u32>,
    /// Rate at which movers on the way shorten it, m/s.
    pub(super) closing_m_per_s: f64,
}

impl TracedPath {
    /// A path through interactions at most [`MAX_ORDER`], with its gain.
    pub(super) fn through(
        kind: Kind,
        tx: &Vec3,
        places: impl Iterator<Item = Place>,
        rx: &Vec3,
        gain: Complex<f64>,
    ) -> Self {
        let mut points = [*rx; MAX_ORDER + 2];
        points[0] = *tx;
        let mut faces = [0; MAX_ORDER];
        let (mut order, mut reflecting) = (0, 0);
        for place in places {
            order += 1;
            points[order] = place.point;
            if let Some(face) = place.face {
                faces[reflecting] = face;
                reflecting += 1;
            }
        }
        let mut vertices = [[0.0; 3]; MAX_ORDER];
        for (place, vertex) in vertices.iter_mut().zip(&points[1..=order]) {
            *place = (*vertex).into();
        }
        Self {
            kind,
            order,
            reflecting,
            faces,
            vertices,
            length_m: points[..order + 2]
                .windows(2)
                .map(|leg| (leg[1] - leg[0]).norm())
                .sum(),
            departure_rad: zenith_azimuth(&(points[1] - points[0])),
            arrival_rad: zenith_azimuth(&(points[order] - points[order + 1])),
            gain,
            across: Complex::new(0.0, 0.0),
            wedge: None,
            closing_m_per_s: 0.0,
        }
    }

    /// The same path with a horizontal component.
    pub(super) fn with_across(mut self, across: Complex<f64>) -> Self {
        self.across = across;
        self
    }

    /// Multiplies both components by what is left of them.
    pub(super) fn weaken(&mut self, left: Complex<f64>) {
        self.gain *= left;
        self.across *= left;
    }

    /// Strongest first; of equal strength, by order and faces.
    pub(super) fn by_strength(&self, other: &Self) -> Ordering {
        let weaker = other.gain.norm_sqr().total_cmp(&self.gain.norm_sqr());
        weaker
            .then(self.order.cmp(&other.order))
            .then(self.faces().cmp(other.faces()))
            .then(self.kind.cmp(&other.kind))
    }

    /// Keeps of paths that are one the first.
    pub(super) fn drop_twins(paths: &mut Vec<Self>) {
        let mut distinct: Vec<Self> = Vec::with_capacity(paths.len());
        for path in paths.drain(..) {
            if !distinct.iter().any(|known| known.is_twin(&path)) {
                distinct.push(path);
            }
        }
        *paths = distinct;
    }

    fn is_twin(&self, other: &Self) -> bool {
        self.kind == other.kind
            && (self.length_m - other.length_m).abs() < SAME_PATH_M
            && self
                .vertices()
                .iter()
                .zip(other.vertices())
                .all(|(p, q)| (Vec3::from(*p) - Vec3::from(*q)).norm() < SAME_PATH_M)
    }

    /// What the wave meets on its way.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Where an edge diffracts the wave, world frame, m.
    pub fn edge_point(&self) -> Option<[f64; 3]> {
        self.kind.edge().map(|at| self.vertices[at])
    }

    /// Number of interactions; 0 is line of sight.
    pub fn order(&self) -> usize {
        self.order
    }

    /// Indices of the reflecting faces in the scene, in the order that the wave meets them.
    pub fn faces(&self) -> &[u32] {
        &self.faces[..self.reflecting]
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

    /// Rate at which movers on the way shorten the path, m/s; the motion of the ends comes on top.
    pub fn closing_m_per_s(&self) -> f64 {
        self.closing_m_per_s
    }

    /// The path as the paths format has it; without kind, if reflections are all that it meets.
    pub fn to_link_path(&self) -> LinkPath {
        LinkPath {
            order: u8::try_from(self.order).ok(),
            kind: (!self.kind.is_specular()).then_some(self.kind),
            delay_s: self.length_m / SPEED_OF_LIGHT_M_PER_S,
            aoa_zenith_rad: self.arrival_rad[0],
            aoa_azimuth_rad: self.arrival_rad[1],
            aod_zenith_rad: Some(self.departure_rad[0]),
            aod_azimuth_rad: Some(self.departure_rad[1]),
            aod_sigma_rad: None,
            gain: Some(self.gain()),
            cross_gain: None,
            first_vertex: self.vertices().first().copied(),
            last_vertex: self.vertices().last().copied(),
            edge_point: self.edge_point(),
            snr_db: None,
            covariance: None,
            confirmed: None,
            closing_m_per_s: (self.closing_m_per_s != 0.0).then_some(self.closing_m_per_s),
        }
    }
}
