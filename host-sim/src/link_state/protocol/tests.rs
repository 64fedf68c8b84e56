//! The grid is the paper's, its pieces make the whole, and nonsense is refused.

use super::*;

fn protocol(scene: &str) -> Protocol {
    Protocol {
        scene: scene.into(),
        set: SetName::Train,
        transmitters: 2,
        step_m: 1.0,
        rate: 0.001,
        permittivity: Some([2.0, 20.0]),
        seed: 3,
    }
}

#[test]
fn the_outdoor_grid_is_the_papers() {
    let scene = Scene::load("outdoor").expect("built in");
    let protocol = Protocol {
        transmitters: 100,
        ..protocol("outdoor")
    };
    let source = Source::new(&protocol, &scene).expect("room");
    assert_eq!(source.all_links(), 28_800_000);
    assert_eq!(source.grid.point_m(0), [0.5, 0.5, 1.0]);
    assert_eq!(source.grid.point_m(288_000 - 1), [119.5, 119.5, 20.0]);
    let free = source.free.iter().filter(|f| **f).count();
    assert!(
        (150_000..280_000).contains(&free),
        "{free} of 288000 receivers are outside buildings"
    );
    assert!(
        source
            .transmitters_m()
            .iter()
            .all(|tx| scene.is_free(*tx) && (1.0..=2.0).contains(&tx[2]))
    );
}

#[test]
fn pieces_make_the_same_links_on_any_number_of_threads() {
    let scene = Scene::load("outdoor").expect("built in");
    let protocol = protocol("outdoor");
    let source = Source::new(&protocol, &scene).expect("room");
    let whole = source.links(0..source.all_links(), |_| {});
    assert!((300..700).contains(&whole.len()), "{}", whole.len());
    assert!(whole.permittivity.iter().all(|e| (2.0..=20.0).contains(e)));
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .expect("a pool");
    let mut pieces = Links::default();
    for range in [0..100_001, 100_001..400_000, 400_000..source.all_links()] {
        pieces.append(&pool.install(|| source.links(range, |_| {})));
    }
    assert_eq!(whole, pieces);
}

#[test]
fn sets_and_seeds_differ_and_a_lower_rate_takes_a_part() {
    let scene = Scene::load("indoor").expect("built in");
    let all = |protocol: &Protocol| {
        let source = Source::new(protocol, &scene).expect("room");
        (
            source.transmitters_m().to_vec(),
            source.links(0..source.all_links(), |_| {}),
        )
    };
    let train = Protocol {
        rate: 0.2,
        ..protocol("indoor")
    };
    let (tx, links) = all(&train);
    let (part_tx, part) = all(&Protocol {
        rate: 0.1,
        ..train.clone()
    });
    assert_eq!(tx, part_tx);
    assert!(part.len() < links.len() && part.index.iter().all(|i| links.index.contains(i)));
    assert_ne!(
        tx,
        all(&Protocol {
            set: SetName::Validation,
            ..train.clone()
        })
        .0
    );
    assert_ne!(
        tx,
        all(&Protocol {
            seed: 4,
            ..train.clone()
        })
        .0
    );
    assert!(links.rx_m.iter().all(|rx| rx[2] < 4.0), "none in the ceiling");
}

#[test]
fn nonsense_is_refused_in_words() {
    let scene = Scene::load("indoor").expect("built in");
    for (wrong, word) in [
        (
            Protocol {
                rate: 0.0,
                ..protocol("indoor")
            },
            "rate",
        ),
        (
            Protocol {
                rate: f64::NAN,
                ..protocol("indoor")
            },
            "rate",
        ),
        (
            Protocol {
                step_m: 0.0,
                ..protocol("indoor")
            },
            "step",
        ),
        (
            Protocol {
                transmitters: 0,
                ..protocol("indoor")
            },
            "transmitters",
        ),
        (
            Protocol {
                permittivity: Some([0.5, 2.0]),
                ..protocol("indoor")
            },
            "permittivity",
        ),
    ] {
        let error = Source::new(&wrong, &scene).expect_err("nonsense");
        assert!(error.contains(word), "{error}");
    }
}
