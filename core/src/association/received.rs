//! A path as the association takes it, and how far it may be off: the one place that says so.

use heapless::Vec;
use nalgebra::{SMatrix, Vector3};

use super::chain::{ROWS, Tangents};
use super::config::PathErrors;
use super::pose::PoseEstimate;
use crate::geometry::{Body, Direction, Matrix3, World};
use crate::localization::filter::{range_of_delay_m, wrap_delay_m};
use crate::lscn::Probabilities;
use crate::ltd::EstimatedPath;
use crate::path::{Departure, Path};

/// Departures are known no better than this, rad: keeps densities finite.
const LEAST_DEPARTURE_RAD: f64 = 1e-4;

/// A path of a sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReceivedPath {
    /// Speed of light times delay with the clock's offset in it, m; a whole number of delay periods does not matter.
    pub c_tau_m: f64,
    /// Angle of arrival, without the arrays' estimated calibration errors.
    pub arrival: Direction<Body>,
    /// Angle of departure in world axes, when it was measured. Its standard deviation is the estimator's own.
    pub departure: Option<Departure>,
    /// The estimator's covariance of (delay, angle along e1, angle along e2), the tangents of the arrival in body axes: noise alone.
    pub covariance: Matrix3<f32>,
    /// Power, dB of any reference that the paths of a sweep share.
    pub power_db: f32,
    /// What the network says of it; `None` when nothing was said.
    pub probabilities: Option<Probabilities>,
}

impl ReceivedPath {
    /// Of an estimated path. `corrected`: its arrival without the arrays' estimated errors; `departure`: its departure in world axes, as the mast
    /// stands.
    #[must_use]
    pub fn of(
        estimated: &EstimatedPath,
        corrected: Direction<Body>,
        departure: Option<Departure>,
        probabilities: Option<Probabilities>,
    ) -> Self {
        Self {
            c_tau_m: f64::from(estimated.path.c_tau_m),
            arrival: corrected,
            departure,
            covariance: estimated.path.covariance,
            power_db: 10.0 * libm::log10f(estimated.energy.max(f32::MIN_POSITIVE)),
            probabilities,
        }
    }

    /// Difference of two delays, m.
    fn apart_m(&self, other: &Self) -> f64 {
        wrap_delay_m(self.c_tau_m - other.c_tau_m).abs()
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

/// What stands beside the path of this index.
#[must_use]
pub fn neighbourhood<const K: usize>(
    paths: &Vec<ReceivedPath, K>,
    index: usize,
    errors: &PathErrors,
) -> Neighbourhood {
    let mut found = Neighbourhood::default();
    let Some(path) = paths.get(index) else {
        return found;
    };
    for (_, other) in paths.iter().enumerate().filter(|(other, _)| *other != index) {
        if path.apart_m(other) > f64::from(errors.neighbour_m) {
            continue;
        }
        let stronger_db = other.power_db - path.power_db;
        found.has_neighbour |= stronger_db > -errors.comparable_db
            && path.arrival.angle_to_rad(&other.arrival) < errors.neighbour_rad;
        found.may_be_artefact |= stronger_db > errors.comparable_db;
    }
    found
}

/// A path in world axes with the pose's clock taken out, and with all its errors but the pose's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Delay less the clock's offset, m, of unknown period.
    pub length_m: f64,
    /// The path in world axes, its length within one period, its covariance with the pose's attitude and clock in it.
    pub path: Path<World, f64>,
    /// Arrival and tangents of both ends.
    pub tangents: Tangents,
    /// Departure, when it was measured.
    pub departure: Option<Vector3<f64>>,
    /// R: covariance of (delay, arrival along both tangents, departure along both). One, where there is no departure.
    pub noise: SMatrix<f64, ROWS, ROWS>,
    /// What stands beside it.
    pub neighbourhood: Neighbourhood,
}

impl Measurement {
    /// Of a path with these neighbours.
    #[must_use]
    pub fn of(
        path: &ReceivedPath,
        neighbourhood: Neighbourhood,
        pose: &PoseEstimate,
        errors: &PathErrors,
    ) -> Self {
        let arrival = path.arrival.to_f64();
        let (e1, e2) = arrival.tangents();
        let mut noise = SMatrix::<f64, ROWS, ROWS>::identity();
        noise
            .fixed_view_mut::<3, 3>(0, 0)
            .copy_from(&path.covariance.map(f64::from));
        let [alone, crowded] = [0, 1].map(|class: usize| {
            let square = |of: &[f32; 2]| of.get(class).map_or(0.0, |x| f64::from(x * x));
            let angle = square(&errors.arrival_rad);
            [square(&errors.delay_m), angle, angle]
        });
        let added = if neighbourhood.has_neighbour {
            crowded
        } else {
            alone
        };
        for (row, added) in added.into_iter().enumerate() {
            if let Some(variance) = noise.get_mut((row, row)) {
                *variance += added;
            }
        }
        let mut departure_tangents = [Vector3::zeros(); 2];
        if let Some(departure) = &path.departure {
            let (a1, a2) = departure.direction.to_f64().tangents();
            departure_tangents = [a1, a2];
            let sigma = f64::from(departure.sigma_rad).max(LEAST_DEPARTURE_RAD);
            for row in 3..ROWS {
                if let Some(variance) = noise.get_mut((row, row)) {
                    *variance = sigma * sigma;
                }
            }
        }
        let length_m = path.c_tau_m - pose.clock_offset_m;
        let mut world = Path {
            c_tau_m: range_of_delay_m(length_m),
            aoa: arrival,
            aod: None,
            covariance: noise.fixed_view::<3, 3>(0, 0).into_owned(),
        }
        .to_world(
            &pose.attitude,
            &pose.covariance.fixed_view::<3, 3>(3, 3).into_owned(),
        );
        world.covariance.m11 += pose.clock_variance_m2();
        Self {
            length_m,
            path: world,
            tangents: Tangents {
                arrival: *world.aoa.vector(),
                arrival_tangents: [e1, e2].map(|e| pose.attitude.apply_vector(&e)),
                departure_tangents,
            },
            departure: path.departure.map(|d| *d.direction.to_f64().vector()),
            noise,
            neighbourhood,
        }
    }

