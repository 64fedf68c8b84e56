//! Values that more than one function takes.

use cslam_core::geometry::{Direction, Matrix3, Position, Vector3, World};
use cslam_core::link_state::Received;
use cslam_core::path::{Departure, Path};
use cslam_core::reflection::Ends;

use crate::pointer::Sized32;
use crate::status::CslamStatus;

/// The two ends of a link. World axes: east, north, up.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamLink {
    /// `sizeof(cslam_link)`.
    pub size: u32,
    /// Position of the UAV, m.
    pub uav_m: [f32; 3],
    /// Its covariance, m^2, row by row.
    pub uav_covariance_m2: [f32; 9],
    /// Position of the transmitter, m.
    pub gmt_m: [f32; 3],
}

/// A path in world axes (east, north, up), clock offset removed.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamMeasuredPath {
    /// `sizeof(cslam_measured_path)`.
    pub size: u32,
    /// 1 when `aod_world` and `aod_sigma_rad` are known, else 0.
    pub has_departure: u8,
    /// 1 when `gain_db` is known, else 0. Used by `cslam_classify` alone.
    pub has_gain: u8,
    /// 0.
    pub reserved: [u8; 2],
    /// Speed of light times the delay, m.
    pub c_tau_m: f32,
    /// From the UAV towards where the wave came from; any length but zero.
    pub aoa_world: [f32; 3],
    /// From the transmitter towards where the wave went; any length but zero.
    pub aod_world: [f32; 3],
    /// Standard deviation of that along any tangent, rad.
    pub aod_sigma_rad: f32,
    /// Covariance of (c tau, angles along the tangents e1, e2 of the arrival), m^2, m rad, rad^2, row by row. e1 is horizontal, towards
    /// growing azimuth; e2 = aoa x e1.
    pub covariance: [f32; 9],
    /// Power gain between half-wave dipoles, dB (negative).
    pub gain_db: f32,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamLink {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamMeasuredPath {}

const _: () = assert!(size_of::<CslamLink>() == 64 && core::mem::offset_of!(CslamLink, gmt_m) == 52);
const _: () = assert!(
    size_of::<CslamMeasuredPath>() == 80 && core::mem::offset_of!(CslamMeasuredPath, covariance) == 40
);

/// A flag: 0 or 1.
pub(crate) fn flag(byte: u8) -> Result<bool, CslamStatus> {
    match byte {
        0 => Ok(false),
        1 => Ok(true),
        _ => Err(CslamStatus::OutOfRange),
    }
}

fn direction(v: [f32; 3]) -> Result<Direction<World>, CslamStatus> {
    Ok(Direction::from_vector(Vector3::from(v))?)
}

pub(crate) fn position([x, y, z]: [f32; 3]) -> Result<Position<World>, CslamStatus> {
    Ok(Position::new(x, y, z)?)
}

impl CslamLink {
    pub(crate) fn ends(&self) -> Result<Ends, CslamStatus> {
        Ok(Ends {
            uav: position(self.uav_m)?,
            uav_covariance: Matrix3::from_row_slice(&self.uav_covariance_m2),
            gmt: position(self.gmt_m)?,
        })
    }
}

impl CslamMeasuredPath {
    pub(crate) fn path(&self) -> Result<Path<World>, CslamStatus> {
        let aod = if flag(self.has_departure)? {
            Some(Departure {
                direction: direction(self.aod_world)?,
                sigma_rad: self.aod_sigma_rad,
            })
        } else {
            None
        };
        Ok(Path {
            c_tau_m: self.c_tau_m,
            aoa: direction(self.aoa_world)?,
            aod,
            covariance: Matrix3::from_row_slice(&self.covariance),
        })
    }

    pub(crate) fn received(&self) -> Result<Received, CslamStatus> {
        let gain_db = flag(self.has_gain)?.then_some(self.gain_db);
        if gain_db.is_some_and(|gain| !gain.is_finite()) {
            return Err(CslamStatus::NotFinite);
        }
        Ok(Received {
            path: self.path()?,
            gain_db,
        })
    }
}
