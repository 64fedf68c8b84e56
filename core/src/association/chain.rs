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

use crate::geometry::Real;
use crate::localization::planes::Plane;
pub(super) use crate::surfaces::MOST_REFLECTIONS;

/// Height over a surface under which an end or a point lies in it, m.
const LEAST_HEIGHT_M: f64 = 0.1;
/// Numbers that a path measures: delay, two of arrival, two of departure.
pub const ROWS: usize = 5;
/// Errors of a pose: position (3, m), attitude (3, rad), clock (1, m).
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
mod tests {
    use super::*;
    use crate::geometry::{Direction, Position, World};

    fn plane(normal: [f64; 3], centre: [f64; 3]) -> Plane<f64> {
        Plane {
            normal: Direction::from_vector(normal.into()).expect("not zero"),
            centre: Position::from_vector(centre.into()).expect("finite"),
            covariance: Matrix3::identity(),
        }
    }

    /// The ground, and a corner of two walls.
    fn scene() -> [Plane<f64>; 3] {
        [
            plane([0.01, -0.02, 1.0], [4.0, 12.0, 0.1]),
            plane([-1.0, 0.02, 0.004], [20.0, 3.0, 4.0]),
            plane([0.03, -1.0, -0.003], [5.0, 60.0, 6.0]),
        ]
    }

    const GMT: [f64; 3] = [2.0, -10.0, 1.5];
    const UAV: [f64; 3] = [6.0, 25.0, 9.0];

    fn at(point: [f64; 3]) -> Vector3<f64> {
        Vector3::from(point)
    }

    #[test]
    fn the_way_over_the_points_is_the_path() {
        for k in 0..=3 {
            let scene = scene();
            let chain = Chain::over(&scene[..k]);
            let path = chain.predict(&at(GMT), &at(UAV)).expect("exists");
            assert_eq!(path.points.len(), k);
            let mut way: Vec<Vector3<f64>, 5> = Vec::new();
            way.push(at(GMT)).expect("room");
            way.extend(path.points.iter().copied());
            way.push(at(UAV)).expect("room");
            let length: f64 = way.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
            assert!((length - path.range_m).abs() < 1e-9, "{k}");
            assert!(
                ((way[1] - way[0]).normalize() - path.departure).norm() < 1e-9,
                "{k}"
            );
            assert!(
                ((way[k] - way[k + 1]).normalize() - path.arrival).norm() < 1e-9,
                "{k}"
            );
            for (point, plane) in path.points.iter().zip(&scene) {
                assert!(plane.height_m(point).abs() < 1e-9, "{k}");
            }
        }
    }

    #[test]
    fn a_chain_behind_a_surface_does_not_exist() {
        let scene = scene();
        let wall = &scene[1..2];
        let behind = Vector3::new(25.0, 0.0, 5.0);
        assert!(Chain::over(wall).predict(&at(GMT), &behind).is_none());
        assert!(Chain::over(wall).predict(&behind, &at(UAV)).is_none());
        // The wave would have to come through the second wall to be reflected by the first.
        let facing_away = [scene[1], plane([-1.0, 0.0, 0.0], [10.0, 0.0, 4.0])];
        assert!(Chain::over(&facing_away).predict(&at(GMT), &at(UAV)).is_none());
        assert!(Chain::over(&[]).predict(&at(GMT), &at(GMT)).is_none());
        assert!(
            Chain::over(&[])
                .predict(&at(GMT), &Vector3::repeat(f64::NAN))
                .is_none()
        );
    }

