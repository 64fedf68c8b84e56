//! The moving picture of a flight: whole, of its stated length and size, and true to when points came into the map.

use std::collections::BTreeSet;
use std::fs;

use cslam_host_sim::flight_files::Export;
use cslam_host_sim::flight_files::ply::Encoding;
use cslam_host_sim::flight_log::FlightLog;
use cslam_host_sim::scene::Scene;

use crate::{cut, synthetic, write};

/// Percent of a round at which the flight ends.
const FLOWN_PERCENT: f64 = 88.0;

fn scene() -> Scene {
    Scene::load("outdoor").expect("built in")
}

fn animation(log: &mut FlightLog) -> String {
    let directory = tempfile::tempdir().expect("a directory");
    write(log, &scene(), directory.path(), Encoding::Binary);
    fs::read_to_string(directory.path().join(Export::Animation.name())).expect("text")
}

/// Panics unless every element is closed in order and every attribute is quoted.
fn assert_well_formed(picture: &str) {
    let mut open: Vec<&str> = Vec::new();
    for piece in picture.split('<').skip(1) {
        let (tag, _text) = piece.split_once('>').expect("a tag ends");
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(tag.split(' ').next().expect("a name"));
        }
    }
    assert!(open.is_empty(), "{open:?}");
    let numbers = picture.replace("infinite", "");
    assert!(!numbers.contains("NaN") && !numbers.contains("inf"));
    let entities = picture.split('&').skip(1);
    entities.for_each(|rest| {
        assert!(
            ["amp;", "lt;", "gt;", "quot;"]
                .iter()
                .any(|e| rest.starts_with(e))
        )
    });
}

/// What stands between two marks, everywhere.
fn between<'p>(picture: &'p str, before: &str, after: &str) -> Vec<&'p str> {
    let pieces = picture.split(before).skip(1);
    pieces
        .filter_map(|piece| Some(piece.split_once(after)?.0))
        .collect()
}

/// Percent of a round at which the points of the map appear, a number for each path of dots.
fn appearances(picture: &str) -> Vec<f64> {
    let dots = picture.split(r#"<path class="dot c"#).skip(1);
    dots.map(|dots| {
        let name = between(dots, "animation-name:", "\"")[0];
        let steps = between(picture, &format!("@keyframes {name}{{0%,"), "%")[0];
        steps.parse().expect("a number")
    })
    .collect()
}

#[test]
fn it_shows_every_point_in_both_views_within_its_length_and_size() {
    let mut log = synthetic::fly(&scene(), 12.0, 4);
    log.header.scene = "</svg><b>&\"".into();
    let picture = animation(&mut log);
    assert_well_formed(&picture);
    // The one address names the kind of drawing; nothing is fetched.
    assert!(!picture.contains("<b>") && picture.matches("http").count() == 1);
    assert!(
        picture.contains("animation:12s") && picture.len() < 1_500_000,
        "{}",
        picture.len()
    );
    assert!(!log.points.is_empty());
    let dots: usize = picture
        .split(r#"<path class="dot c"#)
        .skip(1)
        .map(|dots| between(dots, " d=\"", "\"")[0].matches("h0").count())
        .sum();
    assert_eq!(dots, 2 * log.points.len());
    // Every motion has its steps, and none is left over.
    let wanted: BTreeSet<&str> = between(&picture, "animation-name:", "\"").into_iter().collect();
    let there: Vec<&str> = between(&picture, "@keyframes ", "{");
    assert_eq!(there.iter().copied().collect::<BTreeSet<_>>(), wanted);
    assert_eq!(there.len(), wanted.len());
}

#[test]
fn points_appear_when_they_came_into_the_map() {
    let mut log = synthetic::fly(&scene(), 12.0, 4);
    let (first, last) = (log.sweeps[0].sweep, log.sweeps[log.sweeps.len() - 1].sweep);
    log.points.iter_mut().for_each(|point| point.mapped_sweep = None);
    let own = appearances(&animation(&mut log));
    assert!(
        own.iter().any(|percent| (20.0..60.0).contains(percent)),
        "{own:?}"
    );
    for (sweep, percent) in [(first, 0.0), (last, FLOWN_PERCENT)] {
        log.points
            .iter_mut()
            .for_each(|point| point.mapped_sweep = Some(sweep));
        let all = appearances(&animation(&mut log));
        assert!(!all.is_empty() && all.iter().all(|p| *p == percent), "{all:?}");
    }
}

#[test]
fn a_flight_of_nothing_says_so() {
    let log = synthetic::fly(&scene(), 3.0, 4);
    let empty = animation(&mut cut(&log, 0));
    assert_well_formed(&empty);
    assert!(empty.contains("no sweep was flown"));
    assert!(!animation(&mut cut(&log, 1)).contains("no sweep was flown"));
}
