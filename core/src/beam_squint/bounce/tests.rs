use super::*;

#[test]
fn the_bounce_leaves_for_the_uav_s_image_under_the_ground() {
    let level = Mirror {
        up: [0.0, 1.0, 0.0],
        height_m: 2.0,
        range_m: 50.0,
    };
    // 10 m over the GMT: 14 m under it in the mirror.
    let image = level.image([0.3, 0.2]).expect("before the face");
    let length_m = (50.0_f32 * 50.0 - 100.0 + 14.0 * 14.0).sqrt();
    assert!((image.later_m - (length_m - 50.0)).abs() < 1e-4);
    assert!((image.cosines[0] - 15.0 / length_m).abs() < 1e-6);
    assert!((image.cosines[1] + 14.0 / length_m).abs() < 1e-6);
    assert!(level.image([0.9, 0.9]).is_none(), "no direction");
}

#[test]
fn derivatives_are_those_of_differences_also_of_a_mast_that_leans() {
    let up = Vector3::new(0.05, 0.99, -0.1).normalize();
    let mirror = Mirror {
        up: [up.x, up.y, up.z],
        height_m: 1.5,
        range_m: 40.0,
    };
    let place = [0.3, 0.15];
    let image = mirror.image(place).expect("before the face");
    let step = 1e-2;
    for axis in 0..2 {
        let at = |by: f32| {
            let mut moved = place;
            moved[axis] += by;
            mirror.image(moved).expect("before the face")
        };
        let (low, high) = (at(-step), at(step));
        for i in 0..2 {
            let quotient = (high.cosines[i] - low.cosines[i]) / (2.0 * step);
            assert!((image.by[(i, axis)] - quotient).abs() < 1e-3, "{i} {axis}");
        }
        let quotient = (high.later_m - low.later_m) / (2.0 * step);
        assert!((image.later_by[axis] - quotient).abs() < 1e-2, "{axis}");
    }
}
