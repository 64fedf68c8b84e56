//! A map of free ways: random points where the vehicle fits, joined by straight lines along which it fits.
//!
//! Points are drawn uniformly over the given heights; a part is drawn by the bridge test instead (both ends of a short
//! line inside solids, the middle free), which finds doorways. Only the largest connected part is kept, so there is a
//! way from every point to every other one.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use nalgebra::Vector3;

use super::{Obstacles, Tube};
use crate::seeded::Seeded;

/// Points sought.
const POINTS: usize = 260;
/// Of these, sought by the bridge test.
const BRIDGES: usize = 60;
/// Draws for each point sought, before giving up on it.
const DRAWS: usize = 40;
/// Draws for each bridge: between two solids is a rare place, and asking is cheap.
const BRIDGE_DRAWS: usize = 1000;
/// Neighbours that a point is joined to, at most.
const NEIGHBOURS: usize = 10;

/// Free points and the free lines between them.
#[derive(Clone, Debug)]
pub(super) struct Roadmap {
    points: Vec<Vector3<f64>>,
    /// For each point: (neighbour, length in m).
    lines: Vec<Vec<(usize, f64)>>,
}

impl Roadmap {
    /// Draws a map for a vehicle that needs `tube`, at the heights `levels_m`. Empty when the vehicle fits nowhere.
    pub(super) fn draw(world: &dyn Obstacles, tube: &Tube, levels_m: &[f64], random: &mut Seeded) -> Self {
        let (low, high) = world.bounds();
        let extent = (Vector3::from(high) - Vector3::from(low)).xy();
        let point = |random: &mut Seeded| {
            let level = levels_m
                .get(random.index(levels_m.len()))
                .copied()
                .unwrap_or(low[2]);
            Vector3::new(
                random.between(low[0], high[0]),
                random.between(low[1], high[1]),
                level,
            )
        };
        let inside = |p: &Vector3<f64>| (0..2).all(|i| p[i] > low[i] && p[i] < high[i]);
        let mut points: Vec<Vector3<f64>> = Vec::new();
        for sought in 0..POINTS {
            for _ in 0..if sought < BRIDGES { BRIDGE_DRAWS } else { DRAWS } {
                let mut candidate = point(random);
                if sought < BRIDGES {
                    let half = random.between(0.02, 0.15) * extent.min();
                    // Most walls follow the axes, and through a thin wall only a line along it ends in both jambs.
                    let quarter = core::f64::consts::FRAC_PI_2;
                    let angle = if random.uniform() < 0.5 {
                        quarter * random.index(2) as f64
                    } else {
                        random.between(0.0, 2.0 * quarter)
                    };
                    let (sin, cos) = libm::sincos(angle);
                    let reach = Vector3::new(cos, sin, 0.0) * half;
                    let solid = |p: Vector3<f64>| world.inside_solid(p.into());
                    // Ends in solids half a doorway away on both sides.
                    if !(solid(candidate - reach) && solid(candidate + reach)) {
                        continue;
                    }
                    // Centre the point in the gap, so that the doorway is crossed in its middle.
                    candidate = centred(world, &candidate, &reach);
                }
                // One point in a doorway is enough: many would only be joined to each other.
                let crowded = sought < BRIDGES
                    && points
                        .iter()
                        .any(|p| (p - candidate).norm() < 0.05 * extent.min());
                if !crowded && inside(&candidate) && tube.fits(world, &candidate) {
                    points.push(candidate);
                    break;
                }
            }
        }
        Self::join(world, tube, points).largest_part()
    }

    fn join(world: &dyn Obstacles, tube: &Tube, points: Vec<Vector3<f64>>) -> Self {
        let mut lines = vec![Vec::new(); points.len()];
        for (from, here) in points.iter().enumerate() {
            let mut near: Vec<(usize, f64)> = points
                .iter()
                .enumerate()
                .filter(|&(to, _)| to != from)
                .map(|(to, there)| (to, (there - here).norm()))
                .collect();
            near.sort_by(|a, b| a.1.total_cmp(&b.1));
            let mut joined = 0;
            for &(to, length) in near.iter().take(4 * NEIGHBOURS) {
                if joined == NEIGHBOURS {
                    break;
                }
                let known = lines[from].iter().any(|&(other, _)| other == to);
                if known || tube.is_free(world, here, &points[to]) {
                    joined += 1;
                    if !known {
                        lines[from].push((to, length));
                        lines[to].push((from, length));
                    }
                }
            }
        }
        Self { points, lines }
    }

