//! The best trajectory after a flight: a fixed-interval smoother over the whole error state of the filter, and the map again from its
//! poses (docs/localization.md, "The best trajectory afterwards").
//!
//! ```text
//! filter --steps--> tape --stages--> rts --corrections--> trajectory --poses--> log
//!                     `--moves--> astray --sweeps--> the flight again without them
//! sweep reports --------------------------------------------- map ------------^
//! ```
//! On board nothing changes: a filter that is listened to sends the same packets.

mod astray;
mod errors;
mod map;
mod rts;
mod tape;
mod trajectory;
mod twice;

use std::collections::BTreeSet;
use std::sync::Arc;

use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::estimator::Watch;
use cslam_core::receiver::{Config, Mapped, PATHS, SweepReport};

pub use rts::{Link, Smoothed, Stage, smooth};
pub use twice::{Flier, fly_smoothed};

use self::astray::{Swept, led_astray, moves};
use self::map::Mapper;
use self::tape::Tape;
use self::trajectory::{State, Trajectory};
use crate::flight_log::{FlightLog, PoseEstimate};
use crate::raw_flight::{Remap, pose_estimate};

/// Smooths a flight whose filter has `N` states.
#[derive(Debug)]
pub struct Smoother<const N: usize> {
    tape: Arc<Tape<N>>,
    sweeps: Vec<SweepReport<PATHS>>,
}

impl<const N: usize> Default for Smoother<N> {
    fn default() -> Self {
        Self {
            tape: Arc::new(Tape::new()),
            sweeps: Vec::new(),
        }
    }
}

impl<const N: usize> Smoother<N> {
    /// Who listens to the filter, from before its first step.
    #[must_use]
    pub fn listener(&self) -> Arc<dyn Watch<f32, N>> {
        Arc::clone(&self.tape) as Arc<dyn Watch<f32, N>>
    }

    /// Sees a sweep that has ended.
    pub fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.sweeps.push(report.clone());
    }

    /// Sweeps of outages in which the filter was led astray. Flown again without their paths, the same flight is smoothed better.
    #[must_use]
    pub fn led_astray(&self) -> BTreeSet<u32> {
        let sweeps: Vec<Swept> = self.sweeps.iter().map(Swept::from).collect();
        led_astray(&sweeps, &self.tape.look(moves))
    }

    /// The log of the same flight with the smoothed poses, and with the map that they make from what was heard in this flight. The poses are
    /// those of the flight `again`, where there was one and it had a pose. A pose without a smoothed one, as one after the last sweep,
    /// stays as it was on board; so does the map of a receiver that takes paths alone ([`Mapped`]).
    #[must_use]
    pub fn smoothed(self, again: Option<Self>, log: &FlightLog, config: &Config<'_>) -> FlightLog {
        let again = again.map(|again| Trajectory::of(again.tape.take()));
        let own = Trajectory::of(self.tape.take());
        let at = |time_ns| {
            let again = again.as_ref().and_then(|again| again.at(time_ns));
            again.or_else(|| own.at(time_ns))
        };
        let mut smoothed = log.clone();
        for record in &mut smoothed.poses {
            let state = at(nanoseconds(record.time_s));
            renew(&mut record.estimate, state.as_ref());
        }
        let mapper = Mapper::new(config).filter(|_| config.mapped == Mapped::Every);
        let Some(mut mapper) = mapper else {
            return smoothed;
        };
        let mut remap = Remap::new(smoothed);
        for report in &self.sweeps {
            let Some(state) = at(report.time_ns) else {
                continue;
            };
            let mapped = mapper.sweep(report, &state);
            remap.sweep(report.sweep, |estimate| renew(estimate, Some(&state)), &mapped);
        }
        remap.close(mapper.map())
    }
}

fn nanoseconds(time_s: f64) -> u64 {
    (time_s * 1e9 + 0.5) as u64
}

/// Puts a smoothed state in the place of the pose on board.
fn renew(estimate: &mut Option<PoseEstimate>, state: Option<&State>) {
    let (Some(own), Some(state)) = (&*estimate, state) else {
        return;
    };
    let Some(pose) = state.pose() else {
        return;
    };
    // Whole delay periods are those on board.
    let clock_offset_m = own.clock_offset_s.map(|offset_s| {
        let own_m = offset_s * SPEED_OF_LIGHT_M_PER_S;
        own_m + state.nominal.delay_period.wrap_m(pose.clock.offset_m - own_m)
    });
    *estimate = Some(pose_estimate(&pose, clock_offset_m));
}
