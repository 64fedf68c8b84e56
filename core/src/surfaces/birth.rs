//! Births: the plane that one path suggests.
//!
//! Where a wave was reflected once the normal halves the angle between the ways to both ends, so the closed-form point is a piece of
//! plane, shift and both tilts. And with one surface of a pair known, a path of two reflections is one of a single reflection: the transmitter
//! seen in the first, or the UAV in the last; the other plane halves the way between two images.

use nalgebra::SMatrix;

use super::surface::{Kind, Surface};
use super::{LEAST_HEIGHT_M, SurfaceConfig};
use crate::geometry::{Direction, Matrix3, Plane, Position, Vector3, World};
use crate::reflection::vector_point;

/// Step of difference quotients, m and rad.
/// Numerical: in `f64` both their errors are below a millionth.
const STEP: f64 = 1e-5;
/// Of the inputs of a birth.
/// Derived: delay, two angles of arrival, three of the UAV's position, three of the known surface of a pair.
const INPUTS: usize = 9;

/// A path as a birth takes it: in world axes, without the clock's offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BirthPath {
    /// Place of the transmitter, m.
    pub transmitter_m: Vector3<f64>,
    /// Place of the UAV, m.
    pub uav_m: Vector3<f64>,
    /// Length of the way, m.
    pub length_m: f64,
    /// Where it came from.
    pub arrival: Direction<World, f64>,
    /// Covariance of (length, angle along e1, angle along e2) with e1, e2 the tangents of the arrival, attitude and clock included.
    pub path_covariance: Matrix3<f64>,
    /// Covariance of the UAV's position, m^2.
    pub uav_covariance_m2: Matrix3<f64>,
}

/// A surface that a path suggests.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Birth {
    /// What kind.
    pub kind: Kind,
    /// Plane, centred at the point where it reflected.
    pub plane: Plane,
    /// Log-odds of existence.
    pub log_odds: f32,
}

/// What both ways of a birth solve: a point and a unit normal from a transmitter, a UAV, and a way of one reflection between them.
fn piece(
    transmitter_m: &Vector3<f64>,
    uav_m: &Vector3<f64>,
    arrival: &Vector3<f64>,
    length_m: f64,
) -> Option<(Vector3<f64>, Vector3<f64>)> {
    let solution = vector_point(&(uav_m - transmitter_m), arrival, length_m)?;
    let point = uav_m + arrival * solution.distance_m;
    let back = (transmitter_m - point).try_normalize(1e-6)?;
    let normal = (back - arrival).try_normalize(1e-6)?;
    (solution.distance_m > 0.0).then_some((point, normal))
}

impl BirthPath {
    /// The path with its inputs moved by small steps.
    fn moved(&self, by: &[f64; INPUTS]) -> Self {
        let [length, a1, a2, x, y, z, ..] = *by;
        let (e1, e2) = self.arrival.tangents();
        let arrival = Direction::from_vector(self.arrival.vector() + e1 * a1 + e2 * a2);
        Self {
            length_m: self.length_m + length,
            arrival: arrival.unwrap_or(self.arrival),
            uav_m: self.uav_m + Vector3::new(x, y, z),
            ..*self
        }
    }

    /// The plane that `solve` finds from a path and a step of the known surface, its covariance by differences over all inputs,
    /// then corrected by what builders do.
    fn birth(
        &self,
        log_odds: f32,
        config: &SurfaceConfig,
        known: &Matrix3<f64>,
        solve: impl Fn(&Self, [f64; 3]) -> Option<(Vector3<f64>, Vector3<f64>)>,
    ) -> Option<Birth> {
        let (point, normal) = solve(self, [0.0; 3])?;
        let mut plane = Plane {
            normal: Direction::from_vector(normal).ok()?,
            centre: Position::from_vector(point).ok()?,
            covariance: Matrix3::zeros(),
        };
        let (t1, t2) = plane.tangents();
        let mut jacobian = SMatrix::<f64, 3, INPUTS>::zeros();
        for (input, mut column) in jacobian.column_iter_mut().enumerate() {
            let mut step = [0.0; INPUTS];
            if let Some(step) = step.get_mut(input) {
                *step = STEP;
            }
            let [.., shift, tilt1, tilt2] = step;
            let (moved, turned) = solve(&self.moved(&step), [shift, tilt1, tilt2])?;
            let change = Vector3::new(plane.height_m(&moved), t1.dot(&turned), t2.dot(&turned));
            column.copy_from(&(change / STEP));
        }
        let mut inputs = SMatrix::<f64, INPUTS, INPUTS>::zeros();
        inputs
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&self.path_covariance);
        inputs
            .fixed_view_mut::<3, 3>(3, 3)
            .copy_from(&self.uav_covariance_m2);
        inputs.fixed_view_mut::<3, 3>(6, 6).copy_from(known);
        plane.covariance = jacobian * inputs * jacobian.transpose();
        let log_odds = log_odds + plumb(&mut plane, config)?;
        let most = f64::from(config.same_m);
        let variance = plane.covariance.m11;
        if variance.is_nan() || variance > most * most {
            return None;
        }
        Some(Birth {
            kind: if plane.normal.vector().z.abs() < core::f64::consts::FRAC_1_SQRT_2 {
                Kind::Wall
            } else {
                Kind::Level
            },
            plane: Plane {
                normal: Direction::from_vector(plane.normal.vector().map(|c| c as f32)).ok()?,
                centre: Position::from_vector(plane.centre.vector().map(|c| c as f32)).ok()?,
                covariance: plane.covariance.map(|c| c as f32),
            },
            log_odds,
        })
    }
}

