//! What is claimed of a measured path: the one owner of R.
//!
//! The estimator's covariance is that of thermal noise and of what the arrays' errors scatter from direction to direction. What stays of
//! calibration, and neighbours, add theirs here, and nowhere else.

use heapless::Vec;
use nalgebra::Vector3;

use super::received::ReceivedPath;
use crate::geometry::Matrix3;
use crate::signal::DelayPeriod;

/// How far measured paths are off beyond what the estimator claims, and when their departures mean anything. Figures: 8716 paths of flights
/// against the truth, in the world `budget`; a path with another one near is worse.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathErrors {
    /// Standard deviation of the delay beside the estimator's own, m: alone, and with a neighbour.
    /// Measured: medians of the error: 11 and 21 mm; 90 %: 25 and 69 mm.
    pub delay_m: [f32; 2],
    /// The same of the arrival along any tangent, rad.
    /// Measured: medians of the error: 1.9 and 4.5 mrad; 90 %: 3.8 and 18 mrad.
    pub arrival_rad: [f32; 2],
    /// Share of departures that mean nothing: alone, with a neighbour, and where the path leaves beside the beams.
    /// Measured: beyond 3.7 standard deviations: 6 and 17 %; upwards 26 %, downwards 96 %.
    pub departure_outliers: [f32; 3],
    /// Difference of lengths within which paths are neighbours, m.
    /// Derived: one and a half times what the band resolves (1.22 m).
    pub neighbour_m: f32,
    /// Angle within which they are, rad.
    /// Derived: what the arrays resolve (16 degrees).
    pub neighbour_rad: f32,
    /// A path that is weaker by more is no neighbour, and one that is stronger by more may have an echo of the estimator within
    /// [`Self::neighbour_m`], dB.
    /// Measured: echoes were met 15 to 20 dB down.
    pub comparable_db: f32,
}

impl Default for PathErrors {
    fn default() -> Self {
        Self {
            delay_m: [0.020, 0.036],
            arrival_rad: [0.94e-3, 3.1e-3],
            departure_outliers: [0.03, 0.25, 0.7],
            neighbour_m: 1.5,
            neighbour_rad: 0.28,
            comparable_db: 12.0,
        }
    }
}

/// What stands beside a path in its sweep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Neighbourhood {
    /// Another path is so near that both are estimated worse.
    pub has_neighbour: bool,
    /// It may be an echo of the estimator: a much stronger path is near in delay.
    pub may_be_artefact: bool,
}

/// What stands beside the path of this index, of a sweep whose delays have this period.
#[must_use]
pub fn neighbourhood<const K: usize>(
    paths: &Vec<ReceivedPath, K>,
    index: usize,
    period: &DelayPeriod,
    errors: &PathErrors,
) -> Neighbourhood {
    let mut found = Neighbourhood::default();
    let Some(path) = paths.get(index) else {
        return found;
    };
    for (_, other) in paths.iter().enumerate().filter(|(other, _)| *other != index) {
        if path.apart_m(other, period) > f64::from(errors.neighbour_m) {
            continue;
        }
        let stronger_db = other.power_db - path.power_db;
        found.has_neighbour |= stronger_db > -errors.comparable_db
            && path.arrival.angle_to_rad(&other.arrival) < errors.neighbour_rad;
        found.may_be_artefact |= stronger_db > errors.comparable_db;
    }
    found
}

/// R of delay (m) and arrival along both tangents (rad) of a path with these neighbours, in the axes of [`ReceivedPath::covariance`].
#[must_use]
pub fn covariance(path: &ReceivedPath, neighbourhood: Neighbourhood, errors: &PathErrors) -> Matrix3<f64> {
    let [alone, crowded] = [0, 1].map(|class: usize| {
        let square = |of: &[f32; 2]| of.get(class).map_or(0.0, |x| f64::from(x * x));
        let angle = square(&errors.arrival_rad);
        Vector3::new(square(&errors.delay_m), angle, angle)
    });
    let added = if neighbourhood.has_neighbour {
        crowded
    } else {
        alone
    };
    path.covariance.map(f64::from) + Matrix3::from_diagonal(&added)
}

/// Share of departures that mean nothing, for a path that leaves within the beams or beside them.
#[must_use]
pub fn departure_outliers(neighbourhood: Neighbourhood, in_beams: bool, errors: &PathErrors) -> f64 {
    let [alone, crowded, beside] = errors.departure_outliers;
    f64::from(match (in_beams, neighbourhood.has_neighbour) {
        (false, _) => beside,
        (true, true) => crowded,
        (true, false) => alone,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Direction;
    use crate::signal::Waveform;

    fn path(c_tau_m: f64, azimuth_rad: f32, power_db: f32) -> ReceivedPath {
        ReceivedPath {
            c_tau_m,
            arrival: Direction::from_zenith_azimuth(1.4, azimuth_rad).expect("angles"),
            departure: None,
            covariance: Matrix3::identity() * 1e-8,
            power_db,
            probabilities: None,
        }
    }

    fn of(other: ReceivedPath) -> Neighbourhood {
        let paths: Vec<_, 2> = Vec::from_slice(&[path(50.0, 0.3, -10.0), other]).expect("two");
        neighbourhood(
            &paths,
            0,
            &Waveform::default().delay_period(),
            &PathErrors::default(),
        )
    }

    #[test]
    fn neighbours_are_near_in_delay_and_angle_and_not_much_weaker() {
        let near = of(path(51.4, 0.5, -21.0));
        assert!(near.has_neighbour && !near.may_be_artefact);
        assert!(
            of(path(
                50.0 + Waveform::default().delay_period().length_m(),
                0.3,
                -10.0
            ))
            .has_neighbour
        );
        for other in [
            path(51.6, 0.3, -10.0),
            path(50.2, 0.7, -10.0),
            path(50.2, 0.3, -23.0),
        ] {
            assert_eq!(of(other), Neighbourhood::default());
        }
    }

    #[test]
    fn an_echo_comes_from_any_direction() {
        let echo = of(path(49.0, 2.9, 8.0));
        assert!(echo.may_be_artefact && !echo.has_neighbour);
        assert!(!of(path(49.0, 2.9, 1.0)).may_be_artefact);
    }

    #[test]
    fn errors_are_those_of_noise_and_of_the_class() {
        let mut path = path(50.0, 0.3, 0.0);
        path.covariance = Matrix3::from_diagonal(&Vector3::new(9e-4, 4e-6, 4e-6));
        for (has_neighbour, delay, arrival) in [(false, 0.02, 0.94e-3), (true, 0.036, 3.1e-3)] {
            let around = Neighbourhood {
                has_neighbour,
                ..Neighbourhood::default()
            };
            let of = covariance(&path, around, &PathErrors::default());
            assert!((of[(0, 0)] - 9e-4 - delay * delay).abs() < 1e-9);
            assert!((of[(2, 2)] - 4e-6 - arrival * arrival).abs() < 1e-11);
        }
    }

    #[test]
    fn departures_mean_least_beside_the_beams() {
        let errors = PathErrors::default();
        let [outside, beside, alone] =
            [(false, true), (true, true), (true, false)].map(|(in_beams, has_neighbour)| {
                let around = Neighbourhood {
                    has_neighbour,
                    ..Neighbourhood::default()
                };
                departure_outliers(around, in_beams, &errors)
            });
        assert!(outside > beside && beside > alone);
    }
}
