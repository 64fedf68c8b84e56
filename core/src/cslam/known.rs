//! Every mirror that a path of this sweep may have met, with how far it is known: the ground, the map's planes, and those that
//! reflections have shown.

use heapless::Vec;

use super::PLANES;
use super::mirrors::{MIRRORS, Mirrors, SUPPOSED, same};
use crate::geometry::Vector3;
use crate::localization::filter::MappedPlane;
use crate::localization::planes::{Plane, Surface};

/// Room for all of them, and the ground.
pub(super) const KNOWN: usize = PLANES + MIRRORS + SUPPOSED + 1;
/// A wave may be reflected this far beyond what is known of a mirror, m: a wall goes on, but where there is none the line of
/// sight may pass.
const MARGIN_M: f32 = 6.0;
/// Points this near to a wall are not behind it, m: at a corner two walls meet, and neither hides the other.
const CLEAR_M: f32 = 0.6;
/// A plane lies off the points that show it by this, m.
const THICKNESS_M: f32 = 0.1;

/// A mirror, and the box that holds what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    pub(super) plane: Plane,
    pub(super) bounds_m: Bounds,
}

/// A box along the world's axes: least and largest coordinates, m. Of an upright plane it cuts out the piece that was seen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    least: Vector3<f32>,
    most: Vector3<f32>,
}

impl Bounds {
    /// Around one point.
    pub(super) fn at(point: &Vector3<f32>) -> Self {
        Self {
            least: *point,
            most: *point,
        }
    }

    fn everywhere() -> Self {
        Self {
            least: Vector3::repeat(f32::NEG_INFINITY),
            most: Vector3::repeat(f32::INFINITY),
        }
    }

    /// Grows around another point.
    pub(super) fn take_in(&mut self, point: &Vector3<f32>) {
        self.least = self.least.inf(point);
        self.most = self.most.sup(point);
    }

    fn hold(&self, point: &Vector3<f32>, margin_m: f32) -> bool {
        let margin = Vector3::repeat(margin_m);
        point.inf(&(self.least - margin)) == self.least - margin
            && point.sup(&(self.most + margin)) == self.most + margin
    }
}

impl Known {
    /// Whether it is known to be anywhere near a point on it.
    pub(super) fn reaches(&self, point: &Vector3<f32>) -> bool {
        self.bounds_m.hold(point, MARGIN_M)
    }

    /// Whether it is the ground, which is everywhere.
    pub(super) fn is_ground(&self) -> bool {
        self.bounds_m == Bounds::everywhere()
    }

    /// Whether what is known of it stands between two points.
    pub(super) fn blocks(&self, from: &Vector3<f32>, to: &Vector3<f32>) -> bool {
        let (from_m, to_m) = (self.plane.height_m(from), self.plane.height_m(to));
        from_m * to_m < 0.0
            && from_m.abs().min(to_m.abs()) > CLEAR_M
            && self.bounds_m.hold(&crossing(&self.plane, from, to), THICKNESS_M)
    }
}

/// Whether what is known of a mirror, other than those that reflect, stands in a way from point to point.
pub(super) fn is_blocked(known: &[Known], reflecting: &[&Known], way: &[Vector3<f32>]) -> bool {
    known
        .iter()
        .filter(|mirror| !reflecting.iter().any(|met| core::ptr::eq(*met, *mirror)))
        .any(|mirror| {
            way.iter()
                .zip(way.iter().skip(1))
                .any(|(from, to)| mirror.blocks(from, to))
        })
}

/// Where the straight way between two points on either side of a plane passes through it.
pub(super) fn crossing(plane: &Plane, from: &Vector3<f32>, to: &Vector3<f32>) -> Vector3<f32> {
    let (from_m, to_m) = (plane.height_m(from), plane.height_m(to));
    from + (to - from) * (from_m / (from_m - to_m))
}

/// The first of all that are of one wall.
fn each_once<T>(mirrors: impl Iterator<Item = T>, plane: impl Fn(&T) -> &Plane) -> Vec<T, KNOWN> {
    let mut known = Vec::new();
    for mirror in mirrors {
        if !known.iter().any(|other| same(plane(other), plane(&mirror))) {
            // There is room for all of them.
            let _fits = known.push(mirror);
        }
    }
    known
}

