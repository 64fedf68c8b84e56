use super::*;
use crate::geometry::{Matrix3, Position, Vector3, World};
use crate::map::PointCloud;
use crate::reflection::ReflectionPoint;

/// Fractions of a low-discrepancy sequence.
fn spread(i: u32, step: f64) -> f32 {
    ((f64::from(i) * step).fract()) as f32
}

fn put(cloud: &mut PointCloud<512>, x: f32, y: f32, z: f32) {
    let point = ReflectionPoint {
        position: Position::new(x, y, z).expect("finite"),
        covariance: Matrix3::identity() * 0.01,
        distance_m: 20.0,
    };
    cloud.insert(&point).expect("near the origin");
}

fn place(x: f32, y: f32, z: f32) -> Position<World> {
    Position::new(x, y, z).expect("finite")
}

/// A wall x = 20, y 0..15, and a wall y = 30, x -10..5, both 8 m high with 3 cm of roughness.
fn two_walls() -> PointCloud<512> {
    let mut cloud = PointCloud::new();
    for i in 0..60 {
        let rough = 0.1 * (spread(i, 0.733) - 0.5);
        put(
            &mut cloud,
            20.0 + rough,
            15.0 * spread(i, 0.618_034),
            8.0 * spread(i, 0.414_214),
        );
        put(
            &mut cloud,
            -10.0 + 15.0 * spread(i, 0.618_034),
            30.0 + rough,
            8.0 * spread(i, 0.414_214),
        );
    }
    cloud
}

fn found(cloud: &PointCloud<512>, calls: u32) -> PlaneMap<8> {
    let mut planes = PlaneMap::new(PlaneConfig::default());
    for _ in 0..calls {
        planes.update(cloud, &place(0.0, 5.0, 5.0));
    }
    planes
}

fn near(planes: &PlaneMap<8>, normal: [f32; 3], offset_m: f32) -> Option<Surface> {
    let n = Vector3::from(normal);
    let same = |s: &&Surface| {
        (s.plane.normal.vector() - n).norm() < 0.02 && (s.plane.offset_m() - offset_m).abs() < 0.1
    };
    planes.surfaces().iter().find(same).copied()
}

#[test]
fn walls_are_found_and_face_where_they_were_seen_from() {
    let planes = found(&two_walls(), 60);
    assert_eq!(planes.surfaces().len(), 2, "{:?}", planes.surfaces());
    let east = near(&planes, [-1.0, 0.0, 0.0], -20.0).expect("the wall x = 20");
    let north = near(&planes, [0.0, -1.0, 0.0], -30.0).expect("the wall y = 30");
    assert!(east.id != north.id && east.support > 50 && east.orientation == Orientation::Vertical);
    let [along, up] = east.extent_m.map(|[least, most]| most - least);
    assert!((13.0..15.1).contains(&along) && (7.0..8.1).contains(&up));
    let sigma_m = libm::sqrtf(east.plane.covariance.m11);
    assert!((0.05..0.06).contains(&sigma_m), "{sigma_m}");
}

#[test]
fn level_lines_and_clutter_are_no_walls() {
    let mut line = PointCloud::new();
    for i in 0..60 {
        put(
            &mut line,
            20.0 * spread(i, 0.618_034),
            3.0,
            0.1 * spread(i, 0.414_214),
        );
    }
    assert!(found(&line, 60).surfaces().is_empty());
    let mut clutter = PointCloud::new();
    // A sequence that spreads evenly has planes of its own; this one has not.
    let mut state = 1_u32;
    let mut random = || {
        // Xorshift (Marsaglia 2003).
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        20.0 * (state >> 8) as f32 / 16_777_216.0
    };
    for _ in 0..300 {
        let [x, y, z] = [random(), random(), random()];
        put(&mut clutter, x, y, z);
    }
    let planes = found(&clutter, 200);
    assert!(planes.surfaces().is_empty(), "{:?}", planes.surfaces());
}

#[test]
fn a_floor_is_a_floor() {
    let mut cloud = PointCloud::new();
    for i in 0..80 {
        put(
            &mut cloud,
            12.0 * spread(i, 0.618_034),
            12.0 * spread(i, 0.414_214),
            0.05 * spread(i, 0.733),
        );
    }
    let planes = found(&cloud, 40);
    assert_eq!(planes.surfaces().len(), 1);
    assert_eq!(planes.surfaces()[0].orientation, Orientation::Horizontal);
    assert!(near(&planes, [0.0, 0.0, 1.0], 0.025).is_some());
}

#[test]
fn planes_whose_points_went_away_are_given_up() {
    let mut planes = found(&two_walls(), 60);
    for _ in 0..2 {
        planes.update(&PointCloud::<512>::new(), &place(0.0, 5.0, 5.0));
    }
    assert!(planes.surfaces().is_empty());
    assert_eq!(planes.counters().lost, 2);
}

#[test]
fn a_full_list_keeps_the_best_supported() {
    let mut planes = PlaneMap::<1>::new(PlaneConfig::default());
    let cloud = two_walls();
    for _ in 0..80 {
        planes.update(&cloud, &place(0.0, 5.0, 5.0));
    }
    assert_eq!(planes.surfaces().len(), 1);
    assert!(planes.counters().no_room > 0);
}
