//! From a line of a paths file to what the receiver's solver takes.

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, GeometryError, Matrix3, Position, Real, World};
use cslam_core::path::{Departure, Path, diagonal_covariance};
use cslam_core::reflection::{Ends, InputError};
use serde::{Deserialize, Serialize};

use crate::paths::{Link, LinkPath};

/// Standard deviations of a measurement. The defaults are the error budget that the receiver is designed for
/// (docs/signal-model.md, "Reflection point": attitude 0.1 deg, range 0.05 m, position 0.05 m an axis; AoD by interpolation over beams).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Sigmas {
    /// Path length c tau, clock included, m.
    pub c_tau_m: f64,
    /// Angle of arrival along each tangent, attitude included, deg.
    pub aoa_deg: f64,
    /// Angle of departure along each tangent, deg.
    pub aod_deg: f64,
    /// UAV position along each axis, m.
    pub position_m: f64,
}

impl Default for Sigmas {
    fn default() -> Self {
        Self {
            c_tau_m: 0.05,
            aoa_deg: 0.1,
            aod_deg: 2.0,
            position_m: 0.05,
        }
    }
}

impl Sigmas {
    /// Checks that every value is finite and not negative.
    ///
    /// # Errors
    /// [`crate::input::InputError`] naming the first wrong key with its value and what was expected.
    pub fn check(&self) -> Result<(), crate::input::InputError> {
        let values = [
            ("c_tau_m", self.c_tau_m),
            ("aoa_deg", self.aoa_deg),
            ("aod_deg", self.aod_deg),
            ("position_m", self.position_m),
        ];
        match values
            .into_iter()
            .find(|(_, value)| !value.is_finite() || *value < 0.0)
        {
            None => Ok(()),
            Some((key, value)) => Err(crate::input::InputError::at_key(
                key,
                format!("is {value}, expected a number of at least 0"),
            )),
        }
    }
}

/// The two ends of a link as the receiver believes them.
///
/// # Errors
/// [`InputError`] when a coordinate is not finite.
pub fn ends<T: Real>(link: &Link, sigmas: &Sigmas) -> Result<Ends<T>, InputError> {
    let variance = T::of(sigmas.position_m * sigmas.position_m);
    Ok(Ends {
        uav: position(link.rx)?,
        uav_covariance: Matrix3::identity() * variance,
        gmt: position(link.tx)?,
    })
}

/// A path of the file as a measured path, with its own covariance and standard deviation of departure where it has them.
///
/// Angles become unit vectors in f64 and are rounded once.
///
/// # Errors
/// [`InputError`] when a number is not finite or an angle lies outside its range.
pub fn path<T: Real>(path: &LinkPath, sigmas: &Sigmas) -> Result<Path<World, T>, InputError> {
    let departure = match (path.aod_zenith_rad, path.aod_azimuth_rad) {
        (Some(zenith), Some(azimuth)) => Some(Departure {
            direction: direction(zenith, azimuth)?,
            sigma_rad: T::of(path.aod_sigma_rad.unwrap_or(sigmas.aod_deg.to_radians())),
        }),
        _ => None,
    };
    let covariance = match path.covariance {
        Some(rows) => Matrix3::from_fn(|i, j| T::of(rows[i][j])),
        None => diagonal_covariance(T::of(sigmas.c_tau_m), T::of(sigmas.aoa_deg.to_radians())),
    };
    Ok(Path {
        c_tau_m: T::of(path.delay_s * SPEED_OF_LIGHT_M_PER_S),
        aoa: direction(path.aoa_zenith_rad, path.aoa_azimuth_rad)?,
        aod: departure,
        covariance,
    })
}

fn position<T: Real>(p: [f64; 3]) -> Result<Position<World, T>, GeometryError> {
    Position::new(T::of(p[0]), T::of(p[1]), T::of(p[2]))
}

fn direction<T: Real>(zenith_rad: f64, azimuth_rad: f64) -> Result<Direction<World, T>, GeometryError> {
    let exact = Direction::<World, f64>::from_zenith_azimuth(zenith_rad, azimuth_rad)?;
    Direction::from_vector(exact.vector().map(T::of))
}