    /// Innovation against a length, an arrival and a departure; without a measured departure its rows are zero.
    #[must_use]
    pub fn innovation(
        &self,
        range_m: f64,
        arrival: &Vector3<f64>,
        departure: &Vector3<f64>,
    ) -> SMatrix<f64, ROWS, 1> {
        let [e1, e2] = self.tangents.arrival_tangents;
        let [a1, a2] = self.tangents.departure_tangents;
        let off = self
            .departure
            .map_or_else(Vector3::zeros, |measured| measured - departure);
        SMatrix::from([[
            wrap_delay_m(self.length_m - range_m),
            -e1.dot(arrival),
            -e2.dot(arrival),
            a1.dot(&off),
            a2.dot(&off),
        ]])
    }
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

/// Whether the beams reach a direction of the transmitter's frame, by its vertical component. The codebook looks up 0, 12 and 25 degrees, and
/// its eight rows of elements fall to half the power 7 degrees beside: zenith angles of 58 to 97 degrees.
#[must_use]
pub fn is_in_beams(upwards: f64) -> bool {
    /// `sin 7` and `sin 32` degrees.
    const LOWEST: f64 = -0.121_869;
    const HIGHEST: f64 = 0.529_919;
    (LOWEST..=HIGHEST).contains(&upwards)
}

#[cfg(test)]
mod tests {
    use super::*;

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
        neighbourhood(&paths, 0, &PathErrors::default())
    }

    #[test]
    fn neighbours_are_near_in_delay_and_angle_and_not_much_weaker() {
        let near = of(path(51.4, 0.5, -21.0));
        assert!(near.has_neighbour && !near.may_be_artefact);
        assert!(
            of(path(
                50.0 + crate::localization::filter::DELAY_PERIOD_M,
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
        let errors = PathErrors::default();
        let pose = PoseEstimate {
            position_m: Vector3::zeros(),
            attitude: crate::geometry::Rotation::from_yaw_pitch_roll(0.4, 0.1, -0.1).expect("finite"),
            clock_offset_m: 7.0,
            covariance: SMatrix::zeros(),
        };
        let mut path = path(50.0, 0.3, 0.0);
        path.covariance = Matrix3::from_diagonal(&Vector3::new(9e-4, 4e-6, 4e-6));
        let crowded = Neighbourhood {
            has_neighbour: true,
            ..Neighbourhood::default()
        };
        for (around, delay, arrival) in [
            (Neighbourhood::default(), 0.02, 0.94e-3),
            (crowded, 0.036, 3.1e-3),
        ] {
            let of = Measurement::of(&path, around, &pose, &errors);
            assert!((of.length_m - 43.0).abs() < 1e-12);
            assert!((of.noise[(0, 0)] - 9e-4 - delay * delay).abs() < 1e-9);
            assert!((of.noise[(2, 2)] - 4e-6 - arrival * arrival).abs() < 1e-11);
            assert!((of.noise[(3, 3)] - 1.0).abs() < 1e-12, "no departure");
            let perfect = of.innovation(43.0, &of.tangents.arrival, &Vector3::x());
            assert!(perfect.norm() < 1e-6);
        }
        path.departure = Some(Departure {
            direction: Direction::<World>::from_zenith_azimuth(1.5, 0.0).expect("angles"),
            sigma_rad: 0.002,
        });
        let of = Measurement::of(&path, crowded, &pose, &errors);
        assert!((of.noise[(4, 4)] - 4e-6).abs() < 1e-10);
        let [outside, beside, alone] =
            [(false, true), (true, true), (true, false)].map(|(in_beams, has_neighbour)| {
                let around = Neighbourhood {
                    has_neighbour,
                    ..crowded
                };
                departure_outliers(around, in_beams, &errors)
            });
        assert!(outside > beside && beside > alone);
    }

    #[test]
    fn beams_look_ahead_and_up() {
        let down = |degrees: f64| is_in_beams(libm::cos(degrees.to_radians()));
        assert!(down(96.0) && down(59.0) && !down(98.0) && !down(57.0));
    }
}
