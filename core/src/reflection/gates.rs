//! The gates a solved point has to pass (docs/signal-model.md, "Reflection point"), each with its uncertainty taken into account.

use super::{Ends, ReflectionPoint, Rejection, VectorSolution};
use crate::geometry::{Direction, Position, Real, World};
use crate::path::Path;

/// A box in the world, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<T: Real = f32> {
    /// Smallest coordinates.
    pub min: Position<World, T>,
    /// Largest coordinates.
    pub max: Position<World, T>,
}

/// Thresholds of the gates. [`Gates::default`] holds the design's values; every gate can be opened by its zero setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gates<T: Real = f32> {
    /// Excess delay must exceed this many of its standard deviations. Default 3; 0 leaves a millimetre.
    pub excess_sigmas: T,
    /// Within this angle of the GMT's direction a path without excess is called line of sight, rad. Default 10 degrees.
    pub line_of_sight_angle_rad: T,
    /// Smallest `1 + cos beta`: a range error is magnified by at most its inverse. Default 0.2; 0 opens the gate.
    pub min_one_plus_cos_bistatic: T,
    /// Largest error that the point may have by those of the path and the pose, m: the root of its covariance's trace
    /// ([`ReflectionPoint::sigma_m`]). Open by default: how good a point must be is for its user to say.
    pub max_sigma_m: T,
    /// Smallest distance from the UAV, m. Default 0.5 m.
    pub min_uav_distance_m: T,
    /// Smallest distance from the GMT, m. Default 0.3 m.
    pub min_gmt_distance_m: T,
    /// The direction from the GMT to the point must agree with the angle of departure within this many standard
    /// deviations of both. Default 2.5; infinity opens the gate.
    pub departure_sigmas: T,
    /// Height of the ground, m; `None` when there is none. The gate allows three standard deviations of the point.
    pub ground_z_m: Option<T>,
    /// Bounds of the scene; `None` when unknown. The gate allows three standard deviations of the point.
    pub bounds: Option<Bounds<T>>,
}

impl<T: Real> Default for Gates<T> {
    fn default() -> Self {
        Self {
            excess_sigmas: T::of(3.0),
            line_of_sight_angle_rad: T::of(10.0_f64.to_radians()),
            min_one_plus_cos_bistatic: T::of(0.2),
            max_sigma_m: unlimited(),
            min_uav_distance_m: T::of(0.5),
            min_gmt_distance_m: T::of(0.3),
            departure_sigmas: T::of(2.5),
            ground_z_m: None,
            bounds: None,
        }
    }
}

/// Excess delay below which a path is line of sight whatever its covariance claims, m. No receiver of 200 MHz tells a
/// millimetre apart, and positions come rounded.
const MIN_EXCESS_M: f64 = 1e-3;

/// Standard deviations that a delay may be shorter than the straight way at least.
const DEFICIT_SIGMAS: f64 = 3.5;

/// So many standard deviations of the excess delay, m, as [`Gates::excess_gate_m`] says.
fn excess_m_of<T: Real>(sigmas: T, ends: &Ends<T>, path: &Path<World, T>) -> T {
    let baseline = ends.uav.from_origin(&ends.gmt);
    let along = baseline / baseline.norm();
    let variance = path.covariance.m11 + along.dot(&(ends.uav_covariance * along)).max(T::zero());
    (sigmas * variance.sqrt())
        .max(T::of(MIN_EXCESS_M))
        .max(resolution_m(ends, path.c_tau_m))
}

/// The largest number of its type.
fn unlimited<T: Real>() -> T {
    T::max_value().unwrap_or_else(T::one)
}

/// What the number type can tell apart in this link, m: a few units in the last place of its largest length.
pub(super) fn resolution_m<T: Real>(ends: &Ends<T>, c_tau_m: T) -> T {
    let largest = ends
        .uav
        .vector()
        .amax()
        .max(ends.gmt.vector().amax())
        .max(c_tau_m);
    T::default_epsilon() * T::of(16.0) * largest
}

impl<T: Real> Gates<T> {
    /// Every gate open that can be opened: what remains are the paths that have no solution at all.
    pub fn open() -> Self {
        Self {
            excess_sigmas: T::zero(),
            min_one_plus_cos_bistatic: T::zero(),
            min_uav_distance_m: T::zero(),
            min_gmt_distance_m: T::zero(),
            departure_sigmas: unlimited(),
            ..Self::default()
        }
    }

