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
/// A wave may be reflected this far beyond what a mirror is known by, m: a wall goes on, but where there is none the line of
/// sight may pass.
const MARGIN_M: f32 = 6.0;

/// A mirror and how far from its centre it is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Known {
    pub(super) plane: Plane,
    pub(super) reach_m: f32,
}

impl Known {
    /// Whether it is known to be anywhere near a point on it.
    pub(super) fn reaches(&self, point_m: &Vector3<f32>) -> bool {
        (point_m - self.plane.centre.vector()).norm() < self.reach_m + MARGIN_M
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
        reach_m: f32::INFINITY,
    });
    let mapped = surfaces.iter().map(|surface| Known {
        plane: surface.plane,
        reach_m: half_diagonal_m(surface),
    });
    let shown = single.proven().chain(supposed.proven()).map(|mirror| Known {
        plane: mirror.of.plane,
        reach_m: mirror.reach_m,
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

/// How far a surface reaches from its plane's centre, m: at most.
fn half_diagonal_m(surface: &Surface) -> f32 {
    let most = |[least, most]: [f32; 2]| most.max(-least);
    let [one, two] = surface.extent_m.map(most);
    libm::sqrtf(one * one + two * two)
}
