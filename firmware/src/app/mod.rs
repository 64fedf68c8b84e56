//! The receiver as it flies: what the board's drivers deliver goes in, packets for the ground come out.
//!
//! [`Application`] joins [`Receiver`] with the two ends of a link. It knows no device and no clock: every call has its time stamp by the
//! UAV clock, and what is to be sent waits in a bounded queue. So it is the same code, fed by interrupts on a board, by shared
//! memory under emulation, and by the simulation on a host, and the same calls give the same bytes everywhere.
//!
//! ```text
//! inertial samples, magnetometer, timing --> Application --> Receiver
//! blocks of beams, pilots, symbols ------/        |            | report of a sweep, pose
//! beacons, commands --------------------/         `<-----------'
//!                                                 `--> queue of frames --> downlink
//! ```
//! A sweep ends when all its blocks and its beacon are in, [`AppConfig::beacon_patience_ns`] later when the beacon does not come,
//! [`AppConfig::sweep_patience_ns`] later when blocks are missing, and at the latest when the next one begins.

mod announced;
mod board;
mod counters;
mod downlink;
mod estimated;
mod feed;
mod frames;
mod lines;
mod observer;
mod reports;
mod surface_news;
mod uplink;

use cslam_core::geometry::Vector3;
use cslam_core::inertial::ImuSample;
use cslam_core::receiver::{Beacon, Radio, Receiver};
use cslam_core::telemetry::{ConfigReport, Decoder, ResetCause, Uplink};

use announced::Announced;
use reports::Schedule;

use crate::front_end::{Checksum, FrontEnd, Powers, SoftwareCrc};

pub use board::{Best, BoardEstimatorConfig, Map, VOXELS};
pub use counters::Counters;
pub use downlink::{Downlink, QUEUE};
pub use estimated::Estimated;
pub use feed::Fed;
pub use lines::{PointLine, SweepLine};
pub use observer::{Observer, Stage};
pub use reports::BoardStatus;
pub use uplink::Request;

/// Version of the firmware.
pub const FIRMWARE: [u8; 3] = [0, 1, 0];

/// Reason of [`Event::ConfigRefused`](cslam_core::telemetry::Event::ConfigRefused): there is no reference clock, or no longer. The board
/// runs degraded by a clock of its own, without the front end and two-way timing.
pub const NO_REFERENCE: u8 = 1;

/// What the application is set to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AppConfig {
    /// Blocks of transmit beams in a sweep.
    pub beams: u16,
    /// Blocks of squint symbols that follow them.
    pub squint_symbols: u16,
    /// How long after the start of a sweep its beacon is waited for when all blocks are in, ns.
    pub beacon_patience_ns: u64,
    /// How long after its start a sweep is ended although blocks are missing, ns.
    pub sweep_patience_ns: u64,
    /// What the ground is told about all of this.
    pub report: ConfigReport,
    /// What the program began from.
    pub reset: ResetCause,
}

impl Default for AppConfig {
    /// 72 beams and 33 squint symbols twice a second (docs/signal-model.md, "Default configuration"): a beacon comes a millisecond after its sweep and is
    /// waited for 21 ms, blocks 450 ms.
    fn default() -> Self {
        Self {
            beams: 72,
            squint_symbols: 33,
            beacon_patience_ns: 21_000_000,
            sweep_patience_ns: 450_000_000,
            report: ConfigReport {
                version: 1,
                firmware: FIRMWARE,
                map_capacity: VOXELS as u32,
                voxel_edge_m: Map::DEFAULT_EDGE_M,
                ..ConfigReport::default()
            },
            reset: ResetCause::Unknown,
        }
    }
}

/// A block of samples as the front end captured it: `B` is the [`Radio::Block`] of the receiver's radio.
#[derive(Debug)]
pub struct Capture<B> {
    /// Number of the sweep.
    pub sweep: u32,
    /// Start of the sweep, UAV clock, ns.
    pub sweep_ns: u64,
    /// The samples: of a beam, of a pilot, or of a squint symbol.
    pub symbol: Symbol<B>,
}

/// What was sent.
#[derive(Debug)]
pub enum Symbol<B> {
    /// A transmit beam; `beam` is its number in the codebook.
    Beam(B),
    /// A pilot, behind all beams; `beam` is the number of the beam that was sent again, and with the number of all beams added for the second
    /// time.
    Pilot(B),
    /// A squint symbol; `beam` is its place in the schedule.
    Squint(B),
}

