//! Where the movers of a flight go: lines in free space that keep off walls, off both ends and off each other.

use super::{Body, BodyKind, Course, Floor, GivenMover, MoversConfig, Room};
use crate::flight::FlightPlan;
use crate::input::InputError;
use crate::scene::{Placement, Scene, Vec3};
use crate::seeded::{Seeded, Source};

/// Places that are drawn for a mover before it is left out.
const DRAWS: u32 = 60;
/// Directions of which the one with the longest free line is taken: that of a street.
const DIRECTIONS: u32 = 8;
/// Kept from walls on all sides, m.
const MARGIN_M: f64 = 0.2;
/// Kept between two movers, m.
const GAP_M: f64 = 0.3;
/// Kept from the UAV and the GMT's antenna, m.
const CLEARANCE_M: f64 = 1.0;
/// Times at which distances are looked at, s: no two movers come through each other in between.
const STEP_S: f64 = 0.2;
/// Lengths that are tried, longest first, m: of cars that drive, and of people.
const DRIVES_M: [f64; 5] = [60.0, 40.0, 25.0, 15.0, 10.0];
const WALKS_M: [f64; 4] = [20.0, 10.0, 5.0, 2.0];
/// Speed of cars, m/s.
const DRIVE_M_PER_S: [f64; 2] = [4.0, 14.0];
/// Speed of people, m/s.
const WALK_M_PER_S: f64 = 1.4;
/// A car is parked up to so far aside of where it was drawn, by the kerb, m.
const KERBSIDE_M: f64 = 6.0;

const SQUARE_M_PER_HA: f64 = 1e4;

/// What is drawn.
#[derive(Clone, Copy, PartialEq)]
enum Wanted {
    ParkedCar,
    MovingCar,
    Person,
}

impl Wanted {
    fn kind(self) -> BodyKind {
        match self {
            Self::ParkedCar | Self::MovingCar => BodyKind::Car,
            Self::Person => BodyKind::Person,
        }
    }
}

/// The movers of a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Movers {
    all: Vec<(BodyKind, Course)>,
}

impl Movers {
    /// Finds a line for every mover that a configuration gives or asks for. One that finds no room off walls, off the two ends of
    /// the link at every time of the flight, and off the movers before it, is left out.
    ///
    /// # Errors
    /// [`InputError`] naming a given mover that goes through a wall or out of the scene.
    pub fn place(
        scene: &Scene,
        config: &MoversConfig,
        plan: &FlightPlan,
        seed: u64,
    ) -> Result<Self, InputError> {
        let mut movers = Self::default();
        if *config == MoversConfig::default() {
            return Ok(movers);
        }
        let room = Room::of(scene);
        for (place, given) in config.given.iter().enumerate() {
            let mover = movers.given(&room, given).map_err(|message| {
                let key = format!("world.propagation.movers.given[{place}]");
                InputError::at_key(key, message)
            })?;
            movers.all.push(mover);
        }
        let steps = (plan.duration_s() / STEP_S) as u32 + 1;
        let ends = (0..=steps).map(|step| {
            let time_s = STEP_S * f64::from(step);
            (time_s, [plan.gmt().at(time_s).0, plan.uav().place_m(time_s)])
        });
        let ends: Vec<(f64, [Vec3; 2])> = ends.collect();
        let [[west, south], [east, north]] = room.sides_m();
        let area_m2 = (east - west) * (north - south);
        let roofed = room.is_roofed(&plan.gmt().at(0.0).0);
        let wanted = if roofed {
            vec![(Wanted::Person, config.people_per_100_m2 / 100.0)]
        } else {
            vec![
                (Wanted::ParkedCar, config.parked_cars_per_ha / SQUARE_M_PER_HA),
                (Wanted::MovingCar, config.moving_cars_per_ha / SQUARE_M_PER_HA),
                (Wanted::Person, config.people_per_ha / SQUARE_M_PER_HA),
            ]
        };
        for (wanted, per_m2) in wanted {
            let count = libm::round(per_m2 * area_m2) as u32;
            for number in 0..count {
                // A stream for each, so that more of them move none of the others' draws.
                let number = number << 2 | wanted as u32;
                let mut random = Seeded::numbered(seed, Source::Movers, number);
                let course = (0..DRAWS).find_map(|_| {
                    let course = draw(&room, wanted, &mut random)?;
                    movers.keeps_off(wanted.kind(), &course, &ends).then_some(course)
                });
                movers.all.extend(course.map(|course| (wanted.kind(), course)));
            }
        }
        Ok(movers)
    }

    /// The same movers where a scene stands.
    #[must_use]
    pub fn placed(mut self, placement: &Placement) -> Self {
        for (_, course) in &mut self.all {
            course.place(placement);
        }
        self
    }

    /// Whether nothing moves, or stands where the scene has nothing.
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// All of them at a time.
    pub fn at(&self, time_s: f64) -> Vec<Body> {
        let body = |(kind, course): &(BodyKind, Course)| body(*kind, course, time_s);
        self.all.iter().map(body).collect()
    }

