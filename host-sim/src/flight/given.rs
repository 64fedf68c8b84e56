//! A flight along places that somebody gives, one for each sweep, as another program's ray tracer has them.

use nalgebra::{SVector, Vector1, Vector3};

use super::contact::Sight;
use super::{Contact, FlightPlan, GmtTrack, Schedule, Spline, Trajectory};
use crate::input::InputError;

/// Before a given route begins, the UAV hovers for so long: a curve through places half a second apart swings by centimetres before an
/// abrupt start, by .43 less from sweep to sweep, and shall not do so while biases are found at rest.
const HOVER_S: f64 = 3.0;
/// Greatest acceleration of a given route, m/s^2: two thirds of free fall, where the attitude of a quadrotor is not defined.
const MOST_ACCELERATION_M_PER_S2: f64 = 6.5;
/// Greatest speed of a given route, m/s.
const MOST_SPEED_M_PER_S: f64 = 30.0;
/// How finely speed and acceleration are looked at: so many instants from place to place.
const LOOKS: usize = 10;

/// Where both ends are in a sweep, and how they hear each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenPlace {
    /// Array centre of the UAV, m, world frame.
    pub uav_m: Vector3<f64>,
    /// Heading of the UAV, of body x about the vertical, from east, rad.
    pub heading_rad: f64,
    /// Antenna of the GMT, m, world frame.
    pub gmt_m: Vector3<f64>,
    /// Whether there is a line of sight.
    pub visible: bool,
    /// Whether there is a path of one reflection.
    pub reflected: bool,
}

/// A flight along given places, and how many sweeps the UAV waits at the first of them.
#[derive(Clone, Debug)]
pub struct GivenFlight {
    /// The flight.
    pub plan: FlightPlan,
    /// Sweeps before the one at the second place that are heard at the first: the UAV rests, then hovers there.
    pub waited_sweeps: usize,
}

impl GivenFlight {
    /// The flight through `places`, one every `sweep_period_s`: at rest at the first for `rest_s`, hovering there, and then along a
    /// curve through all of them, tilted as a quadrotor of this rotor drag has to.
    ///
    /// # Errors
    /// [`InputError`] that says what is wrong with which place, from 1.
    pub fn through(
        places: &[GivenPlace],
        sweep_period_s: f64,
        rest_s: f64,
        drag_per_s: f64,
    ) -> Result<Self, InputError> {
        let [first, _, ..] = places else {
            return Err(InputError::new(format!(
                "{} places make no route: expected two or more",
                places.len()
            )));
        };
        let waited_sweeps = ((rest_s + HOVER_S) / sweep_period_s).ceil() as usize;
        // The first sweep is a period after the beginning of the flight.
        let all: Vec<GivenPlace> = core::iter::repeat_n(first, 1 + waited_sweeps)
            .chain(places)
            .copied()
            .collect();
        let position_m = curve(
            &all.iter().map(|place| place.uav_m).collect::<Vec<_>>(),
            sweep_period_s,
        )?;
        let mut heading_rad = first.heading_rad;
        let headings: Vec<_> = all
            .iter()
            .map(|place| {
                heading_rad += shortest_turn_rad(place.heading_rad - heading_rad);
                Vector1::new(heading_rad)
            })
            .collect();
        let heading = curve(&headings, sweep_period_s)?;
        can_be_flown(&position_m, 1 + waited_sweeps)?;
        let schedule = Schedule {
            sweep_period_s,
            sweeps_per_stop: 1,
        };
        let stops_m = all.iter().skip(1).map(|place| place.gmt_m).collect();
        let gmt = GmtTrack::new(stops_m, schedule).ok_or_else(|| InputError::new("no place of the GMT"))?;
        let uav = Trajectory::new(position_m, heading, drag_per_s);
        let duration_s = uav.duration_s();
        let sights = all.iter().skip(1).map(|place| match place.visible {
            true => Sight::Line { high: false },
            false => Sight::None {
                reflected: place.reflected,
            },
        });
        let contact = Contact::of(sights, schedule, duration_s);
        Ok(Self {
            plan: FlightPlan::from_parts(uav, gmt, schedule, rest_s, duration_s, contact),
            waited_sweeps,
        })
    }
}

