//! What the receiver sees of a flight, in the order in which it happens.

use cslam_firmware::icm42688::RawSample;

use super::magnetometer::current_share;
use super::sampling::Sampling;
use super::{Beacon, Beacons, Imu, Magnetometer, MagnetometerSample, SensedFlight, Timing, TimingSample};

/// One thing that reaches the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event {
    /// A sample of the IMU, over the interval that ends at the time stamp.
    Imu(RawSample),
    /// A sample of the magnetometer.
    Magnetometer(MagnetometerSample),
    /// A two-way timing exchange.
    Timing(TimingSample),
    /// A sweep begins: its sample blocks follow from the front end.
    Sweep {
        /// Number of the sweep, from 0.
        sweep: u32,
    },
    /// A beacon has been decoded.
    Beacon(Beacon),
}

impl Event {
    /// Order among events of the same time stamp.
    pub fn rank(&self) -> u8 {
        match self {
            Self::Imu(_) => 0,
            Self::Magnetometer(_) => 1,
            Self::Timing(_) => 2,
            Self::Sweep { .. } => 3,
            Self::Beacon(_) => 4,
        }
    }
}

/// An event and when it happened by the UAV clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stamped {
    /// UAV clock, ns. The clock reads about zero when the flight begins; an event before that would be stamped 0.
    pub uav_time_ns: u64,
    /// What happened.
    pub event: Event,
}

/// Iterator over the events of a flight: IMU and magnetometer tick with the UAV clock, sweeps, beacons and exchanges
/// with the GMT's. Holds one pending event of each kind, so a flight of any length needs the same memory.
#[derive(Clone, Debug)]
pub struct Events<'a> {
    flight: &'a SensedFlight,
    imu: Imu,
    sampling: Sampling,
    magnetometer: Magnetometer,
    timing: Timing,
    beacons: Beacons,
    /// True time at which the last IMU sample ended, s.
    imu_end_s: f64,
    /// Number of the next tick, exchange, sweep of each kind, by rank.
    next: [u64; 5],
    pending: [Option<Stamped>; 5],
}

impl<'a> Events<'a> {
    pub(super) fn new(flight: &'a SensedFlight) -> Self {
        let (config, seed) = (flight.config(), flight.seed());
        let mut events = Self {
            flight,
            imu: Imu::new(&config.imu, seed),
            sampling: Sampling::new(&config.imu, seed),
            magnetometer: Magnetometer::new(&config.magnetometer, seed),
            timing: Timing::new(&config.timing, seed),
            beacons: Beacons::new(
                &config.beacon,
                flight.plan().schedule(),
                flight.plan().gmt_heading_rad(),
                seed,
            ),
            imu_end_s: flight.clock().time_at_s(0.0),
            next: [1, 1, 0, 0, 0],
            pending: [None; 5],
        };
        for kind in 0..5 {
            events.refill(kind);
        }
        events
    }

    /// Makes the next event of one kind.
    fn refill(&mut self, kind: usize) {
        self.pending[kind] = match kind {
            0 => self.imu(),
            1 => self.magnetometer(),
            2 => self.exchange(),
            3 => self.sweep(),
            _ => self.beacon(),
        };
    }

    fn take_number(&mut self, kind: usize) -> u64 {
        let number = self.next[kind];
        self.next[kind] += 1;
        number
    }

    /// UAV time stamp (ns) and true time (s) of the next tick of the UAV clock at `rate_hz`.
    fn tick(&mut self, kind: usize, rate_hz: u32) -> Option<(u64, f64)> {
        let uav_time_ns = self.take_number(kind) * (1_000_000_000 / u64::from(rate_hz));
        let time_s = self.flight.clock().time_at_s(uav_time_ns as f64 * 1e-9);
        (time_s <= self.flight.plan().duration_s()).then_some((uav_time_ns, time_s))
    }

    /// An event at true time `time_s`, stamped by the UAV clock, rounded half up.
    fn stamp(&self, time_s: f64, event: Event) -> Stamped {
        let reading_ns = self.flight.clock().reading_s(time_s) * 1e9;
        Stamped {
            uav_time_ns: libm::floor(reading_ns + 0.5).max(0.0) as u64,
            event,
        }
    }

    fn imu(&mut self) -> Option<Stamped> {
        let (uav_time_ns, time_s) = self.tick(0, self.flight.config().imu.rate_hz)?;
        let plan = self.flight.plan();
        let carried = |time_s| plan.carried_share(time_s);
        let (rate, force) = self.sampling.sample(plan.uav(), carried, self.imu_end_s, time_s);
        self.imu_end_s = time_s;
        let event = Event::Imu(self.imu.measure(&rate, &force));
        Some(Stamped {
            uav_time_ns: self.sampling.stamp_ns(uav_time_ns),
            event,
        })
    }

