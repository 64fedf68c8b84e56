//! Drawing of flights: pairs of a drive and a route, each judged by its contact, the distance to obstacles last.

use core::cell::OnceCell;

use nalgebra::Vector3;

use super::FlightPlan;
use crate::flight::contact::{Contact, contact, elevation_deg};
use crate::flight::roadmap::Roadmap;
use crate::flight::route::Route;
use crate::flight::{FlightConfig, GmtTrack, Obstacles, Trajectory, Tube};
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// The first attempts look for sight only, at a pace that is a guess; the others look for reflections too, at the pace of the
/// drafts before them.
pub(super) const PLAIN_ATTEMPTS: u32 = 160;
/// After this many attempts one more goal is drawn at each choice, and the one in better sight is taken.
const ATTEMPTS_A_CHOICE: u32 = 32;
/// The straight lines of a tour keep this much more than the clearance, so that the curve may round its corners.
const TOUR_CLEARANCE_RATIO: f64 = 1.3;

/// Goals drawn at a choice, at most.
const MOST_CHOICES: u32 = 10;

/// Of the places that the UAV may be at, every so-manyth is asked for whether a GMT sees it.
const SAMPLED: usize = 4;

/// What all attempts share.
pub(super) struct Planner<'a> {
    world: &'a dyn Obstacles,
    config: &'a FlightConfig,
    seed: u64,
    pub(super) clearance_m: f64,
    air: Roadmap,
    ground: Roadmap,
    /// See [`Planner::overlooked`], for each point of the ground's roadmap.
    overlooked: OnceCell<Vec<f64>>,
}

/// One attempt, not yet checked for its distance to obstacles.
pub(super) struct Draft {
    route: Route,
    gmt: GmtTrack,
    pub(super) contact: Contact,
    /// Mean speed over ground once it flies, m/s.
    pub(super) pace_m_per_s: f64,
}

impl<'a> Planner<'a> {
    pub(super) fn new(
        world: &'a dyn Obstacles,
        config: &'a FlightConfig,
        seed: u64,
    ) -> Result<Self, InputError> {
        let clearance_m = config.clearance_in(world);
        let tour_clearance_m = clearance_m * TOUR_CLEARANCE_RATIO;
        let (low, high) = world.bounds();
        // Probes lie beyond the clearance: the lowest level keeps them off the ground.
        let (lowest, highest) = (low[2] + 1.5 * tour_clearance_m, high[2] - tour_clearance_m);
        let levels: Vec<f64> = (0..config.levels)
            .map(|k| (f64::from(k) + 0.5) / f64::from(config.levels))
            .map(|share| lowest + (highest - lowest).max(0.0) * share)
            .collect();
        let mut random = Seeded::new(seed, Source::UavRoute);
        let air = Roadmap::draw(world, &Tube::round(tour_clearance_m), &levels, &mut random);
        if air.points().len() < 2 {
            return Err(InputError::new(format!(
                "the UAV finds no room in this scene at a clearance of {clearance_m} m: expected a smaller \
                 flight.clearance_m"
            )));
        }
        let mut random = Seeded::new(seed, Source::GmtRoute);
        let gmt_clearance_m = config.gmt_clearance_in(world);
        let upright = Tube::upright(gmt_clearance_m, config.mast_m);
        let ground = Roadmap::draw(world, &upright, &[low[2] + config.mast_m], &mut random);
        if ground.points().len() < 2 {
            return Err(InputError::new(format!(
                "the GMT finds no room on the ground of this scene at a clearance of {gmt_clearance_m} m and a mast \
                 of {} m: expected a smaller flight.gmt_clearance_m or flight.mast_m",
                config.mast_m
            )));
        }
        Ok(Self {
            world,
            config,
            seed,
            clearance_m,
            air,
            ground,
            overlooked: OnceCell::new(),
        })
    }

