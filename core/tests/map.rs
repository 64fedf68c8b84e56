//! The bounded map: de-duplication, fusion, and the policy when it is full.

#![allow(
    clippy::expect_used,
    clippy::panic,
    reason = "a helper of a test fails by panicking"
)]

use std::collections::HashMap;

use cslam_core::geometry::{Matrix3, Position};
use cslam_core::map::{Insertion, PointCloud, Voxel, VoxelError};
use cslam_core::reflection::ReflectionPoint;
use proptest::prelude::*;

fn reflection(p: [f32; 3], sigma_m: f32) -> ReflectionPoint {
    let covariance = Matrix3::identity() * (sigma_m * sigma_m / 3.0);
    ReflectionPoint {
        position: Position::new(p[0], p[1], p[2]).expect("finite"),
        covariance,
        distance_m: 1.0,
    }
}

#[test]
fn points_of_a_voxel_fuse_by_their_variances() {
    let mut map = PointCloud::<8>::new();
    assert_eq!(
        map.insert(&reflection([0.10, 0.1, 0.1], 0.1)),
        Ok(Insertion::Added)
    );
    assert_eq!(
        map.insert(&reflection([0.20, 0.1, 0.1], 0.2)),
        Ok(Insertion::Fused)
    );
    assert_eq!(
        map.insert(&reflection([0.26, 0.1, 0.1], 0.1)),
        Ok(Insertion::Added)
    );
    let first = map.points().next().copied().expect("two points");
    // Weights 1/0.01 and 1/0.04: the mean lies a fifth of the way.
    assert!((first.position.to_array()[0] - 0.12).abs() < 1e-6, "{first:?}");
    assert!((first.variance_m2 - 0.008).abs() < 1e-6, "{first:?}");
    assert_eq!((first.hits, map.len()), (2, 2));
}

#[test]
fn a_full_map_keeps_the_better_points() {
    let mut map = PointCloud::<4>::new();
    for (i, sigma) in [0.1, 0.4, 0.2, 0.3].into_iter().enumerate() {
        assert_eq!(
            map.insert(&reflection([i as f32, 0.0, 0.0], sigma)),
            Ok(Insertion::Added)
        );
    }
    assert_eq!(
        map.insert(&reflection([9.0, 0.0, 0.0], 0.5)),
        Ok(Insertion::Dropped),
        "worse than all"
    );
    assert_eq!(
        map.insert(&reflection([9.0, 0.0, 0.0], 0.25)),
        Ok(Insertion::Replaced),
        "takes the place of 0.4"
    );
    let at = |x: f32| Voxel::containing(&Position::new(x, 0.0, 0.0).expect("finite"), 0.25).expect("near");
    assert!(map.get(at(1.0)).is_none() && map.get(at(9.0)).is_some() && map.get(at(3.0)).is_some());
    assert_eq!(
        map.insert(&reflection([9.0, 0.0, 0.0], 0.5)),
        Ok(Insertion::Fused)
    );
    let counters = map.counters();
    assert_eq!(
        (
            counters.added,
            counters.replaced,
            counters.dropped,
            counters.fused
        ),
        (4, 1, 1, 1)
    );
    assert_eq!(map.len(), 4);
}

#[test]
fn far_points_and_bad_edges_are_refused() {
    let mut map = PointCloud::<4>::new();
    assert_eq!(
        map.insert(&reflection([1e6, 0.0, 0.0], 0.1)),
        Err(VoxelError::OutOfRange)
    );
    assert_eq!((map.len(), map.counters().out_of_range), (0, 1));
    assert!(PointCloud::<4>::with_edge(0.0).is_none() && PointCloud::<4>::with_edge(f32::NAN).is_none());
}

/// Reals of a range through integers: the float ranges of proptest trip over their own assertions at symmetric bounds.
fn real(low: f32, high: f32) -> impl Strategy<Value = f32> {
    (0..1_u32 << 20).prop_map(move |i| low + (high - low) * i as f32 / (1_u32 << 20) as f32)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    /// Against the plain model of a hash map: while there is room, the same voxels with the same number of hits; when
    /// full, never more than the capacity, and every point can be found again.
    #[test]
    fn behaves_like_a_hash_map(
        points in prop::collection::vec((prop::array::uniform3(real(-2.0, 2.0)), real(0.05, 0.5)), 1..400),
    ) {
        let mut small = PointCloud::<37>::with_edge(0.5).expect("positive");
        let mut large = PointCloud::<600>::with_edge(0.5).expect("positive");
        let mut model: HashMap<Voxel, u16> = HashMap::new();
        for &(p, sigma) in &points {
            let point = reflection(p, sigma);
            let voxel = Voxel::containing(&point.position, 0.5).expect("near");
            *model.entry(voxel).or_default() += 1;
            large.insert(&point).expect("near");
            let insertion = small.insert(&point).expect("near");
            prop_assert_eq!(small.get(voxel).is_some(), insertion != Insertion::Dropped);
            prop_assert!(small.len() <= 37);
        }
        prop_assert_eq!(large.len(), model.len());
        for (voxel, hits) in &model {
            prop_assert_eq!(large.get(*voxel).map(|p| p.hits), Some(*hits));
        }
        for cloud_point in small.points() {
            let voxel = Voxel::containing(&cloud_point.position, 0.5).expect("near");
            prop_assert_eq!(small.get(voxel), Some(cloud_point), "fused points stay in their voxel and are found");
        }
        let c = small.counters();
        prop_assert_eq!((c.added + c.fused + c.replaced + c.dropped) as usize, points.len());
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Points of four surfaces, of which one is withdrawn and another merged: what is left is what a map would hold that had never seen
    /// the withdrawn ones first in their voxels.
    #[test]
    fn a_withdrawn_surface_leaves_and_the_others_are_found(
        points in prop::collection::vec((prop::array::uniform3(real(-2.0, 2.0)), 0_u16..4), 1..200),
        withdrawn in 0_u16..4,
    ) {
        let mut map = PointCloud::<300>::with_edge(0.5).expect("positive");
        let mut owners: HashMap<Voxel, u16> = HashMap::new();
        for &(p, surface) in &points {
            let point = reflection(p, 0.1);
            owners.entry(Voxel::containing(&point.position, 0.5).expect("near")).or_insert(surface);
            map.insert_on(Some(surface), &point).expect("near");
        }
        let before = map.len();
        let freed = map.withdraw(withdrawn);
        map.rename((withdrawn + 1) % 4, 9);
        prop_assert_eq!(map.len() + freed, before);
        for (voxel, owner) in &owners {
            let found = map.get(*voxel).map(|point| point.surface());
            let expected = match *owner {
                owner if owner == withdrawn => None,
                owner if owner == (withdrawn + 1) % 4 => Some(Some(9)),
                owner => Some(Some(owner)),
            };
            prop_assert_eq!(found, expected);
        }
        // Its places are used again.
        for &(p, _) in &points {
            map.insert(&reflection(p, 0.1)).expect("near");
        }
        prop_assert_eq!(map.len(), before);
    }
}
