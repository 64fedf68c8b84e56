//! C-SLAM, Algorithm 1 of the paper: the one place where path estimation, link state, reflection points, localization and map meet.
//!
//! ```text
//! imu, magnetometer, timing ------------------------------> localizer (pose, clock, calibration)
//! sweep -> beam * 72 -> squint * 33 -> beacon -> end_sweep     |  ^
//!            |             |                                   v  |
//!         paths ------> bearing of the line of sight -> which path is what -> line of sight, mirrors
//!            `---------------------------------------------> points -> map -> planes
//! ```
//! [`Receiver`] is driven by events and knows neither a clock nor a device: every event has its time stamp, everything it
//! does ends in a [`SweepReport`], and all it needs lies in one struct of fixed size. Nothing in it may see the truth.
//!
//! The radio, and with it path estimation ([`crate::paths::Estimator`] or [`crate::paths::PaperEstimator`]), is chosen by the type `R`, which a
//! module of [`crate::profile`] names, everything else by [`Config`].
//!
//! # Example
//! A receiver that has just been switched on: it hears an empty sweep, and says that it does not know where it is.
//! ```
//! use cslam_core::link_state::models;
//! use cslam_core::map::PointCloud;
//! use cslam_core::profile::{FlightConfig, FlightEstimator, Radio, Receiver, ReceiverMemory};
//! use cslam_core::receiver::{Config, LinkStates};
//!
//! let config = Config::best(LinkStates::Trees(models::trees()?));
//! let mut estimator = Box::new(FlightEstimator::checked(&FlightConfig::default())?);
//! let mut squint = Box::new(config.beam_squint::<Radio>()?);
//! let mut map = PointCloud::<256>::new();
//! let memory = ReceiverMemory { estimator: &mut estimator, squint: &mut squint, map: &mut map };
//! let mut receiver: Receiver<256> = Receiver::new(config, memory);
//! receiver.sweep(500_000_000, 0); // no beam follows
//! let report = receiver.end_sweep().expect("a sweep was begun");
//! assert!(report.paths.is_empty() && receiver.pose().is_none());
//! assert_eq!(receiver.counters().beacons_missing, 1);
//! # Ok::<(), Box<dyn core::error::Error>>(())
//! ```

mod bend;
mod clock;
mod config;
mod departure;
mod estimated;
mod gain;
mod localizer;
mod mapping;
mod paths;
mod radio;
mod receive;
mod report;
mod rules;
mod sight;
mod sighting;
mod sweep;

pub use config::{BaselineConfig, Config, ConfigError, Departures, LinkStates, Localization, Mapped, Pilots};
pub use gain::LinkBudget;
pub use mapping::{MOST_GMT_SIGMA_M, map_learned};
pub use radio::{Antennas, Radio};
pub use receive::Residuals;
pub use report::{Innovation, MappedPoint, Measured, Outcome, PathReport, SurfaceChanges, SweepReport};
pub use rules::Rules;

use nalgebra::Vector3;

use self::clock::TwoWayClock;
use self::localizer::Localizer;
use self::sweep::Open;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;
use crate::estimator::{Counters as FilterCounters, Health, Pose, states};
use crate::geometry::{Gmt, Rotation, World};
use crate::inertial::{Imu, ImuCounters, ImuSample, RestAlignment, RestStatus};
use crate::map::PointCloud;
use crate::paths::BeamReport;
use crate::signal::DelayPeriod;
use crate::surfaces::Surfaces;

/// Paths of a sweep.
/// Given: the paper's K (docs/signal-model.md).
pub const PATHS: usize = 9;

/// Surfaces that are kept.
/// Capacity: those of a street are a dozen, and as many may be in doubt.
pub const SURFACES: usize = 32;
/// What the GMT says about itself after a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beacon {
    /// Number of the sweep it follows.
    pub sweep: u32,
    /// Position of the antenna during that sweep, world frame, m.
    pub position_m: Vector3<f64>,
    /// Standard deviation of that, m per axis.
    pub sigma_m: f64,
    /// Attitude of the mast.
    pub attitude: Rotation<Gmt, World>,
    /// Sweeps that the GMT sends from one place before it moves on.
    pub sweeps_per_stop: u32,
}

/// What happened besides the reports, saturating.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Sweeps that ended.
    pub sweeps: u32,
    /// Sweeps that never ended: the next one began before.
    pub abandoned: u32,
    /// Blocks, and path lists, that came without a sweep or after its paths had been taken.
    pub stray_blocks: u32,
    /// Beacons of another sweep than the one in hand.
    pub stray_beacons: u32,
    /// Sweeps whose beacon never came.
    pub beacons_missing: u32,
    /// Two-way exchanges whose offset was no number.
    pub timing_invalid: u32,
    /// Two-way exchanges that contradict those before.
    pub timing_refused: u32,
    /// Chains of surfaces that were not weighed: a sweep had too many ([`crate::association::LeftOut`]).
    pub chains_left_out: u32,
}

