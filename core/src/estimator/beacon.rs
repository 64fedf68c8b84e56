//! Whether the beacon can be true: the GMT is a slow ground vehicle that stands still while it sounds.
//!
//! The whole solution stands on the beacon, so a wrong one moves the pose without contradicting anything else. But a
//! vehicle cannot jump, and between two sweeps of one stop it does not move at all: a position that creeps within the
//! stops is that of a wandering receiver, not of a vehicle. The beacon itself says which sweeps share a stop.
//!
//! A claim that is not believed is believed in its changes all the same: what it is off by stays, until it ends or a line of sight
//! shows that the claim was right.
//!
//! An error that a beacon has had from its first word on moves everything alike, and no measurement on board can show it. Only
//! whoever set the GMT up can: [`BeaconLimits::setup`].

use super::row::BELIEVED_OF_THREE;
use nalgebra::Vector3;

/// Limits of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BeaconLimits {
    /// Fastest drive of the GMT, m/s.
    /// Given: the GMT is a slow vehicle.
    pub speed_m_per_s: f64,
    /// Slack of a single position, m.
    /// Derived: ten standard deviations of an honest beacon's error ([`crate::estimator::RadioNoise::beacon_m`]).
    pub slack_m: f64,
    /// Walk of an honest beacon's error, m per root s and axis.
    /// Derived: 20 mm that wander over a minute, sqrt(2 / 60 s).
    pub walk_m: f64,
    /// The part of an honest beacon's error that is new in each, m per axis.
    /// Given: carrier phase noise of a satellite receiver, twice over for the height.
    pub white_m: f64,
    /// Share of the creep that is kept from stop to stop.
    /// Tuned: `cslam campaign` with tuning seeds (docs/flights.md).
    pub memory: f64,
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
            // 20 mm that wander over a minute: sqrt(2 / 60 s).
            walk_m: 3.7e-3,
            // Carrier phase noise of a satellite receiver, twice over for the height.
            white_m: 5e-3,
            memory: 0.9,
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
    /// Cannot be where it says, or says so since it could not: [`BeaconMonitor::place`] is to be used.
    Jumped,
}

/// A place and how sure it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Where, m.
    pub position_m: Vector3<f64>,
    /// Standard deviation beside that of the claim, m per axis.
    pub sigma_m: f64,
}

/// A beacon as it was heard.
#[derive(Clone, Copy, Debug)]
struct Sounding {
    time_ns: u64,
    stop: u32,
    claimed_m: Vector3<f64>,
}

/// Steps within stops, fading from stop to stop: those of an honest beacon's error go to and fro, those of a lie add up.
#[derive(Clone, Copy, Debug, Default)]
struct Creep {
    /// Sum, m.
    sum_m: Vector3<f64>,
    /// Sum of the squares, m^2.
    squares_m2: f64,
    /// What an honest error may have walked, m^2 per axis.
    walked_m2: f64,
    /// What of it may be new in each beacon, m^2 per axis.
    white_m2: f64,
}

impl Creep {
    fn add(&mut self, step_m: &Vector3<f64>, since_s: f64, limits: &BeaconLimits) {
        self.sum_m += step_m;
        self.squares_m2 += step_m.norm_squared();
        self.walked_m2 += limits.walk_m * limits.walk_m * since_s;
        self.white_m2 += 2.0 * limits.white_m * limits.white_m;
    }

    fn fade(&mut self, kept: f64) {
        self.sum_m *= kept;
        self.squares_m2 *= kept * kept;
        self.walked_m2 *= kept * kept;
        self.white_m2 *= kept * kept;
    }

    /// Whether the steps add up to more than an honest error does: than its walk, and than their own scatter as far as that may be white.
    fn is_a_lie(&self) -> bool {
        let scatter_m2 = (self.squares_m2 / 3.0).min(self.walked_m2 + self.white_m2);
        let variance_m2 = self.walked_m2.max(scatter_m2);
        self.sum_m.norm_squared() > BELIEVED_OF_THREE * variance_m2
    }
}

/// Memory of the beacons.
#[derive(Clone, Copy, Debug)]
pub struct BeaconMonitor {
    limits: BeaconLimits,
    /// The last place that was believed, and when.
    trusted: Option<(u64, Vector3<f64>)>,
    /// What the claims are off by (m), and how sure that is (m per axis).
    off: Option<(Vector3<f64>, f64)>,
    previous: Option<Sounding>,
    creep: Creep,
    /// All creep since it was seen for the first time.
    crept_m: Vector3<f64>,
}

