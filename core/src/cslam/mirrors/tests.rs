use super::*;
use crate::cslam::routes::{Route, at};

/// A piece of the wall x = 10, which faces west, shown by one reflection; and the ends of that.
fn reflection(uav_y: f32) -> (Ends, Position<World>) {
    // Of the way from the image at x = 20, the first two thirds lie behind the wall.
    let image = Vector3::new(20.0, 0.0, 1.5);
    let uav = Vector3::new(5.0, uav_y, 6.5);
    let point = image + (uav - image) * (2.0 / 3.0);
    let ends = Ends {
        uav_covariance: Matrix3::identity() * 0.01,
        ..Route::over(&[[0.0, 0.0, 1.5], uav.into()]).ends()
    };
    (ends, at(point))
}

fn shown(uav_y: f32) -> Plane {
    let (ends, point) = reflection(uav_y);
    piece(&ends, &point).expect("placed")
}

/// A piece of the wall x = 10 that is so far east of it, and turned.
fn aside(east_m: f32, turned_rad: f32) -> Plane {
    let normal = Vector3::new(-1.0, libm::tanf(turned_rad), 0.0);
    piece_of(
        Direction::from_vector(normal).expect("not zero"),
        at(Vector3::new(10.0 + east_m, 0.0, 3.0)),
    )
}

#[test]
fn two_reflections_of_two_sweeps_are_the_wall_and_of_three_prove_it() {
    let mut mirrors = Mirrors::single();
    for (sweep, uav_y) in [(7, 9.0), (7, 10.0)] {
        mirrors.enter(sweep, 0, &shown(uav_y));
    }
    assert_eq!(mirrors.seen().count(), 0, "one sweep may be wrong");
    mirrors.enter(8, 0, &shown(12.0));
    let found = mirrors.seen().next().expect("two sweeps").of;
    let plane = found.plane;
    assert!((plane.normal.vector() + Vector3::x()).norm() < 1e-5, "{plane:?}");
    assert!(
        plane.height_m(&Vector3::new(10.0, -30.0, 2.0)).abs() < 1e-4,
        "{plane:?}"
    );
    assert!(found.id >= FIRST_ID);
    assert_eq!(mirrors.proven().count(), 0, "two may be wrong in the same way");
    mirrors.enter(9, 0, &shown(13.0));
    assert_eq!([mirrors.seen().count(), mirrors.proven().count()], [1, 1]);
}

#[test]
fn the_piece_that_proves_a_mirror_says_so_once() {
    let mut mirrors = Mirrors::supposed();
    let told = [(1, 0), (2, 0), (3, 0), (4, 0), (5, 1), (6, 1)]
        .map(|(sweep, stop)| mirrors.enter(sweep, stop, &aside(0.0, 0.0)));
    assert_eq!(told, [false, false, false, false, true, false]);
}

#[test]
fn a_place_that_is_not_known_well_shows_no_mirror() {
    let (ends, point) = reflection(9.0);
    let known_to = |sigma_m: f32| Ends {
        uav_covariance: Matrix3::identity() * (sigma_m * sigma_m / 3.0),
        ..ends
    };
    assert!(piece(&known_to(0.99 * PLACED_M), &point).is_some());
    assert!(piece(&known_to(1.01 * PLACED_M), &point).is_none());
}

#[test]
fn a_supposed_wall_is_believed_after_four_sweeps_from_two_stops() {
    let Rule { sweeps, stops, .. } = Rule::SUPPOSED;
    assert!((sweeps, stops) >= (4, 2));
    // Whatever is supposed stands as still as the GMT does.
    let mut mirrors = Mirrors::supposed();
    for sweep in 0..20 {
        mirrors.enter(sweep, 5, &aside(0.0, 0.0));
    }
    assert_eq!(mirrors.proven().count(), 0, "one stop");
    mirrors.enter(20, 6, &aside(0.0, 0.0));
    assert_eq!(mirrors.proven().count(), 1);

    let mut mirrors = Mirrors::supposed();
    for sweep in 1..u32::from(sweeps) {
        // Twice in a sweep is once.
        mirrors.enter(sweep, sweep, &aside(0.0, 0.0));
        mirrors.enter(sweep, sweep, &aside(0.01, 0.0));
    }
    assert_eq!(mirrors.proven().count(), 0, "a sweep too few");
    mirrors.enter(u32::from(sweeps), u32::from(sweeps), &aside(0.0, 0.0));
    assert_eq!(mirrors.proven().count(), 1);
    assert!(mirrors.proven().all(|mirror| mirror.of.id >= 2 * FIRST_ID));
}

#[test]
fn supposed_pieces_must_agree_better_than_solved_ones() {
    let (single, supposed) = (Rule::SINGLE, Rule::SUPPOSED);
    let between_m = 0.5 * (single.same_m + supposed.same_m);
    let between_rad = 0.5 * (libm::acosf(single.same_cosine) + libm::acosf(supposed.same_cosine));
    for (other, kept) in [
        (aside(0.9 * supposed.same_m, 0.0), [1, 1]),
        (aside(between_m, 0.0), [1, 2]),
        (aside(0.0, between_rad), [1, 2]),
        (aside(1.1 * single.same_m, 0.0), [2, 2]),
    ] {
        let (mut single, mut supposed) = (Mirrors::single(), Mirrors::supposed());
        for (sweep, plane) in [(0, aside(0.0, 0.0)), (1, other)] {
            single.enter(sweep, 0, &plane);
            supposed.enter(sweep, 0, &plane);
        }
        assert_eq!(
            [single.mirrors.len(), supposed.mirrors.len()],
            kept,
            "{:?}",
            other.centre
        );
    }
}

#[test]
fn its_bounds_grow_around_all_that_was_seen_of_it() {
    let mut mirrors = Mirrors::single();
    let pieces = [0.0, 12.0, -7.0].map(shown);
    for (sweep, piece) in (0..).zip(&pieces) {
        mirrors.enter(sweep, 0, piece);
    }
    let found = mirrors.proven().next().expect("three sweeps");
    let [first, north, south] = pieces.map(|piece| *piece.centre.vector());
    let mut expected = Bounds::at(&first);
    expected.take_in(&south);
    expected.take_in(&north);
    assert_eq!(found.bounds_m, expected);
    assert_ne!(found.bounds_m, Bounds::at(&first));
}

#[test]
fn mirrors_seen_once_make_room_first_and_then_the_oldest() {
    let mut mirrors = Mirrors::single();
    mirrors.enter(0, 0, &aside(0.0, 0.0));
    mirrors.enter(1, 0, &aside(0.0, 0.0));
    let others = MIRRORS as u32 + 3;
    for k in 1..=others {
        mirrors.enter(1 + k, 0, &aside(5.0 * k as f32, 0.0));
    }
    let kept: Vec<u32, MIRRORS> = mirrors.mirrors.iter().map(|mirror| mirror.sweep).collect();
    assert_eq!(kept.len(), MIRRORS);
    assert!(kept.contains(&1), "the one that two sweeps have shown stays");
    // Of those seen once, the newest.
    assert!((others + 3 - MIRRORS as u32..=others + 1).all(|sweep| kept.contains(&sweep)));
    // When all are known, the one that was seen longest ago makes room.
    for sweep in kept.iter().filter(|sweep| **sweep > 1) {
        mirrors.enter(100 + sweep, 0, &aside(5.0 * (sweep - 1) as f32, 0.0));
    }
    assert_eq!(mirrors.seen().count(), MIRRORS);
    mirrors.enter(200, 0, &aside(-50.0, 0.0));
    assert!(mirrors.mirrors.iter().all(|mirror| mirror.sweep > 1));
}