/// The link to the ground.
#[derive(Debug)]
pub struct Ground {
    /// What goes down.
    pub downlink: Downlink,
    /// What comes up.
    pub uplink: Decoder<Uplink>,
}

/// A sweep in hand.
#[derive(Clone, Copy, Debug)]
struct Open {
    sweep: u32,
    time_ns: u64,
    /// The last symbol of the schedule is in: nothing more will come.
    whole: bool,
    beacon: bool,
}

/// The receiver of a board with the radio `R`, see the module. The large parts of [`Receiver`] lie where its owner has put them.
#[derive(Debug)]
pub struct Application<'m, R: Radio, const VOXELS: usize, const STATES: usize, C = SoftwareCrc> {
    config: AppConfig,
    front_end: FrontEnd<C>,
    cslam: Receiver<'m, R, VOXELS, STATES>,
    downlink: Downlink,
    uplink: Decoder<Uplink>,
    schedule: Schedule,
    status: BoardStatus,
    request: Option<Request>,
    open: Option<Open>,
    announced: Announced,
    last_sweep: Option<u32>,
    /// Number of the front end's exchange that was used last, 0 for none.
    last_exchange: u32,
    now_ns: u64,
    /// Number of the next record of the sensor stream.
    next_record: u32,
    counters: Counters,
}

