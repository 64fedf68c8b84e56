//! A measured propagation path: how long the way was, where it ended, and how sure that is.

use nalgebra::{Matrix2, Matrix3, Vector3};

use crate::geometry::{Body, Direction, Frame, Gmt, Real, Rotation, World};

/// One propagation path as the receiver sees it, its angle of arrival in frame `A`, its angle of departure in frame `D`.
///
/// The array measures in body axes, and the transmit beams tell the departure in the axes of the GMT (`Path<Body, f32, Gmt>`); the
/// reflection solver wants world axes (`Path<World>`). [`Path::to_world`] and [`Departure::to_world`] are the only ways between the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Path<A: Frame, T: Real = f32, D: Frame = World> {
    /// Speed of light times the absolute delay, clock offset removed, m.
    pub c_tau_m: T,
    /// Angle of arrival: from the UAV towards where the wave comes from.
    pub aoa: Direction<A, T>,
    /// Angle of departure, when the transmit beams showed it.
    pub aod: Option<Departure<T, D>>,
    /// Covariance of (c tau, angle along e1, angle along e2) in m^2, m rad, rad^2, where (e1, e2) are
    /// [`Direction::tangents`] of the angle of arrival.
    pub covariance: Matrix3<T>,
}

/// Angle of departure: from the GMT towards the first interaction, in frame `D`.
///
/// One in the axes of the GMT where the world's are wanted does not compile:
///
/// ```compile_fail,E0308
/// use cslam_core::geometry::{Direction, Gmt};
/// use cslam_core::path::Departure;
///
/// fn weigh(_left: Departure) {}
///
/// let direction: Direction<Gmt> = Direction::from_zenith_azimuth(1.5, 0.3).unwrap();
/// weigh(Departure { direction, sigma_rad: 0.01 }); // expected `Direction<World>`, found `Direction<Gmt>`
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Departure<T: Real = f32, D: Frame = World> {
    /// Direction in which the wave left.
    pub direction: Direction<D, T>,
    /// Standard deviation of that direction along any tangent, rad.
    pub sigma_rad: T,
}

/// How fast a path grows, by the phase that its carrier has gained between two looks. Offset of the two carriers included, which all paths of a
/// sweep share.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeRate {
    /// Rate of the length, m/s: known but for whole periods, within half of one of nothing.
    pub m_per_s: f32,
    /// Its standard deviation, m/s.
    pub sigma_m_per_s: f32,
    /// Period: a wavelength over the time between the looks, m/s.
    pub period_m_per_s: f32,
}

/// Diagonal path covariance from standard deviations: range in m, both angles in rad.
pub fn diagonal_covariance<T: Real>(c_tau_sigma_m: T, angle_sigma_rad: T) -> Matrix3<T> {
    let angle = angle_sigma_rad * angle_sigma_rad;
    Matrix3::from_diagonal(&Vector3::new(c_tau_sigma_m * c_tau_sigma_m, angle, angle))
}

impl<T: Real> Departure<T, Gmt> {
    /// The same departure in world axes, by how the GMT stands. An error of `gmt_attitude` is not added.
    #[must_use]
    pub fn to_world(&self, gmt_attitude: &Rotation<Gmt, World, T>) -> Departure<T> {
        Departure {
            direction: gmt_attitude.apply(self.direction),
            sigma_rad: self.sigma_rad,
        }
    }
}

