//! The content of a path record, and how it becomes what the solver takes.

use cslam_core::geometry::{Direction, Matrix3, Position, Vector3, World};
use cslam_core::path::{Departure, Path};
use cslam_core::reflection::{Ends, InputError};

/// One measured path with the link it belongs to, as raw numbers: any of them may be NaN.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathRecord {
    /// Index of the link.
    pub link: u32,
    /// Index of the path in the link, 0 is the strongest.
    pub path: u8,
    /// UAV position in the world, m.
    pub uav_m: [f32; 3],
    /// Its covariance, upper triangle by rows (xx, xy, xz, yy, yz, zz), m^2.
    pub uav_covariance_m2: [f32; 6],
    /// GMT position in the world, m.
    pub gmt_m: [f32; 3],
    /// Speed of light times the delay, m.
    pub c_tau_m: f32,
    /// Angle of arrival in the world, as a vector from the UAV towards where the wave comes from.
    pub aoa: [f32; 3],
    /// Covariance of (c tau, angle along e1, angle along e2), upper triangle by rows, in m^2, m rad and rad^2.
    pub covariance: [f32; 6],
    /// Angle of departure, when the transmit beams showed it.
    pub aod: Option<DepartureRecord>,
}

/// Angle of departure of a record.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepartureRecord {
    /// Vector from the GMT towards the first interaction, in the world.
    pub direction: [f32; 3],
    /// Standard deviation along any tangent, rad.
    pub sigma_rad: f32,
}

impl PathRecord {
    /// The record of a measured path.
    #[must_use]
    pub fn new(link: u32, path: u8, ends: &Ends, measured: &Path<World>) -> Self {
        Self {
            link,
            path,
            uav_m: ends.uav.to_array(),
            uav_covariance_m2: triangle(&ends.uav_covariance),
            gmt_m: ends.gmt.to_array(),
            c_tau_m: measured.c_tau_m,
            aoa: components(measured.aoa.vector()),
            covariance: triangle(&measured.covariance),
            aod: measured.aod.map(|departure| DepartureRecord {
                direction: components(departure.direction.vector()),
                sigma_rad: departure.sigma_rad,
            }),
        }
    }

    /// The ends of the link and the path, with directions brought to unit length.
    ///
    /// # Errors
    /// [`InputError::NotFinite`] when a coordinate or a direction is not finite, [`InputError::NoLength`] for a direction
    /// of zero length. Delay and covariances are the solver's to judge.
    pub fn measurement(&self) -> Result<(Ends, Path<World>), InputError> {
        let aod = match self.aod {
            Some(aod) => Some(Departure {
                direction: Direction::from_vector(Vector3::from(aod.direction))?,
                sigma_rad: aod.sigma_rad,
            }),
            None => None,
        };
        let ends = Ends {
            uav: Position::from_vector(Vector3::from(self.uav_m))?,
            uav_covariance: symmetric(&self.uav_covariance_m2),
            gmt: Position::from_vector(Vector3::from(self.gmt_m))?,
        };
        let path = Path {
            c_tau_m: self.c_tau_m,
            aoa: Direction::from_vector(Vector3::from(self.aoa))?,
            aod,
            covariance: symmetric(&self.covariance),
        };
        Ok((ends, path))
    }
}

fn components(vector: &Vector3<f32>) -> [f32; 3] {
    [vector.x, vector.y, vector.z]
}

fn triangle(m: &Matrix3<f32>) -> [f32; 6] {
    [m.m11, m.m12, m.m13, m.m22, m.m23, m.m33]
}

fn symmetric(&[xx, xy, xz, yy, yz, zz]: &[f32; 6]) -> Matrix3<f32> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}
