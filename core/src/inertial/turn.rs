//! Finite rotations of the strapdown mechanisation.
//!
//! A unit quaternion, because it composes at a third of a matrix's cost and stays a rotation by one scaling. Angles of a
//! step are small, so exponential and logarithm are short series; beyond a fifth of a radian `libm` takes over.

use crate::geometry::{Body, GeometryError, Matrix3, Real, Rotation, Vector3, World};

/// Square of the tangent of half an angle up to which the series are exact to round-off.
/// Derived: the next term of each series is below the last bit.
const SMALL: f64 = 1e-3;

/// A rotation as a unit quaternion w + x i + y j + z k (Hamilton): turns vectors of the body frame into those of the
/// frame in which the rotation began.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn<T: Real = f64> {
    w: T,
    v: Vector3<T>,
}

impl<T: Real> Turn<T> {
    /// Square of half the angle up to which the series are exact to the last bit of an `f64` (angle 0.2 rad).
    /// Derived: the next term of each series is below the last bit.
    const SERIES_LIMIT: f64 = 0.01;

    /// No rotation.
    pub fn identity() -> Self {
        Self {
            w: T::one(),
            v: Vector3::zeros(),
        }
    }

    /// From a quaternion [w, x, y, z], normalised here.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity, [`GeometryError::ZeroLength`] for a zero quaternion.
    pub fn from_quaternion([w, x, y, z]: [T; 4]) -> Result<Self, GeometryError> {
        let norm = (w * w + x * x + y * y + z * z).sqrt();
        if !norm.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        if norm <= T::zero() {
            return Err(GeometryError::ZeroLength);
        }
        Ok(Self {
            w: w / norm,
            v: Vector3::new(x, y, z) / norm,
        })
    }

    /// The rotation about the axis and by the length of a rotation vector, rad.
    pub fn from_rotation_vector(angle_rad: &Vector3<T>) -> Self {
        let half = *angle_rad * T::of(0.5);
        let square = half.x * half.x + half.y * half.y + half.z * half.z;
        if square <= T::of(Self::SERIES_LIMIT) {
            let terms = |a: f64, b: f64, c: f64, d: f64| {
                T::one()
                    - square
                        * T::of(a)
                        * (T::one()
                            - square
                                * T::of(b)
                                * (T::one() - square * T::of(c) * (T::one() - square * T::of(d))))
            };
            // sin h / h and cos h, nested: the factors are ratios of consecutive factorials.
            let sinc = terms(1.0 / 6.0, 1.0 / 20.0, 1.0 / 42.0, 1.0 / 72.0);
            let w = terms(1.0 / 2.0, 1.0 / 12.0, 1.0 / 30.0, 1.0 / 56.0);
            Self { w, v: half * sinc }
        } else {
            let length = square.sqrt();
            let (sin, cos) = length.sin_cos_libm();
            Self {
                w: cos,
                v: half * (sin / length),
            }
        }
    }

    /// Axis times angle, rad, of length 0..=pi.
    pub fn rotation_vector(&self) -> Vector3<T> {
        // A quaternion and its negative are the same rotation.
        let (w, v) = if self.w < T::zero() {
            (-self.w, -self.v)
        } else {
            (self.w, self.v)
        };
        let square = v.x * v.x + v.y * v.y + v.z * v.z;
        if square <= T::of(SMALL) * w * w {
            // 2 atan(r) / r with r = |v| / w.
            let r2 = square / (w * w);
            let series = T::one()
                - r2 * (T::of(1.0 / 3.0)
                    - r2 * (T::of(0.2) - r2 * (T::of(1.0 / 7.0) - r2 * T::of(1.0 / 9.0))));
            v * (T::of(2.0) * series / w)
        } else {
            let length = square.sqrt();
            v * (T::of(2.0) * length.atan2_libm(w) / length)
        }
    }

    /// This rotation followed, in the turned frame, by another.
    pub fn then(&self, next: &Self) -> Self {
        let (a, b) = (self, next);
        Self {
            w: a.w * b.w - (a.v.x * b.v.x + a.v.y * b.v.y + a.v.z * b.v.z),
            v: b.v * a.w + a.v * b.w + a.v.cross(&b.v),
        }
    }

    /// Scaled back to unit length, to first order: exact as long as it is applied at every step.
    pub fn renormalised(&self) -> Self {
        let square = self.w * self.w + (self.v.x * self.v.x + self.v.y * self.v.y + self.v.z * self.v.z);
        let scale = (T::of(3.0) - square) * T::of(0.5);
        Self {
            w: self.w * scale,
            v: self.v * scale,
        }
    }

    /// Turns a vector.
    pub fn apply(&self, vector: &Vector3<T>) -> Vector3<T> {
        let twice = self.v.cross(vector) * T::of(2.0);
        vector + twice * self.w + self.v.cross(&twice)
    }

