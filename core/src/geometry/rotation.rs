//! Rotations between frames.

use core::marker::PhantomData;

use nalgebra::{Matrix3, Vector3};

use super::{Direction, Frame, GeometryError, Real};

/// A rotation that turns vectors given in frame `From` into the same vectors given in frame `To`.
///
/// `Rotation<Body, World>` is the attitude `R_wb` of the UAV.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation<From: Frame, To: Frame, T: Real = f32> {
    matrix: Matrix3<T>,
    frames: PhantomData<(From, To)>,
}

impl<From: Frame, To: Frame, T: Real> Rotation<From, To, T> {
    /// The rotation of two frames whose axes coincide.
    pub fn identity() -> Self {
        Self {
            matrix: Matrix3::identity(),
            frames: PhantomData,
        }
    }

    /// From a quaternion [w, x, y, z] (Hamilton), normalised here.
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
        let (w, x, y, z) = (w / norm, x / norm, y / norm, z / norm);
        let (one, two) = (T::one(), T::of(2.0));
        #[rustfmt::skip]
        let matrix = Matrix3::new(
            one - two * (y * y + z * z), two * (x * y - w * z),       two * (x * z + w * y),
            two * (x * y + w * z),       one - two * (x * x + z * z), two * (y * z - w * x),
            two * (x * z - w * y),       two * (y * z + w * x),       one - two * (x * x + y * y),
        );
        Ok(Self {
            matrix,
            frames: PhantomData,
        })
    }

    /// From yaw (about z), then pitch (about the new y), then roll (about the new x), rad.
    ///
    /// In forward-left-up axes a positive pitch lowers the nose.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity.
    pub fn from_yaw_pitch_roll(yaw_rad: T, pitch_rad: T, roll_rad: T) -> Result<Self, GeometryError> {
        if !(yaw_rad.is_finite() && pitch_rad.is_finite() && roll_rad.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        let half = T::of(0.5);
        let (sy, cy) = (yaw_rad * half).sin_cos_libm();
        let (sp, cp) = (pitch_rad * half).sin_cos_libm();
        let (sr, cr) = (roll_rad * half).sin_cos_libm();
        Self::from_quaternion([
            cy * cp * cr + sy * sp * sr,
            cy * cp * sr - sy * sp * cr,
            cy * sp * cr + sy * cp * sr,
            sy * cp * cr - cy * sp * sr,
        ])
    }

    /// From a matrix that is a rotation up to rounding; the columns are made orthonormal again, the first one kept.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity, [`GeometryError::ZeroLength`] for columns that do not span.
    pub fn from_matrix(matrix: Matrix3<T>) -> Result<Self, GeometryError> {
        if !matrix.iter().all(|c| c.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        let unit = |v: Vector3<T>| {
            let length = v.norm();
            (length > T::zero()).then(|| v / length)
        };
        let x = unit(matrix.column(0).into_owned()).ok_or(GeometryError::ZeroLength)?;
        let z = unit(x.cross(&matrix.column(1))).ok_or(GeometryError::ZeroLength)?;
        Ok(Self {
            matrix: Matrix3::from_columns(&[x, z.cross(&x), z]),
            frames: PhantomData,
        })
    }

    /// From a rotation vector (axis times angle, rad): the matrix exponential.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity.
    pub fn from_rotation_vector(angle_rad: &Vector3<T>) -> Result<Self, GeometryError> {
        let half = angle_rad * T::of(0.5);
        let size = half.norm();
        // sin(x)/x, by its series where the quotient would lose digits.
        let share = if size > T::of(1e-3) {
            size.sin_cos_libm().0 / size
        } else {
            T::one() - size * size / T::of(6.0)
        };
        let (_, cosine) = size.sin_cos_libm();
        Self::from_quaternion([cosine, half.x * share, half.y * share, half.z * share])
    }

    /// The rotation that turns by `first`, then by this one.
    pub fn after<Start: Frame>(&self, first: &Rotation<Start, From, T>) -> Rotation<Start, To, T> {
        Rotation {
            matrix: self.matrix * first.matrix,
            frames: PhantomData,
        }
    }

    /// Turns a direction.
    pub fn apply(&self, direction: Direction<From, T>) -> Direction<To, T> {
        Direction::from_unit(self.matrix * direction.vector())
    }

    /// Turns a free vector, such as a lever arm.
    pub fn apply_vector(&self, vector: &Vector3<T>) -> Vector3<T> {
        self.matrix * vector
    }

    /// The rotation back.
    pub fn inverse(&self) -> Rotation<To, From, T> {
        Rotation {
            matrix: self.matrix.transpose(),
            frames: PhantomData,
        }
    }

    /// Rotation matrix, rows in `To`, columns in `From`.
    pub fn matrix(&self) -> &Matrix3<T> {
        &self.matrix
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::geometry::{Body, World};

    #[test]
    fn yaw_turns_forward_to_north_and_pitch_lowers_the_nose() {
        let forward = Direction::<Body, f64>::from_vector(Vector3::x()).expect("unit");
        let yaw = Rotation::<Body, World, f64>::from_yaw_pitch_roll(FRAC_PI_2, 0.0, 0.0).expect("finite");
        assert!((yaw.apply(forward).vector() - Vector3::y()).norm() < 1e-15);
        let pitch = Rotation::<Body, World, f64>::from_yaw_pitch_roll(0.0, 0.2, 0.0).expect("finite");
        assert!(pitch.apply(forward).vector().z < 0.0);
    }

    #[test]
    fn inverse_undoes() {
        let r = Rotation::<Body, World, f64>::from_quaternion([0.3, -0.8, 0.1, 2.0]).expect("finite");
        let v = Vector3::new(0.2, -3.0, 0.7);
        assert!((r.inverse().apply_vector(&r.apply_vector(&v)) - v).norm() < 1e-14);
        assert!((r.matrix().determinant() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_matrix_is_taken_and_straightened() {
        let r = Rotation::<Body, World, f64>::from_quaternion([0.3, -0.8, 0.1, 2.0]).expect("finite");
        let bent = r.matrix() + Matrix3::from_fn(|i, j| 1e-7 * (i as f64 - 2.0 * j as f64));
        let straight = Rotation::<Body, World, f64>::from_matrix(bent).expect("a rotation");
        let m = straight.matrix();
        assert!((m.transpose() * m - Matrix3::identity()).norm() < 1e-14);
        assert!((m - r.matrix()).norm() < 2e-6);
        let make = Rotation::<Body, World, f64>::from_matrix;
        assert_eq!(make(Matrix3::zeros()), Err(GeometryError::ZeroLength));
        assert_eq!(
            make(Matrix3::from_element(f64::NAN)),
            Err(GeometryError::NotFinite)
        );
    }

    #[test]
    fn rotation_vectors_turn_about_their_axis_and_small_ones_add() {
        let turn =
            |v: [f64; 3]| Rotation::<Body, Body, f64>::from_rotation_vector(&v.into()).expect("finite");
        let yaw = Rotation::<Body, Body, f64>::from_yaw_pitch_roll(2.5, 0.0, 0.0).expect("finite");
        assert!((turn([0.0, 0.0, 2.5]).matrix() - yaw.matrix()).norm() < 1e-14);
        // Both sides of the series' limit.
        for size in [1e-9, 1.9e-3, 2.1e-3, 0.3] {
            let half = turn([0.3 * size, -0.4 * size, 0.5 * size]);
            let whole = turn([0.6 * size, -0.8 * size, size]);
            assert!(
                (half.after(&half).matrix() - whole.matrix()).norm() < 1e-14,
                "{size}"
            );
        }
        assert!(Rotation::<Body, Body, f64>::from_rotation_vector(&Vector3::repeat(f64::NAN)).is_err());
    }

    #[test]
    fn composition_turns_by_the_first_first() {
        let first = Rotation::<Body, World, f64>::from_yaw_pitch_roll(0.4, -0.3, 0.9).expect("finite");
        let second = Rotation::<World, World, f64>::from_yaw_pitch_roll(-1.0, 0.2, 0.1).expect("finite");
        let v = Vector3::new(1.0, 2.0, -0.5);
        let both = second.after(&first).apply_vector(&v);
        assert!((both - second.apply_vector(&first.apply_vector(&v))).norm() < 1e-15);
    }

    #[test]
    fn bad_quaternions_are_named() {
        let make = Rotation::<Body, World, f32>::from_quaternion;
        assert_eq!(make([0.0; 4]), Err(GeometryError::ZeroLength));
        assert_eq!(make([f32::NAN, 0.0, 0.0, 1.0]), Err(GeometryError::NotFinite));
        assert_eq!(
            make([f32::MAX, f32::MAX, 0.0, 1.0]),
            Err(GeometryError::NotFinite)
        );
    }
}
