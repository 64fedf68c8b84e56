//! A planned flight with its sensors.

use nalgebra::{Rotation3, Vector3};

use super::faults::wrong_fix_m;
use super::{Clock, Events, Faulty, OverAir, SensorsConfig, Site, true_gmt_attitude};
use crate::flight::{FlightPlan, Motion};
use crate::input::InputError;

/// First exchange, by the GMT clock, in shares of the period: halfway between two sweeps at the default rates.
const TIMING_PHASE: f64 = 0.5;

/// The world as it is at one instant: for the channel and for evaluation, never for the receiver.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// GMT time, s.
    pub time_s: f64,
    /// State of the UAV.
    pub uav: Motion,
    /// Position of the GMT antenna, m, world frame.
    pub gmt_position_m: Vector3<f64>,
    /// Velocity of the GMT antenna, m/s, world frame; zero during every sweep.
    pub gmt_velocity_m_per_s: Vector3<f64>,
    /// Attitude of the GMT's mast: turns vectors of its array frame into world vectors.
    pub gmt_attitude: Rotation3<f64>,
    /// UAV clock less GMT clock, s.
    pub clock_offset_s: f64,
    /// Fractional frequency of the UAV clock, s/s.
    pub clock_drift: f64,
}

/// A flight and everything that is measured on it. Reproducible: plan, configuration and seed decide every bit.
#[derive(Clone, Debug)]
pub struct SensedFlight {
    plan: FlightPlan,
    config: SensorsConfig,
    seed: u64,
    clock: Clock,
    gmt_attitude: Rotation3<f64>,
    over_air: Option<OverAir>,
    site: Site,
}

impl SensedFlight {
    /// Joins a planned flight with sensors.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range.
    pub fn new(plan: FlightPlan, config: SensorsConfig, seed: u64) -> Result<Self, InputError> {
        config.check()?;
        let clock = Clock::new(&config.clock, seed, plan.duration_s()).with_steps(&config.faults.clock);
        let gmt_attitude = true_gmt_attitude(&config.beacon, plan.gmt_heading_rad(), seed);
        Ok(Self {
            plan,
            config,
            seed,
            clock,
            gmt_attitude,
            over_air: None,
            site: Site::default(),
        })
    }

    /// The same flight with words that fare as the air lets them.
    #[must_use]
    pub fn with_words(mut self, over_air: OverAir) -> Self {
        self.over_air = Some(over_air);
        self
    }

    /// The same flight at a place: what ground and walls do to sensors.
    #[must_use]
    pub fn at_site(mut self, site: Site) -> Self {
        self.site = site;
        self
    }

    /// What ground and walls do to sensors there.
    pub(super) fn site(&self) -> &Site {
        &self.site
    }

    /// Whether the air lets the beacon after a sweep through.
    pub(super) fn beacon_arrives(&self, sweep: u32) -> bool {
        let words = self.over_air.as_ref().filter(|_| self.config.beacon.over_air);
        words.is_none_or(|words| words.beacons.get(sweep as usize).copied().unwrap_or(false))
    }

    /// What the air adds to the clock offset of an exchange, s; `None` when it fails.
    pub(super) fn exchange_error_s(&self, exchange: u64) -> Option<f64> {
        match self.over_air.as_ref().filter(|_| self.config.timing.over_air) {
            Some(words) => words
                .exchanges
                .get(usize::try_from(exchange).ok()?)
                .copied()
                .flatten(),
            None => Some(0.0),
        }
    }

    /// When the beacon after each sweep is heard, GMT time, s.
    pub fn beacon_times_s(&self) -> Vec<f64> {
        let sweeps = 0..self.plan.sweeps();
        sweeps.map(|sweep| self.beacon_time_s(sweep)).collect()
    }

    /// When the beacon after a sweep is heard, GMT time, s.
    pub(super) fn beacon_time_s(&self, sweep: u32) -> f64 {
        self.plan.schedule().sweep_time_s(sweep) + self.config.beacon.latency_s
    }

    /// When timing is exchanged, GMT time, s: until the flight ends.
    pub fn exchange_times_s(&self) -> Vec<f64> {
        (0..)
            .map(|number| self.exchange_time_s(number))
            .take_while(|time_s| *time_s <= self.plan.duration_s())
            .collect()
    }

    /// Time of an exchange, GMT time, s.
    pub(super) fn exchange_time_s(&self, number: u64) -> f64 {
        (number as f64 + TIMING_PHASE) / f64::from(self.config.timing.rate_hz)
    }

    /// The planned flight.
    pub fn plan(&self) -> &FlightPlan {
        &self.plan
    }

    /// Errors of the sensors.
    pub fn config(&self) -> &SensorsConfig {
        &self.config
    }

    /// Seed of the sensors' errors.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The UAV clock.
    pub fn clock(&self) -> &Clock {
        &self.clock
    }

    /// All that the receiver gets besides radio samples, with the faults of the configuration, in the order in which it
    /// arrives: that of the UAV clock, unless a fault makes events late.
    pub fn events(&self) -> Faulty<Events<'_>> {
        Faulty::new(Events::new(self), &self.config.faults, self.seed)
    }

    /// By how much the paths of a sweep speak of another place than that of the UAV, m, world frame: whoever makes its
    /// measurements adds it to the position. Zero unless the configuration has a wrong fix there.
    pub fn wrong_fix_m(&self, sweep: u32) -> Vector3<f64> {
        wrong_fix_m(&self.config.faults, sweep, self.seed)
    }

    /// The world at GMT time `time_s`.
    pub fn truth(&self, time_s: f64) -> Truth {
        let (gmt_position_m, gmt_velocity_m_per_s) = self.plan.gmt().at(time_s);
        Truth {
            time_s,
            uav: self.plan.uav().at(time_s),
            gmt_position_m,
            gmt_velocity_m_per_s,
            gmt_attitude: self.gmt_attitude,
            clock_offset_s: self.clock.offset_s(time_s),
            clock_drift: self.clock.drift(time_s),
        }
    }

    /// The world at the start of sweep `sweep`: what the channel needs to make its samples.
    pub fn sweep_truth(&self, sweep: u32) -> Truth {
        self.truth(self.plan.schedule().sweep_time_s(sweep))
    }
}