    /// The rotation back.
    pub fn inverse(&self) -> Self {
        Self {
            w: self.w,
            v: -self.v,
        }
    }

    /// Components [w, x, y, z].
    pub fn to_quaternion(&self) -> [T; 4] {
        [self.w, self.v.x, self.v.y, self.v.z]
    }

    /// Rotation matrix.
    pub fn matrix(&self) -> Matrix3<T> {
        let two = T::of(2.0);
        let (w, x, y, z) = (self.w, self.v.x, self.v.y, self.v.z);
        #[rustfmt::skip]
        let matrix = Matrix3::new(
            T::one() - two * (y * y + z * z), two * (x * y - w * z), two * (x * z + w * y),
            two * (x * y + w * z), T::one() - two * (x * x + z * z), two * (y * z - w * x),
            two * (x * z - w * y), two * (y * z + w * x), T::one() - two * (x * x + y * y),
        );
        matrix
    }

    /// As the attitude of the UAV.
    ///
    /// # Errors
    /// As [`Turn::from_quaternion`]: when the rotation has been made of numbers that are not finite.
    pub fn to_attitude(&self) -> Result<Rotation<Body, World, T>, GeometryError> {
        Rotation::from_quaternion(self.to_quaternion())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn angles() -> impl Iterator<Item = Vector3<f64>> {
        [
            1e-9,
            1e-4,
            0.02,
            0.062,
            0.064,
            0.199,
            0.201,
            1.0,
            3.0,
            3.0 + 0.139,
        ]
        .into_iter()
        .flat_map(|length| {
            [(1.0, 0.0, 0.0), (-0.6, 0.0, 0.8), (0.48, -0.6, 0.64)]
                .map(|(x, y, z)| Vector3::new(x, y, z) * length)
        })
    }

    #[test]
    fn logarithm_undoes_exponential_across_both_series_limits() {
        for angle in angles() {
            let back = Turn::from_rotation_vector(&angle).rotation_vector();
            assert!(
                (back - angle).norm() < 4e-15 * (1.0 + angle.norm()),
                "{angle:?}: {back:?}"
            );
            let narrow = angle.map(|a| a as f32);
            let back = Turn::from_rotation_vector(&narrow).rotation_vector();
            assert!(
                (back - narrow).norm() < 4e-7 * narrow.norm(),
                "{narrow:?}: {back:?}"
            );
        }
    }

    #[test]
    fn exponential_agrees_with_the_matrix_of_rodrigues() {
        for angle in angles() {
            let length = angle.norm();
            let k = (angle / length).cross_matrix();
            let expected = Matrix3::identity() + k * libm::sin(length) + k * k * (1.0 - libm::cos(length));
            let turn = Turn::from_rotation_vector(&angle);
            assert!((turn.matrix() - expected).norm() < 1e-14, "{angle:?}");
            let vector = Vector3::new(0.3, -2.0, 0.9);
            assert!((turn.apply(&vector) - expected * vector).norm() < 1e-14);
            assert!((turn.inverse().apply(&turn.apply(&vector)) - vector).norm() < 1e-14);
        }
    }

    #[test]
    fn rotations_follow_each_other_in_the_turned_frame() {
        let quarter = core::f64::consts::FRAC_PI_2;
        let yaw = Turn::from_rotation_vector(&Vector3::new(0.0, 0.0, quarter));
        let roll = Turn::from_rotation_vector(&Vector3::new(quarter, 0.0, 0.0));
        // Nose to the north, then left wing up about the nose: body y ends upward, body z ends eastward.
        let both = yaw.then(&roll);
        assert!((both.apply(&Vector3::y()) - Vector3::z()).norm() < 1e-15);
        assert!((both.apply(&Vector3::z()) - Vector3::x()).norm() < 1e-15);
        assert!((both.matrix() - yaw.matrix() * roll.matrix()).norm() < 1e-15);
    }

    #[test]
    fn renormalisation_keeps_unit_length_for_ever() {
        let step = Turn::<f32>::from_rotation_vector(&Vector3::new(1e-3, -2e-3, 5e-4));
        let mut turn = Turn::identity();
        for _ in 0..1_000_000 {
            turn = turn.then(&step).renormalised();
        }
        let norm: f32 = turn.to_quaternion().iter().map(|c| c * c).sum();
        assert!((norm - 1.0).abs() < 1e-6, "{norm}");
    }

    #[test]
    fn bad_quaternions_are_named() {
        assert_eq!(
            Turn::from_quaternion([0.0_f64; 4]),
            Err(GeometryError::ZeroLength)
        );
        assert_eq!(
            Turn::from_quaternion([f64::NAN, 0.0, 0.0, 1.0]),
            Err(GeometryError::NotFinite)
        );
    }
}
