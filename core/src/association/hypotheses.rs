//! Candidates of every path of a sweep: line of sight, then one, two and three surfaces, as far as there is time.
//!
//! A candidate is weighed when the image of the transmitter lies within a gate of the place where the path seems to come from. Pairs are
//! formed once for all paths; of threes, the last surface is looked into from the UAV: what is left is a pair.

use heapless::Vec;
use nalgebra::Vector3;

use super::chain::{Chain, MOST_REFLECTIONS};
use super::config::AssociationConfig;
use super::likelihood::{Likelihood, innovation_covariance, joined, likelihood};
use super::measurement::Measurement;
use super::pose::PoseEstimate;
use super::prior::{Known, is_blocked, log_offered, log_open, log_surfaces, probability_of_order};
use crate::estimator::Transmitter;
use crate::geometry::Plane;
use crate::link_state::Probabilities;
use crate::paths::departure_outliers;
use crate::surfaces::SurfaceIds;

/// Confirmed surfaces that threes are made of.
/// Capacity: a third of a million instructions for nine paths.
pub const SURFACES_OF_THREES: usize = 16;

/// What a sweep's paths are held against.
#[derive(Clone, Debug)]
pub(super) struct Scene<'a, const N: usize> {
    pub(super) known: Vec<Known<'a>, N>,
    pub(super) transmitter: &'a Transmitter,
    pub(super) pose: PoseEstimate,
    pub(super) config: &'a AssociationConfig,
}

/// A chain that may have made a path.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Hypothesis {
    pub(super) ids: SurfaceIds,
    /// Log weight: likelihood and prior.
    pub(super) log: f64,
    pub(super) likelihood: Likelihood,
    pub(super) confirmed: bool,
}

/// All that was weighed of a path.
#[derive(Clone, Debug)]
pub(super) struct Weighed {
    /// The best.
    pub(super) best: Option<Hypothesis>,
    /// Logarithm of the sum of all weights.
    pub(super) log_sum: f64,
    /// Best single reflection off a tentative surface whose way is blocked, as if it were not: surface and log weight.
    pub(super) blocked: Option<(u16, f64)>,
    /// Some were near and were not weighed.
    pub(super) unfinished: bool,
}

impl Default for Weighed {
    fn default() -> Self {
        Self {
            best: None,
            log_sum: f64::NEG_INFINITY,
            blocked: None,
            unfinished: false,
        }
    }
}

/// `log (exp a + exp b)`.
#[inline(never)]
pub(super) fn log_add(a: f64, b: f64) -> f64 {
    let (least, most) = if a < b { (a, b) } else { (b, a) };
    if most == f64::NEG_INFINITY {
        most
    } else {
        most + libm::log1p(libm::exp(least - most))
    }
}

impl Weighed {
    fn take(&mut self, hypothesis: Hypothesis) {
        self.log_sum = log_add(self.log_sum, hypothesis.log);
        if self.best.as_ref().is_none_or(|best| best.log < hypothesis.log) {
            self.best = Some(hypothesis);
        }
    }
}

/// What was left out of a sweep for want of time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LeftOut {
    /// Chains near a path that were not weighed ([`AssociationConfig::weighings`]).
    pub unweighed: u32,
    /// Confirmed surfaces beyond [`SURFACES_OF_THREES`].
    pub beyond_threes: u32,
}

/// Where a path seems to come from, and how near to that an image must lie: in all, and in its distance from the UAV, which is known far
/// better than its direction.
struct Source {
    at: Vector3<f64>,
    within_m: f64,
    /// The UAV, or its image.
    uav_m: Vector3<f64>,
    length_m: f64,
    range_within_m: f64,
    gate: f64,
}

impl Source {
    fn of<const N: usize>(scene: &Scene<'_, N>, measured: &Measurement) -> Self {
        let [position, _, clock] = scene.pose.sigmas();
        let covariance = &measured.path.covariance;
        let length_m = measured.path.c_tau_m;
        let sigma = |variance: f64| libm::sqrt(variance.max(0.0));
        // Standard deviations are added, not their squares: errors may be correlated.
        let within = position + sigma(covariance.m11) + length_m * sigma(covariance.m22 + covariance.m33);
        let gate = f64::from(scene.config.gate_sigmas);
        Self {
            at: scene.pose.position_m + measured.path.aoa.vector() * length_m,
            within_m: gate * within,
            uav_m: scene.pose.position_m,
            length_m,
            range_within_m: gate * (position + clock + sigma(covariance.m11)),
            gate,
        }
    }

