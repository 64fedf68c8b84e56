//! What the filter does to its state, step by step, for whoever smooths a flight afterwards on a host (docs/localization.md, "The best
//! trajectory afterwards").
//!
//! Without the feature `watch` nobody can listen, and nothing of this is in the program.

#[cfg(feature = "watch")]
use alloc::sync::Arc;

use super::Filter;
use super::covariance::Transition;
use crate::geometry::Real;

/// A step of a filter of `N` states.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(
    not(feature = "watch"),
    expect(dead_code, unreachable_pub, reason = "nobody listens without the feature")
)]
pub enum Step<'a, T: Real, const N: usize> {
    /// The state as it stands, before a motion or a change, and after the last update of a sweep.
    Stands,
    /// State and covariance were carried over a motion; its noise comes next.
    Carried(&'a Transition<T>),
    /// The noise of that motion was added to the covariance.
    Spread,
    /// An update has added these errors to the state and its planes.
    Corrected(&'a [T; N]),
    /// States may have changed by themselves: the covariance has grown since it stood.
    Doubted,
    /// Neighbouring states begin anew: what was known of them says nothing of what they are now.
    Forgot {
        /// The first of them.
        first: usize,
        /// How many.
        count: usize,
    },
    /// The filter has forgotten its pose.
    Restarted,
}

/// Somebody to whom a filter tells each of its steps. A listener changes nothing.
#[cfg(feature = "watch")]
pub trait Watch<T: Real, const N: usize>: core::fmt::Debug + Send + Sync {
    /// Called after each step, with the filter as it is then.
    fn step(&self, filter: &Filter<T, N>, step: Step<'_, T, N>);
}

impl<T: Real, const N: usize> Filter<T, N> {
    /// Tells every step from now on.
    #[cfg(feature = "watch")]
    pub fn watch(&mut self, watch: Arc<dyn Watch<T, N>>) {
        self.watch = Some(watch);
    }

    #[cfg(feature = "watch")]
    pub(super) fn tell(&self, step: Step<'_, T, N>) {
        if let Some(watch) = &self.watch {
            watch.step(self, step);
        }
    }

    #[cfg(not(feature = "watch"))]
    #[inline(always)]
    pub(super) fn tell(&self, _step: Step<'_, T, N>) {}
}
