//! Sweeps whose paths were estimated elsewhere: a flight that is flown again without its samples.

use cslam_core::beam_squint::{Bearing, Refusal};
use cslam_core::paths::EstimatedPath;
use cslam_core::receiver::{PATHS, Radio};

use super::{Application, Observer, Stage, counters};
use crate::front_end::Checksum;

/// What path estimation and beam squint made of the blocks of a sweep.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Estimated {
    /// Blocks of transmit beams that were there.
    pub beams: u16,
    /// Blocks of pilots that were there.
    pub pilots: u16,
    /// Blocks of squint symbols that were there.
    pub squint_symbols: u16,
    /// The last squint symbol of the schedule is among them: nothing more comes.
    pub whole: bool,
    /// The paths, strongest first; angles of departure in the axes of the GMT's arrays.
    pub paths: heapless::Vec<EstimatedPath, PATHS>,
    /// Index of the path that beam squint listened to, and its bearing or why there is none.
    pub sighted: Option<(usize, Result<Bearing, Refusal>)>,
}

impl<R: Radio, const VOXELS: usize, const STATES: usize, C: Checksum> Application<'_, R, VOXELS, STATES, C> {
    /// Takes all blocks of a sweep, as [`Self::capture`] takes one. `false` when the sweep has ended: they are counted and not used.
    pub fn estimated(
        &mut self,
        sweep: u32,
        sweep_ns: u64,
        estimated: Estimated,
        observer: &mut impl Observer,
    ) -> bool {
        let blocks = [estimated.beams, estimated.pilots, estimated.squint_symbols]
            .into_iter()
            .fold(0_u32, |sum, count| sum.saturating_add(count.into()));
        if !self.enter(sweep, sweep_ns, observer) {
            self.counters.late_blocks = self.counters.late_blocks.saturating_add(blocks);
            return false;
        }
        self.counters.blocks = self.counters.blocks.saturating_add(blocks);
        let sighted = observer.stage(Stage::Paths, || {
            self.cslam.paths(estimated.beams, estimated.paths)
        });
        let was_sighted = estimated.sighted.as_ref().map(|(path, _)| *path);
        if sighted.is_some() && sighted != was_sighted && estimated.squint_symbols > 0 {
            counters::count(&mut self.counters.sightings_unheard);
        }
        if let Some((path, bearing)) = estimated.sighted {
            // Of another path it is none: just counted.
            let _used = self.cslam.bearing(path, bearing);
        }
        if let Some(open) = &mut self.open {
            open.whole |= estimated.whole;
        }
        self.end_if_due(observer);
        true
    }
}
