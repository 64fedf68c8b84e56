//! Packets of surfaces in and out of order: what is in the map in the end.

use super::*;
use crate::ground::model::{Point, Severity, SurfaceChange};
use SurfaceChange::{Merged, Withdrawn};

fn station() -> Station {
    Station::new(Size {
        capacity: 100,
        edge_m: 1.0,
    })
}

/// Points of a surface in a packet of a UAV, each in the voxel that `at` numbers.
fn points(uav: u8, counter: u32, surface: u16, at: &[u16]) -> Heard {
    let point = |at: &u16| Point {
        position_m: [f64::from(*at) + 0.5, 0.5, 0.5],
        sigma_m: 0.1,
        probability: 0.9,
        sweep: 0,
        gmt_index: 0,
        surface: Some(surface),
    };
    let message = Message::Points {
        points: at.iter().map(point).collect(),
    };
    Heard {
        uav,
        counter,
        message,
    }
}

fn event_at(uav: u8, counter: u32, time_s: f64, change: Option<SurfaceChange>) -> Heard {
    let message = Message::Event(Event {
        time_s,
        severity: Severity::Info,
        text: format!("{change:?}"),
        change,
    });
    Heard {
        uav,
        counter,
        message,
    }
}

fn event(uav: u8, counter: u32, change: SurfaceChange) -> Heard {
    event_at(uav, counter, 5.0, Some(change))
}

/// Voxels that hold a point, in ascending order.
fn voxels(station: &Station) -> Vec<u16> {
    let mut voxels: Vec<u16> = station.cloud().points().map(|p| p.position_m[0] as u16).collect();
    voxels.sort_unstable();
    voxels
}

/// Hears packets in an order of their own.
fn heard(packets: &[&Heard]) -> Station {
    let mut station = station();
    for packet in packets {
        station.hear(packet, 10, 1.0);
    }
    station
}

#[test]
fn a_withdrawn_surface_leaves_and_a_merged_one_follows() {
    let mut station = heard(&[
        &points(1, 1, 3, &[0, 1]),
        &points(1, 2, 4, &[2, 3]),
        &points(1, 3, 5, &[4, 5]),
        &points(2, 9, 3, &[6]),
    ]);
    station.hear(&event(1, 4, Withdrawn(3)), 10, 1.0);
    assert_eq!(voxels(&station), [2, 3, 4, 5, 6], "another UAV's surface 3 stays");
    station.hear(&event(1, 5, Merged { gone: 5, stays: 4 }), 10, 1.0);
    assert_eq!(voxels(&station), [2, 3, 4, 5, 6]);
    station.hear(&event(1, 6, Withdrawn(4)), 10, 1.0);
    assert_eq!(voxels(&station), [6]);
    assert_eq!(station.cloud().counters().withdrawn, 6);
    // It was found again: its new points are in the map, and the voxels are new.
    station.hear(&points(1, 7, 3, &[0]), 10, 1.0);
    assert_eq!(voxels(&station), [0, 6]);
    assert_eq!(station.cloud().counters().added, 8);
}

#[test]
fn packets_that_overtake_each_other_end_in_the_same_map() {
    let before = points(1, 1, 3, &[0, 1]);
    let merged = event(1, 2, Merged { gone: 3, stays: 2 });
    let between = points(1, 3, 2, &[2]);
    let withdrawn = event(1, 4, Withdrawn(2));
    let after = points(1, 5, 2, &[3]);
    let packets = [&before, &merged, &between, &withdrawn, &after];
    for swaps in 0..120 {
        // Every order of five.
        let (mut left, mut order, mut which) = (packets.to_vec(), Vec::new(), swaps);
        while !left.is_empty() {
            order.push(left.remove(which % left.len()));
            which /= left.len() + 1;
        }
        let numbers: Vec<u32> = order.iter().map(|packet| packet.counter).collect();
        assert_eq!(voxels(&heard(&order)), [3], "packets came as {numbers:?}");
    }
    let late = heard(&[&withdrawn, &between]);
    assert_eq!(late.cloud().counters().late, 1);
}

#[test]
fn an_event_that_was_lost_is_made_good_when_it_is_told_again() {
    let mut station = heard(&[&points(1, 1, 3, &[0])]);
    assert!(station.hear(&event(1, 900, Withdrawn(3)), 10, 1.0), "news");
    assert_eq!(voxels(&station), [0_u16; 0]);
    assert!(!station.hear(&event(1, 1000, Withdrawn(3)), 10, 1.0), "no news");
    assert_eq!(station.uavs()[&1].events.len(), 1, "shown once");
}

#[test]
fn a_voxel_keeps_what_other_surfaces_and_uavs_put_into_it() {
    let mut station = heard(&[
        &points(1, 1, 3, &[0]),
        &points(1, 2, 4, &[0]),
        &points(2, 3, 3, &[0]),
        &event(1, 4, Withdrawn(3)),
    ]);
    let hits = |station: &Station| station.cloud().get(0).map(|point| point.hits);
    assert_eq!(hits(&station), Some(2));
    station.hear(&event(1, 5, Withdrawn(4)), 10, 1.0);
    assert_eq!(hits(&station), Some(1));
    station.hear(&event(2, 6, Withdrawn(3)), 10, 1.0);
    assert!(station.cloud().is_empty());
    // Both parts of one surface now.
    let merged = heard(&[
        &points(1, 1, 3, &[0]),
        &points(1, 2, 4, &[0]),
        &event(1, 3, Merged { gone: 4, stays: 3 }),
    ]);
    assert_eq!(hits(&merged), Some(2));
    let mut merged = merged;
    merged.hear(&event(1, 4, Withdrawn(3)), 10, 1.0);
    assert!(merged.cloud().is_empty());
}

#[test]
fn surfaces_of_a_former_life_are_others() {
    let mut station = heard(&[
        &event_at(1, 1, 100.0, None),
        &points(1, 2, 3, &[0]),
        &event_at(1, 300, 0.1, None),
        &points(1, 301, 3, &[1]),
    ]);
    station.hear(&event_at(1, 302, 9.0, Some(Withdrawn(3))), 10, 1.0);
    assert_eq!(voxels(&station), [0]);
}

#[test]
fn points_without_a_surface_stay() {
    let mut packet = points(1, 1, 0, &[0]);
    if let Message::Points { points } = &mut packet.message {
        points[0].surface = None;
    }
    let mut station = heard(&[&packet]);
    station.hear(&event(1, 2, Withdrawn(0)), 10, 1.0);
    assert_eq!(voxels(&station), [0]);
}