/// Mirrors that may prove what a path is: the ground first when there is one, each wall once.
pub(super) fn proving(
    ground: Option<Plane>,
    surfaces: &[Surface],
    single: &Mirrors<MIRRORS>,
    supposed: &Mirrors<SUPPOSED>,
) -> Vec<Known, KNOWN> {
    let ground = ground.map(|plane| Known {
        plane,
        bounds_m: Bounds::everywhere(),
    });
    let mapped = surfaces.iter().map(|surface| Known {
        plane: surface.plane,
        bounds_m: bounds_of(surface),
    });
    let shown = single.proven().chain(supposed.proven()).map(|mirror| Known {
        plane: mirror.of.plane,
        bounds_m: mirror.bounds_m,
    });
    each_once(ground.into_iter().chain(mapped).chain(shown), |known| {
        &known.plane
    })
}

/// Mirrors that may hold the pose, each wall once.
pub(super) fn holding(
    surfaces: &[Surface],
    single: &Mirrors<MIRRORS>,
    supposed: &Mirrors<SUPPOSED>,
) -> Vec<MappedPlane, KNOWN> {
    let mapped = surfaces.iter().map(|surface| MappedPlane {
        id: surface.id,
        plane: surface.plane,
    });
    let shown = single.seen().chain(supposed.proven()).map(|mirror| mirror.of);
    each_once(mapped.chain(shown), |known| &known.plane)
}

