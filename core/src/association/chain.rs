//! The image method: what a path over a chain of surfaces looks like, and how that changes with the pose and with each of them.
//!
//! With the transmitter g, the UAV x, and `R_k = I - 2 n_k n_k'`, the wave comes straight from the image of the image ...:
//!
//! ```text
//! g_0 = g,  g_j = g_(j-1) - 2 n_j n_j'(g_(j-1) - c_j)
//! rho = |g_k - x|,  l = (g_k - x) / rho                delay, arrival
//! d = -R_1 R_2 .. R_k l                                departure
//! ```
//! No surface: the line of sight, nothing special.

use heapless::Vec;
use nalgebra::{Matrix3, SMatrix, Vector3};

use crate::geometry::{Plane, Real};
use crate::surfaces::LEAST_HEIGHT_M;
pub(super) use crate::surfaces::MOST_REFLECTIONS;

/// Numbers that a path measures.
/// Derived: delay, two of arrival, two of departure.
pub const ROWS: usize = 5;
/// Errors of a pose.
/// Derived: position (3, m), attitude (3, rad), clock (1, m).
pub const POSE_STATES: usize = 7;

/// Points of a chain, from the transmitter on, m.
pub type ChainPoints = Vec<Vector3<f64>, MOST_REFLECTIONS>;

/// The planes of a chain, from the transmitter on. No more than [`MOST_REFLECTIONS`] count.
#[derive(Clone, Copy, Debug)]
pub struct Chain<'a> {
    planes: &'a [Plane<f64>],
}

/// What a path over a chain looks like.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Length of the way, m.
    pub range_m: f64,
    /// Unit vector from the UAV towards where the wave comes from.
    pub arrival: Vector3<f64>,
    /// Unit vector in which it left the transmitter.
    pub departure: Vector3<f64>,
    /// Where it was reflected, from the transmitter on, m.
    pub points: ChainPoints,
}

/// Directions in which a path is measured, world axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tangents {
    /// Measured arrival.
    pub arrival: Vector3<f64>,
    /// Its two tangents.
    pub arrival_tangents: [Vector3<f64>; 2],
    /// Two tangents of the measured departure; zero when none was measured.
    pub departure_tangents: [Vector3<f64>; 2],
}

/// Derivatives of the innovation `z - h`, transposed: one column each for delay, two of arrival, two of departure.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Derivatives {
    /// By the pose.
    pub pose: SMatrix<f64, POSE_STATES, ROWS>,
    /// By the shift and the two tilts of each surface of the chain; zero beyond its length.
    pub surfaces: [SMatrix<f64, 3, ROWS>; MOST_REFLECTIONS],
}

impl<'a> Chain<'a> {
    /// Over these planes, from the transmitter on; those beyond [`MOST_REFLECTIONS`] are left out.
    #[must_use]
    pub fn over(planes: &'a [Plane<f64>]) -> Self {
        Self {
            planes: planes.get(..MOST_REFLECTIONS).unwrap_or(planes),
        }
    }

