//! Where a scene stands: turned about the vertical and moved as a whole.

use nalgebra::{Matrix3, Rotation3, Vector3};
use serde::{Deserialize, Serialize};

use crate::input::InputError;

/// Farthest that a scene is moved along any axis, m.
const FARTHEST_M: f64 = 100e3;

/// A scene as a whole: turned about the vertical through its own origin, then moved. The default leaves it where it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Placement {
    /// Where its origin comes to lie, m, world frame; the third number raises it. Each within 100 km.
    pub moved_m: [f64; 3],
    /// By how much it is turned, counter-clockwise seen from above, deg; -360 to 360.
    pub turned_deg: f64,
}

/// A turn about the vertical, counter-clockwise seen from above, rad.
pub(crate) fn turn(angle_rad: f64) -> Rotation3<f64> {
    let (sin, cos) = libm::sincos(angle_rad);
    Rotation3::from_matrix_unchecked(Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0))
}

impl Placement {
    /// Whether it leaves everything where it is.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }

    /// The turn about the vertical, rad; -pi to pi.
    pub fn turned_rad(&self) -> f64 {
        let whole = libm::floor(self.turned_deg / 360.0 + 0.5);
        (self.turned_deg - 360.0 * whole).to_radians()
    }

    /// The turn about the vertical: it takes directions of the scene's own frame to world directions.
    pub fn rotation(&self) -> Rotation3<f64> {
        turn(self.turned_rad())
    }

    /// Where a point of the scene's own frame lies in the world, m.
    pub fn place(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation() * point_m + Vector3::from(self.moved_m)
    }

    /// The point of the scene's own frame that lies there in the world, m.
    pub fn back(&self, point_m: &Vector3<f64>) -> Vector3<f64> {
        self.rotation().inverse() * (point_m - Vector3::from(self.moved_m))
    }

    /// Checks the figures.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        let beyond = |c: &&f64| !(-FARTHEST_M..=FARTHEST_M).contains(*c);
        if let Some(c) = self.moved_m.iter().find(beyond) {
            let message = format!("holds {c}, expected -{FARTHEST_M} to {FARTHEST_M}");
            return Err(InputError::at_key("moved_m", message));
        }
        if !(-360.0..=360.0).contains(&self.turned_deg) {
            let message = format!("is {}, expected -360 to 360", self.turned_deg);
            return Err(InputError::at_key("turned_deg", message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_turns_counter_clockwise_then_moves_and_goes_back() {
        let quarter = Placement {
            moved_m: [10.0, 20.0, 3.0],
            turned_deg: 90.0,
        };
        let point = Vector3::new(2.0, 1.0, 0.5);
        assert!((quarter.place(&point) - Vector3::new(9.0, 22.0, 3.5)).norm() < 1e-14);
        assert!((quarter.back(&quarter.place(&point)) - point).norm() < 1e-14);
        assert!(Placement::default().is_none() && !quarter.is_none());
        assert_eq!(Placement::default().place(&point), point);
        let of = |turned_deg| Placement {
            turned_deg,
            ..quarter
        };
        assert!((of(-270.0).turned_rad() - quarter.turned_rad()).abs() < 1e-15);
    }

    #[test]
    fn figures_out_of_range_are_named() {
        let message = |moved_m, turned_deg| {
            let placement = Placement { moved_m, turned_deg };
            placement.check().expect_err("must be refused").to_string()
        };
        assert!(message([0.0, f64::NAN, 0.0], 0.0).starts_with("moved_m holds NaN"));
        assert!(message([0.0; 3], 361.0).starts_with("turned_deg is 361, expected -360 to 360"));
    }
}
