//! The reflection point of a path.

use core::ffi::{CStr, c_char};

use cslam_core::reflection::{Bounds, Form, Gates, Rejection, Verdict, solve};

use crate::pointer::{self, Sized32};
use crate::status::CslamStatus;
use crate::values::{CslamLink, CslamMeasuredPath, flag, position};

/// Thresholds of the gates that a point has to pass. `cslam_gates_default` fills it in.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct CslamGates {
    /// `sizeof(cslam_gates)`.
    pub size: u32,
    /// 1 when `ground_z_m` is known, else 0.
    pub has_ground: u8,
    /// 1 when `bounds_min_m` and `bounds_max_m` are known, else 0.
    pub has_bounds: u8,
    /// 0.
    pub reserved: [u8; 2],
    /// Excess delay must exceed this many of its standard deviations.
    pub excess_sigmas: f32,
    /// Within this angle of the transmitter's direction a path without excess is line of sight, rad.
    pub line_of_sight_angle_rad: f32,
    /// Least `1 + cos beta` of the bistatic angle; 0 opens the gate.
    pub min_one_plus_cos_bistatic: f32,
    /// Largest error of the point, m; INFINITY opens the gate.
    pub max_sigma_m: f32,
    /// Least distance from the UAV, m.
    pub min_uav_distance_m: f32,
    /// Least distance from the transmitter, m.
    pub min_gmt_distance_m: f32,
    /// The point must lie where the wave left to, within this many standard deviations; INFINITY opens the gate.
    pub departure_sigmas: f32,
    /// Height of the ground, m.
    pub ground_z_m: f32,
    /// Least coordinates of the scene, m.
    pub bounds_min_m: [f32; 3],
    /// Greatest coordinates of the scene, m.
    pub bounds_max_m: [f32; 3],
}

/// A solved point.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct CslamPoint {
    /// `sizeof(cslam_point)`.
    pub size: u32,
    /// 0: accepted. Another number: why there is none, in words by `cslam_verdict_text`; all that follows is 0 then.
    pub verdict: i32,
    /// The point, world axes, m.
    pub position_m: [f32; 3],
    /// Its covariance, m^2, row by row.
    pub covariance_m2: [f32; 9],
    /// Distance from the UAV, m.
    pub distance_m: f32,
    /// Root of the covariance's trace, m.
    pub sigma_m: f32,
}

// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamGates {}
// SAFETY: `repr(C)`, `u32` first, numbers only.
unsafe impl Sized32 for CslamPoint {}

const _: () = assert!(size_of::<CslamGates>() == 64 && size_of::<CslamPoint>() == 64);

impl CslamGates {
    fn gates(&self) -> Result<Gates, CslamStatus> {
        let thresholds = [
            self.excess_sigmas,
            self.line_of_sight_angle_rad,
            self.min_one_plus_cos_bistatic,
            self.max_sigma_m,
            self.min_uav_distance_m,
            self.min_gmt_distance_m,
            self.departure_sigmas,
        ];
        if thresholds.iter().any(|x| x.is_nan()) {
            return Err(CslamStatus::NotFinite);
        }
        if thresholds.iter().any(|x| *x < 0.0) {
            return Err(CslamStatus::OutOfRange);
        }
        let ground_z_m = flag(self.has_ground)?.then_some(self.ground_z_m);
        if ground_z_m.is_some_and(|z| !z.is_finite()) {
            return Err(CslamStatus::NotFinite);
        }
        let bounds = if flag(self.has_bounds)? {
            let (min, max) = (position(self.bounds_min_m)?, position(self.bounds_max_m)?);
            let pairs = self.bounds_min_m.iter().zip(&self.bounds_max_m);
            if pairs.into_iter().any(|(least, greatest)| least >= greatest) {
                return Err(CslamStatus::OutOfRange);
            }
            Some(Bounds { min, max })
        } else {
            None
        };
        Ok(Gates {
            excess_sigmas: self.excess_sigmas,
            line_of_sight_angle_rad: self.line_of_sight_angle_rad,
            min_one_plus_cos_bistatic: self.min_one_plus_cos_bistatic,
            max_sigma_m: self.max_sigma_m,
            min_uav_distance_m: self.min_uav_distance_m,
            min_gmt_distance_m: self.min_gmt_distance_m,
            departure_sigmas: self.departure_sigmas,
            ground_z_m,
            bounds,
        })
    }
}

