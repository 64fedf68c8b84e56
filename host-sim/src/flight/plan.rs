//! Planning of a whole flight: the drive of the GMT, and a route of the UAV that mostly stays in its sight.
//!
//! Many pairs of drives and routes are drawn, the later ones more and more in the GMT's sight, and where it is hidden, in
//! that of its reflections; the first that has the wanted contact and keeps its distance is taken. A seed picks a flight,
//! not a fate: contact is planned for, as an operator would who knows the site, and reported. Geometry decides alone, no
//! receiver is asked.

mod planner;

use nalgebra::Vector3;

use self::planner::{PLAIN_ATTEMPTS, Planner};
use super::contact::{Contact, contact};
use super::wind::{Exposure, Wind};
use super::{FlightConfig, GmtTrack, Heading, Obstacles, Schedule, Trajectory, heading};
use crate::input::InputError;
use crate::scene::Placement;

/// Pairs of drive and route that are drawn before the best so far is taken.
const ATTEMPTS: u32 = 640;
/// Plans of which the best is taken when none is as wanted.
const FINALISTS: usize = 8;
/// Time from the end of the rest until the rotors carry the UAV, s.
const TAKE_OFF_S: f64 = 1.0;
/// Lines of a tour are flown at this share of the cruise speed on average, as a first guess.
const PACE_RATIO: f64 = 0.75;

/// A planned flight.
#[derive(Clone, Debug)]
pub struct FlightPlan {
    uav: Trajectory,
    gmt: GmtTrack,
    schedule: Schedule,
    rest_s: f64,
    duration_s: f64,
    contact: Contact,
    /// Heading of the GMT's mast, from east, rad.
    gmt_heading_rad: f64,
}

impl FlightPlan {
    /// Plans the flight of `seed` through a world.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range, or saying that the UAV or the GMT
    /// finds no room in the world.
    pub fn plan(world: &dyn Obstacles, config: &FlightConfig, seed: u64) -> Result<Self, InputError> {
        config.check()?;
        let plan = Self::in_calm(world, config, seed)?;
        let plan = plan.over_relief(world, config).in_wind(world, config, seed);
        Ok(plan.facing(config))
    }

    /// The flight with the nose where it shall point.
    fn facing(self, config: &FlightConfig) -> Self {
        let turned = match config.heading {
            Heading::Along => None,
            Heading::AtGmt => {
                heading::at_gmt(self.uav.position_m(), &self.gmt, &config.limits, config.rest_s)
            }
        };
        match turned {
            Some(turned) => Self {
                uav: self.uav.with_heading(turned),
                ..self
            },
            None => self,
        }
    }

    /// The flight with a GMT that goes up and down with the ground; it was planned for level ground, so that it is the same flight.
    fn over_relief(self, world: &dyn Obstacles, config: &FlightConfig) -> Self {
        let raised = |stop: &Vector3<f64>| stop + Vector3::z() * world.relief_m((*stop).into());
        let gmt = self.gmt.clone().with_stops(raised);
        if gmt == self.gmt {
            return self;
        }
        Self {
            contact: contact(
                world,
                &self.uav,
                &gmt,
                self.schedule,
                self.duration_s,
                config.start_elevation_deg,
            ),
            gmt,
            ..self
        }
    }

