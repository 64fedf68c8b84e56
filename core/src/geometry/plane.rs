//! A mirror: an infinite plane with the uncertainty of its three numbers. It flies in `f32`; where chains of mirrors are followed, in `f64`.

use super::{Direction, Matrix3, Position, Real, Vector3, World};

/// A plane in the world that mirrors waves, with covariance.
///
/// The plane is `n . (x - c) = 0`. Its error is a shift along the normal *at the centre* `c` and two tilts: the true
/// plane has `n + a1 t1 + a2 t2` and passes through `c + shift n`. Taken at the centre of what supports the plane, the
/// three are nearly uncorrelated; taken at the world's origin, a tilt of 0.1 degrees would be a shift of a decimetre.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plane<T: Real = f32> {
    /// Unit normal, towards free space.
    pub normal: Direction<World, T>,
    /// A point on the plane: the centre of what it was fitted to.
    pub centre: Position<World, T>,
    /// Covariance of (shift along the normal in m, tilt along t1 in rad, tilt along t2 in rad), see
    /// [`Plane::tangents`].
    pub covariance: Matrix3<T>,
}

impl<T: Real> Plane<T> {
    /// Two unit vectors in the plane along which it tilts. Of a wall: t1 horizontal (a tilt turns the wall's heading),
    /// t2 up. Of a floor: t1 along -y, t2 along x or nearly so. They do not jump while a wall or a floor tilts a
    /// little.
    #[must_use]
    #[inline(never)]
    pub fn tangents(&self) -> (Vector3<T>, Vector3<T>) {
        tangents(self.normal.vector())
    }

    /// Height of a point over the plane, m: positive on the side of the normal.
    #[must_use]
    pub fn height_m(&self, point: &Vector3<T>) -> T {
        self.normal.vector().dot(&(point - self.centre.vector()))
    }

    /// Offset d of the form `n . x = d`, m.
    #[must_use]
    pub fn offset_m(&self) -> T {
        self.normal.vector().dot(self.centre.vector())
    }

    /// Mirror image of a point: `G' = G - 2 (n . (G - c)) n` (docs/localization.md, "The model").
    #[must_use]
    pub fn image(&self, point: &Vector3<T>) -> Vector3<T> {
        point - self.normal.vector() * (T::of(2.0) * self.height_m(point))
    }

    /// Derivative of [`Plane::image`] over (shift, tilt along t1, tilt along t2): columns `2 n` and
    /// `-2 [(t . (G - c)) n + (n . (G - c)) t]` (docs/localization.md, "The model").
    #[must_use]
    #[inline(never)]
    pub fn image_jacobian(&self, point: &Vector3<T>) -> Matrix3<T> {
        let n = self.normal.vector();
        let away = point - self.centre.vector();
        let (t1, t2) = self.tangents();
        let tilt = |t: &Vector3<T>| (n * t.dot(&away) + t * n.dot(&away)) * T::of(-2.0);
        Matrix3::from_columns(&[n * T::of(2.0), tilt(&t1), tilt(&t2)])
    }

    /// The plane after a correction (shift in m, two tilts in rad) and with a new covariance, as a filter makes them.
    /// `None` when a number is not finite.
    #[must_use]
    #[inline(never)]
    pub fn corrected(&self, [shift_m, tilt1_rad, tilt2_rad]: [T; 3], covariance: Matrix3<T>) -> Option<Self> {
        let (t1, t2) = self.tangents();
        let n = self.normal.vector();
        let normal = Direction::from_vector(n + t1 * tilt1_rad + t2 * tilt2_rad).ok()?;
        let centre = Position::from_vector(self.centre.vector() + n * shift_m).ok()?;
        covariance.iter().all(|c| c.is_finite()).then_some(Self {
            normal,
            centre,
            covariance,
        })
    }
}

impl Plane {
    /// The same plane in double precision.
    #[must_use]
    #[inline(never)]
    pub fn to_f64(&self) -> Plane<f64> {
        Plane {
            normal: self.normal.to_f64(),
            centre: self.centre.to_f64(),
            covariance: self.covariance.map(f64::from),
        }
    }
}

/// Tangents of a normal, see [`Plane::tangents`].
#[inline(never)]
fn tangents<T: Real>(n: &Vector3<T>) -> (Vector3<T>, Vector3<T>) {
    // Whichever of up and east is well off the normal.
    let reference = if n.z.abs() < T::of(0.7) {
        Vector3::z()
    } else {
        Vector3::x()
    };
    let across = reference.cross(n);
    // At least 0.7 long.
    let t1 = across / across.norm();
    (t1, n.cross(&t1))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(normal: [f32; 3]) -> Plane {
        Plane {
            normal: Direction::from_vector(normal.into()).expect("not zero"),
            centre: Position::new(10.0, -4.0, 3.0).expect("finite"),
            covariance: Matrix3::identity(),
        }
    }

    #[test]
    fn an_image_is_as_far_behind_the_plane_as_the_point_is_before_it() {
        let wall = plane([1.0, 0.5, 0.05]);
        let point = Vector3::new(25.0, 7.0, 1.5);
        let image = wall.image(&point);
        assert!((wall.height_m(&point) + wall.height_m(&image)).abs() < 1e-4);
        assert!((image - point).cross(wall.normal.vector()).norm() < 1e-4);
        assert!((wall.image(&image) - point).norm() < 1e-4);
        assert!((wall.offset_m() - wall.normal.vector().dot(wall.centre.vector())).abs() < 1e-5);
    }

    #[test]
    fn image_jacobian_is_the_difference_quotient() {
        for normal in [[1.0, 0.2, 0.0], [-0.3, -0.8, 0.02], [0.01, -0.02, 1.0]] {
            let plane = plane(normal);
            let point = Vector3::new(25.0, 7.0, 1.5);
            let jacobian = plane.image_jacobian(&point);
            for column in 0..3 {
                let moved = |by: f32| {
                    let mut step = [0.0; 3];
                    step[column] = by;
                    plane
                        .corrected(step, plane.covariance)
                        .expect("finite")
                        .image(&point)
                };
                let quotient = (moved(0.01) - moved(-0.01)) / 0.02;
                let off = (quotient - jacobian.column(column)).norm();
                assert!(off < 0.02, "column {column} of {normal:?} is {off} off");
            }
        }
    }

    #[test]
    fn tangents_of_walls_and_floors_are_steady() {
        let (t1, t2) = plane([0.6, -0.8, 0.0]).tangents();
        assert!(t1.z == 0.0 && (t2 - Vector3::z()).norm() < 1e-6);
        let steady = |a: [f32; 3], b: [f32; 3]| {
            let (a, b) = (plane(a).tangents(), plane(b).tangents());
            (a.0 - b.0).norm().max((a.1 - b.1).norm())
        };
        assert!(steady([0.01, 0.0, 1.0], [-0.005, -0.01, 1.0]) < 0.03);
        assert!(steady([1.0, 0.0, 0.02], [1.0, 0.01, -0.02]) < 0.05);
    }

    #[test]
    fn a_correction_that_is_no_number_is_refused() {
        let wall = plane([1.0, 0.0, 0.0]);
        assert!(wall.corrected([f32::NAN, 0.0, 0.0], wall.covariance).is_none());
        assert!(wall.corrected([0.0; 3], Matrix3::repeat(f32::INFINITY)).is_none());
    }
}
