//! Where a once-reflected wave hit the world.
//!
//! A wave that left the GMT at G, was reflected once at P and reached the UAV at R from direction `u` after the length
//! `c tau` puts P on an ellipsoid with foci G and R and on the ray from R along `u`: one point. [`solve`] finds it, says
//! how uncertain it is, and decides whether it may be believed. A path that cannot be a first-order reflection, or whose
//! point would mean nothing, comes back as a [`Rejection`], a measurement that is no path at all as an [`InputError`]:
//! never as a point that looks valid.
//!
//! Two forms of the same surface are selectable: [`Form::Vector`] (docs/signal-model.md, "Reflection point"), which has no singular
//! directions, and [`Form::Paper`], equations geores_1 to geores_3 of the paper, which loses all accuracy near azimuth
//! +-90 degrees and zenith 0 and 180 degrees.
//!
//! ```text
//! b = R - G,  d = (c tau - |b|) (c tau + |b|) / (2 (c tau + u . b)),  P = R + d u
//! ```
//!
//! # Example
//! A wall at x = 20 m: the way from G over it to R is 50 m long, and arrives from (0.8, -0.6, 0).
//! ```
//! use cslam_core::geometry::{Direction, Matrix3, Position, Vector3};
//! use cslam_core::path::{Path, diagonal_covariance};
//! use cslam_core::reflection::{Ends, Form, Gates, Verdict, solve};
//!
//! let ends: Ends<f64> = Ends { uav: Position::new(0.0, 30.0, 2.0)?, uav_covariance: Matrix3::zeros(), gmt: Position::new(0.0, 0.0, 2.0)? };
//! let aoa = Direction::from_vector(Vector3::new(0.8, -0.6, 0.0))?;
//! let path = Path { c_tau_m: 50.0, aoa, aod: None, covariance: diagonal_covariance(0.05, 2e-3) };
//! let Verdict::Accepted(point) = solve(&ends, &path, Form::Vector, &Gates::default())? else { panic!("it is one reflection") };
//! assert!((point.position.vector() - Vector3::new(20.0, 15.0, 2.0)).norm() < 1e-9);
//! assert!((0.04..0.2).contains(&point.sigma_m()));
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod covariance;
mod error;
mod gates;
mod paper;
mod vector;

use nalgebra::Matrix3;

use crate::geometry::{Position, Real, World};
use crate::path::Path;

pub use covariance::{Jacobians, point_covariance};
pub use error::{InputError, Rejection};
pub use gates::{Bounds, Gates};
pub use paper::paper_point;
pub use vector::{VectorSolution, vector_point};

/// Which closed form solves the point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Form {
    /// `P = R + d u`, without singular directions.
    #[default]
    Vector,
    /// Equations geores_1 to geores_3 of the paper.
    Paper,
}

/// The two ends of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ends<T: Real = f32> {
    /// Position of the UAV, R.
    pub uav: Position<World, T>,
    /// Covariance of the UAV's position, m^2.
    pub uav_covariance: Matrix3<T>,
    /// Position of the GMT, G, as its beacon says.
    pub gmt: Position<World, T>,
}

/// A solved reflection point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReflectionPoint<T: Real = f32> {
    /// Position of the point, P.
    pub position: Position<World, T>,
    /// Covariance of P, m^2.
    pub covariance: Matrix3<T>,
    /// Distance from the UAV to P, m.
    pub distance_m: T,
}

impl<T: Real> ReflectionPoint<T> {
    /// Root of the covariance's trace: the rms length of the error, m.
    pub fn sigma_m(&self) -> T {
        self.covariance.trace().max(T::zero()).sqrt()
    }
}

/// What became of a well-formed path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict<T: Real = f32> {
    /// Consistent with one reflection, at this point.
    Accepted(ReflectionPoint<T>),
    /// Not a first-order reflection, or one whose point would mean nothing.
    Rejected(Rejection),
}

/// Solves the reflection point of one path and judges it.
///
/// # Errors
/// [`InputError`] when the input is no measurement of a path: not finite, without length, with an impossible covariance,
/// or with a delay shorter than the straight way between the ends by more than its uncertainty.
pub fn solve<T: Real>(
    ends: &Ends<T>,
    path: &Path<World, T>,
    form: Form,
    gates: &Gates<T>,
) -> Result<Verdict<T>, InputError> {
    check_input(ends, path)?;
    let baseline = ends.uav.from_origin(&ends.gmt);
    let excess_gate_m = gates.excess_gate_m(ends, path);
    let excess_m = path.c_tau_m - baseline.norm();
    if excess_m < -gates.deficit_m(ends, path) {
        return Err(InputError::DelayShorterThanBaseline);
    }
    if excess_m < excess_gate_m {
        return Ok(Verdict::Rejected(gates.without_excess(ends, path)));
    }
    let solution = match vector_point(&baseline, path.aoa.vector(), path.c_tau_m) {
        Some(solution) => solution,
        None => return Ok(Verdict::Rejected(Rejection::IllConditioned)),
    };
    let vector = match form {
        Form::Vector => ends.uav.vector() + path.aoa.vector() * solution.distance_m,
        Form::Paper => paper_point(&ends.uav, &ends.gmt, &path.aoa, path.c_tau_m),
    };
    // Only the paper's form can leave the finite numbers: at its singular directions.
    let Ok(position) = Position::from_vector(vector) else {
        return Ok(Verdict::Rejected(Rejection::Singular));
    };
    let point = ReflectionPoint {
        position,
        covariance: point_covariance(
            &Jacobians::at(&baseline, path, &solution),
            path,
            &ends.uav_covariance,
        ),
        distance_m: position.distance_m(&ends.uav),
    };
    Ok(match gates.check(ends, path, &solution, &point) {
        None => Verdict::Accepted(point),
        Some(rejection) => Verdict::Rejected(rejection),
    })
}

fn check_input<T: Real>(ends: &Ends<T>, path: &Path<World, T>) -> Result<(), InputError> {
    if !path.c_tau_m.is_finite() {
        return Err(InputError::NotFinite);
    }
    if path.c_tau_m <= T::zero() {
        return Err(InputError::NoLength);
    }
    if ends.uav.distance_m(&ends.gmt) <= gates::resolution_m(ends, path.c_tau_m) {
        return Err(InputError::CoincidentEnds);
    }
    let sound = |m: &Matrix3<T>| {
        m.iter().all(|c| c.is_finite()) && m.diagonal().iter().all(|variance| *variance >= T::zero())
    };
    let departure_sound = path
        .aod
        .is_none_or(|d| d.sigma_rad.is_finite() && d.sigma_rad >= T::zero());
    if !sound(&path.covariance) || !sound(&ends.uav_covariance) || !departure_sound {
        return Err(InputError::ImpossibleCovariance);
    }
    Ok(())
}
