//! The measurement rows against difference quotients of their own predictions.

use nalgebra::{Matrix3, Vector3};

use super::super::nominal::rotation;
use super::super::*;
use crate::geometry::{Gmt, Plane, World};

const N: usize = states(2);

fn state() -> Nominal {
    let mut state = Nominal::origin(0, RadioModel::default().waveform.delay_period());
    state.position_m = Vector3::new(22.0, -31.0, 14.0);
    state.attitude = rotation(&Vector3::new(0.1, -0.2, 2.0));
    state.clock_offset_m = 301.0;
    state.face_bias = [[1e-3, -2e-3], [0.5e-3, 1e-3], [-1e-3, 2e-3]];
    state.array_slope = [1e-3, -2e-3, 0.7e-3, 0.2e-3];
    state.array_axis_rad = [[1e-3, 2e-3], [-1e-3, 0.5e-3], [2e-3, 0.0], [0.3e-3, -1e-3]];
    state
}

fn gmt() -> Transmitter {
    Transmitter {
        position_m: Vector3::new(-4.0, 3.0, 1.5),
        sigma_m: 0.0,
        attitude: Rotation::<Gmt, World, f64>::from_yaw_pitch_roll(0.4, 0.02, -0.03).expect("finite"),
        reach: crate::array::BeamReach::default(),
    }
}

fn wall() -> MappedPlane {
    MappedPlane {
        id: 7,
        plane: Plane {
            normal: Direction::from_vector(Vector3::new(-0.9, 0.4, 0.05)).expect("not zero"),
            centre: Position::new(40.0, -10.0, 6.0).expect("finite"),
            covariance: Matrix3::identity(),
        },
    }
}

/// A street's other side.
fn opposite() -> MappedPlane {
    MappedPlane {
        id: 8,
        plane: Plane {
            normal: Direction::from_vector(Vector3::new(0.8, 0.3, -0.02)).expect("not zero"),
            centre: Position::new(-12.0, -20.0, 5.0).expect("finite"),
            covariance: Matrix3::identity(),
        },
    }
}

/// Line of sight, one bounce, two bounces.
fn chains() -> [heapless::Vec<MappedPlane, 2>; 3] {
    let chain = |planes: &[MappedPlane]| planes.iter().copied().collect();
    [chain(&[]), chain(&[wall()]), chain(&[wall(), opposite()])]
}

/// A measurement of anything: only differences of residuals count.
fn path() -> PathMeasurement {
    PathMeasurement {
        c_tau_m: 340.0,
        c_tau_sigma_m: 0.01,
        aoa: Direction::from_zenith_azimuth(1.7, 0.3).expect("angles"),
        aoa_sigma_rad: 1e-3,
        range_rate: None,
        departure: Some(FaceDirection {
            face: 2,
            cosines: [0.3, 0.1],
            sigma: [1e-3; 2],
        }),
    }
}

#[test]
fn of_a_path_the_departure_alone_lasts() {
    let noise = RadioNoise::default();
    let model = Model::new(RadioModel::default(), noise);
    let rows = model.rows::<f64>(&state(), &gmt(), &path(), &[]).expect("apart");
    let lasting = 3.0 * noise.departure_lasting * noise.departure_lasting;
    assert_eq!(rows.len(), 5);
    for (row, expected) in rows.iter().zip([0.0, 0.0, 0.0, lasting, lasting]) {
        let grown = row.update_variance() - row.variance;
        assert!((grown - expected).abs() < 1e-12, "{grown}");
    }
}

#[test]
fn every_derivative_is_the_difference_quotient() {
    let model = Model::new(RadioModel::default(), RadioNoise::default());
    // The shift by the arrays' errors changes with the direction; the rows leave that out (a hundredth of the whole), so
    // the errors are zero here.
    let state = || Nominal {
        array_slope: [0.0; 4],
        array_axis_rad: [[0.0; 2]; 4],
        ..state()
    };
    for chain in chains() {
        let rows_at = |dx: &[f64; N]| {
            let mut here = state();
            here.correct(dx);
            let mut moved = chain.clone();
            for (k, mapped) in moved.iter_mut().enumerate() {
                let shift = [0, 1, 2].map(|i| dx[PLANES + 3 * k + i] as f32);
                mapped.plane = mapped
                    .plane
                    .corrected(shift, Matrix3::identity())
                    .expect("finite");
            }
            let bounces: heapless::Vec<_, 2> = moved
                .iter()
                .enumerate()
                .map(|(k, p)| (p, PLANES + 3 * k))
                .collect();
            // The angle of arrival is compared along the tangents at the prediction, which move with the state; at the
            // prediction itself that does not matter, so the measurement is put there.
            let mut path = path();
            path.aoa = seen(&state(), &source(&chain));
            model.rows::<f64>(&here, &gmt(), &path, &bounces).expect("apart")
        };
        // Planes live in single precision: coarse steps.
        let mut touched = [false; N];
        let here = rows_at(&[0.0; N]);
        for j in 0..N {
            let step = if j >= PLANES { 1e-2 } else { 1e-5 };
            let mut dx = [0.0; N];
            dx[j] = step;
            let plus = rows_at(&dx);
            dx[j] = -step;
            let minus = rows_at(&dx);
            for (k, row) in here.iter().enumerate() {
                let quotient = -(plus[k].residual - minus[k].residual) / (2.0 * step);
                let mut unit = [0.0; N];
                unit[j] = 1.0;
                let claimed = row.dot(&unit);
                touched[j] |= claimed != 0.0;
                let limit = if j >= PLANES { 0.01 } else { 4e-4 };
                assert!(
                    (quotient - claimed).abs() < limit * (1.0 + claimed.abs()),
                    "row {k} state {j}: {quotient} {claimed}"
                );
            }
        }
        let expected = |j: usize| match j {
            0..=2 | 6..=8 | 15 | 21..=34 => true,
            PLANES..N => j < PLANES + 3 * chain.len(),
            _ => false,
        };
        assert!((0..N).all(|j| touched[j] == expected(j)), "{touched:?}");
    }
}