/// The large parts of the receiver, which lie where their owner wants them: a board's stack has no room to build them on the
/// way to one struct.
pub struct Memory<'m, R: Radio, const VOXELS: usize> {
    /// Path estimation.
    pub estimator: &'m mut R::Estimator,
    /// Beam squint, of the receiver's configuration ([`Config::beam_squint`]).
    pub squint: &'m mut R::Squint,
    /// The map; its edge of a voxel is its owner's choice.
    pub map: &'m mut PointCloud<VOXELS>,
}

impl<R: Radio, const VOXELS: usize> core::fmt::Debug for Memory<'_, R, VOXELS> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Memory")
            .field("map", &self.map)
            .finish_non_exhaustive()
    }
}

/// The whole receiver of the radio `R`. The map has `VOXELS` voxels, the filter `STATES` states (49, and three for each
/// plane it may hold at a time).
#[derive(Debug)]
pub struct Receiver<'m, R: Radio, const VOXELS: usize, const STATES: usize = { states(2) }> {
    config: Config<'m, R::Description>,
    /// Of the configuration's radio.
    radio: R,
    memory: Memory<'m, R, VOXELS>,
    imu: Imu,
    rest: Option<RestAlignment>,
    localizer: Localizer<STATES>,
    surfaces: Surfaces<SURFACES>,
    open: Option<Open>,
    last_beacon: Option<(u64, Beacon)>,
    clock: TwoWayClock,
    counters: Counters,
}

impl<'m, R: Radio, const VOXELS: usize, const STATES: usize> Receiver<'m, R, VOXELS, STATES> {
    /// A receiver at rest that knows nothing yet. What was in its memory is forgotten.
    pub fn new(config: Config<'m, R::Description>, memory: Memory<'m, R, VOXELS>) -> Self {
        let _forgotten = R::finish(memory.estimator);
        memory.map.clear();
        let radio = R::new(&config.radio);
        Self {
            memory,
            imu: Imu::new(config.imu),
            rest: Some(RestAlignment::new(config.rest)),
            surfaces: config.no_surfaces(),
            localizer: Localizer::new(&config.localization, radio.model()),
            radio,
            open: None,
            last_beacon: None,
            clock: TwoWayClock::default(),
            counters: Counters::default(),
            config,
        }
    }

    /// Tells every step of the filter from now on; without a filter there is none.
    #[cfg(feature = "watch")]
    pub fn watch(&mut self, watch: alloc::sync::Arc<dyn crate::estimator::Watch<f32, STATES>>) {
        self.localizer.watch(watch);
    }

    /// A sample of the inertial sensor.
    pub fn imu(&mut self, sample: &ImuSample) {
        if let Some(rest) = &mut self.rest
            && let RestStatus::Aligned(alignment) = rest.push(sample)
        {
            self.localizer.aligned(&alignment);
            self.imu.set_errors(self.localizer.imu_errors());
            self.rest = None;
        }
        if let Some(step) = self.imu.push(sample) {
            self.localizer.step(&step);
        }
    }

    /// A sample of the magnetometer, uT in body axes. Its heading must agree with a start.
    pub fn magnetometer(&mut self, time_ns: u64, field_ut: &Vector3<f32>) {
        self.elapse(time_ns);
        let Some(field) = &self.config.magnetic_field else {
            return;
        };
        self.localizer.magnetic(time_ns, field, field_ut);
    }

    /// A two-way timing exchange: UAV clock less GMT clock, s.
    pub fn timing(&mut self, time_ns: u64, clock_offset_s: f64) {
        self.elapse(time_ns);
        if clock_offset_s.is_finite() {
            let offset_m = clock_offset_s * SPEED_OF_LIGHT_M_PER_S;
            if !self.clock.exchange(time_ns, offset_m) {
                count(&mut self.counters.timing_refused);
            }
            // The filter judges for itself: it knows what the sweeps say.
            self.localizer.two_way(time_ns, offset_m);
        } else {
            count(&mut self.counters.timing_invalid);
        }
    }

    /// A sweep begins. One that has not ended is given up.
    pub fn sweep(&mut self, time_ns: u64, sweep: u32) {
        self.elapse(time_ns);
        // The pose of the sweep needs the motion up to here, not up to the end of some step before.
        if let Some(step) = self.imu.finish_step_at(time_ns) {
            self.localizer.step(&step);
        }
        if self.open.is_some() {
            count(&mut self.counters.abandoned);
            let _forgotten = R::finish(self.memory.estimator);
        }
        self.open = Some(Open::new(sweep, time_ns, self.imu.turn_rad_per_s()));
    }