/// Corrects a plane by the prior that walls stand upright and floors lie level, one scalar update for each tilt that leans, and says how
/// much likelier the lean is for a surface of a building than for what only seems one: `log (2 N / (N + U))`. `N` is the lean's
/// density when it is what builders and the plane's own covariance leave, `U` the uniform one up to
/// [`SurfaceConfig::upright_rad`]; of the planes that are none, half lean anyhow and half are images in surfaces of buildings, as
/// upright as those. Never less than that of a plane that leans further, which is `-`[`SurfaceConfig::doubtful_log_odds`]. `None` when
/// a number is none.
fn plumb(plane: &mut Plane<f64>, config: &SurfaceConfig) -> Option<f32> {
    let normal = *plane.normal.vector();
    let most = f64::from(config.upright_rad());
    let variance = f64::from(config.lean_rad * config.lean_rad);
    let (t1, t2) = plane.tangents();
    let builders = if normal.z.abs() < most {
        let upright = lean(plane, [t1.z, t2.z], -normal.z, variance)?;
        2.0 * most * upright
    } else if libm::hypot(normal.x, normal.y) < most {
        let along_x = lean(plane, [t1.x, t2.x], -normal.x, variance)?;
        let along_y = lean(plane, [t1.y, t2.y], -normal.y, variance)?;
        core::f64::consts::PI * most * most * along_x * along_y
    } else {
        return Some(-config.doubtful_log_odds);
    };
    // With `N / U` at hand: 2 N / (N + U).
    let log_ratio = libm::log(2.0 * builders / (builders + 1.0)) as f32;
    Some(log_ratio.max(-config.doubtful_log_odds))
}

/// One scalar update: a component of the normal is to change by `innovation`, and does by both tilts. The density that the innovation had.
fn lean(plane: &mut Plane<f64>, tilts: [f64; 2], innovation: f64, variance: f64) -> Option<f64> {
    let row = Vector3::new(0.0, tilts[0], tilts[1]);
    let spread = plane.covariance * row;
    let innovation_variance = row.dot(&spread) + variance;
    let gain = spread / innovation_variance;
    let by = gain * innovation;
    let covariance = plane.covariance - gain * spread.transpose();
    *plane = plane.corrected([by.x, by.y, by.z], covariance)?;
    let density = libm::exp(-0.5 * innovation * innovation / innovation_variance)
        / libm::sqrt(core::f64::consts::TAU * innovation_variance);
    density.is_finite().then_some(density)
}

/// The surface that a path of one reflection suggests. `None` when there is no such point, or when its plane would be known worse than
/// [`SurfaceConfig::same_m`].
#[must_use]
pub fn from_single(path: &BirthPath, config: &SurfaceConfig) -> Option<Birth> {
    path.birth(0.0, config, &Matrix3::zeros(), |path, _| {
        piece(
            &path.transmitter_m,
            &path.uav_m,
            path.arrival.vector(),
            path.length_m,
        )
    })
}

/// Which of a pair is the known one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Known {
    /// The wave met the known surface first.
    First,
    /// It met the known surface last.
    Last,
}

/// The other surface of a path of two reflections, and both points, from the transmitter on. `None` when the known one cannot be it,
/// when it would have been met outside what is known of it, or when the other one does not stand upright.
#[must_use]
pub fn from_pair(
    path: &BirthPath,
    surface: &Surface,
    known: Known,
    config: &SurfaceConfig,
) -> Option<(Birth, [Vector3<f64>; 2])> {
    let plane = surface.plane.to_f64();
    let is_before = |point: &Vector3<f64>| plane.height_m(point) > LEAST_HEIGHT_M;
    let solve = |path: &BirthPath, step: [f64; 3]| {
        let plane = plane.corrected(step, plane.covariance)?;
        let (transmitter_m, arrival) = (path.transmitter_m, path.arrival.vector());
        match known {
            Known::First => piece(&plane.image(&transmitter_m), &path.uav_m, arrival, path.length_m),
            Known::Last => {
                let normal = plane.normal.vector();
                let turned = arrival - normal * (2.0 * normal.dot(arrival));
                piece(&transmitter_m, &plane.image(&path.uav_m), &turned, path.length_m)
            }
        }
    };
    let end = match known {
        Known::First => path.transmitter_m,
        Known::Last => path.uav_m,
    };
    if !is_before(&end) {
        return None;
    }
    let birth = path.birth(-config.doubtful_log_odds, config, &plane.covariance, solve)?;
    let other = birth.plane.centre.vector().map(f64::from);
    if !is_before(&other) {
        return None;
    }
    // Where the straight way from there to the end behind the known surface passes through it.
    let behind = plane.image(&end);
    let (over, under) = (plane.height_m(&other), plane.height_m(&behind));
    let met = other + (behind - other) * (over / (over - under));
    let upright = birth.plane.normal.vector().z.abs() < config.upright_rad();
    let seen = surface.outside_m(&met) <= config.reach_m;
    (upright && seen).then_some(match known {
        Known::First => (birth, [met, other]),
        Known::Last => (birth, [other, met]),
    })
}

#[cfg(test)]
mod tests;