/// The GMT, or its last image.
fn source(chain: &[MappedPlane]) -> Vector3<f64> {
    chain.iter().fold(gmt().position_m, |from, mapped| {
        let plane = &mapped.plane;
        let away = from - plane.centre.vector().map(f64::from);
        mirrored(mapped, &from, plane.normal.vector().map(f64::from).dot(&away))
    })
}

fn mirrored(mapped: &MappedPlane, v: &Vector3<f64>, height: f64) -> Vector3<f64> {
    v - mapped.plane.normal.vector().map(f64::from) * (2.0 * height)
}

/// Direction of a source in body axes.
fn seen(state: &Nominal, source_m: &Vector3<f64>) -> Direction<Body, f64> {
    Direction::from_vector(state.attitude.tr_mul(&(source_m - state.position_m))).expect("apart")
}

#[test]
fn a_perfect_measurement_leaves_no_residual() {
    let model = Model::new(RadioModel::default(), RadioNoise::default());
    let mut state = state();
    (state.array_slope, state.array_axis_rad, state.face_bias) = ([0.0; 4], [[0.0; 2]; 4], [[0.0; 2]; 3]);
    let gmt = gmt();
    for chain in chains() {
        let source = source(&chain);
        let way = source - state.position_m;
        let leaving = chain.iter().rev().fold(-way.normalize(), |v, mapped| {
            mirrored(mapped, &v, mapped.plane.normal.vector().map(f64::from).dot(&v))
        });
        let local = gmt.attitude.inverse().apply_vector(&leaving);
        let face = 1;
        let azimuth = core::f64::consts::TAU / 3.0;
        let tangent = Vector3::new(-libm::sin(azimuth), libm::cos(azimuth), 0.0);
        let path = PathMeasurement {
            // Three delay periods late: delays are cyclic.
            c_tau_m: way.norm() + state.clock_offset_m + 3.0 * state.delay_period.length_m(),
            aoa: seen(&state, &source),
            departure: Some(FaceDirection {
                face,
                cosines: [tangent.dot(&local), local.z],
                sigma: [1e-3; 2],
            }),
            ..path()
        };
        let bounces: heapless::Vec<_, 2> = chain
            .iter()
            .enumerate()
            .map(|(k, p)| (p, PLANES + 3 * k))
            .collect();
        let rows = model.rows::<f64>(&state, &gmt, &path, &bounces).expect("apart");
        assert_eq!(rows.len(), 5);
        assert!(
            rows.iter().all(|row| row.residual.abs() < 1e-7),
            "{:?}",
            rows.iter().map(|r| r.residual).collect::<heapless::Vec<_, 5>>()
        );
        let without = PathMeasurement {
            departure: None,
            ..path
        };
        assert_eq!(
            model
                .rows::<f64>(&state, &gmt, &without, &[])
                .map(|rows| rows.len()),
            Some(3)
        );
    }
    state.position_m = gmt.position_m;
    assert!(model.rows::<f64>(&state, &gmt, &path(), &[]).is_none());
}