    /// The flight as it would be without wind.
    fn in_calm(world: &dyn Obstacles, config: &FlightConfig, seed: u64) -> Result<Self, InputError> {
        let planner = Planner::new(world, config, seed)?;
        let (mut drafts, mut plans) = (Vec::new(), Vec::new());
        let mut pace = PACE_RATIO * config.cruise_in(world);
        for attempt in 0..ATTEMPTS {
            let Some(draft) = planner.draw(attempt, pace) else {
                continue;
            };
            if attempt + 1 >= PLAIN_ATTEMPTS {
                // Each draft has its share in what is expected of the next ones.
                pace += 0.1 * (draft.pace_m_per_s - pace);
            }
            let shortfall = planner.shortfall(&draft.contact);
            if shortfall > 0.0 {
                drafts.push((shortfall, draft));
            } else if let Some(plan) = planner.keep_distance(draft) {
                // Slowed where it came too near a wall, it may see less.
                let shortfall = planner.shortfall(&plan.contact);
                if shortfall == 0.0 && plan.contact.visible_share <= config.most_visible_share {
                    return Ok(plan);
                }
                plans.push((shortfall, plan));
            }
        }
        // Stable: of equal ones, the first drawn.
        drafts.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, draft) in drafts {
            if plans.len() >= FINALISTS {
                break;
            }
            plans.extend(
                planner
                    .keep_distance(draft)
                    .map(|plan| (planner.shortfall(&plan.contact), plan)),
            );
        }
        plans.sort_by(|a, b| a.0.total_cmp(&b.0));
        plans.into_iter().next().map(|(_, plan)| plan).ok_or_else(|| {
            InputError::new(format!(
                "no flight of {} s with a clearance of {} m was found in this scene: expected more room or a \
                 smaller flight.clearance_m",
                config.duration_s, planner.clearance_m
            ))
        })
    }

    /// The flight in the wind of `seed`. It is calm under a roof.
    fn in_wind(self, world: &dyn Obstacles, config: &FlightConfig, seed: u64) -> Self {
        let (low, high) = world.bounds();
        let start = self.uav.place_m(0.0);
        let sky = start + Vector3::z() * (high[2] - low[2] + 1.0);
        if world.blocked(start.into(), sky.into()) {
            return self;
        }
        let seconds = self.duration_s as u32;
        let heights_m = (0..=seconds).map(|k| self.uav.place_m(f64::from(k)).z - low[2]);
        let exposure = Exposure {
            height_m: heights_m.sum::<f64>() / f64::from(seconds + 1),
            drag_per_s: config.drag_per_s,
            clearance_m: config.clearance_in(world),
            duration_s: self.duration_s,
        };
        let Some(wind) = Wind::new(&config.wind, exposure, |time_s| self.carried_share(time_s), seed) else {
            return self;
        };
        let uav = self.uav.in_wind(wind);
        Self {
            contact: contact(
                world,
                &uav,
                &self.gmt,
                self.schedule,
                self.duration_s,
                config.start_elevation_deg,
            ),
            uav,
            ..self
        }
    }

    /// A flight that was not planned here, of ready-made parts.
    pub(super) fn from_parts(
        uav: Trajectory,
        gmt: GmtTrack,
        schedule: Schedule,
        rest_s: f64,
        duration_s: f64,
        contact: Contact,
    ) -> Self {
        Self {
            uav,
            gmt,
            schedule,
            rest_s,
            duration_s,
            contact,
            gmt_heading_rad: 0.0,
        }
    }

    /// The same flight turned and moved as a whole: of the UAV, of the wind, and of the GMT with its mast. Gravity and the earth's field
    /// stay.
    #[must_use]
    pub fn placed(self, placement: &Placement) -> Self {
        if placement.is_none() {
            return self;
        }
        Self {
            uav: self.uav.placed(placement),
            gmt: self.gmt.with_stops(|stop| placement.place(stop)),
            gmt_heading_rad: self.gmt_heading_rad + placement.turned_rad(),
            ..self
        }
    }

    /// Trajectory of the UAV.
    pub fn uav(&self) -> &Trajectory {
        &self.uav
    }

    /// Drive of the GMT.
    pub fn gmt(&self) -> &GmtTrack {
        &self.gmt
    }

    /// Heading of the GMT's mast, that of its first face, from east, rad: east unless the flight was turned.
    pub fn gmt_heading_rad(&self) -> f64 {
        self.gmt_heading_rad
    }

    /// When the GMT sounds and moves.
    pub fn schedule(&self) -> Schedule {
        self.schedule
    }

    /// Length of the flight, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Share of its weight that the rotors of the UAV carry, 0..=1: none at rest, and all a second later.
    pub fn carried_share(&self, time_s: f64) -> f64 {
        let u = ((time_s - self.rest_s) / TAKE_OFF_S).clamp(0.0, 1.0);
        u * u * (3.0 - 2.0 * u)
    }

    /// Number of sweeps of the flight.
    pub fn sweeps(&self) -> u32 {
        self.schedule.sweeps_until(self.duration_s)
    }

    /// Line of sight over the flight.
    pub fn contact(&self) -> Contact {
        self.contact
    }
}

#[cfg(test)]
mod tests;