    /// Keeps the largest connected part.
    fn largest_part(self) -> Self {
        let mut part = vec![usize::MAX; self.points.len()];
        let mut sizes = Vec::new();
        for start in 0..self.points.len() {
            if part[start] != usize::MAX {
                continue;
            }
            let (mut open, mut size) = (vec![start], 0);
            part[start] = sizes.len();
            while let Some(here) = open.pop() {
                size += 1;
                for &(next, _) in &self.lines[here] {
                    if part[next] == usize::MAX {
                        part[next] = sizes.len();
                        open.push(next);
                    }
                }
            }
            sizes.push(size);
        }
        // The first of the largest, so that the choice does not depend on the order of a search.
        let largest = (0..sizes.len()).fold(0, |best, k| if sizes[k] > sizes[best] { k } else { best });
        let mut renumbered = vec![usize::MAX; self.points.len()];
        let kept: Vec<usize> = (0..self.points.len()).filter(|&k| part[k] == largest).collect();
        for (new, &old) in kept.iter().enumerate() {
            renumbered[old] = new;
        }
        Self {
            points: kept.iter().map(|&k| self.points[k]).collect(),
            lines: kept
                .iter()
                .map(|&k| {
                    self.lines[k]
                        .iter()
                        .map(|&(to, length)| (renumbered[to], length))
                        .collect()
                })
                .collect(),
        }
    }

    /// Free points.
    pub(super) fn points(&self) -> &[Vector3<f64>] {
        &self.points
    }

    /// Shortest way between two points, both included (Dijkstra). Ties go to the lower number.
    pub(super) fn way(&self, from: usize, to: usize) -> Vec<usize> {
        let mut best = vec![(f64::INFINITY, usize::MAX); self.points.len()];
        let mut open = BinaryHeap::new();
        best[from] = (0.0, from);
        open.push(Open {
            length: 0.0,
            point: from,
        });
        while let Some(Open { length, point }) = open.pop() {
            if point == to {
                break;
            }
            if length > best[point].0 {
                continue;
            }
            for &(next, step) in &self.lines[point] {
                let through = length + step;
                if through < best[next].0 {
                    best[next] = (through, point);
                    open.push(Open {
                        length: through,
                        point: next,
                    });
                }
            }
        }
        let mut way = vec![to];
        let mut here = to;
        while here != from && best[here].1 != usize::MAX {
            here = best[here].1;
            way.push(here);
        }
        way.reverse();
        way
    }

    /// A tour of at least `length_m` from point to point, never turning back on the spot where there is another way.
    /// Each goal is the best of `choices` drawn: the way to it has the highest mean of `worth`(point, length up to it).
    pub(super) fn tour(
        &self,
        start: usize,
        length_m: f64,
        random: &mut Seeded,
        choices: u32,
        worth: impl Fn(&Vector3<f64>, f64) -> f64,
    ) -> Vec<Vector3<f64>> {
        let mut tour = vec![start];
        let mut length = 0.0;
        while length < length_m && self.points.len() > 1 {
            let mut best: Option<(f64, f64, Vec<usize>)> = None;
            for _ in 0..choices.max(1) {
                let way = self.onward(&tour, random);
                let (mut reached, mut sum) = (length, 0.0);
                for step in way.windows(2) {
                    reached += (self.points[step[1]] - self.points[step[0]]).norm();
                    sum += worth(&self.points[step[1]], reached);
                }
                let mean = sum / way.len() as f64;
                if best.as_ref().is_none_or(|(most, ..)| mean > *most) {
                    best = Some((mean, reached, way));
                }
            }
            if let Some((_, reached, way)) = best {
                length = reached;
                tour.extend(way.iter().skip(1));
            }
        }
        tour.into_iter().map(|k| self.points[k]).collect()
    }

    /// A way from the end of a tour to a point drawn at random.
    fn onward(&self, tour: &[usize], random: &mut Seeded) -> Vec<usize> {
        let here = tour[tour.len() - 1];
        let before = tour.len().checked_sub(2).map(|k| tour[k]);
        loop {
            let way = self.way(here, random.index(self.points.len()));
            let back = way.get(1) == before.as_ref() && self.lines[here].len() > 1;
            // A tenth of the goals behind is taken all the same: some flights do turn.
            if way.len() > 1 && (!back || random.uniform() < 0.1) {
                return way;
            }
        }
    }
}

