//! How likely a hypothesis is before its innovation is looked at.
//!
//! ```text
//! log pi(chain) = log P'(order) - log n_k + sum_j [ log r_j + log reach_j ] + log open(chain)
//! P' = (1 - 3 doubt) P + doubt
//! ```
//! `open` is asked of every order, and of reflections off unknown surfaces as well: phantoms lie behind a wall.

use heapless::Vec;
use nalgebra::Vector3;

use super::chain::ChainPoints;
use super::config::AssociationConfig;
use crate::geometry::Plane;
use crate::link_state::Probabilities;
use crate::surfaces::{Surface, Surfaces};

/// A surface with its plane in double precision, made once a sweep.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known<'s> {
    pub(super) surface: &'s Surface,
    pub(super) plane: Plane<f64>,
    /// Standard deviation of its offset, m, and of its tilt, norm of both axes, rad.
    pub(super) sigmas: [f64; 2],
}

/// All surfaces of a store.
#[inline(never)]
pub(super) fn known<const N: usize>(surfaces: &Surfaces<N>) -> Vec<Known<'_>, N> {
    crate::numeric::gather(surfaces.iter().map(|surface| {
        let plane = surface.plane.to_f64();
        let covariance = &plane.covariance;
        let variances = [covariance.m11, covariance.m22 + covariance.m33];
        Known {
            surface,
            plane,
            sigmas: variances.map(|variance| libm::sqrt(variance.max(0.0))),
        }
    }))
}

/// Classifier's probability of an order, tempered. Three and more reflections count as two, as artefacts do; without a classifier all are alike.
#[inline(never)]
pub(super) fn probability_of_order(
    probabilities: Option<&Probabilities>,
    order: usize,
    config: &AssociationConfig,
) -> f64 {
    let [straight, one, several] = probabilities.map_or([1.0 / 3.0; 3], |p| {
        [p.los, p.first_order, p.higher_order + p.artefact]
    });
    let said = f64::from(match order {
        0 => straight,
        1 => one,
        _ => several,
    });
    let doubt = f64::from(config.classifier_doubt);
    (1.0 - 3.0 * doubt) * said + doubt
}

/// Logarithm of how many chains of an order a place offers.
pub(super) fn log_offered(order: usize, config: &AssociationConfig) -> f64 {
    let further = f64::from(u32::try_from(order.saturating_sub(1)).unwrap_or(u32::MAX));
    if order == 0 {
        0.0
    } else {
        libm::log(f64::from(config.singles_offered)) + further * libm::log(f64::from(config.offered_growth))
    }
}

/// Logarithm of existence and reach of the surfaces of a chain, which reflects at these points.
#[inline(never)]
pub(super) fn log_surfaces(chain: &[&Known<'_>], points: &ChainPoints, config: &AssociationConfig) -> f64 {
    let of = |(known, point): (&&Known<'_>, &Vector3<f64>)| {
        let outside_m = known.surface.outside_m(point);
        f64::from(libm::logf(known.surface.existence()) + config.reach_per_m * outside_m)
    };
    chain.iter().zip(points).map(of).sum()
}

/// Whether a confirmed surface stands in the way from the transmitter over these points to the UAV. One of the chain itself may do so as well,
/// in a leg that does not end on it.
#[inline(never)]
pub(super) fn is_blocked(
    known: &[Known<'_>],
    [transmitter_m, uav_m]: [&Vector3<f64>; 2],
    points: &[Vector3<f64>],
    config: &AssociationConfig,
) -> bool {
    let mut others = known.iter().map(|known| known.surface);
    others.any(|surface| {
        if !surface.is_confirmed() {
            return false;
        }
        let mut from = transmitter_m;
        points.iter().chain(core::iter::once(uav_m)).any(|to| {
            let stands = surface.stands_between(from, to, config.clear_m);
            from = to;
            stands
        })
    })
}

/// Log prior of an open or a blocked way.
pub(super) fn log_open(blocked: bool, config: &AssociationConfig) -> f64 {
    if blocked { f64::from(config.blocked) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::association::tests::world::{confirmed, wall};

    #[test]
    fn the_classifier_is_tempered_and_stays_a_distribution() {
        let config = AssociationConfig::default();
        let sure = Probabilities {
            los: 0.0,
            first_order: 1.0,
            higher_order: 0.0,
            artefact: 0.0,
        };
        let all: f64 = (0..3)
            .map(|k| probability_of_order(Some(&sure), k, &config))
            .sum();
        assert!((all - 1.0).abs() < 1e-6);
        assert!((probability_of_order(Some(&sure), 2, &config) - 0.06).abs() < 1e-6);
        assert!((probability_of_order(Some(&sure), 3, &config) - 0.06).abs() < 1e-6);
        assert!((probability_of_order(None, 1, &config) - 1.0 / 3.0).abs() < 1e-6);
        assert!((log_offered(2, &config) - libm::log(18.0)).abs() < 1e-6);
        assert!((log_offered(3, &config) - libm::log(162.0)).abs() < 1e-6);
        assert_eq!(log_offered(0, &config), 0.0);
    }

    #[test]
    fn a_surface_that_is_sure_and_was_seen_there_costs_nothing() {
        let config = AssociationConfig::default();
        let mut surfaces = Surfaces::<4>::new(crate::surfaces::SurfaceConfig::default());
        confirmed(&mut surfaces, &wall([20.0, 0.0, 4.0], [-1.0, 0.0, 0.0]), 10.0);
        let cost = |surfaces: &Surfaces<4>, north_m: f64| {
            let known = known(surfaces);
            let points = ChainPoints::from_slice(&[Vector3::new(20.0, north_m, 4.0)]).expect("one");
            log_surfaces(&[&known[0]], &points, &config)
        };
        assert!(cost(&surfaces, 0.0).abs() < 0.01);
        assert!(
            (cost(&surfaces, 18.0) + 2.0 - cost(&surfaces, 0.0)).abs() < 1e-3,
            "8 m outside"
        );
        surfaces.get_mut(1).expect("there").log_odds = 0.0;
        assert!((cost(&surfaces, 0.0) - libm::log(0.5)).abs() < 1e-3);
    }

    #[test]
    fn only_a_confirmed_surface_blocks_and_not_where_it_reflects() {
        let config = AssociationConfig::default();
        let mut surfaces = Surfaces::<4>::new(crate::surfaces::SurfaceConfig::default());
        let id = confirmed(&mut surfaces, &wall([20.0, 0.0, 4.0], [-1.0, 0.0, 0.0]), 10.0);
        let (from, to) = (Vector3::new(0.0, 0.0, 2.0), Vector3::new(0.0, 5.0, 8.0));
        let beyond = [Vector3::new(40.0, 2.0, 5.0)];
        let blocked = |surfaces: &Surfaces<4>, points: &[Vector3<f64>]| {
            is_blocked(&known(surfaces), [&from, &to], points, &config)
        };
        let on = [Vector3::new(20.0, 2.0, 5.0)];
        assert!(blocked(&surfaces, &beyond) && !blocked(&surfaces, &on));
        assert!(!blocked(&surfaces, &[]) && !blocked(&surfaces, &[Vector3::new(19.0, 0.0, 4.0)]));
        surfaces.get_mut(id).expect("there").status = crate::surfaces::Status::Tentative;
        assert!(!blocked(&surfaces, &beyond));
    }
}
