use super::*;
use crate::geometry::{Direction, Position, World};

fn plane(normal: [f64; 3], centre: [f64; 3]) -> Plane<f64> {
    Plane {
        normal: Direction::from_vector(normal.into()).expect("not zero"),
        centre: Position::from_vector(centre.into()).expect("finite"),
        covariance: Matrix3::identity(),
    }
}

/// The ground, and a corner of two walls.
fn scene() -> [Plane<f64>; 3] {
    [
        plane([0.01, -0.02, 1.0], [4.0, 12.0, 0.1]),
        plane([-1.0, 0.02, 0.004], [20.0, 3.0, 4.0]),
        plane([0.03, -1.0, -0.003], [5.0, 60.0, 6.0]),
    ]
}

const GMT: [f64; 3] = [2.0, -10.0, 1.5];
const UAV: [f64; 3] = [6.0, 25.0, 9.0];

fn at(point: [f64; 3]) -> Vector3<f64> {
    Vector3::from(point)
}

#[test]
fn the_way_over_the_points_is_the_path() {
    for k in 0..=3 {
        let scene = scene();
        let chain = Chain::over(&scene[..k]);
        let path = chain.predict(&at(GMT), &at(UAV)).expect("exists");
        assert_eq!(path.points.len(), k);
        let mut way: Vec<Vector3<f64>, 5> = Vec::new();
        way.push(at(GMT)).expect("room");
        way.extend(path.points.iter().copied());
        way.push(at(UAV)).expect("room");
        let length: f64 = way.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
        assert!((length - path.range_m).abs() < 1e-9, "{k}");
        assert!(
            ((way[1] - way[0]).normalize() - path.departure).norm() < 1e-9,
            "{k}"
        );
        assert!(
            ((way[k] - way[k + 1]).normalize() - path.arrival).norm() < 1e-9,
            "{k}"
        );
        for (point, plane) in path.points.iter().zip(&scene) {
            assert!(plane.height_m(point).abs() < 1e-9, "{k}");
        }
    }
}

#[test]
fn a_chain_behind_a_surface_does_not_exist() {
    let scene = scene();
    let wall = &scene[1..2];
    let behind = Vector3::new(25.0, 0.0, 5.0);
    assert!(Chain::over(wall).predict(&at(GMT), &behind).is_none());
    assert!(Chain::over(wall).predict(&behind, &at(UAV)).is_none());
    // The wave would have to come through the second wall to be reflected by the first.
    let facing_away = [scene[1], plane([-1.0, 0.0, 0.0], [10.0, 0.0, 4.0])];
    assert!(Chain::over(&facing_away).predict(&at(GMT), &at(UAV)).is_none());
    assert!(Chain::over(&[]).predict(&at(GMT), &at(GMT)).is_none());
    assert!(
        Chain::over(&[])
            .predict(&at(GMT), &Vector3::repeat(f64::NAN))
            .is_none()
    );
}

/// Innovation of a measurement against a chain, with the pose's errors applied.
fn innovation(
    planes: &[Plane<f64>],
    (transmitter, uav): (&Vector3<f64>, &Vector3<f64>),
    turn: &Vector3<f64>,
    clock: f64,
    measured: (f64, &Tangents, &Vector3<f64>),
) -> [f64; ROWS] {
    let (delay, tangents, departure) = measured;
    let path = Chain::over(planes).predict(transmitter, uav).expect("exists");
    let seen = tangents.arrival + turn.cross(&tangents.arrival);
    let [e1, e2] = tangents.arrival_tangents;
    let [a1, a2] = tangents.departure_tangents;
    [
        delay - clock - path.range_m,
        e1.dot(&(seen - path.arrival)),
        e2.dot(&(seen - path.arrival)),
        a1.dot(&(departure - path.departure)),
        a2.dot(&(departure - path.departure)),
    ]
}

#[test]
fn derivatives_are_the_difference_quotients() {
    const STEP: f64 = 1e-5;
    // Three on the way up, with the ground first, and three on the way back, with the ground last.
    let up: [&[usize]; 6] = [&[], &[0], &[1], &[1, 2], &[0, 1], &[0, 1, 2]];
    let down: [&[usize]; 3] = [&[2, 1], &[1, 0], &[2, 1, 0]];
    let up = up.map(|chain| (chain, at(GMT), at(UAV)));
    let down = down.map(|chain| (chain, at(UAV), at(GMT)));
    for (chain, transmitter, uav) in up.into_iter().chain(down) {
        let planes: Vec<Plane<f64>, 3> = chain.iter().map(|index| scene()[*index]).collect();
        let path = Chain::over(&planes).predict(&transmitter, &uav).expect("exists");
        // Measured a little beside, as in flight.
        let tangents_of = |v: Vector3<f64>| {
            let direction = Direction::<World, f64>::from_vector(v).expect("not zero");
            (*direction.vector(), direction.tangents())
        };
        let (arrival, e) = tangents_of(path.arrival);
        let (departure, a) = tangents_of(path.departure + Vector3::new(0.01, -0.02, 0.004));
        let tangents = Tangents {
            arrival,
            arrival_tangents: [e.0, e.1],
            departure_tangents: [a.0, a.1],
        };
        let of = |planes: &[Plane<f64>], pose: &[f64; POSE_STATES]| {
            let [x, y, z, a, b, c, clock] = *pose;
            let (uav, turn) = (uav + Vector3::new(x, y, z), Vector3::new(a, b, c));
            innovation(
                planes,
                (&transmitter, &uav),
                &turn,
                clock,
                (path.range_m, &tangents, &departure),
            )
        };
        let quotient = |plus: [f64; ROWS], minus: [f64; ROWS]| -> [f64; ROWS] {
            core::array::from_fn(|row| (plus[row] - minus[row]) / (2.0 * STEP))
        };
        let derivatives = Chain::over(&planes).derivatives(&transmitter, &path, &tangents);
        for state in 0..POSE_STATES {
            let by = |step: f64| {
                of(
                    &planes,
                    &core::array::from_fn(|s| if s == state { step } else { 0.0 }),
                )
            };
            for (row, slope) in quotient(by(STEP), by(-STEP)).into_iter().enumerate() {
                let analytic = derivatives.pose[(state, row)];
                assert!(
                    (analytic - slope).abs() < 1e-8,
                    "{chain:?} {state} {row}: {analytic} {slope}"
                );
            }
        }
        for j in 0..planes.len() {
            for parameter in 0..3 {
                let by = |step: f64| {
                    let mut planes = planes.clone();
                    let change = core::array::from_fn(|p| if p == parameter { step } else { 0.0 });
                    planes[j] = planes[j].corrected(change, planes[j].covariance).expect("finite");
                    of(&planes, &[0.0; POSE_STATES])
                };
                for (row, slope) in quotient(by(STEP), by(-STEP)).into_iter().enumerate() {
                    let analytic = derivatives.surfaces[j][(parameter, row)];
                    assert!(
                        (analytic - slope).abs() < 1e-7,
                        "{chain:?} surface {j} {parameter} {row}: {analytic} {slope}"
                    );
                }
            }
        }
    }
}