    fn magnetometer(&mut self) -> Option<Stamped> {
        let (uav_time_ns, time_s) = self.tick(1, self.flight.config().magnetometer.rate_hz)?;
        let plan = self.flight.plan();
        let motion = plan.uav().at(time_s);
        let thrust_m_per_s2 = motion.specific_force_m_per_s2.norm() * plan.carried_share(time_s);
        let sample = self
            .magnetometer
            .measure(&motion.attitude, current_share(thrust_m_per_s2));
        let event = Event::Magnetometer(sample);
        Some(Stamped { uav_time_ns, event })
    }

    fn exchange(&mut self) -> Option<Stamped> {
        loop {
            let number = self.take_number(2);
            let time_s = self.flight.exchange_time_s(number);
            if time_s > self.flight.plan().duration_s() {
                return None;
            }
            let sample = self.timing.measure(self.flight.clock().offset_s(time_s));
            let error_s = self.flight.exchange_error_s(number);
            if let (Some(sample), Some(error_s)) = (sample, error_s) {
                let sample = TimingSample {
                    clock_offset_s: sample.clock_offset_s + error_s,
                };
                return Some(self.stamp(time_s, Event::Timing(sample)));
            }
        }
    }

    fn sweep(&mut self) -> Option<Stamped> {
        let sweep = u32::try_from(self.take_number(3)).ok()?;
        let time_s = self.flight.plan().schedule().sweep_time_s(sweep);
        (sweep < self.flight.plan().sweeps()).then(|| self.stamp(time_s, Event::Sweep { sweep }))
    }

    fn beacon(&mut self) -> Option<Stamped> {
        loop {
            let sweep = u32::try_from(self.take_number(4)).ok()?;
            let start_s = self.flight.plan().schedule().sweep_time_s(sweep);
            let heard_s = self.flight.beacon_time_s(sweep);
            if sweep >= self.flight.plan().sweeps() || heard_s > self.flight.plan().duration_s() {
                return None;
            }
            let (position_m, _) = self.flight.plan().gmt().at(start_s);
            let beacon = self.beacons.next(sweep, &position_m);
            if let Some(beacon) = beacon.filter(|_| self.flight.beacon_arrives(sweep)) {
                return Some(self.stamp(heard_s, Event::Beacon(beacon)));
            }
        }
    }
}

impl Iterator for Events<'_> {
    type Item = Stamped;

    fn next(&mut self) -> Option<Stamped> {
        let kind = (0..5)
            .filter(|&kind| self.pending[kind].is_some())
            .min_by_key(|&kind| self.pending[kind].map(|stamped| stamped.uav_time_ns))?;
        let event = self.pending[kind].take();
        self.refill(kind);
        event
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::{FlightConfig, FlightPlan};
    use crate::scene::Scene;
    use crate::sensors::{ImuConfig, MagnetometerConfig, SensorsConfig};

    /// Five seconds, of which three at rest.
    fn flight(config: &FlightConfig, sensors: SensorsConfig) -> SensedFlight {
        let scene = Scene::load("outdoor").expect("built in");
        let config = FlightConfig {
            duration_s: 5.0,
            ..config.clone()
        };
        let plan = FlightPlan::plan(&scene, &config, 2).expect("room");
        SensedFlight::new(plan, sensors, 2).expect("sound")
    }

    /// How many events of each kind are others than by default, by rank.
    fn changed(config: &FlightConfig, sensors: SensorsConfig) -> [usize; 5] {
        let of_kind = |flight: &SensedFlight, rank: u8| -> Vec<Stamped> {
            let events = Events::new(flight);
            events.filter(|stamped| stamped.event.rank() == rank).collect()
        };
        let plain = flight(&FlightConfig::default(), SensorsConfig::default());
        let other = flight(config, sensors);
        [0, 1, 2, 3, 4].map(|rank| {
            let (before, after) = (of_kind(&plain, rank), of_kind(&other, rank));
            assert_eq!(before.len(), after.len(), "rank {rank}");
            before.iter().zip(&after).filter(|(a, b)| a != b).count()
        })
    }

    #[test]
    fn an_effect_changes_the_events_of_its_sensor_only() {
        let calm = FlightConfig::default();
        let imu = SensorsConfig {
            imu: ImuConfig::real(),
            ..SensorsConfig::default()
        };
        let [of_imu, others @ ..] = changed(&calm, imu);
        assert!(of_imu > 4900 && others == [0; 4], "{of_imu} {others:?}");
        let motors = SensorsConfig {
            magnetometer: MagnetometerConfig::real(),
            ..SensorsConfig::default()
        };
        // At rest the motors stand still.
        let [of_imu, of_magnetometer, others @ ..] = changed(&calm, motors);
        assert!((80..=100).contains(&of_magnetometer), "{of_magnetometer}");
        assert!(of_imu == 0 && others == [0; 3]);
        // Wind moves the UAV once it flies, and with it whatever is in it; the GMT and the clocks know nothing of it.
        let [of_imu, of_magnetometer, others @ ..] = changed(&FlightConfig::real(), SensorsConfig::default());
        assert!((1500..=2100).contains(&of_imu), "{of_imu}");
        assert!((50..=105).contains(&of_magnetometer), "{of_magnetometer}");
        assert_eq!(others, [0; 3]);
    }
}
