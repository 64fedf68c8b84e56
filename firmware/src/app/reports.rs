//! What the ground is told, and how often.

use cslam_core::estimator::SweepVerdict;
use cslam_core::receiver::{Outcome, PATHS, Radio, SweepReport};
use cslam_core::telemetry::{
    DownlinkRates, Event, EventReport, HealthCounters, HealthReport, LinkReport, Message, PointReport,
    PoseReport,
};

use super::{Application, Observer, Stage};
use crate::front_end::Checksum;

/// How the board is, which the application cannot know.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardStatus {
    /// Share of the time that the processor worked, 0..=1.
    pub load: f32,
    /// Stack that was never used, bytes.
    pub free_stack: u32,
    /// Samples of the inertial sensor that its driver lost, and packets of it that were damaged.
    pub imu_lost: u32,
    /// Packets of the inertial sensor that were damaged.
    pub imu_damaged: u32,
}

/// Times of the next reports.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Schedule {
    pub(super) rates: DownlinkRates,
    pose_due_ns: u64,
    health_due_ns: u64,
    config_due_ns: u64,
    link_sweeps: u8,
    sighted: bool,
}

/// Time between two reports of what the receiver is set to: whoever begins to listen later hears it too, ns.
const CONFIG_INTERVAL_NS: u64 = 60_000_000_000;

/// The next time after `now_ns` on a raster: a gap skips reports, it does not pile them up.
fn next_ns(due_ns: u64, now_ns: u64, interval_ns: u64) -> u64 {
    let interval_ns = interval_ns.max(1);
    let behind = now_ns.saturating_sub(due_ns);
    due_ns.saturating_add((behind / interval_ns + 1).saturating_mul(interval_ns))
}