    /// Excess delay below which nothing can be said, m: the gate in standard deviations of `c tau - |b|` (delay, and the
    /// UAV's position along the baseline), but never less than a millimetre or than the number type resolves.
    pub(super) fn excess_gate_m(&self, ends: &Ends<T>, path: &Path<World, T>) -> T {
        excess_m_of(self.excess_sigmas, ends, path)
    }

    /// How much shorter than the straight way a delay may be and still be a measurement, m. However far the gate for points
    /// is open, a line of sight has its error.
    pub(super) fn deficit_m(&self, ends: &Ends<T>, path: &Path<World, T>) -> T {
        excess_m_of(self.excess_sigmas.max(T::of(DEFICIT_SIGMAS)), ends, path)
    }

    /// The name for a path without excess delay.
    pub(super) fn without_excess(&self, ends: &Ends<T>, path: &Path<World, T>) -> Rejection {
        let towards_gmt = Direction::from_vector(ends.gmt.from_origin(&ends.uav));
        let aligned = towards_gmt.is_ok_and(|d| d.angle_to_rad(&path.aoa) <= self.line_of_sight_angle_rad);
        if aligned {
            Rejection::LineOfSight
        } else {
            Rejection::ExcessDelayTooSmall
        }
    }

    /// The first gate that the point does not pass.
    pub(super) fn check(
        &self,
        ends: &Ends<T>,
        path: &Path<World, T>,
        solution: &VectorSolution<T>,
        point: &ReflectionPoint<T>,
    ) -> Option<Rejection> {
        // Negated so that an error that is no number passes no gate.
        let conditioned = solution.one_plus_cos_bistatic >= self.min_one_plus_cos_bistatic
            && point.sigma_m() <= self.max_sigma_m;
        if !conditioned {
            return Some(Rejection::IllConditioned);
        }
        if point.distance_m < self.min_uav_distance_m {
            return Some(Rejection::TooCloseToUav);
        }
        let from_gmt_m = point.position.distance_m(&ends.gmt);
        if from_gmt_m < self.min_gmt_distance_m {
            return Some(Rejection::TooCloseToGmt);
        }
        // The vector form is exact here by construction; the paper's form can land on the wrong branch.
        let mismatch_m = (point.distance_m + from_gmt_m - path.c_tau_m).abs();
        if mismatch_m > T::of(1e-3) * path.c_tau_m {
            return Some(Rejection::LengthMismatch);
        }
        if self.departure_disagrees(ends, path, point, from_gmt_m) {
            return Some(Rejection::DepartureMismatch);
        }
        let [x, y, z] = point.position.to_array();
        let [sx, sy, sz] = [0, 1, 2].map(|i| {
            let variance = point.covariance.get((i, i)).copied().unwrap_or_else(T::zero);
            variance.max(T::zero()).sqrt() * T::of(3.0)
        });
        let rounding_m = resolution_m(ends, path.c_tau_m);
        if self.ground_z_m.is_some_and(|ground| z < ground - sz - rounding_m) {
            return Some(Rejection::UnderGround);
        }
        let outside = self.bounds.is_some_and(|bounds| {
            let (min, max) = (bounds.min.vector(), bounds.max.vector());
            let beyond = |c: T, low: T, high: T, slack: T| {
                c < low - slack - rounding_m || c > high + slack + rounding_m
            };
            beyond(x, min.x, max.x, sx) || beyond(y, min.y, max.y, sy) || beyond(z, min.z, max.z, sz)
        });
        outside.then_some(Rejection::OutOfBounds)
    }

    fn departure_disagrees(
        &self,
        ends: &Ends<T>,
        path: &Path<World, T>,
        point: &ReflectionPoint<T>,
        from_gmt_m: T,
    ) -> bool {
        let Some(departure) = path.aod else {
            return false;
        };
        let Ok(towards_point) = Direction::from_vector(point.position.from_origin(&ends.gmt)) else {
            return false;
        };
        // Only the point's error across the line turns the line; both tangents together.
        let line = towards_point.vector();
        let across_m2 = (point.covariance.trace() - line.dot(&(point.covariance * line))).max(T::zero());
        let sigma = (departure.sigma_rad * departure.sigma_rad * T::of(2.0)
            + across_m2 / (from_gmt_m * from_gmt_m))
            .sqrt();
        let rounding = T::default_epsilon() * T::of(64.0);
        towards_point.angle_to_rad(&departure.direction) > self.departure_sigmas * sigma + rounding
    }
}
