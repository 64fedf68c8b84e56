//! Which paths enter the map: probable single reflections whose point can be trusted.
//!
//! The network's word alone leaves one false point in ten, because links differ in how well their point is known: a path
//! with hardly any excess delay may be off by metres. So the probability stands beside the excess delay, the angle of
//! departure, and where the point lies. Source: link-state.md, gate.

use super::features::LinkGeometry;
use super::probability::Probabilities;
use crate::geometry::World;
use crate::path::Path;
use crate::reflection::{Ends, Form, Gates, InputError, ReflectionPoint, Rejection, Verdict, solve};

/// Thresholds for entering the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AcceptGate {
    /// Least probability of first order. Default 0.8.
    pub min_probability: f32,
    /// Least excess delay whatever its uncertainty, m: below, the point is where the noise wants it. Default 1.5 m.
    pub min_excess_m: f32,
    /// Gates of the point: excess of 3.5 standard deviations, 0.3 m from both ends, departure within 2.5 standard
    /// deviations; ground and bounds where they are known.
    pub point: Gates,
}

impl Default for AcceptGate {
    fn default() -> Self {
        Self {
            min_probability: 0.8,
            min_excess_m: 1.5,
            point: Gates {
                excess_sigmas: 3.5,
                // The least excess delay does this gate's work, and keeps walls that are met at grazing angles.
                min_one_plus_cos_bistatic: 0.0,
                min_uav_distance_m: 0.3,
                min_gmt_distance_m: 0.3,
                ..Gates::default()
            },
        }
    }
}

/// What became of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Acceptance {
    /// A point for the map.
    Accepted(ReflectionPoint),
    /// Not probably a single reflection.
    Improbable,
    /// The point does not pass a gate.
    Rejected(Rejection),
}

impl AcceptGate {
    /// Judges a classified path.
    ///
    /// # Errors
    /// [`InputError`] when the path is no measurement.
    pub fn judge(
        &self,
        ends: &Ends,
        link: &LinkGeometry<'_>,
        path: &Path<World>,
        probabilities: &Probabilities,
    ) -> Result<Acceptance, InputError> {
        // Solved in any case: a path that is no measurement is an error whatever the network says.
        let verdict = solve(ends, path, Form::Vector, &self.point)?;
        Ok(match verdict {
            // Negated so that a probability that is no number accepts nothing.
            _ if !probabilities.first_order.ge(&self.min_probability) => Acceptance::Improbable,
            Verdict::Rejected(reason) => Acceptance::Rejected(reason),
            Verdict::Accepted(_) if link.excess_m(path) < self.min_excess_m => {
                Acceptance::Rejected(Rejection::ExcessDelayTooSmall)
            }
            Verdict::Accepted(point) => Acceptance::Accepted(point),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Direction, Position, Vector3};
    use crate::lscn::Received;
    use crate::path::{Departure, diagonal_covariance};
    use crate::reflection::Bounds;
    use nalgebra::Matrix3;

    const SURE: Probabilities = Probabilities {
        los: 0.05,
        first_order: 0.9,
        higher_order: 0.05,
    };

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

    fn judged(
        gate: &AcceptGate,
        gap: f32,
        change: impl Fn(&mut Path<World>),
        p: &Probabilities,
    ) -> Acceptance {
        let (ends, mut path) = case(gap);
        change(&mut path);
        let received = [Received { path, gain_db: None }];
        let link = LinkGeometry::new(&ends, &received).expect("apart");
        gate.judge(&ends, &link, &path, p).expect("a measurement")
    }

    #[test]
    fn a_probable_and_consistent_path_gives_its_point() {
        let Acceptance::Accepted(point) = judged(&AcceptGate::default(), 12.0, |_| {}, &SURE) else {
            panic!("consistent");
        };
        assert!((point.position.vector() - Vector3::new(0.0, 20.0, 4.0)).norm() < 1e-3);
    }

    #[test]
    fn every_gate_closes() {
        let gate = AcceptGate::default();
        let doubtful = Probabilities {
            first_order: 0.79,
            los: 0.21,
            higher_order: 0.0,
        };
        assert_eq!(judged(&gate, 12.0, |_| {}, &doubtful), Acceptance::Improbable);
        let broken = Probabilities {
            first_order: f32::NAN,
            ..doubtful
        };
        assert_eq!(judged(&gate, 12.0, |_| {}, &broken), Acceptance::Improbable);
        // Excess 2 sqrt(gap^2 + 404) - 40.2: 1.24 m, far beyond its 3.5 standard deviations of 0.11 m.
        let small = judged(&gate, 5.0, |_| {}, &SURE);
        assert_eq!(small, Acceptance::Rejected(Rejection::ExcessDelayTooSmall));
        let open = AcceptGate {
            min_excess_m: 0.0,
            ..gate
        };
        assert!(matches!(
            judged(&open, 5.0, |_| {}, &SURE),
            Acceptance::Accepted(_)
        ));
        let turned = |path: &mut Path<World>| {
            if let Some(departure) = &mut path.aod {
                departure.direction = Direction::from_vector(Vector3::x()).expect("some");
            }
        };
        assert_eq!(
            judged(&gate, 12.0, turned, &SURE),
            Acceptance::Rejected(Rejection::DepartureMismatch)
        );
        let mut small_world = gate;
        small_world.point.bounds = Some(Bounds {
            min: at(2.0, -5.0, 0.0),
            max: at(30.0, 50.0, 20.0),
        });
        assert_eq!(
            judged(&small_world, 12.0, |_| {}, &SURE),
            Acceptance::Rejected(Rejection::OutOfBounds)
        );
    }

    #[test]
    fn no_measurement_is_an_error_whatever_its_probability() {
        let (ends, mut path) = case(12.0);
        path.c_tau_m = 5.0;
        let link = LinkGeometry::new(&ends, &[]).expect("apart");
        let error = AcceptGate::default().judge(
            &ends,
            &link,
            &path,
            &Probabilities {
                first_order: 0.0,
                ..SURE
            },
        );
        assert_eq!(error, Err(InputError::DelayShorterThanBaseline));
    }
}