/// Fills in the gates of the design: no ground, no bounds, errors of any size.
///
/// # Safety
/// Unless null or misaligned, `gates` points to a `cslam_gates`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_gates_default(gates: *mut CslamGates) -> CslamStatus {
    let default = Gates::<f32>::default();
    // SAFETY: the caller's promise.
    CslamStatus::of(unsafe { pointer::place(gates) }.map(|place| {
        place.write(CslamGates {
            size: size_of::<CslamGates>() as u32,
            has_ground: 0,
            has_bounds: 0,
            reserved: [0; 2],
            excess_sigmas: default.excess_sigmas,
            line_of_sight_angle_rad: default.line_of_sight_angle_rad,
            min_one_plus_cos_bistatic: default.min_one_plus_cos_bistatic,
            max_sigma_m: default.max_sigma_m,
            min_uav_distance_m: default.min_uav_distance_m,
            min_gmt_distance_m: default.min_gmt_distance_m,
            departure_sigmas: default.departure_sigmas,
            ground_z_m: 0.0,
            bounds_min_m: [0.0; 3],
            bounds_max_m: [0.0; 3],
        });
    }))
}

/// Where a path was reflected, if it was reflected once: `point->verdict` is 0 then. `gates` may be null: those of the design.
///
/// A status but `CSLAM_STATUS_OK` says that the input is no measurement of a path.
///
/// # Safety
/// Pointers as their types say; `link`, `path` and `gates` filled in, `point` with its size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn cslam_solve(
    link: *const CslamLink,
    path: *const CslamMeasuredPath,
    gates: *const CslamGates,
    point: *mut CslamPoint,
) -> CslamStatus {
    let solved = || {
        // SAFETY: the caller's promise.
        unsafe { pointer::check_size(point.cast_const())? };
        let gates = if gates.is_null() {
            Gates::default()
        } else {
            // SAFETY: the caller's promise.
            unsafe { pointer::read(gates)? }.gates()?
        };
        // SAFETY: the caller's promise.
        let (link, path) = unsafe { (pointer::read(link)?, pointer::read(path)?) };
        let verdict = solve(&link.ends()?, &path.path()?, Form::Vector, &gates)?;
        // SAFETY: checked above.
        unsafe { pointer::place(point)? }.write(verdict.into());
        Ok(())
    };
    CslamStatus::of(solved())
}

impl From<Verdict<f32>> for CslamPoint {
    fn from(verdict: Verdict<f32>) -> Self {
        let size = size_of::<Self>() as u32;
        match verdict {
            Verdict::Accepted(point) => {
                let c = &point.covariance;
                Self {
                    size,
                    verdict: 0,
                    position_m: point.position.to_array(),
                    covariance_m2: [c.m11, c.m12, c.m13, c.m21, c.m22, c.m23, c.m31, c.m32, c.m33],
                    distance_m: point.distance_m,
                    sigma_m: point.sigma_m(),
                }
            }
            Verdict::Rejected(reason) => Self {
                size,
                verdict: number(reason),
                ..Self::default()
            },
        }
    }
}

/// Number of a reason, from 1.
fn number(reason: Rejection) -> i32 {
    let place = Rejection::ALL.iter().position(|other| *other == reason);
    place.map_or(-1, |place| place as i32 + 1)
}

/// Words of [`Rejection::as_str`] with a closing zero, in the order of [`Rejection::ALL`].
const REASONS: [&CStr; 10] = [
    c"line of sight",
    c"excess delay too small",
    c"ill-conditioned: the point's error is too large",
    c"point too close to the UAV",
    c"point too close to the GMT",
    c"point beyond the path's length",
    c"higher order: angle of departure disagrees",
    c"higher order: point under the ground",
    c"higher order: point outside the scene's bounds",
    c"the tangent form is singular in this direction",
];

/// A verdict in words, never null: "ok" for 0, "unknown verdict" for a number that is none. Static.
#[unsafe(no_mangle)]
pub extern "C" fn cslam_verdict_text(verdict: i32) -> *const c_char {
    let text = match usize::try_from(verdict) {
        Ok(0) => c"ok",
        Ok(place) => REASONS
            .get(place.wrapping_sub(1))
            .copied()
            .unwrap_or(c"unknown verdict"),
        Err(_) => c"unknown verdict",
    };
    text.as_ptr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_those_of_the_core() {
        for (place, reason) in Rejection::ALL.into_iter().enumerate() {
            assert_eq!(REASONS[place].to_str(), Ok(reason.as_str()));
            assert_eq!(number(reason), place as i32 + 1);
        }
    }
}
