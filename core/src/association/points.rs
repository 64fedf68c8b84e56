//! Where a chain of surfaces reflected a path: points of the map.

use heapless::Vec;
use nalgebra::{Matrix3, Vector3};

use super::chain::Chain;
use crate::geometry::{Plane, Position, World};
use crate::reflection::ReflectionPoint;
use crate::surfaces::{MOST_REFLECTIONS, SurfaceIds, Surfaces, Waiting};

/// Step of difference quotients, m and rad.
/// Numerical: in `f64` both their errors are below a millionth.
const STEP: f64 = 1e-5;

/// A point of a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The surface.
    pub surface: u16,
    /// Sweep of the path.
    pub sweep: u32,
    /// Index of the path in its sweep.
    pub path: u8,
    /// Which of the path's reflections it is, the first after the transmitter being 1, and of how many.
    pub reflection: [u8; 2],
    /// Probability that every surface of the path's chain exists.
    pub existence: f32,
    /// Point with covariance: of the UAV's place and of every surface of the chain.
    pub point: ReflectionPoint,
}

/// The points of a path, from the transmitter on.
pub(super) type PathPoints = Vec<SurfacePoint, MOST_REFLECTIONS>;

/// The points of a path over surfaces as they are now. `None` when one of them is gone, when the chain does not exist any more, or when a
/// point would be known worse than [`crate::surfaces::SurfaceConfig::most_point_m`].
pub(super) fn points_of<const N: usize>(surfaces: &Surfaces<N>, path: &Waiting) -> Option<PathPoints> {
    let mut planes = Vec::<Plane<f64>, MOST_REFLECTIONS>::new();
    let mut existence = 1.0;
    for id in &path.chain {
        let surface = surfaces.get(*id)?;
        planes.push(surface.plane.to_f64()).ok()?;
        existence *= surface.existence();
    }
    let [transmitter_m, uav_m] = [path.transmitter_m, path.uav_m].map(|end| end.map(f64::from));
    let covariances = covariances(path, &planes)?;
    let predicted = Chain::over(&planes).predict(&transmitter_m, &uav_m)?;
    let mut points = PathPoints::new();
    let met = path.chain.iter().zip(&predicted.points).zip(&covariances);
    for (reflection, ((id, at), covariance)) in (1..).zip(met) {
        let point = ReflectionPoint {
            position: Position::<World>::from_vector(at.map(|c| c as f32)).ok()?,
            covariance: covariance.map(|c| c as f32),
            distance_m: (at - uav_m).norm() as f32,
        };
        let sigma_m = point.sigma_m();
        if sigma_m.is_nan() || sigma_m > surfaces.config().most_point_m {
            return None;
        }
        let _fits = points.push(SurfacePoint {
            surface: *id,
            sweep: path.sweep,
            path: path.path,
            reflection: [reflection, path.chain.len() as u8],
            existence,
            point,
        });
    }
    Some(points)
}

/// Covariance of each point: by differences over the UAV's place and each surface, m^2.
fn covariances(path: &Waiting, planes: &[Plane<f64>]) -> Option<Vec<Matrix3<f64>, MOST_REFLECTIONS>> {
    let [transmitter_m, uav_m] = [path.transmitter_m, path.uav_m].map(|end| end.map(f64::from));
    let at = |planes: &[Plane<f64>], uav: &Vector3<f64>| {
        Some(Chain::over(planes).predict(&transmitter_m, uav)?.points)
    };
    let here = at(planes, &uav_m)?;
    // One Jacobian of each point by each source of errors.
    let differences = |moved: &dyn Fn(usize) -> Option<Vec<Vector3<f64>, MOST_REFLECTIONS>>| {
        let mut jacobians = [Matrix3::<f64>::zeros(); MOST_REFLECTIONS];
        for axis in 0..3 {
            let there = moved(axis)?;
            for ((jacobian, there), here) in jacobians.iter_mut().zip(&there).zip(&here) {
                if let Some(mut column) = jacobian.column_iter_mut().nth(axis) {
                    column.copy_from(&((there - here) / STEP));
                }
            }
        }
        Some(jacobians)
    };
    let step = |axis: usize| -> [f64; 3] { core::array::from_fn(|a| if a == axis { STEP } else { 0.0 }) };
    let mut covariances = [Matrix3::<f64>::zeros(); MOST_REFLECTIONS];
    let mut add = |jacobians: &[Matrix3<f64>; MOST_REFLECTIONS], of: &Matrix3<f64>| {
        for (sum, jacobian) in covariances.iter_mut().zip(jacobians) {
            *sum += jacobian * of * jacobian.transpose();
        }
    };
    let by_uav = differences(&|axis| at(planes, &(uav_m + Vector3::from(step(axis)))))?;
    add(&by_uav, &path.uav_covariance_m2.map(f64::from));
    for id in each_once(&path.chain) {
        let moved = |axis: usize| {
            let mut moved = Vec::<Plane<f64>, MOST_REFLECTIONS>::new();
            for (other, plane) in path.chain.iter().zip(planes) {
                let by = if *other == id { step(axis) } else { [0.0; 3] };
                moved.push(plane.corrected(by, plane.covariance)?).ok()?;
            }
            at(&moved, &uav_m)
        };
        let of = path.chain.iter().zip(planes).find(|(other, _)| **other == id)?;
        add(&differences(&moved)?, &of.1.covariance);
    }
    Some(crate::numeric::gather(covariances.into_iter().take(planes.len())))
}

/// The surfaces of a chain, each once.
pub(super) fn each_once(chain: &SurfaceIds) -> SurfaceIds {
    let mut once = SurfaceIds::new();
    for id in chain {
        if !once.contains(id) {
            let _fits = once.push(*id);
        }
    }
    once
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::tests::world::{confirmed, wall};
    use crate::surfaces::SurfaceConfig;

    #[test]
    fn the_error_of_a_point_is_that_of_the_uav_and_of_the_surface() {
        let mut surfaces = Surfaces::<4>::new(SurfaceConfig::default());
        let id = confirmed(&mut surfaces, &wall([20.0, 0.0, 4.0], [-1.0, 0.0, 0.0]), 10.0);
        let shift = surfaces.get(id).expect("there").plane.covariance.m11;
        let path = Waiting {
            sweep: 4,
            path: 2,
            chain: SurfaceIds::from_slice(&[id]).expect("one"),
            transmitter_m: Vector3::new(0.0, -6.0, 4.0),
            uav_m: Vector3::new(0.0, 6.0, 4.0),
            uav_covariance_m2: Matrix3::from_diagonal(&Vector3::new(0.0, 0.04, 0.0)),
        };
        let points = points_of(&surfaces, &path).expect("known well");
        let [point] = points.as_slice() else { panic!("one") };
        assert_eq!((point.surface, point.sweep, point.path), (id, 4, 2));
        assert!((point.point.position.vector() - Vector3::new(20.0, 0.0, 4.0)).norm() < 1e-4);
        // Along the normal the wall's shift; along the wall half of the UAV's motion, and the heading's 20 m.
        let covariance = point.point.covariance;
        assert!((covariance.m11 - shift).abs() < 1e-5, "{covariance}");
        let heading = surfaces.get(id).expect("there").plane.covariance.m22;
        assert!(
            (covariance.m22 - 0.01 - 400.0 * heading).abs() < 1e-4,
            "{covariance}"
        );
        let lost = Waiting {
            uav_covariance_m2: Matrix3::identity(),
            ..path
        };
        assert!(points_of(&surfaces, &lost).is_none());
    }
}
