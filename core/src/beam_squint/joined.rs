//! The bearings of several faces as one direction.
//!
//! A face tells the angle along its row the worse the further off its normal the wave leaves: a cosine of 1.5 mrad is
//! 3 mrad of azimuth at 60 degrees. There the neighbouring face looks at the same place from its other side. It sends the
//! same symbols, has element errors of its own, and is heard until the wave leaves along its front. Both faces stand on one
//! mast, so each bearing measures two components of one direction; they are added up with their full covariance, noise and
//! the constant error of the face together.

use nalgebra::{Matrix2, Vector2};

use super::{Bearing, Delay, Expected, Sighting};
use crate::array::{GmtArrays, GmtFace};
use crate::geometry::{Direction, Gmt, Vector3};

/// Cosine of the angle off a face's normal from which on it is listened to: 84 degrees.
/// Derived: Beyond, its elements are at their floor and the cosine along the row stands still.
const LEAST_AHEAD: f32 = 0.1;
/// How far from where one face puts the path another looks for it, direction cosine.
/// Derived: a step of the search and a few standard deviations.
const RADIUS: f32 = 0.06;
/// Chi-square of two degrees of freedom beyond which a face contradicts what the faces before it said.
/// Derived: one in 10 000.
const GATE: f32 = 18.4;

/// Direction and delay of the UAV as all faces see it that were heard.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joined {
    /// Direction from the GMT.
    pub direction: Direction<Gmt>,
    /// Its covariance along the direction's two tangents, rad^2: noise and the faces' constant errors.
    pub covariance: Matrix2<f32>,
    /// The delay of the face that tells it best.
    pub delay: Option<Delay>,
    /// Faces that agreed.
    pub faces: usize,
}

impl Sighting {
    /// The same for another face: where it must see what one face saw at `seen`. None when the wave leaves along its front
    /// or from behind it, or there is no such face.
    #[must_use]
    pub fn on_face<const FACES: usize, const X: usize, const Z: usize>(
        &self,
        face: usize,
        seen: &Direction<Gmt>,
        arrays: &GmtArrays<f32, FACES, X, Z>,
    ) -> Option<Self> {
        let described = arrays.faces().get(face)?;
        (described.normal.dot(seen.vector()) > LEAST_AHEAD).then(|| Self {
            face,
            expected: Some(Expected {
                cosines: GmtArrays::<f32, FACES, X, Z>::cosines(described, seen),
                radius: RADIUS,
            }),
            ..self.clone()
        })
    }
}

impl Joined {
    /// Of one or more bearings, the surest first: one that contradicts those before it is left out. `bias_sigma` is the
    /// standard deviation of the constant error of a face's cosines ([`super::FACE_BIAS_SIGMA`], zero for perfect arrays),
    /// independent from face to face. None without a bearing, or when the first is no direction.
    #[must_use]
    pub fn new<const FACES: usize, const X: usize, const Z: usize>(
        bearings: &[Bearing],
        bias_sigma: [f32; 2],
        arrays: &GmtArrays<f32, FACES, X, Z>,
    ) -> Option<Self> {
        let (first, others) = bearings.split_first()?;
        let face = arrays.faces().get(first.face)?;
        let direction = first.direction(face)?;
        let by_cosines = Look::new(face, &direction).by_tangents.try_inverse()?;
        let mut joined = Self {
            direction,
            covariance: by_cosines * with_bias(first, bias_sigma) * by_cosines.transpose(),
            delay: first.delay,
            faces: 1,
        };
        for bearing in others {
            let face = arrays.faces().get(bearing.face);
            if let Some(next) = face.and_then(|face| joined.with(bearing, face, bias_sigma)) {
                joined = next;
            }
        }
        Some(joined)
    }

    /// With one more bearing; none when it contradicts.
    fn with(&self, bearing: &Bearing, face: &GmtFace, bias_sigma: [f32; 2]) -> Option<Self> {
        let look = Look::new(face, &self.direction);
        let j = look.by_tangents;
        let residual = Vector2::from(bearing.cosines) - look.cosines;
        let innovation = j * self.covariance * j.transpose() + with_bias(bearing, bias_sigma);
        let inverse = innovation.try_inverse()?;
        let chi_square = residual.dot(&(inverse * residual));
        if chi_square.is_nan() || chi_square > GATE {
            return None;
        }
        let gain = self.covariance * j.transpose() * inverse;
        let step = gain * residual;
        let (e1, e2) = self.direction.tangents();
        let covariance = self.covariance - gain * j * self.covariance;
        let moved = self.direction.vector() + e1 * step.x + e2 * step.y;
        Some(Self {
            direction: Direction::from_vector(moved).ok()?,
            covariance: (covariance + covariance.transpose()) * 0.5,
            delay: match (self.delay, bearing.delay) {
                (Some(a), Some(b)) if b.variance_m2 < a.variance_m2 => Some(b),
                (a, b) => a.or(b),
            },
            faces: self.faces + 1,
        })
    }
}

/// A direction as a face has it.
struct Look {
    cosines: Vector2<f32>,
    /// Derivative of the cosines by the direction's tangents.
    by_tangents: Matrix2<f32>,
}

impl Look {
    fn new(face: &GmtFace, direction: &Direction<Gmt>) -> Self {
        let (row, column): (Vector3<f32>, Vector3<f32>) = (face.tangent, face.normal.cross(&face.tangent));
        let (u, (e1, e2)) = (direction.vector(), direction.tangents());
        Self {
            cosines: Vector2::new(row.dot(u), column.dot(u)),
            by_tangents: Matrix2::new(row.dot(&e1), row.dot(&e2), column.dot(&e1), column.dot(&e2)),
        }
    }
}

