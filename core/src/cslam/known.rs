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
            && self
                .bounds_m
                .hold(&(from + (to - from) * (from_m / (from_m - to_m))), THICKNESS_M)
    }
}

/// Mirrors that may prove what a path is: the ground first when there is one, each wall once.
pub(super) fn proving(
    ground: Option<Plane>,
    surfaces: &[Surface],
    single: &Mirrors<MIRRORS>,
    supposed: &Mirrors<SUPPOSED>,
) -> Vec<Known, KNOWN> {
    let mut known = Vec::new();
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
    for mirror in ground.into_iter().chain(mapped).chain(shown) {
        if !known
            .iter()
            .any(|other: &Known| same(&other.plane, &mirror.plane))
        {
            // There is room for all of them.
            let _fits = known.push(mirror);
        }
    }
    known
}

/// Mirrors that may hold the pose, each wall once.
pub(super) fn holding(
    surfaces: &[Surface],
    single: &Mirrors<MIRRORS>,
    supposed: &Mirrors<SUPPOSED>,
) -> Vec<MappedPlane, KNOWN> {
    let mut known = Vec::new();
    let mapped = surfaces.iter().map(|surface| MappedPlane {
        id: surface.id,
        plane: surface.plane,
    });
    let shown = single.seen().chain(supposed.proven()).map(|mirror| mirror.of);
    for mirror in mapped.chain(shown) {
        if !known
            .iter()
            .any(|other: &MappedPlane| same(&other.plane, &mirror.plane))
        {
            let _fits = known.push(mirror);
        }
    }
    known
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