#[test]
fn corrections_undo_the_errors_they_stand_for() {
    let model = Model::new(RadioModel::default(), RadioNoise::default());
    let (state, gmt) = (state(), gmt());
    // What the arrays see: the combination of their errors that least squares makes of the four.
    let truth = seen(&state, &gmt.position_m);
    let arrays = crate::array::UavArrays::<f64>::default();
    let (e1, e2) = truth.tangents();
    let gains = arrays.amplitude(&truth).map(|a| a * a);
    let (mut h, mut b) = (nalgebra::Matrix2::zeros(), nalgebra::Vector2::zeros());
    for (j, array) in arrays.arrays().iter().enumerate() {
        let dw = nalgebra::Vector2::new(array.axis.dot(&e1), array.axis.dot(&e2));
        let tilted = array.normal * state.array_axis_rad[j][0]
            + array.axis.cross(&array.normal) * state.array_axis_rad[j][1];
        h += dw * dw.transpose() * gains[j];
        b += dw * (gains[j] * (state.array_slope[j] + tilted.dot(truth.vector())));
    }
    let e = h.try_inverse().expect("three axes") * b;
    let measured = Direction::from_vector(truth.vector() + e1 * e.x + e2 * e.y).expect("unit");
    assert!((measured.vector() - truth.vector()).norm() > 1e-3);
    let left = (model.corrected(&measured, &state) - truth.vector()).norm();
    assert!(left < 2e-5, "{left}");
    // And the departure.
    let departure = FaceDirection {
        face: 0,
        cosines: [0.2 + state.face_bias[0][0], 0.1 + state.face_bias[0][1]],
        sigma: [1e-3; 2],
    };
    let g = model.departed(&departure, &gmt, &state).expect("on the sphere");
    let local = gmt.attitude.inverse().apply_vector(&g);
    assert!((local - Vector3::new(libm::sqrt(1.0 - 0.05), 0.2, 0.1)).norm() < 1e-12);
    let outside = FaceDirection {
        cosines: [0.9, 0.9],
        ..departure
    };
    assert!(model.departed(&outside, &gmt, &state).is_none());
    assert!(
        model
            .departed(&FaceDirection { face: 3, ..departure }, &gmt, &state)
            .is_none()
    );
}

#[test]
fn a_step_of_metres_lands_where_the_path_points() {
    // As after an outage: 5 m off at 34 m, and unsure by as much; the path is exact.
    let model = Model::new(RadioModel::default(), RadioNoise::default());
    let truth = Nominal {
        position_m: Vector3::new(14.0, -24.0, 8.0),
        ..Nominal::origin(0, RadioModel::default().waveform.delay_period())
    };
    let mut path = path();
    path.aoa = seen(&truth, &gmt().position_m);
    let way = gmt().position_m - truth.position_m;
    path.c_tau_m = way.norm();
    let local = gmt().attitude.inverse().apply_vector(&-way.normalize());
    let azimuth = 2.0 * core::f64::consts::TAU / 3.0;
    let tangent = Vector3::new(-libm::sin(azimuth), libm::cos(azimuth), 0.0);
    path.departure = Some(FaceDirection {
        face: 2,
        cosines: [tangent.dot(&local), local.z],
        sigma: [1e-3; 2],
    });
    let place = model.place(&truth, &gmt(), &path, &[]).expect("a place");
    assert!((place - truth.position_m).norm() < 1e-9);
    let after = |from_afar: bool| {
        let mut state = truth;
        state.position_m += Vector3::new(-3.0, 3.5, 2.0);
        let mut covariance = Covariance::<f64, N>::zero();
        for i in 0..3 {
            covariance.reset(POSITION + i, 25.0);
            covariance.reset(ATTITUDE + i, 1e-4);
        }
        let rows = if from_afar {
            model.rows_from_afar::<f64>(&state, &gmt(), &path, &[])
        } else {
            model.rows::<f64>(&state, &gmt(), &path, &[])
        };
        let mut dx = [0.0; N];
        for row in rows.expect("apart") {
            let rest = row.residual - row.dot(&dx);
            let gain = covariance.update(&row).expect("positive");
            dx.iter_mut().zip(&gain).for_each(|(x, k)| *x += k * rest);
        }
        state.correct(&dx);
        (state.position_m - truth.position_m).norm()
    };
    assert!(after(false) > 0.2, "{}", after(false));
    assert!(after(true) < 0.02, "{}", after(true));
}

#[test]
fn a_direction_beside_a_face_moves_its_cosine_less() {
    let sure = FaceDirection::of_angle(1, [0.8, -0.6], 0.01);
    // Sines of the angles to row and column.
    for (sigma, expected) in sure.sigma.iter().zip([0.006, 0.008]) {
        assert!((sigma - expected).abs() < 1e-12, "{sigma}");
    }
    let both = sure.widened(0.024).sigma_rad();
    assert!(both.iter().all(|sigma| (sigma - 0.026).abs() < 1e-12), "{both:?}");
    // A sideways way rises with its elevation alone.
    let along = sure.sigma_along(&Vector3::new(0.8, 0.6, 0.0));
    assert!((along - Vector3::repeat(0.01)).norm() < 1e-12, "{along}");
    let edge = FaceDirection::of_angle(0, [1.0, 0.0], 0.01).sigma_rad();
    assert!((edge[0] - 0.01).abs() < 1e-12, "{edge:?}");
}
