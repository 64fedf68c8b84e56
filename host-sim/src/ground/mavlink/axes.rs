//! From the project's axes to MAVLink's.
//!
//! World: NED = C ENU with C = ((0, 1, 0), (1, 0, 0), (0, 0, -1)). Body: FRD = D FLU with D = diag(1, -1, -1). Both are their own
//! inverses. An attitude R (FLU to ENU) becomes C R D (FRD to NED).

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// A world vector, east-north-up to north-east-down.
pub fn to_ned([east, north, up]: [f64; 3]) -> [f64; 3] {
    [north, east, -up]
}

/// A body vector, forward-left-up to forward-right-down.
pub fn to_frd([forward, left, up]: [f64; 3]) -> [f64; 3] {
    [forward, -left, -up]
}

/// Body to world [w, x, y, z], forward-left-up and east-north-up. `None` unless it can be made a unit quaternion.
pub(super) fn rotation([w, x, y, z]: [f64; 4]) -> Option<Rotation3<f64>> {
    let quaternion = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-6)?;
    Some(quaternion.to_rotation_matrix())
}

/// The same attitude, forward-right-down to north-east-down, [w, x, y, z] with w >= 0.
pub(super) fn quaternion_ned_frd(flu_to_enu: &Rotation3<f64>) -> [f64; 4] {
    let matrix = Rotation3::from_matrix_unchecked(c() * flu_to_enu.matrix() * d());
    let q = UnitQuaternion::from_rotation_matrix(&matrix);
    let sign = if q.w < 0.0 { -1.0 } else { 1.0 };
    [q.w, q.i, q.j, q.k].map(|c| c * sign)
}

/// A world vector in body axes, forward-right-down.
pub(super) fn world_to_frd(flu_to_enu: &Rotation3<f64>, vector: [f64; 3]) -> [f64; 3] {
    to_frd((flu_to_enu.inverse() * Vector3::from(vector)).into())
}

/// A covariance in the world's axes, in body axes, forward-right-down.
pub(super) fn covariance_frd(flu_to_enu: &Rotation3<f64>, enu: &Matrix3<f64>) -> Matrix3<f64> {
    let turn = d() * flu_to_enu.matrix().transpose();
    turn * enu * turn.transpose()
}

/// A covariance in the world's axes, north-east-down.
pub(super) fn covariance_ned(enu: &Matrix3<f64>) -> Matrix3<f64> {
    c() * enu * c().transpose()
}

fn c() -> Matrix3<f64> {
    Matrix3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -1.0)
}

fn d() -> Matrix3<f64> {
    Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about_z(degrees: f64) -> Rotation3<f64> {
        Rotation3::from_axis_angle(&Vector3::z_axis(), degrees.to_radians())
    }

    fn near(a: [f64; 4], b: [f64; 4]) -> bool {
        a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12)
    }

    #[test]
    fn a_level_uav_looking_north_has_no_rotation() {
        // In ENU, looking north is a turn of 90 degrees from east.
        assert!(near(quaternion_ned_frd(&about_z(90.0)), [1.0, 0.0, 0.0, 0.0]));
        // Looking east is a turn of 90 degrees about down.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        assert!(near(quaternion_ned_frd(&about_z(0.0)), [half, 0.0, 0.0, half]));
    }

    #[test]
    fn a_nose_up_pitch_is_positive_about_the_right_wing() {
        // Looking north and 30 degrees up: about ENU's east axis, positive.
        let up = Rotation3::from_axis_angle(&Vector3::x_axis(), 30_f64.to_radians()) * about_z(90.0);
        let [w, x, y, z] = quaternion_ned_frd(&up);
        let (sine, cosine) = 15_f64.to_radians().sin_cos();
        assert!(near([w, x, y, z], [cosine, 0.0, sine, 0.0]), "{w} {x} {y} {z}");
    }

    #[test]
    fn vectors_and_covariances_turn_with_the_body() {
        // Looking north, flying east: to the right.
        let velocity = world_to_frd(&about_z(90.0), [2.0, 0.0, 0.5]);
        assert!((velocity[0]).abs() < 1e-12 && (velocity[1] - 2.0).abs() < 1e-12);
        assert!((velocity[2] + 0.5).abs() < 1e-12);
        // East's uncertainty is then the right wing's.
        let enu = Matrix3::from_diagonal(&Vector3::new(9.0, 1.0, 0.25));
        let covariance = covariance_frd(&about_z(90.0), &enu);
        assert!((covariance[(0, 0)] - 1.0).abs() < 1e-12 && (covariance[(1, 1)] - 9.0).abs() < 1e-12);
        // Half-way between, north-east: shared, and forward and right are of opposite sign in it.
        let shared = covariance_frd(&about_z(45.0), &enu);
        assert!((shared[(0, 0)] - 5.0).abs() < 1e-12 && (shared[(0, 1)] - 4.0).abs() < 1e-12);
    }

    #[test]
    fn covariances_in_the_world_keep_their_signs() {
        // East and up rise together: east and down do not.
        let enu = Matrix3::new(4.0, 0.0, 1.0, 0.0, 2.0, 0.5, 1.0, 0.5, 9.0);
        let ned = covariance_ned(&enu);
        let expected = Matrix3::new(2.0, 0.0, -0.5, 0.0, 4.0, -1.0, -0.5, -1.0, 9.0);
        assert_eq!(ned, expected);
    }

    #[test]
    fn axes_are_their_own_inverses() {
        let v = [1.0, 2.0, 3.0];
        assert_eq!((to_ned(v), to_ned(to_ned(v))), ([2.0, 1.0, -3.0], v));
        assert_eq!((to_frd(v), to_frd(to_frd(v))), ([1.0, -2.0, -3.0], v));
    }
}