    /// Samples of a transmit beam; the block is worked on in place. Nothing is reported of a stray block.
    pub fn beam(&mut self, block: R::Block<'_>) -> BeamReport {
        match &mut self.open {
            Some(open) if open.paths.is_none() => {
                open.beams = open.beams.saturating_add(1);
                R::push_beam(self.memory.estimator, block)
            }
            _ => {
                count(&mut self.counters.stray_blocks);
                BeamReport::default()
            }
        }
    }

    /// Samples of a squint symbol, after all beams of its sweep; `block.beam` is its place in the schedule.
    pub fn squint(&mut self, block: R::Block<'_>) {
        self.close_beams();
        if self.open.is_none() {
            count(&mut self.counters.stray_blocks);
            return;
        }
        R::push_symbol(self.memory.squint, self.memory.estimator, block);
    }

    /// Samples of a pilot, after all beams of its sweep: `block.beam` is the beam that was sent again, and with the number of all beams added for the second
    /// time ([`crate::paths::PathEstimator::push_pilot`]). Nothing depends on them: a sweep without is what it was.
    pub fn pilot(&mut self, block: R::Block<'_>) {
        self.close_beams();
        let Some(Open {
            paths: Some(paths),
            turn_rad_per_s,
            ..
        }) = &mut self.open
        else {
            count(&mut self.counters.stray_blocks);
            return;
        };
        let read = match self.config.pilots {
            Pilots::Unread => false,
            // One path alone tells nothing but the offset of the carriers.
            Pilots::WithPose => paths.len() > 1 && self.localizer.pose().is_some(),
            Pilots::EverySweep => true,
        };
        if read {
            R::push_pilot(self.memory.estimator, block, turn_rad_per_s, paths);
        }
    }

    /// What the GMT says about the sweep in hand.
    pub fn beacon(&mut self, time_ns: u64, beacon: &Beacon) {
        self.elapse(time_ns);
        match &mut self.open {
            Some(open) if open.sweep == beacon.sweep => {
                open.beacon_heard = true;
                self.last_beacon = Some((open.time_ns, *beacon));
            }
            _ => count(&mut self.counters.stray_beacons),
        }
    }

    /// The map so far.
    pub fn map(&self) -> &PointCloud<VOXELS> {
        self.memory.map
    }

    /// Forgets the map and its surfaces.
    pub fn clear_map(&mut self) {
        self.memory.map.clear();
        self.surfaces.clear();
    }

    /// The newest beacon of a sweep that was heard.
    pub fn last_beacon(&self) -> Option<&Beacon> {
        self.last_beacon.as_ref().map(|(_, beacon)| beacon)
    }

    /// Surfaces of the map, and those that are not confirmed yet.
    pub fn surfaces(&self) -> &Surfaces<SURFACES> {
        &self.surfaces
    }

    /// Pose by the newest inertial data; `None` before there is one.
    pub fn pose(&self) -> Option<Pose> {
        self.localizer.expected()
    }

    /// Clock offset of a pose with the whole delay periods that two-way timing tells, m: the UAV's clock less the GMT's.
    /// `None` before two exchanges.
    pub fn clock_offset_m(&self, pose: &Pose) -> Option<f64> {
        let offset_m = pose.clock.offset_m;
        let beyond_m = self.clock.offset_m(pose.time_ns)? - offset_m;
        // What is left beside a whole number of periods is the timing's error.
        Some(offset_m + beyond_m - self.delay_period().wrap_m(beyond_m))
    }

    /// The clock by which a sweep's delays are lengths, m, beside whole delay periods: the filter's, which knows strays from steps, and before it
    /// runs, and where there is none, two-way timing's.
    fn offset_m(&self, time_ns: u64) -> Option<f64> {
        let filtered = self.localizer.clock_offset_m(time_ns);
        filtered.or_else(|| self.clock.offset_m(time_ns))
    }

    /// Flags of the filter.
    pub fn health(&self) -> Health {
        self.localizer.health()
    }

    /// What became of the samples of the inertial sensor so far.
    pub fn imu_counters(&self) -> ImuCounters {
        *self.imu.counters()
    }

    /// What happened to the filter so far.
    pub fn filter_counters(&self) -> FilterCounters {
        self.localizer.counters()
    }

    /// What happened so far.
    pub fn counters(&self) -> Counters {
        self.counters
    }

    /// Period of the delays.
    fn delay_period(&self) -> DelayPeriod {
        self.radio.model().waveform.delay_period()
    }

    /// Tells the time to a sensor that may have fallen silent.
    fn elapse(&mut self, now_ns: u64) {
        // A gap of an hour ends the loop too: every step takes the sensor's time forward to now.
        while let Some(step) = self.imu.elapse(now_ns) {
            self.localizer.step(&step);
        }
    }
}

fn count(counter: &mut u32) {
    *counter = counter.saturating_add(1);
}
