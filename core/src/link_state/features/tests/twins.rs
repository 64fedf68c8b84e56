//! What the features make of twins: paths that went the same way in plan.

use super::*;

/// The path off the wall at x = 10 and the ground: from the image of the GMT under the ground and behind the wall.
pub(super) fn mirrored_at_wall_and_ground() -> Received {
    let image = at(16.0, 5.0, -1.5);
    let line = ends().uav.from_origin(&image);
    let on = |share: f32| *image.vector() + line * share;
    let (ground, wall) = (on(1.5 / 10.5), on(6.0 / 14.0));
    // The ground is met first; seen from the GMT that is before the wall, on its side of it.
    let first = Vector3::new(20.0 - ground.x, ground.y, 0.0);
    let point = |v: Vector3<f32>| Position::from_vector(v).expect("finite");
    let path = over(&[point(first), point(wall)]);
    assert!((path.path.c_tau_m - image.distance_m(&ends().uav)).abs() < 1e-3);
    path
}

/// Turns the departure of a path to the left, seen from above.
fn turned(mut path: Received, angle_rad: f32) -> Received {
    let departure = path.path.aod.as_mut().expect("set");
    let v = *departure.direction.vector();
    let (sin, cos) = (libm::sinf(angle_rad), libm::cosf(angle_rad));
    let left = Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, v.z);
    departure.direction = Direction::from_vector(left).expect("some");
    path
}

#[test]
fn a_twin_went_the_same_way_in_plan() {
    let (wall, both, los) = (mirrored_at_wall(), mirrored_at_wall_and_ground(), over(&[]));
    assert_eq!(
        named(&wall, &[los], "twins"),
        0.0,
        "the GMT is not above its image"
    );
    assert_eq!(named(&wall, &[los, both], "twins"), 0.25);
    assert_eq!(
        named(&both, &[wall, los], "twins"),
        0.25,
        "seen from the other one too"
    );
    assert_eq!(named(&los, &[wall, both], "twins"), 0.0);
    // Two standard deviations of 0.4 m and 0.35 m aside still count, four do not.
    let aside = |turn_rad: f32| {
        let mut path = both;
        let v = *path.path.aoa.vector();
        let across = Vector3::new(-v.y, v.x, 0.0) * turn_rad;
        path.path.aoa = Direction::from_vector(v + across).expect("some");
        named(&wall, &[path], "twins")
    };
    assert_eq!((aside(0.03), aside(0.08)), (0.25, 0.0));
}

#[test]
fn departures_of_twins_average_their_errors() {
    let (wall, both) = (mirrored_at_wall(), mirrored_at_wall_and_ground());
    let feature = |own: f32, twin: f32, name| named(&turned(wall, own), &[turned(both, twin)], name);
    let plan = |own, twin| libm::sinhf(feature(own, twin, "twins_departure_off_point")) * 0.05;
    assert!(plan(0.0, 0.0) < 1e-3);
    // Both left at nearly the same elevation, so both weigh the same.
    assert!((plan(0.06, 0.02) - 0.04).abs() < 2e-3);
    assert!(plan(0.05, -0.05) < 2e-3, "errors of opposite sign");
    assert!(
        (plan(3.0, 3.0) - 1.0).abs() < 1e-3,
        "beyond a right angle there is nothing more to tell"
    );
    // Where the departures are by far the least certain, two of them halve the variance.
    let unsure = |mut path: Received| {
        path.path.aod.as_mut().expect("set").sigma_rad = 1.0;
        turned(path, 0.2)
    };
    let sigmas =
        |others: &[Received]| libm::sinhf(named(&unsure(wall), others, "twins_departure_off_point_sigmas"));
    let ratio = sigmas(&[unsure(both)]) / sigmas(&[]);
    assert!((ratio - core::f32::consts::SQRT_2).abs() < 0.02, "{ratio}");
}
