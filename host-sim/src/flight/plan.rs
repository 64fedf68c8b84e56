//! Planning of a whole flight: the drive of the GMT, and a route of the UAV that mostly stays in its sight.
//!
//! Many pairs of drives and routes are drawn, the later ones more and more in the GMT's sight; the first that has the
//! wanted contact and keeps its distance is taken. A seed picks a flight, not a fate: which share of sweeps has line of
//! sight is planned for, as an operator would, and reported.

use nalgebra::Vector3;

use super::roadmap::Roadmap;
use super::route::Route;
use super::{FlightConfig, GmtTrack, Obstacles, Schedule, Trajectory, Tube};
use crate::input::InputError;
use crate::seeded::{Seeded, Source};

/// Pairs of drive and route that are drawn before the best so far is taken.
const ATTEMPTS: u32 = 160;
/// After this many attempts one more goal is drawn at each choice, and the one in better sight is taken.
const ATTEMPTS_A_CHOICE: u32 = 32;
/// The straight lines of a tour keep this much more than the clearance, so that the curve may round its corners.
const TOUR_CLEARANCE_RATIO: f64 = 1.3;

/// Line of sight between GMT and UAV over the sweeps of a flight.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact {
    /// Share of sweeps with line of sight, 0..=1.
    pub visible_share: f64,
    /// Longest time without, s.
    pub longest_outage_s: f64,
    /// Line of sight in all sweeps up to this time, s.
    pub visible_start_s: f64,
}

/// A planned flight.
#[derive(Clone, Debug)]
pub struct FlightPlan {
    uav: Trajectory,
    gmt: GmtTrack,
    schedule: Schedule,
    duration_s: f64,
    contact: Contact,
}

impl FlightPlan {
    /// Plans the flight of `seed` through a world.
    ///
    /// # Errors
    /// [`InputError`] naming a figure of the configuration that is out of range, or saying that the UAV or the GMT
    /// finds no room in the world.
    pub fn plan(world: &dyn Obstacles, config: &FlightConfig, seed: u64) -> Result<Self, InputError> {
        config.check()?;
        let planner = Planner::new(world, config, seed)?;
        let mut candidates = Vec::new();
        for attempt in 0..ATTEMPTS {
            let Some(draft) = planner.draw(attempt) else {
                continue;
            };
            let shortfall = planner.shortfall(&draft.contact);
            if shortfall == 0.0 {
                if let Some(plan) = planner.keep_distance(draft) {
                    return Ok(plan);
                }
            } else {
                candidates.push((shortfall, draft));
            }
        }
        // Stable: of equal ones, the first drawn.
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        candidates.into_iter().find_map(|(_, draft)| planner.keep_distance(draft)).ok_or_else(|| {
            InputError::new(format!(
                "no flight of {} s with a clearance of {} m was found in this scene: expected more room or a \
                 smaller flight.clearance_m",
                config.duration_s, planner.clearance_m
            ))
        })
    }

