//! A second data association beside the one that flew: its map, and where the two differ and who was right.

use std::collections::BTreeMap;

use serde::Serialize;

use super::by_faces::is_right;
use super::map::{self, MapFigures};
use super::surface::Surfaces;
use crate::flight_log::{FlightLog, PointRecord};

/// Paths by who made points of them. A path is right when all its points are of the true order and on the true surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Differences {
    /// Both, right.
    pub both_right: usize,
    /// Both, and at least one of them is wrong.
    pub both_wrong: usize,
    /// The one that flew alone, right.
    pub flown_right: usize,
    /// The one that flew alone, wrong.
    pub flown_wrong: usize,
    /// The second one alone, right.
    pub shadow_right: usize,
    /// The second one alone, wrong.
    pub shadow_wrong: usize,
}

/// Figures of a second association.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ShadowFigures {
    /// Its map.
    pub map: MapFigures,
    /// Against the one that flew, where the scene is known.
    pub differences: Differences,
    /// Points that it took back.
    pub withdrawn: u64,
}

/// Judges the second association; `None` when none was flown beside. The log's paths must have been matched.
pub(super) fn judge(log: &FlightLog, surfaces: Option<&Surfaces<'_>>) -> Option<ShadowFigures> {
    let shadow = log.shadow.as_ref()?;
    let other = FlightLog {
        points: shadow.points.clone(),
        map: shadow.map.clone(),
        shadow: None,
        ..log.clone()
    };
    Some(ShadowFigures {
        map: map::judge(&other, surfaces).0,
        differences: surfaces.map_or_else(Differences::default, |surfaces| {
            differences(&by_path(log, surfaces), &by_path(&other, surfaces))
        }),
        withdrawn: shadow.withdrawn,
    })
}

/// Sweep and index of a path.
type PathKey = (u32, u8);

/// Paths with points whose truth is known, and whether all of them are right.
fn by_path(log: &FlightLog, surfaces: &Surfaces<'_>) -> BTreeMap<PathKey, bool> {
    let mut paths = BTreeMap::new();
    let key = |point: &PointRecord| (point.sweep, point.path);
    for point in &log.points {
        if let Some(right) = is_right(log, point, surfaces) {
            *paths.entry(key(point)).or_insert(true) &= right;
        }
    }
    paths
}

fn differences(flown: &BTreeMap<PathKey, bool>, shadow: &BTreeMap<PathKey, bool>) -> Differences {
    let mut found = Differences::default();
    for (path, right) in flown {
        *match (shadow.get(path), right) {
            (Some(true), true) => &mut found.both_right,
            (Some(_), _) => &mut found.both_wrong,
            (None, true) => &mut found.flown_right,
            (None, false) => &mut found.flown_wrong,
        } += 1;
    }
    for (_, right) in shadow.iter().filter(|(path, _)| !flown.contains_key(*path)) {
        *if *right {
            &mut found.shadow_right
        } else {
            &mut found.shadow_wrong
        } += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_with_points_is_counted_once() {
        let of = |paths: &[(u8, bool)]| {
            paths
                .iter()
                .map(|&(path, right)| ((7, path), right))
                .collect::<BTreeMap<_, _>>()
        };
        let flown = of(&[(0, true), (1, true), (2, false), (3, false), (4, true)]);
        let shadow = of(&[
            (0, true),
            (1, false),
            (2, false),
            (5, true),
            (6, false),
            (7, true),
        ]);
        let expected = Differences {
            both_right: 1,
            both_wrong: 2,
            flown_right: 1,
            flown_wrong: 1,
            shadow_right: 2,
            shadow_wrong: 1,
        };
        assert_eq!(differences(&flown, &shadow), expected);
    }
}
