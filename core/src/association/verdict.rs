//! What a path is, by the posterior of its hypotheses; then one chain for one path.

use heapless::Vec;

use super::clutter::Clutter;
use super::config::AssociationConfig;
use super::hypotheses::{LeftOut, Weighed, log_add};
use crate::paths::Neighbourhood;
use crate::surfaces::SurfaceIds;

/// What is decided of a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Decision {
    /// By a chain of confirmed surfaces, or the line of sight, with the posterior that is wanted.
    Explained,
    /// By a chain with a tentative surface: updates it, and reaches neither map nor pose.
    Tentative,
    /// A chain is in front and not sure, or not all near chains were weighed.
    Ambiguous,
    /// One reflection off a surface that is not in the store: gives birth to it.
    New,
    /// Anything else.
    Unexplained,
}

/// What became of a path.
#[derive(Clone, Debug, PartialEq)]
pub struct Verdict {
    /// What is decided.
    pub decision: Decision,
    /// The chain in front, from the transmitter on: empty for the line of sight, and where no chain is in front.
    pub chain: SurfaceIds,
    /// Posterior of what is in front.
    pub posterior: f32,
    /// Normalised innovation squared of delay and arrival, 3 degrees of freedom; infinite without a chain.
    pub chi_square: f32,
    /// Probability that the departure is the path's, by that chain; 0 without one.
    pub departure_held: f32,
    /// A tentative surface whose reflection this path would be if no confirmed one stood in its way.
    pub contradicts: Option<u16>,
    /// What stands beside the path.
    pub neighbourhood: Neighbourhood,
}

/// What became of a sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Association<const K: usize> {
    /// One verdict for each path, in its order.
    pub verdicts: Vec<Verdict, K>,
    /// What there was no time for.
    pub left_out: LeftOut,
}

impl Verdict {
    /// Whether it is explained by the line of sight.
    #[must_use]
    pub fn is_line_of_sight(&self) -> bool {
        self.decision == Decision::Explained && self.chain.is_empty()
    }

    /// Whether a chain explains it, tentatively or not.
    #[must_use]
    pub fn is_explained(&self) -> bool {
        matches!(self.decision, Decision::Explained | Decision::Tentative)
    }

    /// Whether known surfaces may have turned it, surely or not.
    #[must_use]
    pub fn may_be_reflected(&self) -> bool {
        !self.chain.is_empty()
    }

    /// Nothing is said of the path.
    pub(super) fn nothing() -> Self {
        Self {
            decision: Decision::Unexplained,
            chain: SurfaceIds::new(),
            posterior: 0.0,
            chi_square: f32::INFINITY,
            departure_held: 0.0,
            contradicts: None,
            neighbourhood: Neighbourhood::default(),
        }
    }

    /// By the posterior of all that was weighed.
    pub(super) fn of(
        weighed: &Weighed,
        clutter: &Clutter,
        neighbourhood: Neighbourhood,
        config: &AssociationConfig,
    ) -> Self {
        let sum = log_add(log_add(clutter.new, clutter.unknown), weighed.log_sum);
        let posterior = |log: f64| libm::exp(log - sum) as f32;
        let none = clutter.new.max(clutter.unknown);
        // As good as certain, if only the way were open.
        let contradicts = weighed.blocked.filter(|(_, log)| *log > sum).map(|(id, _)| id);
        let front = weighed.best.as_ref().filter(|best| best.log > none);
        let Some(best) = front else {
            let new = posterior(clutter.new);
            // An echo of the estimator comes from anywhere, also from where a wall could be.
            let is_new = new > 0.5 && !clutter.new_is_blocked && !neighbourhood.may_be_artefact;
            return Self {
                decision: if is_new {
                    Decision::New
                } else {
                    Decision::Unexplained
                },
                posterior: posterior(none),
                contradicts,
                neighbourhood,
                ..Self::nothing()
            };
        };
        let p = posterior(best.log);
        let gate = f64::from(config.gate_sigmas);
        let wanted = if best.confirmed {
            config.explained
        } else {
            config.tentative
        };
        let decision = if weighed.unfinished || p < wanted || best.likelihood.chi_square > gate * gate {
            Decision::Ambiguous
        } else if best.confirmed {
            Decision::Explained
        } else {
            Decision::Tentative
        };
        Self {
            decision,
            chain: best.ids.clone(),
            posterior: p,
            chi_square: best.likelihood.chi_square as f32,
            departure_held: best.likelihood.departure_held as f32,
            contradicts,
            neighbourhood,
        }
    }
}

/// A chain explains one path of a sweep: of several the likeliest keeps it, the others are ambiguous.
pub(super) fn claim_once<const K: usize>(verdicts: &mut Vec<Verdict, K>) {
    let claimed = |verdicts: &[Verdict], index: usize| {
        let Some(own) = verdicts.get(index).filter(|own| own.is_explained()) else {
            return false;
        };
        // By posterior, then by fit: two claimants of one chain are often both certain.
        let is_better = |other: &Verdict, earlier: bool| {
            let by_posterior = other.posterior.total_cmp(&own.posterior);
            let order = by_posterior.then(own.chi_square.total_cmp(&other.chi_square));
            order.is_gt() || (order.is_eq() && earlier)
        };
        verdicts.iter().enumerate().any(|(other, verdict)| {
            other != index
                && verdict.is_explained()
                && verdict.chain == own.chain
                && is_better(verdict, other < index)
        })
    };
    let mut lost = Vec::<usize, K>::new();
    for index in 0..verdicts.len() {
        if claimed(verdicts, index) {
            let _fits = lost.push(index);
        }
    }
    for index in lost {
        if let Some(verdict) = verdicts.get_mut(index) {
            verdict.decision = Decision::Ambiguous;
        }
    }
}
