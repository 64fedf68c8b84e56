//! Trees along streets: a trunk that blocks, and a crown that takes a part of what goes through it.
//!
//! Trees stand off the ways of both ends, so neither is in their way. They are no part of the scene: the map has no surface there.

use serde::{Deserialize, Serialize};

use crate::flight::FlightPlan;
use crate::input::InputError;
use crate::movers::{Floor, Room};
use crate::scene::{Placement, Scene, Vec3};
use crate::seeded::{Seeded, Source};

/// Half of the thickness of a trunk, and its height, m.
const TRUNK_M: [f64; 2] = [0.15, 5.0];
/// Widths of crowns, which are as high as wide, m.
const WIDTHS_M: [f64; 2] = [4.0, 8.0];
/// Crowns begin so high above the ground, m.
const UNDER_CROWN_M: f64 = 2.5;
/// Kept between a trunk and a wall or the GMT, and between a crown and the UAV, m.
const CLEARANCE_M: f64 = 1.0;
/// Half of the side of the square that a crown needs free of walls, of its width: twigs give way.
const TRIMMED: f64 = 0.35;
/// Places that are drawn for a tree before it is left out.
const DRAWS: u32 = 200;
/// Times at which distances to the ways of both ends are looked at, s.
const STEP_S: f64 = 0.1;
const SQUARE_M_PER_HA: f64 = 1e4;
const MOST_DENSE: f64 = 100.0;

/// Trees of a world. The default is none.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct VegetationConfig {
    /// Trees, for each hectare of a scene under the sky; none under a roof.
    pub trees_per_ha: f64,
}

impl VegetationConfig {
    /// 6 trees a hectare.
    pub fn real() -> Self {
        Self { trees_per_ha: 6.0 }
    }

    /// Checks every figure.
    ///
    /// # Errors
    /// [`InputError`] naming the key and what was expected.
    pub fn check(&self) -> Result<(), InputError> {
        if (0.0..=MOST_DENSE).contains(&self.trees_per_ha) {
            return Ok(());
        }
        let message = format!("is {}, expected 0 to {MOST_DENSE}", self.trees_per_ha);
        Err(InputError::at_key("trees_per_ha", message))
    }
}

/// A tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tree {
    /// Foot of its trunk, m.
    pub foot_m: Vec3,
    /// Width and height of its crown, m.
    pub width_m: f64,
}

impl Tree {
    /// Middle of the crown, m.
    pub fn crown_m(&self) -> Vec3 {
        self.foot_m + Vec3::z() * (UNDER_CROWN_M + 0.5 * self.width_m)
    }

    /// Length of a straight line within the crown, m.
    pub fn depth_m(&self, from: &Vec3, to: &Vec3) -> f64 {
        // Where |from + t way - crown| is the radius.
        let (way, off) = (to - from, from - self.crown_m());
        let (a, b) = (way.norm_squared(), way.dot(&off));
        let c = off.norm_squared() - 0.25 * self.width_m * self.width_m;
        let root = b * b - a * c;
        if root <= 0.0 || a <= 0.0 {
            return 0.0;
        }
        let root = root.sqrt();
        let [enter, leave] = [-b - root, -b + root].map(|t| (t / a).clamp(0.0, 1.0));
        (leave - enter) * a.sqrt()
    }

    /// Whether the trunk stands in a straight line.
    pub fn blocks(&self, from: &Vec3, to: &Vec3) -> bool {
        let [radius_m, height_m] = TRUNK_M;
        let (way, off) = ((to - from).xy(), (from - self.foot_m).xy());
        let (a, b) = (way.norm_squared(), way.dot(&off));
        let root = b * b - a * (off.norm_squared() - radius_m * radius_m);
        if root <= 0.0 || a <= 0.0 {
            return false;
        }
        let root = root.sqrt();
        let [enter, leave] = [-b - root, -b + root].map(|t| (t / a).clamp(0.0, 1.0));
        let over_m = |t: f64| from.z + (to.z - from.z) * t - self.foot_m.z;
        enter < leave && over_m(enter).min(over_m(leave)) < height_m
    }
}

/// The trees around a flight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trees {
    all: Vec<Tree>,
}

impl Trees {
    /// The same trees where a scene stands.
    #[must_use]
    pub fn placed(mut self, placement: &Placement) -> Self {
        for tree in &mut self.all {
            tree.foot_m = placement.place(&tree.foot_m);
        }
        self
    }