    /// A flight from ready-made parts, such as a recorded route. Contact is evaluated in `world`.
    pub fn from_parts(
        world: &dyn Obstacles,
        uav: Trajectory,
        gmt: GmtTrack,
        schedule: Schedule,
        duration_s: f64,
    ) -> Self {
        let contact = contact(world, &uav, &gmt, schedule, duration_s);
        Self {
            uav,
            gmt,
            schedule,
            duration_s,
            contact,
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

    /// When the GMT sounds and moves.
    pub fn schedule(&self) -> Schedule {
        self.schedule
    }

    /// Length of the flight, s.
    pub fn duration_s(&self) -> f64 {
        self.duration_s
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

/// What all attempts share.
struct Planner<'a> {
    world: &'a dyn Obstacles,
    config: &'a FlightConfig,
    seed: u64,
    clearance_m: f64,
    air: Roadmap,
    ground: Roadmap,
}

/// One attempt, not yet checked for its distance to obstacles.
struct Draft {
    route: Route,
    gmt: GmtTrack,
    contact: Contact,
}

impl<'a> Planner<'a> {
    fn new(world: &'a dyn Obstacles, config: &'a FlightConfig, seed: u64) -> Result<Self, InputError> {
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
        })
    }

    fn draw(&self, attempt: u32) -> Option<Draft> {
        let config = self.config;
        let mut random = Seeded::numbered(self.seed, Source::GmtRoute, attempt);
        let stops = config.schedule.sweeps_until(config.duration_s) / config.schedule.sweeps_per_stop + 2;
        let start = random.index(self.ground.points().len());
        let way = self.ground.tour(
            start,
            config.gmt_step_m * f64::from(stops),
            &mut random,
            1,
            |_, _| 0.0,
        );
        let gmt = GmtTrack::along(&way, config.gmt_step_m, stops as usize, config.schedule)?;

        let mut random = Seeded::numbered(self.seed, Source::UavRoute, attempt);
        let seen = |p: &Vector3<f64>| !self.world.blocked(gmt.stops_m()[0].into(), (*p).into());
        let starts: Vec<usize> = (0..self.air.points().len())
            .filter(|&k| seen(&self.air.points()[k]))
            .collect();
        let start = *starts.get(random.index(starts.len()))?;
        let cruise = config.cruise_in(self.world);
        // Seen from where the GMT will be, roughly: lines are flown at 0.75 of the cruise speed on average.
        let pace = 0.75 * cruise;
        let in_sight = |p: &Vector3<f64>, along_m: f64| {
            let (there, _) = gmt.at(config.rest_s + along_m / pace);
            f64::from(u8::from(!self.world.blocked(there.into(), (*p).into())))
        };
        let length_m = cruise * (config.duration_s + 10.0);
        let choices = 1 + attempt / ATTEMPTS_A_CHOICE;
        let tour = self.air.tour(start, length_m, &mut random, choices, in_sight);
        let route = Route::new(tour, &config.limits, || cruise * random.between(0.5, 1.0))?;
        let draft = self.fly(&route, |_, _, _| true)?;
        let contact = contact(self.world, &draft, &gmt, config.schedule, config.duration_s);
        Some(Draft { route, gmt, contact })
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
    fn keep_distance(&self, draft: Draft) -> Option<FlightPlan> {
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
        let config = self.config;
        Some(FlightPlan::from_parts(
            self.world,
            uav,
            draft.gmt,
            config.schedule,
            config.duration_s,
        ))
    }

    /// How far a contact falls short of what is wanted; zero when it does not.
    fn shortfall(&self, contact: &Contact) -> f64 {
        let config = self.config;
        let start_s = config.visible_start_s.min(config.duration_s);
        (config.visible_share - contact.visible_share).max(0.0)
            + (contact.longest_outage_s - config.longest_outage_s).max(0.0) / config.duration_s
            + (start_s - contact.visible_start_s).max(0.0) / config.duration_s
    }
}

fn contact(
    world: &dyn Obstacles,
    uav: &Trajectory,
    gmt: &GmtTrack,
    schedule: Schedule,
    duration_s: f64,
) -> Contact {
    let sweeps = schedule.sweeps_until(duration_s);
    let (mut visible, mut outage, mut longest, mut start) = (0u32, 0u32, 0u32, None);
    for sweep in 0..sweeps {
        let time_s = schedule.sweep_time_s(sweep);
        let (there, here) = (gmt.at(time_s).0, uav.position_m().at(time_s)[0]);
        if world.blocked(there.into(), here.into()) {
            outage += 1;
            longest = longest.max(outage);
            start.get_or_insert(time_s - schedule.sweep_period_s);
        } else {
            visible += 1;
            outage = 0;
        }
    }
    Contact {
        visible_share: f64::from(visible) / f64::from(sweeps.max(1)),
        longest_outage_s: f64::from(longest) * schedule.sweep_period_s,
        visible_start_s: start.unwrap_or(duration_s),
    }
}

#[cfg(test)]
mod tests {
    use super::super::obstacles::tests::Boxes;
    use super::*;

    fn short() -> FlightConfig {
        FlightConfig {
            duration_s: 60.0,
            ..FlightConfig::default()
        }
    }

    #[test]
    fn flights_through_a_town_keep_their_distance_and_their_contact() {
        let town = Boxes::town();
        for seed in 0..6 {
            let plan = FlightPlan::plan(&town, &short(), seed).expect("room");
            let mut heights = (f64::INFINITY, 0.0f64);
            let mut way_m = 0.0;
            for k in 0..6000 {
                let p = plan.uav().at(f64::from(k) * 0.01).position_m;
                assert!(
                    town.distance_m(&p) >= 1.5,
                    "seed {seed}: {} m",
                    town.distance_m(&p)
                );
                heights = (heights.0.min(p.z), heights.1.max(p.z));
                way_m += plan.uav().at(f64::from(k) * 0.01).velocity_m_per_s.norm() * 0.01;
                let (gmt, _) = plan.gmt().at(f64::from(k) * 0.01);
                let (foot, mast) = (Vector3::new(gmt.x, gmt.y, 0.3), gmt);
                assert!((gmt.z - 1.5).abs() < 1e-12);
                let walls = Boxes {
                    solids: town.solids.clone(),
                    bounds: town.bounds,
                };
                let clear = walls.solids.iter().all(|(low, high)| {
                    [foot, mast].iter().all(|p| {
                        let gap = |i: usize| (low[i] - p[i]).max(p[i] - high[i]).max(0.0);
                        libm::hypot(gap(0), gap(1)) > 0.99
                    })
                });
                assert!(clear, "seed {seed}: the GMT touches a wall at {gmt:?}");
            }
            let contact = plan.contact();
            assert!(
                heights.1 - heights.0 > 3.0 && way_m > 80.0,
                "seed {seed}: {heights:?}, {way_m} m"
            );
            assert!(contact.visible_share >= 0.5, "seed {seed}: {contact:?}");
            assert!(contact.longest_outage_s <= 20.0, "seed {seed}: {contact:?}");
        }
    }

    #[test]
    fn seeds_decide_everything() {
        let town = Boxes::town();
        let place = |seed| {
            FlightPlan::plan(&town, &short(), seed)
                .expect("room")
                .uav()
                .at(40.0)
                .position_m
        };
        assert_eq!(place(3), place(3));
        assert_ne!(place(3), place(4));
    }

    #[test]
    fn a_world_without_room_is_refused_in_words() {
        let cell = Boxes {
            solids: Vec::new(),
            bounds: ([0.0; 3], [4.0, 4.0, 2.0]),
        };
        let solid = Boxes {
            solids: vec![([-1.0; 3], [11.0; 3])],
            bounds: ([0.0; 3], [10.0; 3]),
        };
        let error = FlightPlan::plan(&solid, &short(), 1)
            .expect_err("no room")
            .to_string();
        assert!(error.contains("UAV finds no room"), "{error}");
        let config = FlightConfig {
            mast_m: 3.0,
            ..short()
        };
        let wall = Boxes {
            solids: vec![([-1.0, -1.0, 2.5], [5.0, 5.0, 9.0])],
            ..cell
        };
        let error = FlightPlan::plan(&wall, &config, 1)
            .expect_err("no room")
            .to_string();
        assert!(error.contains("GMT finds no room"), "{error}");
    }
}