/// Around the corners of a surface.
fn bounds_of(surface: &Surface) -> Bounds {
    let centre = surface.plane.centre.vector();
    let (t1, t2) = surface.plane.tangents();
    let [one, two] = surface.extent_m;
    let mut bounds = Bounds::at(centre);
    for a in one {
        for b in two {
            bounds.take_in(&(centre + t1 * a + t2 * b));
        }
    }
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cslam::mirrors::piece_of;
    use crate::cslam::routes::{Route, at, within_a_metre};
    use crate::cslam::specular;
    use crate::geometry::Direction;
    use crate::localization::planes::Orientation;

    /// The wall x = `east_m`, which faces west.
    fn wall(east_m: f32) -> Plane {
        let west = Direction::from_vector(-Vector3::x()).expect("not zero");
        piece_of(west, at(Vector3::new(east_m, 0.0, 3.0)))
    }

    fn surface(id: u32, plane: Plane) -> Surface {
        Surface {
            id,
            plane,
            orientation: Orientation::Vertical,
            extent_m: [[-3.0, 4.0], [-2.0, 5.0]],
            support: 9,
        }
    }

    fn ground() -> Plane {
        let ends = Route::over(&[[0.0, 0.0, 1.5], [4.0, 30.0, 9.0]]).ends();
        specular::ground(&ends, 0.0).expect("a number")
    }

    /// What so many sweeps, each from a stop of its own, have shown of a wall.
    fn shown<const N: usize>(mut mirrors: Mirrors<N>, sweeps: u32, plane: &Plane) -> Mirrors<N> {
        for sweep in 0..sweeps {
            mirrors.enter(sweep, sweep, plane);
        }
        mirrors
    }

    /// Enough to prove any mirror.
    const ENOUGH: u32 = 8;

    #[test]
    fn a_mirror_reaches_so_far_beyond_what_was_seen_of_it() {
        let seen = Vector3::new(10.0, 7.0, 3.0);
        let known = Known {
            plane: wall(10.0),
            bounds_m: within_a_metre(&seen),
        };
        for axis in [Vector3::y(), Vector3::z()] {
            for side in [-1.0, 1.0] {
                let at_m = |beyond_m: f32| seen + axis * side * (1.0 + beyond_m);
                assert!(known.reaches(&at_m(0.99 * MARGIN_M)), "{axis} {side}");
                assert!(!known.reaches(&at_m(1.01 * MARGIN_M)), "{axis} {side}");
            }
        }
    }

    #[test]
    fn a_wall_blocks_where_it_was_seen_and_spares_the_corner() {
        let known = Known {
            plane: wall(10.0),
            bounds_m: within_a_metre(&Vector3::new(10.0, 7.0, 3.0)),
        };
        let blocks = |from: [f32; 3], to: [f32; 3]| {
            let (from, to) = (from.into(), to.into());
            let [there, back] = [known.blocks(&from, &to), known.blocks(&to, &from)];
            assert_eq!(there, back);
            there
        };
        // Through it slantwise, at y = 7.5; past it, at y = 9; and before it.
        assert!(blocks([4.0, 9.0, 3.0], [14.0, 6.5, 3.0]));
        assert!(!blocks([4.0, 10.5, 3.0], [14.0, 8.0, 3.0]));
        assert!(!blocks([4.0, 9.0, 3.0], [9.9, 6.5, 3.0]));
        // Seen to y = 8, and hardly beyond.
        assert!(blocks(
            [4.0, 8.0 + 0.9 * THICKNESS_M, 3.0],
            [14.0, 8.0 + 0.9 * THICKNESS_M, 3.0]
        ));
        assert!(!blocks(
            [4.0, 8.0 + 1.2 * THICKNESS_M, 3.0],
            [14.0, 8.0 + 1.2 * THICKNESS_M, 3.0]
        ));
        // Points near it are not behind it.
        assert!(!blocks([4.0, 7.0, 3.0], [10.0 + 0.9 * CLEAR_M, 7.0, 3.0]));
        assert!(blocks([4.0, 7.0, 3.0], [10.0 + 1.1 * CLEAR_M, 7.0, 3.0]));
    }

    #[test]
    fn what_may_prove_is_the_ground_and_each_wall_once() {
        let surfaces = [surface(3, wall(10.0)), surface(4, wall(-20.0))];
        // One of the map's walls again, and one of their own.
        let single = shown(Mirrors::single(), ENOUGH, &wall(10.1));
        let single = shown(single, ENOUGH, &wall(30.0));
        let supposed = shown(Mirrors::supposed(), ENOUGH, &wall(30.05));
        let supposed = shown(supposed, ENOUGH, &wall(40.0));
        let known = proving(Some(ground()), &surfaces, &single, &supposed);
        let east_m: Vec<f32, KNOWN> = known
            .iter()
            .skip(1)
            .map(|known| known.plane.centre.vector().x)
            .collect();
        assert_eq!(east_m.as_slice(), [10.0, -20.0, 30.0, 40.0]);
        assert!(known[0].is_ground() && known[0].plane == ground());
        assert!(!known.iter().skip(1).any(Known::is_ground));
        assert!(known[0].reaches(&Vector3::new(-4e3, 9e3, 0.0)));
        assert_eq!(known[3].bounds_m, Bounds::at(wall(30.0).centre.vector()));
        assert!(
            !proving(None, &surfaces, &single, &supposed)
                .iter()
                .any(Known::is_ground)
        );
    }

    #[test]
    fn two_sweeps_hold_a_pose_and_prove_nothing() {
        let single = shown(Mirrors::single(), 2, &wall(10.0));
        let supposed = shown(Mirrors::supposed(), 2, &wall(40.0));
        assert!(proving(None, &[], &single, &supposed).is_empty());
        let held = holding(&[], &single, &supposed);
        assert_eq!(held.len(), 1);
        assert_eq!(held[0].plane, wall(10.0));
    }

    #[test]
    fn a_plane_of_the_map_is_not_named_twice() {
        let single = shown(Mirrors::single(), ENOUGH, &wall(10.0));
        let supposed = shown(Mirrors::supposed(), ENOUGH, &wall(10.1));
        let ids = |surfaces: &[Surface]| -> Vec<u32, KNOWN> {
            holding(surfaces, &single, &supposed)
                .iter()
                .map(|held| held.id)
                .collect()
        };
        let mirror = single.seen().next().expect("seen").of.id;
        assert_eq!(ids(&[surface(0, wall(10.05))]).as_slice(), [0]);
        assert_eq!(ids(&[]).as_slice(), [mirror]);
        assert_eq!(
            ids(&[surface(0, wall(12.0))]).as_slice(),
            [0, mirror],
            "another wall, 2 m behind"
        );
    }

    #[test]
    fn a_surface_is_known_to_its_corners() {
        let surface = surface(0, wall(10.0));
        let (t1, t2) = surface.plane.tangents();
        let corners =
            [(-3.0, -2.0), (4.0, 5.0)].map(|(a, b)| surface.plane.centre.vector() + t1 * a + t2 * b);
        let bounds = bounds_of(&surface);
        assert!(corners.iter().all(|corner| bounds.hold(corner, 1e-3)));
        assert!(!bounds.hold(&(corners[0] - t1), 0.9) && !bounds.hold(&(corners[1] + t2), 0.9));
    }
}