    /// Innovation of a measurement against a chain, with the pose's errors applied.
    fn innovation(
        planes: &[Plane<f64>],
        (transmitter, uav): (&Vector3<f64>, &Vector3<f64>),
        turn: &Vector3<f64>,
        clock: f64,
        measured: (f64, &Tangents, &Vector3<f64>),
    ) -> [f64; ROWS] {
        let (delay, tangents, departure) = measured;
        let path = Chain::over(planes).predict(transmitter, uav).expect("exists");
        let seen = tangents.arrival + turn.cross(&tangents.arrival);
        let [e1, e2] = tangents.arrival_tangents;
        let [a1, a2] = tangents.departure_tangents;
        [
            delay - clock - path.range_m,
            e1.dot(&(seen - path.arrival)),
            e2.dot(&(seen - path.arrival)),
            a1.dot(&(departure - path.departure)),
            a2.dot(&(departure - path.departure)),
        ]
    }

    #[test]
    fn derivatives_are_the_difference_quotients() {
        const STEP: f64 = 1e-5;
        // Three on the way up, with the ground first, and three on the way back, with the ground last.
        let up: [&[usize]; 6] = [&[], &[0], &[1], &[1, 2], &[0, 1], &[0, 1, 2]];
        let down: [&[usize]; 3] = [&[2, 1], &[1, 0], &[2, 1, 0]];
        let up = up.map(|chain| (chain, at(GMT), at(UAV)));
        let down = down.map(|chain| (chain, at(UAV), at(GMT)));
        for (chain, transmitter, uav) in up.into_iter().chain(down) {
            let planes: Vec<Plane<f64>, 3> = chain.iter().map(|index| scene()[*index]).collect();
            let path = Chain::over(&planes).predict(&transmitter, &uav).expect("exists");
            // Measured a little beside, as in flight.
            let tangents_of = |v: Vector3<f64>| {
                let direction = Direction::<World, f64>::from_vector(v).expect("not zero");
                (*direction.vector(), direction.tangents())
            };
            let (arrival, e) = tangents_of(path.arrival);
            let (departure, a) = tangents_of(path.departure + Vector3::new(0.01, -0.02, 0.004));
            let tangents = Tangents {
                arrival,
                arrival_tangents: [e.0, e.1],
                departure_tangents: [a.0, a.1],
            };
            let of = |planes: &[Plane<f64>], pose: &[f64; POSE_STATES]| {
                let [x, y, z, a, b, c, clock] = *pose;
                let (uav, turn) = (uav + Vector3::new(x, y, z), Vector3::new(a, b, c));
                innovation(
                    planes,
                    (&transmitter, &uav),
                    &turn,
                    clock,
                    (path.range_m, &tangents, &departure),
                )
            };
            let quotient = |plus: [f64; ROWS], minus: [f64; ROWS]| -> [f64; ROWS] {
                core::array::from_fn(|row| (plus[row] - minus[row]) / (2.0 * STEP))
            };
            let derivatives = Chain::over(&planes).derivatives(&transmitter, &path, &tangents);
            for state in 0..POSE_STATES {
                let by = |step: f64| {
                    of(
                        &planes,
                        &core::array::from_fn(|s| if s == state { step } else { 0.0 }),
                    )
                };
                for (row, slope) in quotient(by(STEP), by(-STEP)).into_iter().enumerate() {
                    let analytic = derivatives.pose[(state, row)];
                    assert!(
                        (analytic - slope).abs() < 1e-8,
                        "{chain:?} {state} {row}: {analytic} {slope}"
                    );
                }
            }
            for j in 0..planes.len() {
                for parameter in 0..3 {
                    let by = |step: f64| {
                        let mut planes = planes.clone();
                        let change = core::array::from_fn(|p| if p == parameter { step } else { 0.0 });
                        planes[j] = planes[j].corrected(change, planes[j].covariance).expect("finite");
                        of(&planes, &[0.0; POSE_STATES])
                    };
                    for (row, slope) in quotient(by(STEP), by(-STEP)).into_iter().enumerate() {
                        let analytic = derivatives.surfaces[j][(parameter, row)];
                        assert!(
                            (analytic - slope).abs() < 1e-7,
                            "{chain:?} surface {j} {parameter} {row}: {analytic} {slope}"
                        );
                    }
                }
            }
        }
    }
}
