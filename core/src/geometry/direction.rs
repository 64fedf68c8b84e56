//! Unit vectors in a frame.

use core::marker::PhantomData;

use nalgebra::Vector3;

use super::{Frame, GeometryError, Real};

/// A unit vector in frame `F`.
///
/// `u = (sin zenith cos azimuth, sin zenith sin azimuth, cos zenith)`. An angle of arrival points from the UAV towards
/// where the wave comes from, an angle of departure from the GMT towards the first interaction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Direction<F: Frame, T: Real = f32> {
    unit: Vector3<T>,
    frame: PhantomData<F>,
}

impl<F: Frame, T: Real> Direction<F, T> {
    /// A direction from its zenith angle (0..=pi, 0 = up) and azimuth (any finite value), rad.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity, [`GeometryError::ZenithOutOfRange`] for a zenith angle more
    /// than one millionth of a radian outside 0..=pi (a value that was rounded up from pi is a direction down).
    pub fn from_zenith_azimuth(zenith_rad: T, azimuth_rad: T) -> Result<Self, GeometryError> {
        if !zenith_rad.is_finite() || !azimuth_rad.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        let slack = T::of(1e-6);
        if zenith_rad < -slack || zenith_rad > T::pi() + slack {
            return Err(GeometryError::ZenithOutOfRange);
        }
        let (sin_zenith, cos_zenith) = zenith_rad.sin_cos_libm();
        let (sin_azimuth, cos_azimuth) = azimuth_rad.sin_cos_libm();
        let unit = Vector3::new(sin_zenith * cos_azimuth, sin_zenith * sin_azimuth, cos_zenith);
        Ok(Self {
            unit,
            frame: PhantomData,
        })
    }

    /// The direction of a vector of any length.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity, [`GeometryError::ZeroLength`] for a vector whose squared
    /// length underflows.
    // Fifty callers: a copy at each costs more flash than the call costs time.
    #[inline(never)]
    pub fn from_vector(vector: Vector3<T>) -> Result<Self, GeometryError> {
        if !vector.iter().all(|c| c.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        let length = vector.norm_squared().root();
        if !length.is_finite() {
            return Err(GeometryError::NotFinite);
        }
        if length <= T::zero() {
            return Err(GeometryError::ZeroLength);
        }
        Ok(Self {
            unit: vector / length,
            frame: PhantomData,
        })
    }

    /// A vector of unit length, such as a [`Self::vector`] that was kept: taken as it is, where [`Self::from_vector`] would round its
    /// components again.
    ///
    /// # Errors
    /// [`GeometryError::NotFinite`] for NaN or infinity, [`GeometryError::NotUnit`] for a length more than 1e-4 off 1: no sequence of
    /// rotations in single precision strays so far.
    pub fn from_unit_vector(unit: Vector3<T>) -> Result<Self, GeometryError> {
        if !unit.iter().all(|c| c.is_finite()) {
            return Err(GeometryError::NotFinite);
        }
        // To first order the square is off by twice as much. One that overflows is no unit either.
        let off = unit.norm_squared() - T::one();
        if !(off < T::of(2e-4) && -off < T::of(2e-4)) {
            return Err(GeometryError::NotUnit);
        }
        Ok(Self::from_unit(unit))
    }

    /// A vector that is already of unit length, such as a rotated direction.
    pub(super) fn from_unit(unit: Vector3<T>) -> Self {
        Self {
            unit,
            frame: PhantomData,
        }
    }

    /// Components of the unit vector.
    pub fn vector(&self) -> &Vector3<T> {
        &self.unit
    }

    /// Zenith angle, rad, 0..=pi. Well conditioned at the poles too, where the arc cosine is not.
    pub fn zenith_rad(&self) -> T {
        let horizontal = (self.unit.x * self.unit.x + self.unit.y * self.unit.y).root();
        horizontal.atan2_libm(self.unit.z)
    }

    /// Azimuth, rad, in (-pi, pi]; 0 at the poles.
    pub fn azimuth_rad(&self) -> T {
        self.unit.y.atan2_libm(self.unit.x)
    }

    /// Angle to another direction, rad, 0..=pi. Exact for small angles as well (no arc cosine).
    pub fn angle_to_rad(&self, other: &Self) -> T {
        let sine = self.unit.cross(&other.unit).norm_squared().root();
        sine.atan2_libm(self.unit.dot(&other.unit))
    }

    /// Two unit tangents (e1, e2): e1 horizontal, towards growing azimuth, and e2 = u x e1. Free of poles: straight up
    /// and down, e1 is +y. The angular covariance of a path is given along these (docs/signal-model.md, "Path estimation").
    pub fn tangents(&self) -> (Vector3<T>, Vector3<T>) {
        let horizontal = Vector3::new(-self.unit.y, self.unit.x, T::zero());
        let length = horizontal.norm_squared().root();
        let e1 = if length > T::of(1e-6) {
            horizontal / length
        } else {
            Vector3::y()
        };
        (e1, self.unit.cross(&e1))
    }
}

impl<F: Frame> Direction<F> {
    /// The same direction in double precision, of unit length there.
    #[must_use]
    pub fn to_f64(&self) -> Direction<F, f64> {
        let unit = self.unit.map(f64::from);
        Direction::from_unit(unit / unit.norm_squared().root())
    }
}

#[cfg(test)]
mod tests {
    use core::f64::consts::{FRAC_PI_2, PI};

