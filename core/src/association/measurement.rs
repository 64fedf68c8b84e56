//! A path as a measurement: in world axes, with all its errors but the pose's.

use nalgebra::{SMatrix, Vector3};

use super::chain::{ROWS, Tangents};
use super::part::part;
use super::pose::PoseEstimate;
use crate::geometry::World;
use crate::path::Path;
use crate::paths::{Neighbourhood, PathErrors, ReceivedPath, covariance};
use crate::signal::DelayPeriod;

/// Departures are known no better than this, rad.
/// Numerical: keeps densities finite.
const LEAST_DEPARTURE_RAD: f64 = 1e-4;

/// A path in world axes with the pose's clock taken out, and with all its errors but the pose's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measurement {
    /// Delay less the clock's offset, m, but for a whole number of delay periods.
    pub length_m: f64,
    /// That period.
    pub delay_period: DelayPeriod,
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
            .copy_from(&covariance(path, neighbourhood, errors));
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
            c_tau_m: pose.delay_period.range_m(length_m),
            aoa: arrival,
            aod: None,
            covariance: part(&noise, (0, 0)),
        }
        .to_world(&pose.attitude, &part(&pose.covariance, (3, 3)));
        world.covariance.m11 += pose.clock_variance_m2();
        Self {
            length_m,
            delay_period: pose.delay_period,
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
    #[inline(never)]
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
            self.delay_period.wrap_m(self.length_m - range_m),
            -e1.dot(arrival),
            -e2.dot(arrival),
            a1.dot(&off),
            a2.dot(&off),
        ]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Body, Direction, Matrix3, Rotation};
    use crate::path::Departure;

    #[test]
    fn noise_is_the_claim_of_the_path_and_of_its_departure() {
        let errors = PathErrors::default();
        let pose = PoseEstimate {
            position_m: Vector3::zeros(),
            attitude: Rotation::from_yaw_pitch_roll(0.4, 0.1, -0.1).expect("finite"),
            clock_offset_m: 7.0,
            delay_period: crate::signal::Waveform::default().delay_period(),
            covariance: SMatrix::zeros(),
        };
        let mut path = ReceivedPath {
            c_tau_m: 50.0,
            arrival: Direction::<Body>::from_zenith_azimuth(1.4, 0.3).expect("angles"),
            departure: None,
            covariance: Matrix3::from_diagonal(&Vector3::new(9e-4, 4e-6, 5e-6)),
            power_db: 0.0,
            probabilities: None,
        };
        for has_neighbour in [false, true] {
            let around = Neighbourhood {
                has_neighbour,
                ..Neighbourhood::default()
            };
            let of = Measurement::of(&path, around, &pose, &errors);
            assert!((of.length_m - 43.0).abs() < 1e-12);
            let claimed = covariance(&path, around, &errors);
            assert!((of.noise.fixed_view::<3, 3>(0, 0) - claimed).norm() < 1e-15);
            assert!((of.noise[(3, 3)] - 1.0).abs() < 1e-12, "no departure");
            let perfect = of.innovation(43.0, &of.tangents.arrival, &Vector3::x());
            assert!(perfect.norm() < 1e-6);
        }
        path.departure = Some(Departure {
            direction: Direction::<World>::from_zenith_azimuth(1.5, 0.0).expect("angles"),
            sigma_rad: 0.002,
        });
        let of = Measurement::of(&path, Neighbourhood::default(), &pose, &errors);
        assert!((of.noise[(4, 4)] - 4e-6).abs() < 1e-10);
    }
}
