//! Planned flights keep their distance and their contact, follow from their seed, and are refused in words where there is no room.

use super::super::obstacles::tests::Boxes;
use super::*;

fn short() -> FlightConfig {
    FlightConfig {
        duration_s: 60.0,
        ..FlightConfig::default()
    }
}

#[test]
fn flights_through_a_town_keep_their_distance_and_their_contact() {
    let town = Boxes::town();
    for seed in 0..6 {
        let plan = FlightPlan::plan(&town, &short(), seed).expect("room");
        let mut heights = (f64::INFINITY, 0.0f64);
        let mut way_m = 0.0;
        for k in 0..6000 {
            let p = plan.uav().at(f64::from(k) * 0.01).position_m;
            assert!(
                town.distance_m(&p) >= 1.5,
                "seed {seed}: {} m",
                town.distance_m(&p)
            );
            heights = (heights.0.min(p.z), heights.1.max(p.z));
            way_m += plan.uav().at(f64::from(k) * 0.01).velocity_m_per_s.norm() * 0.01;
            let (gmt, _) = plan.gmt().at(f64::from(k) * 0.01);
            let (foot, mast) = (Vector3::new(gmt.x, gmt.y, 0.3), gmt);
            assert!((gmt.z - 1.5).abs() < 1e-12);
            let walls = Boxes {
                solids: town.solids.clone(),
                bounds: town.bounds,
            };
            let clear = walls.solids.iter().all(|(low, high)| {
                [foot, mast].iter().all(|p| {
                    let gap = |i: usize| (low[i] - p[i]).max(p[i] - high[i]).max(0.0);
                    libm::hypot(gap(0), gap(1)) > 0.99
                })
            });
            assert!(clear, "seed {seed}: the GMT touches a wall at {gmt:?}");
        }
        let contact = plan.contact();
        assert!(
            heights.1 - heights.0 > 3.0 && way_m > 80.0,
            "seed {seed}: {heights:?}, {way_m} m"
        );
        assert!(contact.visible_share >= 0.5, "seed {seed}: {contact:?}");
        assert!(contact.longest_outage_s <= 20.0, "seed {seed}: {contact:?}");
    }
}

#[test]
fn seeds_decide_everything() {
    let town = Boxes::town();
    let place = |seed| {
        FlightPlan::plan(&town, &short(), seed)
            .expect("room")
            .uav()
            .at(40.0)
            .position_m
    };
    assert_eq!(place(3), place(3));
    assert_ne!(place(3), place(4));
}

#[test]
fn a_world_without_room_is_refused_in_words() {
    let cell = Boxes {
        solids: Vec::new(),
        bounds: ([0.0; 3], [4.0, 4.0, 2.0]),
    };
    let solid = Boxes {
        solids: vec![([-1.0; 3], [11.0; 3])],
        bounds: ([0.0; 3], [10.0; 3]),
    };
    let error = FlightPlan::plan(&solid, &short(), 1)
        .expect_err("no room")
        .to_string();
    assert!(error.contains("UAV finds no room"), "{error}");
    let config = FlightConfig {
        mast_m: 3.0,
        ..short()
    };
    let wall = Boxes {
        solids: vec![([-1.0, -1.0, 2.5], [5.0, 5.0, 9.0])],
        ..cell
    };
    let error = FlightPlan::plan(&wall, &config, 1)
        .expect_err("no room")
        .to_string();
    assert!(error.contains("GMT finds no room"), "{error}");
}
