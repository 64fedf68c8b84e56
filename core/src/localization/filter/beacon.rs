//! Whether the beacon can be true: the GMT is a slow ground vehicle that stands still while it sounds.
//!
//! The whole solution stands on the beacon, so a wrong one moves the pose without contradicting anything else. But a
//! vehicle cannot jump, and between two sweeps of one stop it does not move at all: a position that creeps within the
//! stops is that of a wandering receiver, not of a vehicle. The beacon itself says which sweeps share a stop.
//!
//! An error that a beacon has had from its first word on moves everything alike, and no measurement on board can show it. Only
//! whoever set the GMT up can: [`BeaconLimits::setup`].

use nalgebra::Vector3;

/// Limits of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeaconLimits {
    /// Fastest drive of the GMT, m/s.
    pub speed_m_per_s: f64,
    /// Slack of a single position, m.
    pub slack_m: f64,
    /// Creep that cannot be noise, m: summed over the stops of the memory.
    pub creep_m: f64,
    /// Share of the creep that is kept from stop to stop.
    pub memory: f64,
    /// A new place is accepted when it has been claimed this long and no line of sight has refuted it, s.
    pub accept_after_s: f64,
    /// Where the GMT was set up, if whoever did so says it.
    pub setup: Option<Setup>,
}

/// Where the GMT was set up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// Antenna position, world frame, m.
    pub position_m: Vector3<f64>,
    /// The first beacon is not further from it than this, m.
    pub within_m: f64,
}

impl Default for BeaconLimits {
    fn default() -> Self {
        Self {
            speed_m_per_s: 2.0,
            slack_m: 0.3,
            creep_m: 0.2,
            memory: 0.9,
            accept_after_s: 20.0,
            setup: None,
        }
    }
}

/// Verdict on a beacon.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BeaconVerdict {
    /// Believed.
    Plausible,
    /// Creeps while it should stand: used, but flagged.
    Creeping,
    /// Cannot be where it says: not to be used.
    Jumped,
}

/// Memory of the beacons.
#[derive(Clone, Copy, Debug)]
pub struct BeaconMonitor {
    limits: BeaconLimits,
    trusted: Option<(u64, Vector3<f64>)>,
    /// The same before the last beacon.
    before: Option<(u64, Vector3<f64>)>,
    previous: Option<(u32, Vector3<f64>)>,
    creep_m: Vector3<f64>,
    doubted_since_ns: Option<u64>,
}

impl BeaconMonitor {
    /// Before the first beacon.
    pub fn new(limits: BeaconLimits) -> Self {
        Self {
            limits,
            trusted: None,
            before: None,
            previous: None,
            creep_m: Vector3::zeros(),
            doubted_since_ns: None,
        }
    }

    /// Judges a beacon heard at `time_ns` (UAV clock) that belongs to stop number `stop`.
    pub fn judge(&mut self, time_ns: u64, stop: u32, position_m: &Vector3<f64>) -> BeaconVerdict {
        let limits = self.limits;
        if !position_m.iter().all(|c| c.is_finite()) {
            return BeaconVerdict::Jumped;
        }
        if !self.is_possible(time_ns, position_m) {
            let doubted = *self.doubted_since_ns.get_or_insert(time_ns);
            if self.trusted.is_none() || seconds(doubted, time_ns) < limits.accept_after_s {
                return BeaconVerdict::Jumped;
            }
            // It has stayed there: the vehicle was carried, or its receiver had been wrong before.
            self.previous = None;
            self.creep_m = Vector3::zeros();
        }
        self.doubted_since_ns = None;
        self.before = self.trusted;
        self.trusted = Some((time_ns, *position_m));
        if let Some((before, place)) = self.previous {
            if before == stop {
                self.creep_m += position_m - place;
            } else {
                self.creep_m *= limits.memory;
            }
        }
        self.previous = Some((stop, *position_m));
        if self.creep_m.norm() > limits.creep_m {
            BeaconVerdict::Creeping
        } else {
            BeaconVerdict::Plausible
        }
    }

    /// Whether the GMT can be at a place (m) at `time_ns`: within its drive of where it was last, or of where it was set up.
    pub fn is_possible(&self, time_ns: u64, position_m: &Vector3<f64>) -> bool {
        let limits = self.limits;
        let (place, reach) = match (self.trusted, limits.setup) {
            (Some((since, place)), _) => {
                let drive = limits.speed_m_per_s * seconds(since, time_ns);
                // While a place is doubted the true one may move on, but not the doubt's benefit.
                (place, limits.slack_m + drive.min(limits.speed_m_per_s))
            }
            (None, Some(setup)) => (setup.position_m, setup.within_m),
            (None, None) => return true,
        };
        (position_m - place).norm() <= reach
    }

    /// A line of sight has shown that the beacon of `time_ns` was wrong: the place before it stands, and how long the new one has been
    /// claimed counts from now.
    pub fn refute(&mut self, time_ns: u64) {
        if self.trusted.is_some_and(|(since, _)| since == time_ns) {
            self.trusted = self.before;
        }
        self.doubted_since_ns = Some(time_ns);
    }

    /// A line of sight has shown that the beacon of `time_ns` was right, though it had jumped.
    pub fn confirm(&mut self, time_ns: u64, position_m: &Vector3<f64>) {
        *self = Self::new(self.limits);
        self.trusted = Some((time_ns, *position_m));
    }
}

fn seconds(since_ns: u64, time_ns: u64) -> f64 {
    time_ns.saturating_sub(since_ns) as f64 * 1e-9
}