    /// The planes.
    #[must_use]
    pub fn planes(&self) -> &'a [Plane<f64>] {
        self.planes
    }

    /// Images of the transmitter: itself, then in one plane after the other; and the last one.
    #[inline(never)]
    fn images(&self, transmitter_m: &Vector3<f64>) -> (ChainPoints, Vector3<f64>) {
        let mut images = ChainPoints::new();
        let mut image = *transmitter_m;
        for plane in self.planes {
            let _fits = images.push(image);
            image = plane.image(&image);
        }
        (images, image)
    }

    /// The path from the transmitter to the UAV. `None` when the chain does not exist: an end, an image or a point lies behind the
    /// surface that it should be before.
    #[must_use]
    pub fn predict(&self, transmitter_m: &Vector3<f64>, uav_m: &Vector3<f64>) -> Option<Prediction> {
        let (images, source) = self.images(transmitter_m);
        let way = source - uav_m;
        let range_m = way.norm();
        // In this order a number that is none has no prediction.
        if !(range_m > LEAST_HEIGHT_M && range_m.is_finite()) {
            return None;
        }
        let mut backwards = ChainPoints::new();
        let (mut towards, mut behind) = (*uav_m, source);
        for (plane, image) in self.planes.iter().zip(&images).rev() {
            let (over, under) = (plane.height_m(&towards), plane.height_m(image));
            if !(over > LEAST_HEIGHT_M && under > LEAST_HEIGHT_M) {
                return None;
            }
            towards += (behind - towards) * (over / (over + under));
            behind = *image;
            let _fits = backwards.push(towards);
        }
        let mut points = ChainPoints::new();
        for point in backwards.iter().rev() {
            let _fits = points.push(*point);
        }
        let arrival = way / range_m;
        Some(Prediction {
            range_m,
            arrival,
            departure: -self.led_back(&arrival),
            points,
        })
    }

    /// `R_1 R_2 .. R_k v`.
    #[inline(never)]
    fn led_back(&self, v: &Vector3<f64>) -> Vector3<f64> {
        self.planes.iter().rev().fold(*v, |v, plane| turned(plane, &v))
    }

    /// Derivatives of the innovation at a prediction. With `Q = (I - l l') / rho`, `F = R_1 .. R_k`, the tangents E and A of the measured arrival
    /// m and departure:
    ///
    /// ```text
    /// delay      [ l' (x), -1 (clock), -l' dg_k/ds_j ]
    /// arrival    [ E'Q (x), -E'[m]x (attitude), -E'Q dg_k/ds_j ]
    /// departure  [ -A'F Q (x), A'F Q dg_k/ds_j + A' dF_j l ]
    /// dg_k/ds_j = R_k .. R_(j+1) [ 2 n, -2 (t1'e n + n'e t1), -2 (t2'e n + n'e t2) ],  e = g_(j-1) - c_j
    /// ```
    #[must_use]
    pub fn derivatives(
        &self,
        transmitter_m: &Vector3<f64>,
        prediction: &Prediction,
        tangents: &Tangents,
    ) -> Derivatives {
        let l = prediction.arrival;
        let across = (Matrix3::identity() - l * l.transpose()) / prediction.range_m;
        let [e1, e2] = tangents.arrival_tangents.map(|e| across * e);
        // A'F is F'A transposed: the tangents led along with the wave.
        let [a1, a2] = tangents.departure_tangents.map(|a| {
            let along = self.planes.iter().fold(a, |a, plane| turned(plane, &a));
            across * along
        });
        // E'(e x m) = (m x E)'e.
        let [turn1, turn2] = tangents.arrival_tangents.map(|e| tangents.arrival.cross(&e));
        let zero = Vector3::zeros();
        let pose = columns(&[
            (l, zero, -1.0),
            (e1, turn1, 0.0),
            (e2, turn2, 0.0),
            (-a1, zero, 0.0),
            (-a2, zero, 0.0),
        ]);
        let (images, _) = self.images(transmitter_m);
        let mut surfaces = [SMatrix::zeros(); MOST_REFLECTIONS];
        for (j, ((plane, image), out)) in self.planes.iter().zip(&images).zip(&mut surfaces).enumerate() {
            let after = self.planes.get(j + 1..).unwrap_or(&[]);
            let before = self.planes.get(..j).unwrap_or(&[]);
            let mut moved = plane.image_jacobian(image);
            for plane in after {
                let n = plane.normal.vector();
                moved -= n * (n.transpose() * moved) * 2.0;
            }
            // The wave as it left this plane, led back over those behind it; and the tangents as they come to it.
            let leaving = after.iter().rev().fold(l, |v, plane| turned(plane, &v));
            let n = plane.normal.vector();
            let (t1, t2) = plane.tangents();
            let tilted = |a: &Vector3<f64>| {
                let a = before.iter().fold(*a, |a, plane| turned(plane, &a));
                let by =
                    |t: &Vector3<f64>| -2.0 * (t.dot(&leaving) * n.dot(&a) + n.dot(&leaving) * t.dot(&a));
                Vector3::new(0.0, by(&t1), by(&t2))
            };
            let [d1, d2] = tangents.departure_tangents;
            *out = SMatrix::from_columns(&[
                -moved.tr_mul(&l),
                -moved.tr_mul(&e1),
                -moved.tr_mul(&e2),
                moved.tr_mul(&a1) + tilted(&d1),
                moved.tr_mul(&a2) + tilted(&d2),
            ]);
        }
        Derivatives { pose, surfaces }
    }
}

/// A free vector mirrored: `v - 2 n n'v`.
pub(super) fn turned<T: Real>(plane: &Plane<T>, v: &Vector3<T>) -> Vector3<T> {
    let n = plane.normal.vector();
    v - n * (T::of(2.0) * n.dot(v))
}

/// Columns of derivatives by position, attitude and clock.
fn columns(of: &[(Vector3<f64>, Vector3<f64>, f64); ROWS]) -> SMatrix<f64, POSE_STATES, ROWS> {
    let columns = of.map(|(x, a, clock)| [x.x, x.y, x.z, a.x, a.y, a.z, clock]);
    SMatrix::from(columns)
}

#[cfg(test)]
mod tests;
