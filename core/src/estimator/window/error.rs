//! How a pose from a window errs with what it is made of.
//!
//! The sight gives the attitude across itself, and the force about it; the force with that attitude carries the line through the
//! fixes on to the last. So an error of the attitude, or of the force, is one of velocity and place as well.

use nalgebra::{Matrix3, Vector3};

use super::bend::{Bend, Times};
use super::{Fix, LEAST_NORM, Segment, WINDOW};

/// What one fix has to do with the pose at the last one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::estimator) struct Share {
    /// In the end of the line through the fixes, in its slope (1/s), in the acceleration that they bend by (1/s^2), in the mean sight.
    pub(in crate::estimator) weights: [f64; 4],
    /// Variance of the fix along each axis, m^2.
    pub(in crate::estimator) variance_m2: Vector3<f64>,
    /// Time since the fix before, s; none before the first.
    pub(in crate::estimator) since_s: Option<f64>,
}

/// Errors of what a pose is made of: estimated less true, world axes.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::estimator) struct Cause {
    /// Of the sight from outside less that from inside, rad.
    pub(in crate::estimator) sight: Vector3<f64>,
    /// Of the force seen from outside, by how the fixes bend, m/s^2.
    pub(in crate::estimator) outside: Vector3<f64>,
    /// Of the force felt inside, m/s^2.
    pub(in crate::estimator) inside: Vector3<f64>,
    /// Of the end of the line, m, and of its slope, m/s.
    pub(in crate::estimator) line: [Vector3<f64>; 2],
    /// Of the angular rate, rad/s: the sights agree best in the middle of the window.
    pub(in crate::estimator) rate: Vector3<f64>,
    /// Of the attitude at the last fix where that was given, rad.
    pub(in crate::estimator) given: Vector3<f64>,
}

/// How a pose errs with its causes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::estimator) struct Errors {
    /// To the GMT, world axes.
    pub(in crate::estimator) towards: Vector3<f64>,
    /// Mean specific force, world axes, m/s^2.
    pub(in crate::estimator) force: Vector3<f64>,
    /// The fixes, oldest first.
    pub(in crate::estimator) shares: [Share; WINDOW],
    /// Mean square of what they are off the line by, of what they claim; 1 at least.
    pub(in crate::estimator) excess: f64,
    /// Variance of the angle between both ends of a sight as found, rad^2 per axis.
    pub(in crate::estimator) sight_variance_rad2: f64,
    /// What an acceleration does to the last of the fixes beside the line through all, s^2, and to its velocity, s.
    carried: [f64; 2],
    /// From the mean of the fixes to the last, s.
    since_mean_s: f64,
}

impl Errors {
    pub(super) fn of(
        motion: &[(Segment, Fix)],
        times: &Times,
        bend: &Bend,
        first: &Matrix3<f64>,
    ) -> Option<Self> {
        let end = times.of(motion.last()?);
        let mut shares = [Share::default(); WINDOW];
        let (mut towards, mut force) = (Vector3::zeros(), Vector3::zeros());
        for ((share, entry), bent) in shares.iter_mut().zip(motion).zip(&bend.weights) {
            let (since, fix) = entry;
            let t = times.of(entry);
            let slope = t / times.spread;
            *share = Share {
                weights: [1.0 / times.n + end * slope, slope, 2.0 * bent, 1.0 / times.n],
                variance_m2: fix.variance_m2,
                since_s: (since.dt_s > 0.0).then_some(fix.since_previous.dt_s),
            };
            towards += fix.towards_gmt;
            force += first * since.position * (2.0 * bent);
        }
        Some(Self {
            towards: towards.try_normalize(LEAST_NORM)?,
            force,
            shares,
            excess: 1.0,
            sight_variance_rad2: 0.0,
            carried: bend.shape(end).map(|shape| 0.5 * shape),
            since_mean_s: end,
        })
    }

    /// What a place that is off by `error`, m, does at `range_m` to what the fixes with these weights give. A sight from outside that is turned
    /// displaces the place as well, hence both are one error.
    pub(in crate::estimator) fn by_place(
        &self,
        weights: [f64; 4],
        error: &Vector3<f64>,
        range_m: f64,
    ) -> Cause {
        let [line, slope, bend, sight] = weights;
        Cause {
            sight: self.across(error) * (-sight / range_m),
            outside: error * bend,
            line: [error * line, error * slope],
            ..Cause::default()
        }
    }

    /// The part of a vector across the sight.
    pub(in crate::estimator) fn across(&self, vector: &Vector3<f64>) -> Vector3<f64> {
        vector - self.towards * self.towards.dot(vector)
    }

    /// Errors of place, velocity and attitude at the last fix. The attitude is `given`, or of the window as well.
    pub(in crate::estimator) fn of_pose(&self, cause: &Cause, given: bool) -> [Vector3<f64>; 3] {
        let turned = cause.rate * self.since_mean_s;
        let mean = if given {
            cause.given - turned
        } else {
            let tilt = self.towards.cross(&cause.sight);
            let lever = self.towards.cross(&self.force);
            // Twisted about the sight until the force felt inside lies where it is seen from outside.
            let apart = cause.outside - cause.inside - tilt.cross(&self.force);
            tilt + self.towards * (lever.dot(&apart) / lever.norm_squared().max(LEAST_NORM))
        };
        let gained = mean.cross(&self.force) + cause.inside;
        let [end, slope] = cause.line;
        let [place, velocity] = self.carried;
        [end + gained * place, slope + gained * velocity, mean + turned]
    }
}
