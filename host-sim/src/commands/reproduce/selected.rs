//! What a mode made of one link, with its points selected twice: by the truth, which knows the strongest path, and by what the
//! receiver knows, which may believe a wrong one.

use cslam_core::link_state::LinkState;
use cslam_core::paths::PathEstimator;
use cslam_core::reflection::ReflectionPoint;

use super::known_pose::{KnownPose, Perceived, error_m, nearest, truth_of};
use crate::channel::{Instant, Simulator};
use crate::paths::Link;

/// A point this far off is wrong whatever its path was, m.
pub(super) const FAR_M: f64 = 1.0;

/// A point that the receiver believes, held against the truth.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Believed {
    /// Distance from where its wave was reflected, m; of a path that was not reflected once, from the nearest place of the link
    /// that reflected a wave once.
    pub(super) error_m: f64,
    /// Whether its path was reflected once.
    pub(super) first_order: bool,
}

impl Believed {
    /// Of a point that the estimate number `place` gave. `None` when nothing of the link was reflected once.
    fn of(point: &ReflectionPoint, perceived: &Perceived, place: usize, link: &Link) -> Option<Self> {
        let reflected = |path: &&crate::paths::LinkPath| path.order == Some(1);
        let truth = truth_of(perceived.paths.get(place)?, link).and_then(|index| link.paths.get(index));
        let own_m = truth.filter(reflected).and_then(|path| path.last_vertex);
        let off_m = |vertex_m| error_m(point, vertex_m);
        let nearest_m = || {
            let places_m = link
                .paths
                .iter()
                .filter(reflected)
                .filter_map(|path| path.last_vertex);
            places_m.map(off_m).min_by(f64::total_cmp)
        };
        Some(Self {
            error_m: own_m.map(off_m).or_else(nearest_m)?,
            first_order: own_m.is_some(),
        })
    }
}

/// What one mode made of one link.
#[derive(Clone, Debug, Default)]
pub(super) struct Measured {
    /// Error of the point of the path that was strongest in truth, m, when it was found.
    pub(super) error_m: Option<f64>,
    /// Whether the strongest estimate is that path.
    pub(super) strongest: bool,
    /// Error of the point that enters the map from the strongest true path, m.
    pub(super) accepted_m: Option<f64>,
    /// The strongest estimate's point, where the link state says first order; every gate open.
    pub(super) judged: Option<Believed>,
    /// Every point that the mode takes into its map.
    pub(super) mapped: Vec<Believed>,
}

impl Measured {
    fn of(receiver: &KnownPose, perceived: &Perceived, link: &Link) -> Self {
        let truth_m = link.paths.first().and_then(|path| path.last_vertex);
        let place = nearest(perceived, link, 0);
        let error = |point: Option<ReflectionPoint>| {
            point
                .zip(truth_m)
                .map(|(point, truth_m)| error_m(&point, truth_m))
        };
        let believed = |place: usize, point: Option<ReflectionPoint>| {
            point.and_then(|point| Believed::of(&point, perceived, place, link))
        };
        let state = perceived
            .probabilities
            .first()
            .copied()
            .flatten()
            .map(|p| p.state());
        Self {
            error_m: place.and_then(|place| error(receiver.solve(perceived, place))),
            strongest: place == Some(0),
            accepted_m: place.and_then(|place| error(receiver.outcome(perceived, place).ok())),
            judged: (state == Some(LinkState::FirstOrder))
                .then(|| believed(0, receiver.solve(perceived, 0)))
                .flatten(),
            mapped: (0..perceived.paths.len())
                .filter_map(|place| believed(place, receiver.outcome(perceived, place).ok()))
                .collect(),
        }
    }
}

/// Sends a link number `index` and gives what each receiver made of it.
///
/// # Errors
/// A link that cannot be sent.
pub(super) fn measure(
    simulator: &Simulator,
    receivers: &[KnownPose],
    estimators: &mut [Box<dyn PathEstimator<32, 9>>],
    link: &Link,
    index: u32,
) -> anyhow::Result<Vec<Measured>> {
    let instant = Instant::at_rest();
    let sweep = simulator
        .sweep(link, &instant, index)
        .map_err(|e| anyhow::anyhow!("link {index}: {e}"))?;
    let mut all = Vec::with_capacity(receivers.len());
    for (receiver, estimator) in receivers.iter().zip(estimators) {
        let mut blocks = sweep.clone();
        let perceived = receiver.perceive(estimator.as_mut(), &mut blocks, link, &instant)?;
        all.push(Measured::of(receiver, &perceived, link));
    }
    Ok(all)
}
