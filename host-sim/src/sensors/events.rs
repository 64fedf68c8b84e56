//! What the receiver sees of a flight, in the order in which it happens.

use cslam_firmware::icm42688::RawSample;

use super::magnetometer::current_share;
use super::sampling::Sampling;
use super::{
    Barometer, BarometerSample, Beacon, Beacons, Imu, Magnetometer, MagnetometerSample, SensedFlight, Timing,
    TimingSample,
};

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
    /// A sample of the barometer.
    Barometer(BarometerSample),
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
            Self::Barometer(_) => 5,
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

/// Kinds of events.
pub(crate) const KINDS: usize = 6;

/// Iterator over the events of a flight: magnetometer and barometer tick with the UAV clock, the IMU with one of its own, sweeps,
/// beacons and exchanges with the GMT's. Holds one pending event of each kind, so a flight of any length needs the same memory.
#[derive(Clone, Debug)]
pub struct Events<'a> {
    flight: &'a SensedFlight,
    imu: Imu,
    sampling: Sampling,
    magnetometer: Magnetometer,
    timing: Timing,
    beacons: Beacons,
    barometer: Barometer,
    /// True time at which the last IMU sample ended, s.
    imu_end_s: f64,
    /// Number of the next tick, exchange, sweep of each kind, by rank.
    next: [u64; KINDS],
    pending: [Option<Stamped>; KINDS],
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
            barometer: Barometer::new(&config.barometer, seed),
            imu_end_s: flight.clock().time_at_s(0.0),
            next: [1, 1, 0, 0, 0, 1],
            pending: [None; KINDS],
        };
        for kind in 0..KINDS {
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
            4 => self.beacon(),
            _ => self.barometer(),
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
        self.at(uav_time_ns)
    }

    /// A time by the UAV clock (ns) and the true one (s); `None` after the end.
    fn at(&self, uav_time_ns: u64) -> Option<(u64, f64)> {
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
        let own_ns = self.take_number(0) * (1_000_000_000 / u64::from(self.flight.config().imu.rate_hz));
        let (uav_time_ns, time_s) = self.at(self.sampling.by_uav_clock_ns(own_ns))?;
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
        let iron_ut = self.flight.site().iron.field_ut(&motion.position_m);
        let sample = self
            .magnetometer
            .measure(&motion.attitude, current_share(thrust_m_per_s2), &iron_ut);
        let event = Event::Magnetometer(sample);
        Some(Stamped { uav_time_ns, event })
    }

    fn barometer(&mut self) -> Option<Stamped> {
        let rate_hz = self.flight.config().barometer.rate_hz;
        if rate_hz == 0 {
            return None;
        }
        let (uav_time_ns, time_s) = self.tick(5, rate_hz)?;
        let plan = self.flight.plan();
        let motion = plan.uav().at(time_s);
        let airspeed_m_per_s = motion.velocity_m_per_s - plan.uav().air_m_per_s(time_s);
        let sample = self.barometer.measure(
            &motion,
            &airspeed_m_per_s,
            self.flight.site().ground_z_m,
            plan.carried_share(time_s),
        );
        let event = Event::Barometer(sample);
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
        let kind = (0..KINDS)
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
    use crate::sensors::{BarometerConfig, ImuConfig, MagnetometerConfig, SensorsConfig, Site, WallIron};

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
    fn changed(config: &FlightConfig, sensors: SensorsConfig) -> [usize; KINDS] {
        let of_kind = |flight: &SensedFlight, rank: u8| -> Vec<Stamped> {
            let events = Events::new(flight);
            events.filter(|stamped| stamped.event.rank() == rank).collect()
        };
        let plain = flight(&FlightConfig::default(), SensorsConfig::default());
        let other = flight(config, sensors);
        [0, 1, 2, 3, 4, 5].map(|rank| {
            let (before, after) = (of_kind(&plain, rank), of_kind(&other, rank));
            if rank == 5 {
                // A barometer is there, or none is.
                return after.len().abs_diff(before.len());
            }
            assert_eq!(before.len(), after.len(), "rank {rank}");
            before.iter().zip(&after).filter(|(a, b)| a != b).count()
        })
    }

    #[test]
    fn a_barometer_and_a_clock_change_no_other_event() {
        let calm = FlightConfig::default();
        let barometer = SensorsConfig {
            barometer: BarometerConfig::real(),
            ..SensorsConfig::default()
        };
        let [others @ .., of_barometer] = changed(&calm, barometer);
        assert!(
            (124..=125).contains(&of_barometer) && others == [0; 5],
            "{of_barometer}"
        );
        let clock = SensorsConfig {
            imu: ImuConfig {
                clock_rms_ppm: 50.0,
                ..ImuConfig::default()
            },
            ..SensorsConfig::default()
        };
        let flight = flight(&calm, clock);
        let of_imu: Vec<u64> = Events::new(&flight)
            .filter(|stamped| stamped.event.rank() == 0)
            .map(|stamped| stamped.uav_time_ns)
            .collect();
        let step = |k: usize| of_imu[k + 1] as f64 - of_imu[k] as f64;
        let ppm = (of_imu[4999 - 1] as f64 / 4999e6 - 1.0) * 1e6;
        assert!(ppm.abs() > 1.0 && ppm.abs() < 250.0, "{ppm}");
        assert!((0..of_imu.len() - 1).all(|k| (step(k) / 1e6 - 1.0 - ppm * 1e-6).abs() < 2e-6));
        let others = |flight: &SensedFlight| -> Vec<Stamped> {
            Events::new(flight)
                .filter(|stamped| stamped.event.rank() != 0)
                .collect()
        };
        let plain = self::flight(&calm, SensorsConfig::default());
        assert_eq!(others(&flight), others(&plain));
    }

    #[test]
    fn iron_in_walls_is_read_by_the_magnetometer_alone() {
        let read = |field_ut: f64| -> (Vec<Stamped>, Vec<Stamped>) {
            let scene = Scene::load("indoor").expect("built in");
            let config = FlightConfig {
                duration_s: 5.0,
                ..FlightConfig::default()
            };
            let plan = FlightPlan::plan(&scene, &config, 2).expect("room");
            let site = Site {
                iron: WallIron::draw(&scene, &plan, field_ut, 2),
                ..Site::default()
            };
            let flight = SensedFlight::new(plan, SensorsConfig::default(), 2)
                .expect("sound")
                .at_site(site);
            Events::new(&flight).partition(|stamped| stamped.event.rank() == 1)
        };
        let ((none, others), (iron, same)) = (read(0.0), read(20.0));
        assert_eq!(others, same);
        assert!(none.len() == iron.len() && none != iron);
    }

    #[test]
    fn an_effect_changes_the_events_of_its_sensor_only() {
        let calm = FlightConfig::default();
        let imu = SensorsConfig {
            imu: ImuConfig {
                clock_rms_ppm: 0.0,
                ..ImuConfig::real()
            },
            ..SensorsConfig::default()
        };
        let [of_imu, others @ ..] = changed(&calm, imu);
        assert!(of_imu > 4900 && others == [0; 5], "{of_imu} {others:?}");
        // Iron is of a place, and there is none.
        let motors = SensorsConfig {
            magnetometer: MagnetometerConfig::real(),
            ..SensorsConfig::default()
        };
        // At rest the motors stand still.
        let [of_imu, of_magnetometer, others @ ..] = changed(&calm, motors);
        assert!((80..=100).contains(&of_magnetometer), "{of_magnetometer}");
        assert!(of_imu == 0 && others == [0; 4]);
        // Wind moves the UAV once it flies, and with it whatever is in it; the GMT and the clocks know nothing of it.
        let [of_imu, of_magnetometer, others @ ..] = changed(&FlightConfig::real(), SensorsConfig::default());
        assert!((1500..=2100).contains(&of_imu), "{of_imu}");
        assert!((50..=105).contains(&of_magnetometer), "{of_magnetometer}");
        assert_eq!(others, [0; 4]);
    }
}