    /// Finds a place for every tree that a configuration asks for, off walls and off the ways of the UAV and the GMT. One that
    /// finds none is left out.
    pub fn place(scene: &Scene, config: &VegetationConfig, plan: &FlightPlan, seed: u64) -> Self {
        let mut trees = Self::default();
        if config.trees_per_ha <= 0.0 {
            return trees;
        }
        let room = Room::of(scene);
        if room.is_roofed(&plan.gmt().at(0.0).0) {
            return trees;
        }
        let times = (0..=(plan.duration_s() / STEP_S) as u32).map(|step| STEP_S * f64::from(step));
        let ways: Vec<[Vec3; 2]> = times
            .map(|time_s| [plan.gmt().at(time_s).0, plan.uav().place_m(time_s)])
            .collect();
        let [[west, south], [east, north]] = room.sides_m();
        let hectares = (east - west) * (north - south) / SQUARE_M_PER_HA;
        for number in 0..libm::round(config.trees_per_ha * hectares) as u32 {
            let mut random = Seeded::numbered(seed, Source::Trees, number);
            let found = (0..DRAWS).find_map(|_| {
                let tree = Tree {
                    foot_m: Vec3::new(
                        random.between(west, east),
                        random.between(south, north),
                        room.ground_m(),
                    ),
                    width_m: random.between(WIDTHS_M[0], WIDTHS_M[1]),
                };
                let apart = |other: &Tree| {
                    let least_m = 0.5 * (tree.width_m + other.width_m);
                    (tree.foot_m - other.foot_m).norm() > least_m
                };
                (fits(&room, &tree)
                    && trees.all.iter().all(apart)
                    && ways.iter().all(|ends| keeps_off(&tree, ends)))
                .then_some(tree)
            });
            trees.all.extend(found);
        }
        trees
    }

    /// All of them.
    pub fn all(&self) -> &[Tree] {
        &self.all
    }
}

/// Whether trunk and crown are free of walls.
fn fits(room: &Room<'_>, tree: &Tree) -> bool {
    let square = |half_m: f64, height_m: f64| Floor {
        middle: tree.foot_m,
        along: Vec3::x(),
        half_m: [half_m; 2],
        height_m,
    };
    room.is_free(&square(TRUNK_M[0] + CLEARANCE_M, TRUNK_M[1]))
        && room.is_free(&square(TRIMMED * tree.width_m, UNDER_CROWN_M + tree.width_m))
}

/// Whether both ends stay clear of a tree.
fn keeps_off(tree: &Tree, ends: &[Vec3; 2]) -> bool {
    ends.iter().all(|end| {
        let beside_m = (end - tree.foot_m).xy().norm();
        let of_crown_m = (end - tree.crown_m()).norm();
        beside_m > TRUNK_M[0] + CLEARANCE_M && of_crown_m > 0.5 * tree.width_m + CLEARANCE_M
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flight::FlightConfig;

    const TREE: Tree = Tree {
        foot_m: Vec3::new(10.0, 0.0, 0.0),
        width_m: 6.0,
    };

    #[test]
    fn a_crown_is_as_deep_as_a_chord_and_a_trunk_ends() {
        let level = |y: f64, z: f64| [Vec3::new(0.0, y, z), Vec3::new(20.0, y, z)];
        let depth_m = |[from, to]: [Vec3; 2]| TREE.depth_m(&from, &to);
        // The middle is 5.5 m high.
        assert!((depth_m(level(0.0, 5.5)) - 6.0).abs() < 1e-12);
        assert!((depth_m(level(1.8, 7.9)) - 0.0).abs() < 1e-6);
        assert!((depth_m(level(1.8, 5.5)) - 4.8).abs() < 1e-12);
        assert_eq!(depth_m(level(3.1, 5.5)), 0.0);
        // A line that ends in the middle.
        assert!((TREE.depth_m(&Vec3::new(0.0, 0.0, 5.5), &TREE.crown_m()) - 3.0).abs() < 1e-12);
        let blocks = |[from, to]: [Vec3; 2]| TREE.blocks(&from, &to);
        assert!(blocks(level(0.0, 1.5)) && blocks(level(0.14, 4.9)));
        assert!(!blocks(level(0.16, 1.5)) && !blocks(level(0.0, 5.1)));
        assert!(!TREE.blocks(&Vec3::new(0.0, 0.0, 1.5), &Vec3::new(9.0, 0.0, 1.5)));
    }

    #[test]
    fn trees_stand_off_walls_and_off_the_ways_of_both_ends() {
        for (name, least) in [("outdoor", 5), ("street", 2), ("indoor", 0)] {
            let scene = Scene::load(name).expect("built in");
            for seed in 1..3 {
                let plan = FlightPlan::plan(&scene, &FlightConfig::default(), seed).expect("room");
                let trees = Trees::place(&scene, &VegetationConfig::real(), &plan, seed);
                println!("{name} {seed}: {} trees", trees.all().len());
                assert!(trees.all().len() >= least, "{name}: {}", trees.all().len());
                assert!(least > 0 || trees.all().is_empty());
                for tree in trees.all() {
                    assert!(!scene.inside_solid((tree.foot_m + Vec3::z()).into()));
                    for step in 0..=480 {
                        let time_s = 0.25 * f64::from(step);
                        let (gmt, uav) = (plan.gmt().at(time_s).0, plan.uav().place_m(time_s));
                        assert!((gmt - tree.foot_m).xy().norm() > 1.0);
                        assert!((uav - tree.crown_m()).norm() > 0.5 * tree.width_m + 0.8);
                    }
                }
                let none = Trees::place(&scene, &VegetationConfig::default(), &plan, seed);
                assert_eq!(none, Trees::default());
            }
        }
    }
}
