//! Tests of the merged map.

use super::*;

fn at(x: f64, sigma_m: f64) -> Point {
    Point {
        position_m: [x, 0.1, 0.1],
        sigma_m,
        probability: 0.5,
        sweep: 0,
        gmt_index: 0,
        surface: None,
    }
}

fn of(uav: u8) -> Came {
    Came {
        uav,
        counter: 0,
        surface: None,
    }
}

fn small(capacity: u32) -> Cloud {
    Cloud::new(Size {
        capacity,
        edge_m: 1.0,
    })
}

#[test]
fn points_of_a_voxel_fuse_by_their_variances() {
    let mut cloud = small(8);
    cloud.insert(of(1), &at(0.2, 0.1), 1.0);
    cloud.insert(of(2), &at(0.5, 0.2), 3.0);
    let point = cloud.get(0).expect("one");
    assert_eq!((cloud.len(), point.hits, point.uav, point.seen_s), (1, 2, 2, 3.0));
    assert!((point.position_m[0] - 0.26).abs() < 1e-6, "{point:?}");
    assert!((point.variance_m2 - 0.008).abs() < 1e-6, "{point:?}");
}

#[test]
fn a_full_cloud_keeps_the_better_points_and_counts_every_one() {
    let mut cloud = small(100);
    for k in 0..100 {
        cloud.insert(of(1), &at(f64::from(k) + 0.5, 0.5), 0.0);
    }
    // Worse ones have no place, better ones take one each.
    for k in 100..200 {
        cloud.insert(of(1), &at(f64::from(k) + 0.5, 1.0), 0.0);
    }
    assert_eq!((cloud.counters().dropped, cloud.len()), (100, 100));
    for k in 200..250 {
        cloud.insert(of(1), &at(f64::from(k) + 0.5, 0.1), 0.0);
    }
    let counters = cloud.counters();
    assert_eq!(
        (counters.added, counters.replaced, counters.dropped),
        (100, 50, 100)
    );
    assert_eq!(cloud.points().filter(|p| p.variance_m2 < 0.02).count(), 50);
    // Whoever was replaced is forgotten: the same voxel is new again.
    assert_eq!(cloud.slots.len(), 100);
    cloud.insert(of(1), &at(f64::NAN, 0.1), 0.0);
    assert_eq!(cloud.counters().out_of_range, 1);
}

#[test]
fn changes_are_told_once_and_in_order() {
    let mut cloud = small(100);
    for k in [5, 3, 5, 9] {
        cloud.insert(of(1), &at(f64::from(k) + 0.5, 0.5), 0.0);
    }
    assert_eq!(cloud.take_changed(2), [1, 2]);
    assert_eq!(cloud.take_changed(9), [0]);
    assert!(cloud.take_changed(9).is_empty());
    cloud.insert(of(1), &at(9.5, 0.5), 0.0);
    cloud.insert(of(1), &at(3.5, 0.5), 0.0);
    assert_eq!(cloud.take_changed(9), [1, 2]);
}
