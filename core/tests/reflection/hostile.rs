//! Whatever comes in, what is accepted fits its own geometry, and line of sight is never a point.

use super::*;

/// Reals of a range through integers: the float ranges of proptest trip over their own assertions at symmetric bounds.
fn real(low: f32, high: f32) -> impl Strategy<Value = f32> {
    (0..1_u32 << 20).prop_map(move |i| low + (high - low) * i as f32 / (1_u32 << 20) as f32)
}

fn any_coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![4 => real(-200.0, 200.0), 1 => any::<f32>()]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(4000))]

    /// Whatever goes in: no panic, and an accepted point lies on the ellipsoid, on the ray, with a finite covariance.
    #[test]
    fn accepted_points_are_consistent(
        g in prop::array::uniform3(any_coordinate()),
        r in prop::array::uniform3(any_coordinate()),
        u in prop::array::uniform3(any_coordinate()),
        c_tau_m in any_coordinate(),
        sigma in any_coordinate(),
        paper in any::<bool>(),
    ) {
        let (Ok(gmt), Ok(uav)) = (Position::from_vector(g.into()), Position::from_vector(r.into())) else {
            return Ok(());
        };
        let Ok(aoa) = Direction::<World>::from_vector(u.into()) else { return Ok(()) };
        let ends = Ends { uav, uav_covariance: Matrix3::zeros(), gmt };
        let path = Path { c_tau_m, aoa, aod: None, covariance: diagonal_covariance(sigma, 0.01) };
        let form = if paper { Form::Paper } else { Form::Vector };
        if let Ok(Verdict::Accepted(point)) = solve(&ends, &path, form, &Gates::default()) {
            let way = point.distance_m + point.position.distance_m(&gmt);
            prop_assert!((way - c_tau_m).abs() <= 2e-3 * c_tau_m, "way {way} of {c_tau_m}");
            prop_assert!(point.sigma_m().is_finite());
            if form == Form::Vector {
                let along = point.position.from_origin(&uav).dot(aoa.vector());
                prop_assert!((along - point.distance_m).abs() <= 1e-3 * c_tau_m);
            }
        }
    }

    /// The straight path, seen with any allowed error, is never a point.
    #[test]
    fn line_of_sight_is_never_a_point(
        g in prop::array::uniform3(real(0.0, 120.0)),
        r in prop::array::uniform3(real(0.0, 120.0)),
        error_sigmas in real(-2.9, 2.9),
        sigma in real(0.0, 0.5),
    ) {
        let (gmt, uav) = (position(g.map(f64::from)), position(r.map(f64::from)));
        prop_assume!(uav.distance_m(&gmt) > 10.0);
        let aoa = Direction::from_vector(gmt.from_origin(&uav)).expect("apart");
        let c_tau_m = uav.distance_m(&gmt) + error_sigmas * sigma;
        let path = Path { c_tau_m, aoa, aod: None, covariance: diagonal_covariance(sigma, 0.002) };
        let ends = Ends { uav, uav_covariance: Matrix3::zeros(), gmt };
        for form in [Form::Vector, Form::Paper] {
            let verdict = solve(&ends, &path, form, &Gates::default());
            prop_assert_eq!(verdict, Ok(Verdict::Rejected(Rejection::LineOfSight)));
        }
    }
}