fn curve<const D: usize>(values: &[SVector<f64, D>], sweep_period_s: f64) -> Result<Spline<D>, InputError> {
    Spline::through(values, sweep_period_s)
        .ok_or_else(|| InputError::new(format!("sweeps every {sweep_period_s} s make no route")))
}

/// An angle from -pi to pi.
fn shortest_turn_rad(angle_rad: f64) -> f64 {
    let turns = angle_rad / core::f64::consts::TAU;
    (turns - (turns + 0.5).floor()) * core::f64::consts::TAU
}

/// Looks at speed and acceleration everywhere; `before` knots lie before the first place.
fn can_be_flown(position_m: &Spline<3>, before: usize) -> Result<(), InputError> {
    let knots = (position_m.duration_s() / position_m.knot_s() + 0.5) as usize;
    for look in 0..=LOOKS * knots {
        let [_, velocity, acceleration, ..] = position_m.at(look as f64 / LOOKS as f64 * position_m.knot_s());
        let wrong = [
            ("speed", velocity.norm(), "m/s", MOST_SPEED_M_PER_S),
            (
                "acceleration",
                acceleration.norm(),
                "m/s^2",
                MOST_ACCELERATION_M_PER_S2,
            ),
        ]
        .into_iter()
        .find(|(_, size, _, most)| size.is_nan() || size > most);
        if let Some((what, size, unit, most)) = wrong {
            let place = (look / LOOKS).saturating_sub(before) + 1;
            return Err(InputError::new(format!(
                "place {place}: the route from there on asks for {size:.1} {unit} of {what}, expected up to {most}: \
                 begin and end slowly, give more places, or more time between them"
            )));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(x: f64) -> GivenPlace {
        GivenPlace {
            uav_m: Vector3::new(x, 2.0, 5.0),
            heading_rad: 3.0 + 0.1 * x,
            gmt_m: Vector3::new(0.0, 0.1 * x, 1.5),
            visible: x < 4.0,
            reflected: true,
        }
    }

    /// Gently from 0 m on.
    fn route() -> Vec<GivenPlace> {
        (0..30)
            .map(|k| place(0.03 * f64::from(k) * f64::from(k)))
            .collect()
    }

    #[test]
    fn the_flight_rests_and_is_at_each_place_in_its_sweep() {
        let flight = GivenFlight::through(&route(), 0.5, 3.0, 0.15).expect("a route");
        assert_eq!(flight.waited_sweeps, 12);
        let (plan, schedule) = (&flight.plan, flight.plan.schedule());
        assert_eq!(plan.sweeps(), 12 + 30);
        for (k, wanted) in route().iter().enumerate() {
            let time_s = schedule.sweep_time_s((flight.waited_sweeps + k) as u32);
            let motion = plan.uav().at(time_s);
            assert!((motion.position_m - wanted.uav_m).norm() < 1e-9, "place {k}");
            assert!(
                (plan.gmt().at(time_s).0 - wanted.gmt_m).norm() < 1e-12,
                "place {k}"
            );
            let forward = motion.attitude * Vector3::x();
            let off = shortest_turn_rad(libm::atan2(forward.y, forward.x) - wanted.heading_rad);
            assert!(off.abs() < 0.02, "place {k}: {off}");
        }
        for tenth in 0..30 {
            let motion = plan.uav().at(0.1 * f64::from(tenth));
            assert!((motion.position_m - place(0.0).uav_m).norm() < 1e-4);
            assert!(motion.acceleration_m_per_s2.norm() < 1e-2 && motion.rate_rad_per_s.norm() < 1e-2);
        }
        let contact = plan.contact();
        assert!((contact.visible_share - 24.0 / 42.0).abs() < 1e-9, "{contact:?}");
    }

    #[test]
    fn what_cannot_be_flown_names_its_place() {
        let refused = |places: &[GivenPlace]| {
            GivenFlight::through(places, 0.5, 3.0, 0.15)
                .expect_err("no flight")
                .to_string()
        };
        assert!(refused(&[place(0.0)]).contains("1 places make no route"));
        let mut jump = route();
        jump[17].uav_m.z += 3.0;
        let error = refused(&jump);
        assert!(
            error.contains("place 1") && error.contains("m/s^2 of acceleration, expected up to 6.5"),
            "{error}"
        );
        let mut nowhere = route();
        nowhere[3].uav_m.x = f64::NAN;
        assert!(refused(&nowhere).contains("expected up to"));
    }
}
