//! What a line of the paths format says of a measurement: when it was taken, in which axes, and how sure it is.

use cslam_core::geometry::{Body, Direction, Matrix3, Rotation};
use cslam_core::path::Path;

use super::{Link, LinkPath};

/// Latest time of a line, s: what the time stamp of a packet holds (48 bits of microseconds).
const LATEST_S: f64 = (1_u64 << 48) as f64 / 1e6;

/// Whether a list holds measurements: one of its lines says so, or one of its paths has a covariance. Then nothing is added to
/// any of its numbers.
pub fn are_measured(links: &[Link]) -> bool {
    links
        .iter()
        .any(|link| link.measured || link.paths.iter().any(|path| path.covariance.is_some()))
}

/// Checks what only measurements have.
///
/// # Errors
/// The key, what is wrong with it and what was expected, in words.
pub(super) fn check(link: &Link) -> Result<(), String> {
    if let Some(time_s) = link.time_s
        && !(0.0..LATEST_S).contains(&time_s)
    {
        return Err(format!(
            "`time_s` is {time_s}, expected seconds from the start of the flight, 0 to {LATEST_S:.0}"
        ));
    }
    attitude(link)?;
    for (index, path) in link.paths.iter().enumerate() {
        let Some(sigma_rad) = path.aod_sigma_rad else {
            continue;
        };
        if path.aod_zenith_rad.is_none() {
            return Err(format!(
                "path {index}: `aod_sigma_rad` needs aod_zenith_rad and aod_azimuth_rad beside it"
            ));
        }
        if !sigma_rad.is_finite() || sigma_rad < 0.0 {
            return Err(format!(
                "path {index}: `aod_sigma_rad` is {sigma_rad}, expected a finite angle of at least 0 rad"
            ));
        }
    }
    Ok(())
}

fn attitude(link: &Link) -> Result<Option<Rotation<Body, cslam_core::geometry::World, f64>>, String> {
    link.uav_quaternion_wb
        .map(Rotation::from_quaternion)
        .transpose()
        .map_err(|e| format!("`uav_quaternion_wb`: {e}"))
}

/// Turns angles of arrival and covariances from body axes into those of the world.
///
/// # Errors
/// In words: a line without attitude, or angles outside their range.
pub(super) fn turn_into_world(link: &mut Link) -> Result<(), String> {
    let Some(attitude) = attitude(link)? else {
        return Err(
            "`frame` is \"body\", expected \"world\", or the UAV's attitude beside it: \
             \"uav_quaternion_wb\":[w,x,y,z], body (FLU) to world"
                .to_owned(),
        );
    };
    for (index, path) in link.paths.iter_mut().enumerate() {
        turn(path, &attitude).map_err(|e| format!("path {index}: {e}"))?;
    }
    Ok(())
}

fn turn(
    path: &mut LinkPath,
    attitude: &Rotation<Body, cslam_core::geometry::World, f64>,
) -> Result<(), cslam_core::geometry::GeometryError> {
    let body = Path::<Body, f64> {
        c_tau_m: 0.0,
        aoa: Direction::from_zenith_azimuth(path.aoa_zenith_rad, path.aoa_azimuth_rad)?,
        aod: None,
        covariance: path
            .covariance
            .map_or_else(Matrix3::zeros, |rows| Matrix3::from_fn(|i, j| rows[i][j])),
    };
    let world = body.to_world(attitude, &Matrix3::zeros());
    path.aoa_zenith_rad = world.aoa.zenith_rad();
    path.aoa_azimuth_rad = world.aoa.azimuth_rad();
    path.covariance = path
        .covariance
        .map(|_| std::array::from_fn(|i| std::array::from_fn(|j| world.covariance[(i, j)])));
    Ok(())
}