impl<R: Radio, const VOXELS: usize, const STATES: usize, C: Checksum> Application<'_, R, VOXELS, STATES, C> {
    /// How the board is, for the next health report.
    pub fn set_status(&mut self, status: BoardStatus) {
        self.status = status;
    }

    /// Tells the ground that something happened.
    pub fn announce(&mut self, event: Event) {
        let time_ns = self.now_ns;
        self.downlink
            .send(&Message::Event(EventReport { time_ns, event }));
    }

    pub(super) fn send_config(&mut self) {
        self.downlink.send(&Message::Config(self.config.report));
    }

    pub(super) fn set_rates(&mut self, rates: &DownlinkRates) {
        self.schedule.rates = *rates;
        self.downlink
            .set_patience_ns(u64::from(rates.point_wait_ds) * 100_000_000);
    }

    /// Reports that are due now.
    pub(super) fn report(&mut self, observer: &mut impl Observer) {
        let now_ns = self.now_ns;
        let rates = self.schedule.rates;
        if rates.pose_hz > 0 && now_ns >= self.schedule.pose_due_ns {
            let interval_ns = 1_000_000_000 / u64::from(rates.pose_hz);
            self.schedule.pose_due_ns = next_ns(self.schedule.pose_due_ns, now_ns, interval_ns);
            if let Some(pose) = self.cslam.pose() {
                observer.stage(Stage::Telemetry, || {
                    let clock_offset_m = self.cslam.clock_offset_m(&pose);
                    let health = self.cslam.health();
                    let report = PoseReport::new(&pose, clock_offset_m, health, self.schedule.sighted);
                    self.downlink.send(&Message::Pose(report));
                });
            }
        }
        if rates.health_s > 0 && now_ns >= self.schedule.health_due_ns {
            let interval_ns = u64::from(rates.health_s) * 1_000_000_000;
            self.schedule.health_due_ns = next_ns(self.schedule.health_due_ns, now_ns, interval_ns);
            observer.stage(Stage::Telemetry, || self.report_health());
        }
        if now_ns >= self.schedule.config_due_ns {
            self.schedule.config_due_ns = next_ns(self.schedule.config_due_ns, now_ns, CONFIG_INTERVAL_NS);
            observer.stage(Stage::Telemetry, || self.send_config());
        }
        self.downlink.points_if_due(now_ns);
    }

    /// What a sweep came to.
    pub(super) fn report_sweep(&mut self, report: &SweepReport<PATHS>) {
        let beacon = self.cslam.last_beacon();
        let gmt_m = beacon.map(|beacon| beacon.position_m.into());
        let sweeps_per_stop = beacon.map_or(1, |beacon| beacon.sweeps_per_stop.max(1));
        let stop_of = |sweep: u32| (sweep / sweeps_per_stop) as u16;
        let stop = beacon.map_or(0, |beacon| stop_of(beacon.sweep));
        self.schedule.sighted = report.verdict.is_taken();
        match report.verdict {
            SweepVerdict::Started => self.announce(Event::Started),
            SweepVerdict::Refixed => self.announce(Event::Refixed),
            _ => {}
        }
        for mapped in &report.points {
            let point = PointReport {
                sweep: mapped.sweep,
                stop: stop_of(mapped.sweep),
                position_m: mapped.point.position.to_array(),
                sigma_m: mapped.point.sigma_m(),
                probability: mapped.probability,
                surface: mapped.surface,
            };
            // The ground's map is no larger than ours.
            if mapped.insertion.is_some() {
                self.downlink.point(self.now_ns, &point);
            }
            super::counters::count(&mut self.counters.points);
        }
        for &(gone, stays) in &report.surfaces.merged {
            self.announce(Event::SurfaceMerged { gone, stays });
        }
        for &surface in &report.surfaces.withdrawn {
            self.announce(Event::SurfaceWithdrawn(surface));
        }
        for path in &report.paths {
            let counter = match &path.outcome {
                Outcome::Rejected(_) => &mut self.counters.rejected,
                Outcome::Input(_) => &mut self.counters.invalid,
                _ => continue,
            };
            super::counters::count(counter);
        }
        let every = self.schedule.rates.link_sweeps;
        self.schedule.link_sweeps = self.schedule.link_sweeps.saturating_add(1);
        if every > 0 && self.schedule.link_sweeps >= every {
            self.schedule.link_sweeps = 0;
            let link = LinkReport::new(report, gmt_m, stop);
            self.downlink.send(&Message::Link(link));
        }
        self.downlink.points_if_due(self.now_ns);
    }

    pub(super) fn report_health(&mut self) {
        let report = HealthReport {
            time_ns: self.now_ns,
            uptime_ms: (self.now_ns / 1_000_000) as u32,
            load: self.status.load,
            free_stack: self.status.free_stack,
            reset: self.config.reset,
            counters: self.health_counters(),
        };
        self.downlink.send(&Message::Health(report));
    }

    /// Every counter, as the ground sees it.
    #[must_use]
    pub fn health_counters(&self) -> HealthCounters {
        let counters = &self.counters;
        let link = self.front_end.counters();
        let receiver = self.cslam.counters();
        let filter = self.cslam.filter_counters();
        let inertial = self.cslam.imu_counters();
        let map = self.cslam.map();
        let [packets_sent, packets_dropped] = self.downlink.sent_and_dropped();
        HealthCounters {
            sweeps: counters.sweeps,
            blocks: counters.blocks,
            blocks_damaged: link.damaged(),
            blocks_lost: link.lost,
            blocks_repeated: link.repeated,
            blocks_late: counters.late_blocks.saturating_add(link.stale),
            blocks_overrun: link.overrun,
            imu_samples: counters.imu,
            imu_lost: self.status.imu_lost.saturating_add(counters.records_lost),
            imu_damaged: self.status.imu_damaged.saturating_add(counters.records_damaged),
            magnetometer: counters.magnetometer,
            beacons: counters.beacons,
            timing: counters.timing,
            commands: counters.commands,
            uplink_damaged: counters.uplink_damaged,
            uplink_unsigned: counters.uplink_unsigned,
            uplink_replayed: counters.uplink_replayed,
            uplink_wrong_link: counters.uplink_wrong_link,
            uplink_unknown: counters.uplink_unknown,
            points: counters.points,
            rejected: counters.rejected,
            invalid: counters.invalid,
            map_points: u32::try_from(map.len()).unwrap_or(u32::MAX),
            map_dropped: map.counters().dropped.saturating_add(map.counters().out_of_range),
            packets_sent,
            packets_dropped,
            timing_refused: counters
                .timing_ahead
                .saturating_add(receiver.timing_invalid)
                .saturating_add(receiver.timing_refused.max(filter.timing_rejected)),
            clock_steps: filter.clock_steps,
            beacons_refused: filter.beacons_refused,
            uplink_unreserved: counters.uplink_unreserved,
            starts_refused: filter.starts_refused,
            contrary: filter.contrary,
            imu_missing: inertial.missing,
            imu_refused: inertial
                .repeated
                .saturating_add(inertial.late)
                .saturating_add(inertial.invalid),
            imu_spikes: inertial.spikes,
            imu_saturated: inertial.saturated,
            imu_stuck: inertial.stuck,
            imu_stops: inertial.stops,
        }
    }
}