    /// A draft that expects to move on at `pace` m/s.
    pub(super) fn draw(&self, attempt: u32, pace: f64) -> Option<Draft> {
        let config = self.config;
        let mut random = Seeded::numbered(self.seed, Source::GmtRoute, attempt);
        let stops = config.schedule.sweeps_until(config.duration_s) / config.schedule.sweeps_per_stop + 2;
        let start = random.index(self.ground.points().len());
        let far_seeing = attempt >= PLAIN_ATTEMPTS;
        let choices = (1 + attempt / ATTEMPTS_A_CHOICE).min(MOST_CHOICES);
        let way = self.ground.tour(
            start,
            config.gmt_step_m * f64::from(stops),
            &mut random,
            if far_seeing { choices } else { 1 },
            |p, _| if far_seeing { self.overlooked(p) } else { 0.0 },
        );
        let gmt = GmtTrack::along(&way, config.gmt_step_m, stops as usize, config.schedule)?;

        let mut random = Seeded::numbered(self.seed, Source::UavRoute, attempt);
        let first = gmt.stops_m()[0];
        let seen = |p: &Vector3<f64>| !self.world.blocked(first.into(), (*p).into());
        let starts: Vec<usize> = (0..self.air.points().len())
            .filter(|&k| seen(&self.air.points()[k]))
            .filter(|&k| !far_seeing || self.is_low(&first, &self.air.points()[k]))
            .collect();
        let start = *starts.get(random.index(starts.len()))?;
        let cruise = config.cruise_in(self.world);
        // Seen from where the GMT will be, roughly.
        let worth = |p: &Vector3<f64>, along_m: f64| {
            let time_s = config.rest_s + along_m / pace;
            let (there, _) = gmt.at(time_s);
            if !self.world.blocked(there.into(), (*p).into()) {
                let early = far_seeing && time_s < config.visible_start_s;
                f64::from(u8::from(!early || self.is_low(&there, p)))
            } else {
                let asked = far_seeing && config.reflected_share > 0.0;
                f64::from(u8::from(asked && self.world.reflected(there.into(), (*p).into())))
            }
        };
        let length_m = cruise * (config.duration_s + 10.0);
        let tour = self.air.tour(start, length_m, &mut random, choices, worth);
        let route = Route::new(tour, &config.limits, || cruise * random.between(0.5, 1.0))?;
        let flown = self.fly(&route, |_, _, _| true)?;
        let contact = self.contact(&flown, &gmt);
        Some(Draft {
            route,
            gmt,
            contact,
            pace_m_per_s: pace_of(&flown, config),
        })
    }

    /// Share of the places that the UAV may be at which a GMT at a point of its roadmap sees.
    fn overlooked(&self, gmt: &Vector3<f64>) -> f64 {
        let shares = self.overlooked.get_or_init(|| {
            let places = || self.air.points().iter().step_by(SAMPLED);
            let seen = |from: &Vector3<f64>| {
                places()
                    .filter(|p| !self.world.blocked((*from).into(), (**p).into()))
                    .count()
            };
            let all = places().count().max(1) as f64;
            self.ground
                .points()
                .iter()
                .map(|p| seen(p) as f64 / all)
                .collect()
        });
        let of = self.ground.points().iter().position(|p| p == gmt);
        of.and_then(|k| shares.get(k)).copied().unwrap_or(0.0)
    }

    /// Whether the UAV is as low above the GMT as wanted for a start.
    fn is_low(&self, gmt: &Vector3<f64>, uav: &Vector3<f64>) -> bool {
        elevation_deg(gmt, uav) <= self.config.start_elevation_deg
    }

    fn contact(&self, uav: &Trajectory, gmt: &GmtTrack) -> Contact {
        let config = self.config;
        contact(
            self.world,
            uav,
            gmt,
            config.schedule,
            config.duration_s,
            config.start_elevation_deg,
        )
    }

    fn fly(&self, route: &Route, clear: impl Fn(&Trajectory, f64, f64) -> bool) -> Option<Trajectory> {
        let config = self.config;
        route.clone().fly(
            &config.limits,
            config.drag_per_s,
            config.rest_s,
            config.duration_s,
            clear,
        )
    }

    /// The plan of a draft, slowed where it came too near an obstacle.
    pub(super) fn keep_distance(&self, draft: Draft) -> Option<FlightPlan> {
        let tube = Tube::round(self.clearance_m);
        let uav = self.fly(&draft.route, |trajectory, from_s, to_s| {
            let place = |time_s: f64| trajectory.position_m().at(time_s)[0];
            let (from, to) = (place(from_s), place(to_s));
            // Standing still: a short line stands for the point.
            let to = if (to - from).norm() < 1e-3 {
                from + Vector3::x() * 1e-3
            } else {
                to
            };
            tube.is_free(self.world, &from, &to)
        })?;
        Some(FlightPlan {
            contact: self.contact(&uav, &draft.gmt),
            uav,
            gmt: draft.gmt,
            schedule: self.config.schedule,
            rest_s: self.config.rest_s,
            duration_s: self.config.duration_s,
            gmt_heading_rad: 0.0,
        })
    }

    /// How far a contact falls short of what is wanted; zero when it does not.
    pub(super) fn shortfall(&self, contact: &Contact) -> f64 {
        let config = self.config;
        let start_s = config.visible_start_s.min(config.duration_s);
        (config.visible_share - contact.visible_share).max(0.0)
            + (contact.longest_outage_s - config.longest_outage_s).max(0.0) / config.duration_s
            + (start_s - contact.low_start_s).max(0.0) / config.duration_s
            + (config.reflected_share - contact.reflected_share).max(0.0) * (1.0 - contact.visible_share)
    }
}

/// Mean speed after the rest, m/s.
fn pace_of(uav: &Trajectory, config: &FlightConfig) -> f64 {
    let flying_s = (config.duration_s - config.rest_s).max(1.0);
    let place = |step: u32| uav.position_m().at(config.rest_s + 0.5 * f64::from(step))[0];
    let steps = (2.0 * flying_s) as u32;
    let way_m: f64 = (0..steps)
        .map(|step| (place(step + 1) - place(step)).norm())
        .sum();
    (way_m / flying_s).max(0.1)
}