/// Covariance of a bearing with the constant error of its face.
fn with_bias(bearing: &Bearing, [x, z]: [f32; 2]) -> Matrix2<f32> {
    let mut covariance = bearing.covariance;
    covariance.m11 += x * x;
    covariance.m22 += z * z;
    covariance
}

#[cfg(test)]
mod tests {
    use super::*;

    const BIAS: [f32; 2] = [1.5e-3, 1.5e-3];

    fn arrays() -> GmtArrays<f32> {
        GmtArrays::default()
    }

    fn direction(azimuth_deg: f32) -> Direction<Gmt> {
        Direction::from_zenith_azimuth(80_f32.to_radians(), azimuth_deg.to_radians()).expect("angles")
    }

    /// What a face says of a direction, its cosines off by `off`.
    fn bearing(face: usize, u: &Direction<Gmt>, off: [f32; 2]) -> Bearing {
        let [x, z] = GmtArrays::<f32>::cosines(&arrays().faces()[face], u);
        Bearing {
            face,
            cosines: [x + off[0], z + off[1]],
            covariance: Matrix2::new(1e-8, 0.0, 0.0, 1e-8),
            delay: None,
        }
    }

    #[test]
    fn covariance_is_the_inverse_of_the_added_information() {
        for azimuth_deg in [0.0_f32, 35.0, 45.0, 60.0] {
            // Level: there the cosine along a row changes by cos(off) a tangent, that of the column by one.
            let u = Direction::from_vector(Vector3::new(
                azimuth_deg.to_radians().cos(),
                azimuth_deg.to_radians().sin(),
                0.0,
            ));
            let u = u.expect("unit");
            let one = Joined::new(&[bearing(0, &u, [0.0; 2])], BIAS, &arrays()).expect("a face");
            let both = [bearing(0, &u, [0.0; 2]), bearing(1, &u, [0.0; 2])];
            let both = Joined::new(&both, BIAS, &arrays()).expect("faces");
            let variance = 1e-8 + 1.5e-3 * 1.5e-3;
            let share = |off_deg: f32| off_deg.to_radians().cos().powi(2);
            let (near, far) = (share(azimuth_deg), share(120.0 - azimuth_deg));
            for (joined, expected) in [
                (one, [variance / near, variance]),
                (both, [variance / (near + far), variance / 2.0]),
            ] {
                let ratios = [
                    joined.covariance.m11 / expected[0],
                    joined.covariance.m22 / expected[1],
                ];
                assert!(
                    ratios.iter().all(|ratio| (ratio - 1.0).abs() < 1e-3),
                    "{azimuth_deg}: {ratios:?}"
                );
                assert!(joined.covariance.m12.abs() < 1e-3 * joined.covariance.m22);
                assert!(joined.direction.angle_to_rad(&u) < 1e-6);
            }
            assert_eq!((one.faces, both.faces), (1, 2));
        }
    }

    #[test]
    fn at_the_border_both_faces_count_alike() {
        let u = direction(60.0);
        let arrays = arrays();
        let off = 2e-3;
        let one = [bearing(0, &u, [off, 0.0])];
        let both = [bearing(0, &u, [off, 0.0]), bearing(1, &u, [0.0; 2])];
        let error = |b: &[Bearing]| {
            let joined = Joined::new(b, BIAS, &arrays).expect("faces");
            joined.direction.angle_to_rad(&u)
        };
        assert!(
            (error(&both) / error(&one) - 0.5).abs() < 0.01,
            "{}",
            error(&both) / error(&one)
        );
    }

    #[test]
    fn a_face_that_contradicts_is_left_out() {
        let u = direction(55.0);
        let wrong = [bearing(0, &u, [0.0; 2]), bearing(1, &u, [0.02, 0.0])];
        let joined = Joined::new(&wrong, BIAS, &arrays()).expect("a face");
        assert!(joined.faces == 1 && joined.direction.angle_to_rad(&u) < 1e-6);
        assert_eq!(Joined::new(&[], BIAS, &arrays()), None);
        let nowhere = Bearing {
            cosines: [0.9, 0.9],
            ..wrong[0]
        };
        assert_eq!(Joined::new(&[nowhere], BIAS, &arrays()), None);
        // The surer delay is kept.
        let with = |b: Bearing, variance_m2| Bearing {
            delay: Some(Delay {
                c_tau_m: 50.0,
                variance_m2,
            }),
            ..b
        };
        let two = [with(wrong[0], 2.0), with(bearing(1, &u, [0.0; 2]), 1.0)];
        let joined = Joined::new(&two, BIAS, &arrays()).expect("faces");
        assert_eq!(joined.delay.map(|d| d.variance_m2), Some(1.0));
    }

    #[test]
    fn a_face_is_listened_to_as_far_as_it_looks() {
        let sighting = Sighting {
            line_of_sight: true,
            face: 0,
            aoa: Direction::from_vector(Vector3::x()).expect("unit"),
            c_tau_m: 50.0,
            interferers: heapless::Vec::new(),
            expected: None,
            ground: None,
        };
        let on = |azimuth_deg: f32, face| sighting.on_face(face, &direction(azimuth_deg), &arrays());
        // Face 1 looks at 120 degrees.
        let neighbour = on(50.0, 1).expect("70 degrees off");
        assert!(neighbour.face == 1 && neighbour.aoa == sighting.aoa);
        let expected = neighbour.expected.expect("told where");
        assert!((expected.cosines[0] + 80_f32.to_radians().sin() * 70_f32.to_radians().sin()).abs() < 1e-6);
        assert!(on(33.0, 1).is_none() && on(50.0, 2).is_none() && on(50.0, 3).is_none());
    }
}
