//! Sweeps whose paths somebody else has estimated: another path estimator, or this receiver at an earlier time.
//!
//! [`Receiver::paths`] stands for all [`Receiver::beam`]s of a sweep, [`Receiver::bearing`] for its [`Receiver::squint`] symbols. The rest of the
//! sweep is the same, to the last bit.

use heapless::Vec;

use super::{PATHS, count};
use crate::beam_squint::{Bearing, Refusal};
use crate::paths::EstimatedPath;
use crate::receiver::{Radio, Receiver};

impl<R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'_, R, VOXELS, STATES> {
    /// Ends the beams of the sweep in hand with paths that were estimated elsewhere, strongest first, from `beams` transmit beams. Their
    /// angles of departure are in the axes of the GMT's arrays, as a [`PathEstimator`](crate::paths::PathEstimator) gives them. Blocks of the sweep that came
    /// before are forgotten.
    ///
    /// Returns the index of the path that beam squint is to listen to, if there is one: its symbols, or [its bearing](Self::bearing), may
    /// follow. Paths of no sweep, or of one whose beams have ended, are counted ([`super::Counters::stray_blocks`]) and not used.
    pub fn paths(&mut self, beams: u16, paths: Vec<EstimatedPath, PATHS>) -> Option<usize> {
        match &mut self.open {
            Some(open) if open.paths.is_none() => open.beams = beams,
            _ => {
                count(&mut self.counters.stray_blocks);
                return None;
            }
        }
        let _forgotten = R::finish(self.memory.estimator);
        self.close_with(paths);
        self.open.as_ref().and_then(|open| open.sighted)
    }

    /// The bearing of the path with this index, or why there is none, read elsewhere from the squint symbols after the sweep in
    /// hand. `false` when the receiver listens to another path, or to none ([`super::Departures::Beams`]): it is not used.
    pub fn bearing(&mut self, path: usize, bearing: Result<Bearing, Refusal>) -> bool {
        match &mut self.open {
            Some(open) if open.sighted == Some(path) && open.squint.is_ok() => {
                open.squint = bearing.map(Some);
                true
            }
            _ => false,
        }
    }

    /// The paths of the sweep in hand as they were estimated, and the index of the one that beam squint listens to; `None` before its
    /// beams have ended.
    pub fn estimated(&self) -> Option<(&[EstimatedPath], Option<usize>)> {
        let open = self.open.as_ref()?;
        Some((open.paths.as_deref()?, open.sighted))
    }
}

#[cfg(test)]
mod tests;