    fn is_near(&self, image: &Image) -> bool {
        let moved = self.gate * image.sigma_m;
        let most = self.within_m + moved;
        if (image.at - self.at).norm_squared() >= most * most {
            return false;
        }
        // Compared by their squares: a root takes as long as all else here.
        let within = self.range_within_m + moved;
        let square = |length_m: f64| length_m * length_m;
        let away = (image.at - self.uav_m).norm_squared();
        away < square(self.length_m + within) && away >= square((self.length_m - within).max(0.0))
    }

    /// The same, seen in a plane.
    #[inline(never)]
    fn seen_in(&self, known: &Known<'_>) -> Self {
        let image = Image {
            at: self.at,
            sigma_m: 0.0,
        }
        .seen_in(known);
        let moved = self.gate * image.sigma_m;
        Self {
            at: image.at,
            within_m: self.within_m + moved,
            uav_m: known.plane.image(&self.uav_m),
            range_within_m: self.range_within_m + moved,
            ..*self
        }
    }
}

/// An image of the transmitter.
#[derive(Clone, Copy)]
struct Image {
    at: Vector3<f64>,
    /// What the surfaces' errors move it by, m, at most.
    sigma_m: f64,
}

impl Image {
    #[inline(never)]
    fn seen_in(&self, known: &Known<'_>) -> Self {
        let [shift_m, tilt_rad] = known.sigmas;
        let lever = (self.at - known.plane.centre.vector()).norm();
        let error = shift_m + tilt_rad * lever;
        Self {
            at: known.plane.image(&self.at),
            sigma_m: self.sigma_m + 2.0 * error,
        }
    }

    fn is_before(&self, known: &Known<'_>) -> bool {
        known.plane.height_m(&self.at) > 0.0
    }
}

impl<const N: usize> Scene<'_, N> {
    /// Weighs one chain against one path. `None` when the chain does not exist. Also whether its way is blocked.
    fn weigh(
        &self,
        measured: &Measurement,
        probabilities: Option<&Probabilities>,
        chain: &[&Known<'_>],
    ) -> Option<(Hypothesis, bool)> {
        let mut planes = Vec::<Plane<f64>, MOST_REFLECTIONS>::new();
        let mut ids = SurfaceIds::new();
        for known in chain {
            planes.push(known.plane).ok()?;
            ids.push(known.surface.id).ok()?;
        }
        let over = Chain::over(&planes);
        let predicted = over.predict(&self.transmitter.position_m, &self.pose.position_m)?;
        let derivatives = over.derivatives(&self.transmitter.position_m, &predicted, &measured.tangents);
        let by_surface = joined(&derivatives, &ids);
        let covariance =
            innovation_covariance(&derivatives, &by_surface, &planes, &self.pose, &measured.noise);
        let innovation = measured.innovation(predicted.range_m, &predicted.arrival, &predicted.departure);
        let in_beams = self.transmitter.leaves_in_beams(&predicted.departure);
        let outliers = measured
            .departure
            .map(|_| departure_outliers(measured.neighbourhood, in_beams, &self.config.errors));
        let likelihood = likelihood(&innovation, &covariance, outliers)?;
        let ends = [&self.transmitter.position_m, &self.pose.position_m];
        let blocked = is_blocked(&self.known, ends, &predicted.points, self.config);
        let log = likelihood.log + libm::log(probability_of_order(probabilities, chain.len(), self.config))
            - log_offered(chain.len(), self.config)
            + log_surfaces(chain, &predicted.points, self.config)
            + log_open(blocked, self.config);
        let confirmed = chain.iter().all(|known| known.surface.is_confirmed());
        Some((
            Hypothesis {
                ids,
                log,
                likelihood,
                confirmed,
            },
            blocked,
        ))
    }
}

/// One path in hand.
struct Candidate<'a> {
    measured: &'a Measurement,
    probabilities: Option<&'a Probabilities>,
    source: Source,
    weighed: Weighed,
}

/// The search of one sweep.
struct Search<'a, const N: usize> {
    scene: &'a Scene<'a, N>,
    left: u16,
    left_out: LeftOut,
}

