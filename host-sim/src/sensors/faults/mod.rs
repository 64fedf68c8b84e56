//! Faults of sensors and of the way their data take: seeded wrappers around the ordinary events.
//!
//! A fault is configured by time ([`FaultsConfig`], `[sensors.faults]` of a world's TOML file) and enters where it would
//! in the air: samples are changed or left out, the beacon tells another position and timing another offset, events are lost, doubled or late on
//! their way, the clock itself steps (so that time stamps, exchanges and delays agree about it), and a sweep sees the GMT
//! from somewhere else ([`wrong_fix_m`]). What does not fail is bit for bit what it would have been without faults.

mod config;
mod imu;
mod transport;

use nalgebra::Vector3;

use super::{Beacon, Event, Stamped};
use crate::seeded::{Seeded, Source};

pub use config::{
    BeaconFault, ClockStep, FaultsConfig, ImuAxis, ImuFault, ImuFaultKind, Span, TimingFault, TransportFault,
    Traveller, WrongFix,
};
use imu::ImuFaults;
use transport::Transport;

/// Iterator over events with faults, in the order in which they arrive.
#[derive(Clone, Debug)]
pub struct Faulty<I> {
    events: I,
    config: FaultsConfig,
    imu: ImuFaults,
    transport: Transport,
}

impl<I: Iterator<Item = Stamped>> Faulty<I> {
    /// Events with the faults of the world of `seed`. `config` has been checked by [`super::SensorsConfig::check`].
    pub fn new(events: I, config: &FaultsConfig, seed: u64) -> Self {
        Self {
            events,
            config: config.clone(),
            imu: ImuFaults::new(&config.imu, seed),
            transport: Transport::new(&config.transport, seed),
        }
    }

    /// An event as its sensor makes it; `None` when it makes none.
    fn sensed(&mut self, mut stamped: Stamped) -> Option<Stamped> {
        // Faults are by GMT time, stamps by the UAV clock: they differ by microseconds.
        let time_s = stamped.uav_time_ns as f64 * 1e-9;
        match &mut stamped.event {
            Event::Imu(sample) => *sample = self.imu.apply(sample, time_s)?,
            Event::Beacon(beacon) => lie(beacon, &self.config.beacon),
            Event::Timing(sample) => sample.clock_offset_s += lie_s(time_s, &self.config.timing),
            Event::Magnetometer(_) | Event::Barometer(_) | Event::Sweep { .. } => {}
        }
        Some(stamped)
    }
}

impl<I: Iterator<Item = Stamped>> Iterator for Faulty<I> {
    type Item = Stamped;

    fn next(&mut self) -> Option<Stamped> {
        loop {
            if let Some(arrived) = self.transport.arrived() {
                return Some(arrived);
            }
            match self.events.next() {
                Some(stamped) => {
                    if let Some(stamped) = self.sensed(stamped) {
                        self.transport.send(stamped);
                    }
                }
                None => return self.transport.rest(),
            }
        }
    }
}

/// Moves the position that a beacon tells.
fn lie(beacon: &mut Beacon, faults: &[BeaconFault]) {
    for fault in faults {
        let since_s = beacon.gmt_time_s - fault.start_s;
        let span = Span {
            start_s: fault.start_s,
            duration_s: fault.duration_s,
        };
        if span.contains(beacon.gmt_time_s) {
            for ((told, offset), drift) in beacon
                .position_m
                .iter_mut()
                .zip(fault.offset_m)
                .zip(fault.drift_m_per_s)
            {
                *told += offset + drift * since_s;
            }
        }
    }
}

/// Error of two-way timing at a time, s.
fn lie_s(time_s: f64, faults: &[TimingFault]) -> f64 {
    let at_work = faults.iter().filter(|fault| {
        let span = Span {
            start_s: fault.start_s,
            duration_s: fault.duration_s,
        };
        span.contains(time_s)
    });
    at_work
        .map(|fault| (fault.offset_ns + fault.drift_ns_per_s * (time_s - fault.start_s)) * 1e-9)
        .sum()
}

/// By how much the paths of a sweep speak of another place than that of the UAV, m, world frame; zero for a sound sweep.
/// Whoever makes the measurements of a sweep adds it to the position that they are made from.
pub fn wrong_fix_m(config: &FaultsConfig, sweep: u32, seed: u64) -> Vector3<f64> {
    let faults = config.fix.iter().zip(0u32..);
    faults
        .filter(|(fault, _)| sweep >= fault.sweep && sweep - fault.sweep < fault.sweeps)
        .map(|(fault, number)| {
            let direction = Seeded::numbered(seed, Source::WrongFix, number).normal_vector();
            direction * (fault.distance_m / direction.norm().max(f64::MIN_POSITIVE))
        })
        .sum()
}

#[cfg(test)]
mod tests;
