//! How the errors of delay, angle and pose become an error of the point (docs/signal-model.md, "Reflection point").

use nalgebra::{Matrix3, Vector3};

use super::VectorSolution;
use crate::geometry::{Real, World};
use crate::path::Path;

/// Derivatives of the reflection point P.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobians<T: Real = f32> {
    /// dP / d(c tau, angle along e1, angle along e2): columns in m/m, m/rad, m/rad.
    pub path: Matrix3<T>,
    /// dP / dR with the direction held fixed, m/m.
    pub uav: Matrix3<T>,
}

impl<T: Real> Jacobians<T> {
    /// At a solution with baseline `b = R - G`:
    /// `dP/dc tau = u (c tau - d)/D`, `dP/du = d I - (d/D) u b^T` along the tangents, `dP/dR = I - u (b + d u)^T / D`.
    pub fn at(baseline: &Vector3<T>, path: &Path<World, T>, solution: &VectorSolution<T>) -> Self {
        let u = path.aoa.vector();
        let (d, denominator) = (solution.distance_m, solution.denominator_m);
        let (e1, e2) = path.aoa.tangents();
        let along = |e: &Vector3<T>| e * d - u * (d / denominator * baseline.dot(e));
        let delay = u * ((path.c_tau_m - d) / denominator);
        let path = Matrix3::from_columns(&[delay, along(&e1), along(&e2)]);
        let uav = Matrix3::identity() - u * (baseline + u * d).transpose() / denominator;
        Self { path, uav }
    }
}

/// `Cov_P = J Cov_path J^T + J_R Cov_R J_R^T`, m^2. The errors of path and pose are taken as independent.
pub fn point_covariance<T: Real>(
    jacobians: &Jacobians<T>,
    path: &Path<World, T>,
    uav_covariance: &Matrix3<T>,
) -> Matrix3<T> {
    jacobians.path * path.covariance * jacobians.path.transpose()
        + jacobians.uav * uav_covariance * jacobians.uav.transpose()
}