impl<'m, R: Radio, const VOXELS: usize, const STATES: usize, C: Checksum>
    Application<'m, R, VOXELS, STATES, C>
{
    /// An application around a receiver that knows nothing yet, on a link of the front end that has been opened. Of a radio whose samples come
    /// by [`Self::capture`] that link stays silent.
    pub fn new(
        config: AppConfig,
        front_end: FrontEnd<C>,
        ground: Ground,
        cslam: Receiver<'m, R, VOXELS, STATES>,
    ) -> Self {
        Self {
            config,
            front_end,
            downlink: ground.downlink,
            uplink: ground.uplink,
            schedule: Schedule::default(),
            status: BoardStatus::default(),
            request: None,
            cslam,
            open: None,
            announced: Announced::default(),
            last_sweep: None,
            last_exchange: 0,
            now_ns: 0,
            next_record: 0,
            counters: Counters::default(),
        }
    }

    /// The receiver.
    pub fn cslam(&self) -> &Receiver<'m, R, VOXELS, STATES> {
        &self.cslam
    }

    /// Tells every step of the receiver's filter from now on.
    #[cfg(feature = "watch")]
    pub fn watch(&mut self, watch: alloc::sync::Arc<dyn cslam_core::estimator::Watch<f32, STATES>>) {
        self.cslam.watch(watch);
    }

    /// What became of everything that came in.
    pub fn counters(&self) -> &Counters {
        &self.counters
    }

    /// What waits for the radio.
    pub fn downlink(&mut self) -> &mut Downlink {
        &mut self.downlink
    }

    /// The link of the front end: its counters, its session, frames that its hardware gave up.
    pub fn front_end(&mut self) -> &mut FrontEnd<C> {
        &mut self.front_end
    }

    /// A sample of the inertial sensor.
    pub fn imu(&mut self, sample: &ImuSample, observer: &mut impl Observer) {
        self.elapse(sample.time_ns, observer);
        counters::count(&mut self.counters.imu);
        observer.stage(Stage::Inertial, || self.cslam.imu(sample));
    }

    /// A sample of the magnetometer, uT in body axes.
    pub fn magnetometer(&mut self, time_ns: u64, field_ut: &Vector3<f32>, observer: &mut impl Observer) {
        self.elapse(time_ns, observer);
        counters::count(&mut self.counters.magnetometer);
        observer.stage(Stage::Magnetic, || self.cslam.magnetometer(time_ns, field_ut));
    }

    /// A two-way timing exchange: UAV clock less GMT clock, s. One that the front end has measured comes with its [frame](Self::frame).
    pub fn timing(&mut self, time_ns: u64, clock_offset_s: f64, observer: &mut impl Observer) {
        self.elapse(time_ns, observer);
        counters::count(&mut self.counters.timing);
        observer.stage(Stage::Timing, || self.cslam.timing(time_ns, clock_offset_s));
    }

    /// How strong the beams of a sweep are, by the front end's word; 0 for each that the codebook does not have.
    pub fn powers(&mut self, sweep: u32, sweep_ns: u64, powers: &Powers, observer: &mut impl Observer) {
        if self.enter(sweep, sweep_ns, observer) {
            self.announced.take(powers);
        }
    }

    /// A block of samples. `false` when it belongs to a sweep that has ended: it is counted and not used.
    pub fn capture(&mut self, capture: Capture<R::Block<'_>>, observer: &mut impl Observer) -> bool {
        if !self.enter(capture.sweep, capture.sweep_ns, observer) {
            counters::count(&mut self.counters.late_blocks);
            return false;
        }
        counters::count(&mut self.counters.blocks);
        match capture.symbol {
            Symbol::Beam(block) => {
                let beam = R::number(&block);
                let report = observer.stage(Stage::Beam, || self.cslam.beam(block));
                self.announced.heard(beam, report.power, &mut self.counters);
                if report.left_out {
                    counters::count(&mut self.counters.beams_left_out);
                }
            }
            Symbol::Pilot(block) => {
                observer.stage(Stage::Paths, || self.cslam.close_beams());
                observer.stage(Stage::Pilot, || self.cslam.pilot(block));
            }
            Symbol::Squint(block) => {
                // The first one ends the beams: their paths are estimated.
                let last = R::number(&block).saturating_add(1) >= self.config.squint_symbols;
                observer.stage(Stage::Paths, || self.cslam.close_beams());
                observer.stage(Stage::Squint, || self.cslam.squint(block));
                if let Some(open) = &mut self.open {
                    open.whole |= last;
                }
            }
        }
        self.end_if_due(observer);
        true
    }

    /// What the GMT says about a sweep.
    pub fn beacon(&mut self, time_ns: u64, beacon: &Beacon, observer: &mut impl Observer) {
        self.elapse(time_ns, observer);
        counters::count(&mut self.counters.beacons);
        self.cslam.beacon(time_ns, beacon);
        if let Some(open) = self.open.as_mut().filter(|open| open.sweep == beacon.sweep) {
            open.beacon = true;
        }
        self.end_if_due(observer);
    }

    /// Tells the time: sweeps that will not be whole any more end.
    pub fn elapse(&mut self, now_ns: u64, observer: &mut impl Observer) {
        self.now_ns = self.now_ns.max(now_ns);
        self.end_if_due(observer);
        self.report(observer);
    }

    /// Ends the sweep in hand, if there is one.
    pub fn end(&mut self, observer: &mut impl Observer) {
        if self.open.take().is_none() {
            return;
        }
        observer.stage(Stage::Paths, || self.cslam.close_beams());
        if let Some((paths, sighted)) = self.cslam.estimated() {
            observer.estimated(paths, sighted);
        }
        if let Some(report) = observer.stage(Stage::Sweep, || self.cslam.end_sweep()) {
            counters::count(&mut self.counters.sweeps);
            observer.swept(&report);
            observer.stage(Stage::Telemetry, || self.report_sweep(&report));
        }
    }

    /// Begins a sweep if it is a new one. `false` when it has ended.
    fn enter(&mut self, sweep: u32, time_ns: u64, observer: &mut impl Observer) -> bool {
        if self.open.is_some_and(|open| open.sweep == sweep) {
            return true;
        }
        // Sweeps count up; an older one has been reported.
        if self.last_sweep.is_some_and(|last| !is_after(sweep, last)) {
            return false;
        }
        self.end(observer);
        self.begin(sweep, time_ns, observer);
        true
    }

    fn begin(&mut self, sweep: u32, time_ns: u64, observer: &mut impl Observer) {
        observer.stage(Stage::Inertial, || self.cslam.sweep(time_ns, sweep));
        self.announced.begin(&mut self.counters);
        self.last_sweep = Some(sweep);
        self.open = Some(Open {
            sweep,
            time_ns,
            whole: false,
            beacon: false,
        });
    }

    /// Sends what has waited for more: the stream has ended.
    pub fn close(&mut self) {
        self.downlink.close_batch();
        self.report_health();
    }

    fn end_if_due(&mut self, observer: &mut impl Observer) {
        let Some(open) = &self.open else { return };
        let waited_ns = self.now_ns.saturating_sub(open.time_ns);
        let due = (open.whole && (open.beacon || waited_ns > self.config.beacon_patience_ns))
            || waited_ns > self.config.sweep_patience_ns;
        if due {
            self.end(observer);
        }
    }
}

/// Whether a sweep's number comes after another's; numbers wrap.
fn is_after(sweep: u32, last: u32) -> bool {
    sweep.wrapping_sub(last).wrapping_sub(1) < u32::MAX / 2
}