impl BeaconMonitor {
    /// Before the first beacon.
    pub fn new(limits: BeaconLimits) -> Self {
        Self {
            limits,
            trusted: None,
            off: None,
            previous: None,
            creep: Creep::default(),
            crept_m: Vector3::zeros(),
        }
    }

    /// Judges a beacon heard at `time_ns` (UAV clock) that belongs to stop number `stop`.
    pub fn judge(&mut self, time_ns: u64, stop: u32, claimed_m: &Vector3<f64>) -> BeaconVerdict {
        let limits = self.limits;
        match self.place(time_ns, claimed_m) {
            Some(place) => {
                let off_m = claimed_m - place.position_m;
                // Of a claim that is no number nothing can be believed, not even its changes.
                if off_m.iter().all(|c| c.is_finite()) {
                    let again = self.off.is_some_and(|(before_m, _)| before_m == off_m);
                    self.previous = self.previous.filter(|_| again);
                    self.off = Some((off_m, place.sigma_m));
                    self.trusted = Some((time_ns, place.position_m));
                }
            }
            None if !claimed_m.iter().all(|c| c.is_finite()) => return BeaconVerdict::Jumped,
            None => {
                self.off = None;
                self.trusted = Some((time_ns, *claimed_m));
            }
        }
        if let Some(before) = self.previous {
            if before.stop == stop {
                let step_m = claimed_m - before.claimed_m;
                let since_s = time_ns.saturating_sub(before.time_ns) as f64 * 1e-9;
                self.creep.add(&step_m, since_s, &limits);
                if self.crept_m != Vector3::zeros() {
                    self.crept_m += step_m;
                }
            } else {
                self.creep.fade(limits.memory);
            }
        }
        let heard = Sounding {
            time_ns,
            stop,
            claimed_m: *claimed_m,
        };
        self.previous = claimed_m.iter().all(|c| c.is_finite()).then_some(heard);
        let creeps = self.creep.is_a_lie();
        if creeps && self.crept_m == Vector3::zeros() {
            self.crept_m = self.creep.sum_m;
        }
        match (self.off, creeps) {
            (Some(_), _) => BeaconVerdict::Jumped,
            (None, true) => BeaconVerdict::Creeping,
            (None, false) => BeaconVerdict::Plausible,
        }
    }

    /// Where the GMT is instead of where it claims to be at `time_ns`; `None` when it can be believed, or nothing better is known.
    pub fn place(&self, time_ns: u64, claimed_m: &Vector3<f64>) -> Option<Place> {
        let limits = self.limits;
        let (was_m, reach_m, aged_m) = match (self.trusted, limits.setup) {
            (Some((since_ns, was_m)), _) => {
                let since_s = time_ns.saturating_sub(since_ns) as f64 * 1e-9;
                let drive_m = limits.speed_m_per_s * since_s;
                // While a place is doubted the true one may move on, but not the doubt's benefit.
                let reach_m = limits.slack_m + drive_m.min(limits.speed_m_per_s);
                (was_m, reach_m, GMT_PACE_M_PER_S * since_s)
            }
            // Anywhere within.
            (None, Some(setup)) => (setup.position_m, setup.within_m, setup.within_m / libm::sqrt(3.0)),
            (None, None) => return None,
        };
        let within = |place: &Vector3<f64>| (place - was_m).norm() <= reach_m;
        if let Some((off_m, sigma_m)) = self.off {
            let position_m = claimed_m - off_m;
            if within(&position_m) {
                return Some(Place { position_m, sigma_m });
            }
        }
        if within(claimed_m) {
            return None;
        }
        let before_m = self.off.map_or(0.0, |(_, sigma_m)| sigma_m);
        Some(Place {
            position_m: was_m,
            sigma_m: libm::hypot(before_m, aged_m),
        })
    }

    /// A line of sight has shown that the beacon of `time_ns` is wrong, and where the GMT was.
    pub fn refute(&mut self, time_ns: u64, claimed_m: &Vector3<f64>, place: &Place) {
        self.off = Some((claimed_m - place.position_m, place.sigma_m));
        self.trusted = Some((time_ns, place.position_m));
    }

    /// The beacon of `time_ns` is right, though it has jumped.
    pub fn confirm(&mut self, time_ns: u64, claimed_m: &Vector3<f64>) {
        *self = Self::new(self.limits);
        self.trusted = Some((time_ns, *claimed_m));
    }

    /// How far the claims may have crept, m: what was seen within stops, and as much between them.
    pub fn crept_m(&self) -> f64 {
        2.0 * self.crept_m.norm()
    }
}

/// The GMT's pace between its stops, m/s: how fast the last trusted position ages.
/// Given: how the GMT drives, its stops included.
pub(crate) const GMT_PACE_M_PER_S: f64 = 0.3;