/// Middle of the gap that a point lies in, along a line.
fn centred(world: &dyn Obstacles, point: &Vector3<f64>, reach: &Vector3<f64>) -> Vector3<f64> {
    let free = |sign: f64| {
        (1..=20)
            .map(|k| f64::from(k) / 20.0)
            .take_while(|share| !world.inside_solid((point + reach * (sign * share)).into()))
            .last()
            .unwrap_or(0.0)
    };
    point + reach * (0.5 * (free(1.0) - free(-1.0)))
}

/// A point to be visited; the heap gives the shortest way first.
struct Open {
    length: f64,
    point: usize,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        other
            .length
            .total_cmp(&self.length)
            .then(other.point.cmp(&self.point))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

#[cfg(test)]
mod tests {
    use super::super::obstacles::tests::Boxes;
    use super::*;
    use crate::seeded::Source;

    #[test]
    fn both_rooms_are_joined_through_the_doorway() {
        let world = Boxes::two_rooms();
        for seed in 0..10 {
            let mut random = Seeded::new(seed, Source::UavRoute);
            let map = Roadmap::draw(&world, &Tube::round(0.35), &[1.0, 1.8, 2.6], &mut random);
            let left = map
                .points()
                .iter()
                .position(|p| p.x < -2.0)
                .expect("a point in the left room");
            let right = map
                .points()
                .iter()
                .position(|p| p.x > 2.0)
                .expect("a point in the right room");
            let way = map.way(left, right);
            assert_eq!((way.first(), way.last()), (Some(&left), Some(&right)));
            // The way goes through the doorway, y 1.0 to 2.2.
            let crossing = way
                .windows(2)
                .map(|w| (map.points()[w[0]], map.points()[w[1]]))
                .find(|(a, b)| (a.x < 0.0) != (b.x < 0.0))
                .map(|(a, b)| a.y + (b.y - a.y) * (a.x / (a.x - b.x)))
                .expect("a crossing");
            assert!((1.35..1.85).contains(&crossing), "{crossing}");
        }
    }

    #[test]
    fn the_way_is_the_shortest_one() {
        let corner = |x: f64, y: f64| Vector3::new(x, y, 1.0);
        let map = Roadmap {
            points: vec![
                corner(0.0, 0.0),
                corner(10.0, 0.0),
                corner(10.0, 10.0),
                corner(0.0, 3.0),
            ],
            lines: vec![
                vec![(1, 10.0), (3, 3.0)],
                vec![(0, 10.0), (2, 10.0)],
                vec![(1, 10.0), (3, 12.2)],
                vec![(0, 3.0), (2, 12.2)],
            ],
        };
        assert_eq!(map.way(0, 2), [0, 3, 2]);
        assert_eq!(map.way(1, 3), [1, 0, 3]);
        assert_eq!(map.way(2, 2), [2]);
    }

    #[test]
    fn a_tour_is_as_long_as_asked_and_a_full_world_gives_none() {
        let world = Boxes::town();
        let mut random = Seeded::new(1, Source::UavRoute);
        let map = Roadmap::draw(&world, &Tube::round(1.5), &[4.0, 10.0, 16.0], &mut random);
        assert!(map.points().len() > 150);
        let tour = map.tour(0, 500.0, &mut random, 1, |_, _| 0.0);
        let length: f64 = tour.windows(2).map(|w| (w[1] - w[0]).norm()).sum();
        assert!(length >= 500.0);
        // Of several goals the one of more worth is taken: the mean height rises.
        let height = |tour: &[Vector3<f64>]| tour.iter().map(|p| p.z).sum::<f64>() / tour.len() as f64;
        let high = map.tour(0, 500.0, &mut random, 6, |p, _| p.z);
        assert!(
            height(&high) > height(&tour) + 1.0,
            "{} {}",
            height(&high),
            height(&tour)
        );
        let solid = Boxes {
            solids: vec![([-50.0, -50.0, 0.0], [50.0, 50.0, 20.0])],
            bounds: ([-50.0, -50.0, 0.0], [50.0, 50.0, 20.0]),
        };
        let map = Roadmap::draw(&solid, &Tube::round(1.5), &[4.0], &mut random);
        assert!(map.points().is_empty());
    }
}