impl<T: Real, D: Frame> Path<Body, T, D> {
    /// The same path with its arrival in world axes; its departure stays as it is.
    ///
    /// `attitude_covariance_rad2` is the covariance of the attitude error as a small rotation vector in world axes; an
    /// error `e` turns the direction `u` by `e x u`, so its part across `u` adds to the angular covariance.
    pub fn to_world(
        &self,
        attitude: &Rotation<Body, World, T>,
        attitude_covariance_rad2: &Matrix3<T>,
    ) -> Path<World, T, D> {
        let aoa = attitude.apply(self.aoa);
        let (b1, b2) = self.aoa.tangents();
        let (b1, b2) = (attitude.apply_vector(&b1), attitude.apply_vector(&b2));
        let (w1, w2) = aoa.tangents();
        // Both tangent pairs span the same plane; this 2 x 2 rotation turns one into the other.
        let turn = Matrix2::new(w1.dot(&b1), w1.dot(&b2), w2.dot(&b1), w2.dot(&b2));
        let mut lift = Matrix3::identity();
        lift.fixed_view_mut::<2, 2>(1, 1).copy_from(&turn);
        let mut covariance = lift * self.covariance * lift.transpose();
        // d(w_i . (e x u))/de = u x w_i
        let (g1, g2) = (aoa.vector().cross(&w1), aoa.vector().cross(&w2));
        let (s1, s2) = (attitude_covariance_rad2 * g1, attitude_covariance_rad2 * g2);
        covariance.m22 += g1.dot(&s1);
        covariance.m33 += g2.dot(&s2);
        covariance.m23 += g1.dot(&s2);
        covariance.m32 += g2.dot(&s1);
        Path {
            c_tau_m: self.c_tau_m,
            aoa,
            aod: self.aod,
            covariance,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The covariance as a 3 x 3 matrix over the components of the direction vector, which has no basis to choose.
    fn spread<F: Frame>(path: &Path<F, f64>) -> Matrix3<f64> {
        let (e1, e2) = path.aoa.tangents();
        let basis = nalgebra::Matrix3x2::from_columns(&[e1, e2]);
        basis * path.covariance.fixed_view::<2, 2>(1, 1) * basis.transpose()
    }

    fn body_path() -> Path<Body, f64> {
        let covariance = Matrix3::new(0.04, 1e-4, -2e-4, 1e-4, 4e-5, 1e-5, -2e-4, 1e-5, 9e-5);
        let aoa = Direction::from_zenith_azimuth(1.1, -0.7).expect("valid");
        Path {
            c_tau_m: 80.0,
            aoa,
            aod: None,
            covariance,
        }
    }

    #[test]
    fn a_departure_turns_with_the_gmt() {
        let north = Rotation::<Gmt, World, f64>::from_yaw_pitch_roll(core::f64::consts::FRAC_PI_2, 0.0, 0.0);
        let ahead = Departure {
            direction: Direction::<Gmt, f64>::from_vector(Vector3::x()).expect("unit"),
            sigma_rad: 0.01,
        };
        let left = ahead.to_world(&north.expect("finite"));
        assert!((left.direction.vector() - Vector3::y()).norm() < 1e-15);
        assert_eq!(left.sigma_rad, 0.01);
    }

    #[test]
    fn the_covariance_turns_with_the_direction() {
        let attitude = Rotation::<Body, World, f64>::from_yaw_pitch_roll(2.0, -0.4, 0.9).expect("finite");
        let path = body_path();
        let world = path.to_world(&attitude, &Matrix3::zeros());
        let turned = attitude.matrix() * spread(&path) * attitude.matrix().transpose();
        assert!((spread(&world) - turned).norm() < 1e-15);
        assert!((world.covariance.m11 - path.covariance.m11).abs() < 1e-15);
    }

    #[test]
    fn attitude_error_widens_the_angle_but_not_about_the_line_of_sight() {
        let path = Path {
            covariance: Matrix3::zeros(),
            ..body_path()
        };
        let identity = Rotation::<Body, World, f64>::identity();
        let u = *path.aoa.vector();
        let about_u = u * u.transpose() * 1e-4;
        assert!(path.to_world(&identity, &about_u).covariance.norm() < 1e-18);
        let isotropic = path.to_world(&identity, &(Matrix3::identity() * 1e-4)).covariance;
        assert!((isotropic - diagonal_covariance(0.0, 1e-2)).norm() < 1e-16);
        // An uneven one: the spread of e x u over the error e is -[u] S [u] with the cross-product matrix [u].
        let uneven = Matrix3::new(4.0, 1.0, -0.5, 1.0, 2.0, 0.3, -0.5, 0.3, 1.0) * 1e-4;
        let cross = path.aoa.vector().cross_matrix();
        let seen = path.to_world(&identity, &uneven);
        assert!((spread(&seen) + cross * uneven * cross).norm() < 1e-16);
    }
}