    /// # Errors
    /// What is wrong with its line, in words.
    fn given(&self, room: &Room<'_>, given: &GivenMover) -> Result<(BodyKind, Course), String> {
        let [from, to] = [given.from_m, given.to_m].map(|[x, y]| Vec3::new(x, y, room.ground_m()));
        let length_m = (to - from).norm();
        let along = (to - from).try_normalize(1e-9).unwrap_or_else(Vec3::x);
        let course = Course::going(
            from,
            along,
            length_m,
            [given.speed_m_per_s, given.kind.acceleration_m_per_s2()],
            0.0,
        );
        if !room.is_free(&swept(given.kind, &course, 0.0)) {
            let ([x0, y0], [x1, y1]) = (given.from_m, given.to_m);
            return Err(format!(
                "goes through a wall or out of the scene between ({x0}, {y0}) and ({x1}, {y1}), expected a free line for a box \
                 of {:?} m",
                given.kind.size_m()
            ));
        }
        Ok((given.kind, course))
    }

    /// Whether a course keeps off both ends of the link and off all other movers.
    fn keeps_off(&self, kind: BodyKind, course: &Course, ends: &[(f64, [Vec3; 2])]) -> bool {
        let reach_m = |kind: BodyKind, half_m: f64| half_m + kind.size_m()[0];
        let (middle, half_m) = course.middle();
        let near: Vec<_> = self
            .all
            .iter()
            .filter(|(other, theirs)| {
                let (there, theirs_m) = theirs.middle();
                (there - middle).norm() < reach_m(kind, half_m) + reach_m(*other, theirs_m) + GAP_M
            })
            .collect();
        ends.iter().all(|(time_s, ends)| {
            let here = body(kind, course, *time_s);
            ends.iter().all(|end| here.distance_m(end) >= CLEARANCE_M)
                && near
                    .iter()
                    .all(|(other, theirs)| !here.is_close_to(&body(*other, theirs, *time_s), GAP_M))
        })
    }
}

fn body(kind: BodyKind, course: &Course, time_s: f64) -> Body {
    let (foot_m, velocity_m_per_s) = course.at(time_s);
    Body {
        kind,
        foot_m,
        forward: course.along(),
        velocity_m_per_s,
    }
}

/// What a mover passes through, with a margin.
fn swept(kind: BodyKind, course: &Course, margin_m: f64) -> Floor {
    let [length_m, width_m, height_m] = kind.size_m();
    let (middle, half_m) = course.middle();
    Floor {
        middle,
        along: course.along(),
        half_m: [half_m + 0.5 * length_m + margin_m, 0.5 * width_m + margin_m],
        height_m,
    }
}

/// A course that keeps off walls, or none at the place that was drawn.
fn draw(room: &Room<'_>, wanted: Wanted, random: &mut Seeded) -> Option<Course> {
    let [[west, south], [east, north]] = room.sides_m();
    let place = Vec3::new(
        random.between(west, east),
        random.between(south, north),
        room.ground_m(),
    );
    let turn_rad = random.between(0.0, core::f64::consts::PI);
    let share = random.uniform();
    let pace = random.uniform();
    let side = if random.uniform() < 0.5 { 1.0 } else { -1.0 };
    let along = |direction: u32| {
        let angle = turn_rad + core::f64::consts::PI * f64::from(direction) / f64::from(DIRECTIONS);
        let (sin, cos) = libm::sincos(angle);
        Vec3::new(cos, sin, 0.0)
    };
    let kind = wanted.kind();
    let course = |along: Vec3, length_m: f64| {
        let speed_m_per_s = match wanted {
            Wanted::Person => WALK_M_PER_S,
            _ => DRIVE_M_PER_S[0] + pace * (DRIVE_M_PER_S[1] - DRIVE_M_PER_S[0]),
        };
        let start = place - along * (0.5 * length_m);
        let speeds = [speed_m_per_s, kind.acceleration_m_per_s2()];
        Course::going(start, along, length_m, speeds, share)
    };
    let free = |course: &Course| room.is_free(&swept(kind, course, MARGIN_M));
    let longest = |lengths_m: &[f64], directions: u32| {
        lengths_m.iter().find_map(|&length_m| {
            let courses = (0..directions).map(|direction| course(along(direction), length_m));
            courses.into_iter().find(free)
        })
    };
    match wanted {
        Wanted::Person => longest(&WALKS_M, 1),
        Wanted::MovingCar => longest(&DRIVES_M, DIRECTIONS),
        Wanted::ParkedCar => {
            let along = longest(&DRIVES_M, DIRECTIONS)?.along();
            let aside = Vec3::z().cross(&along) * side;
            let parked = (0..=(2.0 * KERBSIDE_M) as u32)
                .map(|step| Course::standing(place + aside * (0.5 * f64::from(step)), along))
                .take_while(free);
            parked.last()
        }
    }
}
