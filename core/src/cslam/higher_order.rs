//! Paths of two and three reflections: known mirrors explain them, and every mirror met is a point of the map.
//!
//! A wave that planes A, then B reflected comes straight from the image in B of the GMT's image in A: as with one mirror, length
//! and direction of arrival are three numbers without a free one, and any other pair of planes misses them by metres and
//! degrees. A third plane is looked for from the UAV's side: seen in the last mirror, what is left is a path of two. Where the straight
//! way passes through the mirrors, in order, the wave was reflected; it must come to the front of each, and near where that is known.

use heapless::Vec;

use super::known::{KNOWN, Known, is_blocked};
use super::specular::{End, both, is_before, is_placed, misfit_of, point_on};
use crate::bounded::gather;
use crate::geometry::{Direction, Vector3, World};
use crate::path::Path;
use crate::reflection::{Ends, ReflectionPoint};

/// Most reflections of a path that is followed.
pub const MAX_REFLECTIONS: usize = 3;
/// Places that are compared with those that paths seem to come from, in a sweep: a million instructions. A dozen mirrors ask
/// for a thousand a path.
pub(super) const EFFORT: u32 = 40_000;
/// A place that is off by more than this is not looked at again, m, and as a share of the way.
const FAR: (f32, f32) = (1.0, 0.05);
/// How far the departure of a path of three reflections may be off that of its explanation, rad (3 degrees). There are so many threes
/// of mirrors that one in twenty fits by chance.
const DEPARTURE_RAD: f32 = 0.052;

/// Where known mirrors reflected a path, from the GMT to the UAV.
pub(super) type Reflections = Vec<ReflectionPoint, MAX_REFLECTIONS>;

/// Where the mirrors that explain a path best reflected it; `None` when no two or three do. `effort` is what is left of [`EFFORT`];
/// where it ends, nothing explains the path, and it is 0.
pub(super) fn explain(
    ends: &Ends,
    path: &Path<World>,
    known: &[Known],
    effort: &mut u32,
) -> Option<Reflections> {
    if !is_placed(ends) {
        return None;
    }
    let (uav, gmt) = (ends.uav.vector(), ends.gmt.vector());
    let source = uav + path.aoa.vector() * path.c_tau_m;
    let far_m = FAR.0 + FAR.1 * path.c_tau_m;
    let is_near = |a: &Vector3<f32>, b: &Vector3<f32>| (a - b).norm_squared() < far_m * far_m;
    // The last mirrors that the UAV may look into, with what the source is in them.
    let mut last: Vec<(&Known, Vector3<f32>), KNOWN> = Vec::new();
    for mirror in known.iter().filter(|mirror| is_before(&mirror.plane, uav)) {
        let _fits = last.push((mirror, mirror.plane.image(&source)));
    }
    let mut best: Option<(f32, Reflections)> = None;
    for first in known.iter().filter(|mirror| is_before(&mirror.plane, gmt)) {
        let one = first.plane.image(gmt);
        for second in known {
            if core::ptr::eq(first, second) || !is_before(&second.plane, &one) {
                continue;
            }
            let two = second.plane.image(&one);
            if is_near(&two, &source) {
                consider(ends, path, known, &[first, second], &mut best);
            }
            let looked = u32::try_from(last.len()).unwrap_or(u32::MAX).saturating_add(1);
            *effort = effort.saturating_sub(looked);
            if *effort == 0 {
                return None;
            }
            for (third, seen) in &last {
                if is_near(&two, seen) && !core::ptr::eq(*third, second) && is_before(&third.plane, &two) {
                    consider(ends, path, known, &[first, second, third], &mut best);
                }
            }
        }
    }
    best.map(|(_, points)| points)
}

/// Keeps an explanation if it is the best so far.
fn consider(
    ends: &Ends,
    path: &Path<World>,
    known: &[Known],
    chain: &[&Known],
    best: &mut Option<(f32, Reflections)>,
) {
    let mut sources: Vec<End, MAX_REFLECTIONS> = Vec::new();
    let [uav, gmt] = both(ends);
    let mut source = gmt;
    for mirror in chain {
        let _fits = sources.push(source);
        source = source.mirrored(&mirror.plane);
    }
    let Some(misfit) = misfit_of(ends, path, &source.at) else {
        return;
    };
    if best.as_ref().is_some_and(|(least, _)| *least <= misfit) {
        return;
    }
    if let Some(points) = reflections(uav, &sources, chain)
        && !is_blocked(known, chain, &way(ends, &points))
        && (chain.len() < MAX_REFLECTIONS
            || points
                .first()
                .is_some_and(|first| left_towards(ends, path, first.position.vector(), DEPARTURE_RAD)))
    {
        *best = Some((misfit, points));
    }
}

/// Where the mirrors of a chain reflect, met backwards from the UAV. `None` when they do not. Each lies between the GMT as the mirrors
/// before show it and the UAV as those after do: so the error of every mirror enters a point once.
fn reflections(uav: End, sources: &[End], chain: &[&Known]) -> Option<Reflections> {
    let (mut seen, mut next) = (uav, uav.at);
    let mut backwards = Reflections::new();
    for (mirror, source) in chain.iter().zip(sources).rev() {
        let point = point_on(&seen, source, &mirror.plane)?;
        let here = *point.position.vector();
        if !is_before(&mirror.plane, &next) || !mirror.reaches(&here) {
            return None;
        }
        let distance_m = (here - uav.at).norm();
        backwards.push(ReflectionPoint { distance_m, ..point }).ok()?;
        (seen, next) = (seen.mirrored(&mirror.plane), here);
    }
    let mut points = Reflections::new();
    for point in backwards.iter().rev() {
        points.push(*point).ok()?;
    }
    Some(points)
}

/// From the GMT over these points to the UAV.
fn way(ends: &Ends, points: &[ReflectionPoint]) -> Vec<Vector3<f32>, { MAX_REFLECTIONS + 2 }> {
    let points = points.iter().map(|point| *point.position.vector());
    gather(
        core::iter::once(*ends.gmt.vector())
            .chain(points)
            .chain(core::iter::once(*ends.uav.vector())),
    )
}

/// Whether a path left the GMT for a point, to within an angle. A departure that is not known went nowhere.
pub(super) fn left_towards(ends: &Ends, path: &Path<World>, point: &Vector3<f32>, within_rad: f32) -> bool {
    let way = Direction::<World>::from_vector(point - ends.gmt.vector());
    path.aod
        .zip(way.ok())
        .is_some_and(|(departure, way)| departure.direction.angle_to_rad(&way) < within_rad)
}

#[cfg(test)]
mod tests;