    use super::*;
    use crate::geometry::World;

    fn direction(zenith_rad: f64, azimuth_rad: f64) -> Direction<World, f64> {
        Direction::from_zenith_azimuth(zenith_rad, azimuth_rad).expect("valid angles")
    }

    #[test]
    fn a_kept_unit_vector_has_the_same_bits() {
        // Normalised again, some component of these is another number.
        let mut moved = 0;
        for k in 0..200_u8 {
            let angle = f32::from(k) * 0.015;
            let kept: Direction<World, f32> =
                Direction::from_zenith_azimuth(angle, 2.0 * angle).expect("valid");
            let again = Direction::<World>::from_unit_vector(*kept.vector()).expect("of unit length");
            assert_eq!(again.vector().map(f32::to_bits), kept.vector().map(f32::to_bits));
            moved += u32::from(Direction::<World>::from_vector(*kept.vector()).expect("a direction") != kept);
        }
        assert!(moved > 0);
        let tried = |x: f32| Direction::<World>::from_unit_vector(Vector3::new(x, 0.0, 0.0));
        assert_eq!(tried(f32::NAN), Err(GeometryError::NotFinite));
        for length in [0.0, 0.999, 1.001, f32::MAX] {
            assert_eq!(tried(length), Err(GeometryError::NotUnit));
        }
    }

    #[test]
    fn axes_follow_the_convention() {
        assert!((direction(0.0, 0.3).vector() - Vector3::z()).norm() < 1e-15);
        assert!((direction(FRAC_PI_2, 0.0).vector() - Vector3::x()).norm() < 1e-15);
        assert!((direction(FRAC_PI_2, FRAC_PI_2).vector() - Vector3::y()).norm() < 1e-15);
    }

    #[test]
    fn angles_survive_the_round_trip() {
        for (zenith, azimuth) in [
            (0.1, -3.0),
            (1.5, 0.0),
            (3.1, 2.9),
            (1e-7, 1.0),
            (PI - 1e-7, -1.0),
        ] {
            let u = direction(zenith, azimuth);
            assert!((u.zenith_rad() - zenith).abs() < 1e-15, "zenith {zenith}");
            assert!((u.azimuth_rad() - azimuth).abs() < 1e-9, "azimuth {azimuth}");
        }
    }

    #[test]
    fn tangents_are_an_orthonormal_basis_at_the_poles_too() {
        for u in [
            direction(0.0, 0.0),
            direction(PI, 2.0),
            direction(1.0, -2.0),
            direction(1e-5, 0.4),
        ] {
            let (e1, e2) = u.tangents();
            assert!(e1.dot(u.vector()).abs() < 1e-5 && e2.dot(u.vector()).abs() < 1e-5);
            assert!((e1.norm() - 1.0).abs() < 1e-12 && (e2.norm() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn small_angles_are_not_lost_to_rounding() {
        let (a, b) = (direction(1.0, 0.0), direction(1.0 + 1e-9, 0.0));
        assert!((a.angle_to_rad(&b) - 1e-9).abs() < 1e-15);
    }

    #[test]
    fn bad_numbers_are_named() {
        let make = Direction::<World, f32>::from_zenith_azimuth;
        assert_eq!(make(f32::NAN, 0.0), Err(GeometryError::NotFinite));
        assert_eq!(make(1.0, f32::INFINITY), Err(GeometryError::NotFinite));
        assert_eq!(make(-0.1, 0.0), Err(GeometryError::ZenithOutOfRange));
        assert_eq!(make(3.2, 0.0), Err(GeometryError::ZenithOutOfRange));
        let of = Direction::<World, f32>::from_vector;
        assert_eq!(of(Vector3::zeros()), Err(GeometryError::ZeroLength));
        assert_eq!(
            of(Vector3::new(0.0, f32::NAN, 1.0)),
            Err(GeometryError::NotFinite)
        );
        assert_eq!(
            of(Vector3::new(f32::MAX, f32::MAX, 0.0)),
            Err(GeometryError::NotFinite)
        );
    }
}
