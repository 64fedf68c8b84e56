//! A check of the whole sweep: whether all explained paths agree on one error of the pose.
//!
//! Each path alone may be off by what the pose is allowed; together they may not be off in different ways. The joint innovation has the covariance
//! `H P H' + R` with P shared, so its normalised square is the sum of those of a filter that takes one path after the other.

use nalgebra::{Matrix3, SMatrix, Vector3};

use super::chain::{Chain, POSE_STATES};
use super::config::AssociationConfig;
use super::hypotheses::Scene;
use super::likelihood::{chi_square_of_three, joined};
use super::measurement::Measurement;
use super::part::part;
use crate::geometry::Plane;
use crate::surfaces::{MOST_REFLECTIONS, SurfaceIds};

/// The sum over a sweep.
#[derive(Clone, Debug)]
pub(super) struct Joint {
    error: SMatrix<f64, POSE_STATES, 1>,
    covariance: SMatrix<f64, POSE_STATES, POSE_STATES>,
    pub(super) chi_square: f64,
    pub(super) degrees: u32,
}

impl Joint {
    pub(super) fn new<const N: usize>(scene: &Scene<'_, N>) -> Self {
        Self {
            error: SMatrix::zeros(),
            covariance: scene.pose.covariance,
            chi_square: 0.0,
            degrees: 0,
        }
    }

    /// Takes one path in. Surfaces count as noise. Whether its chain exists.
    pub(super) fn take<const N: usize>(
        &mut self,
        scene: &Scene<'_, N>,
        measured: &Measurement,
        ids: &SurfaceIds,
    ) -> Option<()> {
        let mut planes = heapless::Vec::<Plane<f64>, MOST_REFLECTIONS>::new();
        for id in ids {
            let known = scene.known.iter().find(|known| known.surface.id == *id)?;
            planes.push(known.plane).ok()?;
        }
        let chain = Chain::over(&planes);
        let predicted = chain.predict(&scene.transmitter.position_m, &scene.pose.position_m)?;
        let derivatives = chain.derivatives(&scene.transmitter.position_m, &predicted, &measured.tangents);
        let three = |m: &SMatrix<f64, 3, 5>| -> Matrix3<f64> { part(m, (0, 0)) };
        let mut noise: Matrix3<f64> = part(&measured.noise, (0, 0));
        for (plane, of) in planes.iter().zip(&joined(&derivatives, ids)) {
            let of = three(of);
            noise += of.tr_mul(&(plane.covariance * of));
        }
        let innovation = measured.innovation(predicted.range_m, &predicted.arrival, &predicted.departure);
        let innovation: Vector3<f64> = part(&innovation, (0, 0));
        // The error with the other sign: by its derivative the innovation grows.
        let by_pose: SMatrix<f64, POSE_STATES, 3> = part(&derivatives.pose, (0, 0));
        let rest = innovation - by_pose.tr_mul(&self.error);
        let spread = self.covariance * by_pose;
        let covariance = noise + by_pose.tr_mul(&spread);
        self.chi_square += chi_square_of_three(&rest, &covariance);
        self.degrees += 3;
        let gain = spread * covariance.try_inverse()?;
        self.error += gain * rest;
        self.covariance -= gain * spread.transpose();
        Some(())
    }

    /// Whether that is within as many standard deviations as a single path is allowed.
    pub(super) fn is_consistent(&self, config: &AssociationConfig) -> bool {
        self.degrees == 0 || self.chi_square <= chi_square_gate(self.degrees, f64::from(config.gate_sigmas))
    }
}

/// The value that chi-square of so many degrees of freedom exceeds as seldom as a Gaussian exceeds so many standard deviations: the
/// approximation of Wilson and Hilferty.
fn chi_square_gate(degrees: u32, sigmas: f64) -> f64 {
    let n = f64::from(degrees);
    let ninth = 2.0 / (9.0 * n);
    let root = 1.0 - ninth + sigmas * libm::sqrt(ninth);
    n * root * root * root
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gate_is_that_of_the_tables() {
        // Exceeded in one of a thousand: 3.0902 standard deviations.
        for (degrees, value) in [(3, 16.266), (6, 22.458), (15, 37.697)] {
            assert!(
                (chi_square_gate(degrees, 3.0902) / value - 1.0).abs() < 0.02,
                "{degrees}"
            );
        }
    }
}