impl<const N: usize> Search<'_, N> {
    /// Weighs a chain against a path that is near.
    fn weigh(&mut self, candidate: &mut Candidate<'_>, chain: &[&Known<'_>]) {
        let Some(left) = self.left.checked_sub(1) else {
            candidate.weighed.unfinished = true;
            self.left_out.unweighed = self.left_out.unweighed.saturating_add(1);
            return;
        };
        self.left = left;
        let weighed = self
            .scene
            .weigh(candidate.measured, candidate.probabilities, chain);
        let Some((hypothesis, blocked)) = weighed else {
            return;
        };
        if let (true, false, [id]) = (blocked, hypothesis.confirmed, hypothesis.ids.as_slice()) {
            let open = hypothesis.log - log_open(true, self.scene.config);
            if candidate.weighed.blocked.is_none_or(|(_, best)| best < open) {
                candidate.weighed.blocked = Some((*id, open));
            }
        }
        candidate.weighed.take(hypothesis);
    }

    fn weigh_near(&mut self, candidates: &mut [Candidate<'_>], image: &Image, chain: &[&Known<'_>]) {
        for candidate in candidates {
            if candidate.source.is_near(image) {
                self.weigh(candidate, chain);
            }
        }
    }

    /// Line of sight, the ground and the other single reflections, pairs and threes with confirmed surfaces, other pairs; of each the strongest
    /// path first.
    fn run(&mut self, candidates: &mut [Candidate<'_>]) {
        let scene = self.scene;
        let transmitter = Image {
            at: scene.transmitter.position_m,
            sigma_m: 0.0,
        };
        self.weigh_near(candidates, &transmitter, &[]);
        let firsts = || scene.known.iter().filter(|known| transmitter.is_before(known));
        for first in firsts() {
            self.weigh_near(candidates, &transmitter.seen_in(first), &[first]);
        }
        self.pairs(candidates, &transmitter, true);
        let confirmed = scene.known.iter().filter(|known| known.surface.is_confirmed());
        let all = u32::try_from(confirmed.clone().count()).unwrap_or(u32::MAX);
        let most = u32::try_from(SURFACES_OF_THREES).unwrap_or(u32::MAX);
        self.left_out.beyond_threes = all.saturating_sub(most);
        let threes: Vec<Known<'_>, SURFACES_OF_THREES> = crate::numeric::gather(confirmed.copied());
        for candidate in candidates.iter_mut() {
            self.threes(candidate, &threes, &transmitter);
        }
        self.pairs(candidates, &transmitter, false);
    }

    /// Pairs with a confirmed surface, or those without. Two tentative surfaces vouch for each other only, and where walls scatter there are
    /// more of them than anybody could weigh: they get what time is left, and a path that they were not weighed for is none the less finished.
    fn pairs(&mut self, candidates: &mut [Candidate<'_>], transmitter: &Image, with_confirmed: bool) {
        let known = &self.scene.known;
        for first in known.iter().filter(|known| transmitter.is_before(known)) {
            let one = transmitter.seen_in(first);
            for second in after(known, first).filter(|second| one.is_before(second)) {
                let confirmed = first.surface.is_confirmed() || second.surface.is_confirmed();
                let in_time = with_confirmed || usize::from(self.left) >= candidates.len();
                if confirmed == with_confirmed && in_time {
                    self.weigh_near(candidates, &one.seen_in(second), &[first, second]);
                }
            }
        }
    }

    /// Three confirmed surfaces: the pair of the first two, and the source as the last one shows it to the UAV.
    fn threes(&mut self, candidate: &mut Candidate<'_>, known: &[Known<'_>], transmitter: &Image) {
        let uav = self.scene.pose.position_m;
        let lasts: Vec<(&Known<'_>, Source), SURFACES_OF_THREES> = crate::numeric::gather(
            known
                .iter()
                .filter(|last| last.plane.height_m(&uav) > 0.0)
                .map(|last| (last, candidate.source.seen_in(last))),
        );
        for first in known.iter().filter(|known| transmitter.is_before(known)) {
            let one = transmitter.seen_in(first);
            for second in after(known, first).filter(|second| one.is_before(second)) {
                let two = one.seen_in(second);
                for (last, seen) in &lasts {
                    if last.surface.id != second.surface.id && seen.is_near(&two) && two.is_before(last) {
                        self.weigh(candidate, &[first, second, last]);
                    }
                }
            }
        }
    }
}

/// All surfaces but one: no surface reflects a wave twice in a row.
fn after<'k, 'a>(known: &'k [Known<'a>], first: &Known<'_>) -> impl Iterator<Item = &'k Known<'a>> {
    let id = first.surface.id;
    known.iter().filter(move |second| second.surface.id != id)
}

/// Weighs all chains that are near against all paths, strongest first. `None`: the path has no direction.
pub(super) fn weigh_all<'m, const N: usize, const K: usize>(
    scene: &Scene<'_, N>,
    paths: &'m Vec<(Measurement, Option<Probabilities>), K>,
) -> (Vec<Weighed, K>, LeftOut) {
    let mut candidates: Vec<Candidate<'m>, K> =
        crate::numeric::gather(paths.iter().map(|(measured, probabilities)| Candidate {
            measured,
            probabilities: probabilities.as_ref(),
            source: Source::of(scene, measured),
            weighed: Weighed::default(),
        }));
    let mut search = Search {
        scene,
        left: scene.config.weighings,
        left_out: LeftOut::default(),
    };
    search.run(&mut candidates);
    let left_out = search.left_out;
    let weighed = crate::numeric::gather(candidates.iter().map(|candidate| candidate.weighed.clone()));
    (weighed, left_out)
}
