//! Which paths enter the map: probable single reflections whose point can be trusted.
//!
//! That a path was reflected once does not make its point a good one: with hardly any excess delay along a wall the point
//! may be off by tens of metres, beside a wall right at the UAV by decimetres. So the probability stands beside the error
//! that the point has by those of delay, angles and pose, and beside the angle of departure and where the point lies.
//! Source: docs/link-state.md, gate.

use crate::reflection::Gates;

/// Thresholds for entering the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcceptGate {
    /// Least probability of first order ([`Probabilities::is_first_order`](super::Probabilities::is_first_order)). Default 0.8.
    pub min_probability: f32,
    /// Gates of the point: an error of at most 5 m, excess of 2 standard deviations, 0.3 m from both ends, departure within
    /// 2.5 standard deviations; ground and bounds where they are known.
    pub point: Gates,
}

impl Default for AcceptGate {
    fn default() -> Self {
        Self {
            min_probability: 0.8,
            point: Gates {
                // Against a line of sight alone, which the network knows by its angles too.
                excess_sigmas: 2.0,
                // The error of the point does this gate's work, and keeps walls that are met at grazing angles.
                min_one_plus_cos_bistatic: 0.0,
                max_sigma_m: 5.0,
                min_uav_distance_m: 0.3,
                min_gmt_distance_m: 0.3,
                ..Gates::default()
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Direction, Position, Vector3, World};
    use crate::path::{Departure, Path, diagonal_covariance};
    use crate::reflection::{Bounds, Ends, Form, InputError, Rejection, Verdict, solve};
    use nalgebra::Matrix3;

    fn at(x: f32, y: f32, z: f32) -> Position {
        Position::new(x, y, z).expect("finite")
    }

    /// UAV and GMT `gap` m in front of a wall at x = 0, 40 m apart, and the path off the wall.
    fn case(gap: f32) -> (Ends, Path<World>) {
        let ends = Ends {
            uav: at(gap, 40.0, 6.0),
            uav_covariance: Matrix3::identity() * 0.01,
            gmt: at(gap, 0.0, 2.0),
        };
        let point = Vector3::new(0.0, 20.0, 4.0);
        let (to_uav, to_gmt) = (point - ends.uav.vector(), point - ends.gmt.vector());
        let path = Path {
            c_tau_m: to_uav.norm() + to_gmt.norm(),
            aoa: Direction::from_vector(to_uav).expect("some"),
            aod: Some(Departure {
                direction: Direction::from_vector(to_gmt).expect("some"),
                sigma_rad: 0.035,
            }),
            covariance: diagonal_covariance(0.05, 0.003),
        };
        (ends, path)
    }

    fn solved(gate: &AcceptGate, gap: f32, change: impl Fn(&mut Path<World>)) -> Verdict<f32> {
        let (ends, mut path) = case(gap);
        change(&mut path);
        solve(&ends, &path, Form::Vector, &gate.point).expect("a measurement")
    }

    #[test]
    fn a_consistent_path_gives_its_point() {
        let Verdict::Accepted(point) = solved(&AcceptGate::default(), 12.0, |_| {}) else {
            panic!("consistent");
        };
        assert!((point.position.vector() - Vector3::new(0.0, 20.0, 4.0)).norm() < 1e-3);
    }

    #[test]
    fn every_gate_closes() {
        let gate = AcceptGate::default();
        // Excess 2 sqrt(gap^2 + 404) - 40.2 = 0.20 m, 1.8 of its standard deviations of 0.11 m, 6 degrees off the GMT.
        let small = solved(&gate, 2.0, |_| {});
        assert_eq!(small, Verdict::Rejected(Rejection::LineOfSight));
        // 0.45 m, 4 standard deviations: along a wall 3 m away the point has an error of 2.7 m.
        assert!(matches!(
            solved(&gate, 3.0, |_| {}),
            Verdict::Accepted(point) if (2.5..3.0).contains(&point.sigma_m())
        ));
        // 2.4 m of excess, 2.4 standard deviations with twenty times the errors, and the point has one of 6.2 m.
        let poor = |path: &mut Path<World>| path.covariance *= 400.0;
        assert_eq!(
            solved(&gate, 7.0, poor),
            Verdict::Rejected(Rejection::IllConditioned)
        );
        let mut open = gate;
        open.point.max_sigma_m = f32::INFINITY;
        assert!(matches!(solved(&open, 7.0, poor), Verdict::Accepted(_)));
        let turned = |path: &mut Path<World>| {
            if let Some(departure) = &mut path.aod {
                departure.direction = Direction::from_vector(Vector3::x()).expect("some");
            }
        };
        assert_eq!(
            solved(&gate, 12.0, turned),
            Verdict::Rejected(Rejection::DepartureMismatch)
        );
        let mut small_world = gate;
        small_world.point.bounds = Some(Bounds {
            min: at(2.0, -5.0, 0.0),
            max: at(30.0, 50.0, 20.0),
        });
        assert_eq!(
            solved(&small_world, 12.0, |_| {}),
            Verdict::Rejected(Rejection::OutOfBounds)
        );
    }

    #[test]
    fn no_measurement_is_an_error() {
        let (ends, mut path) = case(12.0);
        path.c_tau_m = 5.0;
        let error = solve(&ends, &path, Form::Vector, &AcceptGate::default().point);
        assert_eq!(error, Err(InputError::DelayShorterThanBaseline));
    }
}
