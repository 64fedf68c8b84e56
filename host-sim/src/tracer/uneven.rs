//! Paths over surfaces that are off their faces ([`Unevenness`](crate::scene::Unevenness)).
//!
//! The tracer finds a path over the flat faces; here it is led over the surfaces. A wave takes the way whose length is stationary
//! (Fermat), so its reflection points are sought by Newton's method from the flat ones on: two unknowns for each reflection, one for
//! an edge. What reflects there is the tangent plane at the point: its normal, its material, no curvature.
//!
//! The flat faces decide which paths there are and what is in their way. A path stays that of the flat faces where no way over the
//! surfaces takes its place: the search does not end in a way that is the shortest nearby (ground that is curved more than that
//! has several such points about one flat one, none of which is singled out), a point comes to lie beyond the face, or a leg is
//! blocked. None is dropped and none is added, so that the field stays that which the edges complete.

use nalgebra::{SMatrix, SVector};

use super::diffraction::LitEdges;
use super::field::{self, Bounce};
use super::path::{Place, TracedPath};
use super::surface::Surfaces;
use super::{LEAST_DISTANCE_M, MAX_ORDER};
use crate::scene::{Patch, Scene, Uneven, Vec3};

/// Unknowns of a path at most: two for each reflection.
const UNKNOWNS: usize = 2 * MAX_ORDER;

/// Steps of Newton's method: three or four do where the way is well defined.
const STEPS: usize = 12;

/// The length is stationary when moving a point by a metre would change it by less than this, m. What is left of the length is
/// of second order.
const STATIONARY: f64 = 1e-10;

/// Faces within this of one plane are one surface: by the cosine of their normals, and m.
const SAME_NORMAL: f64 = 1.0 - 1e-8;
const SAME_PLANE_M: f64 = 1e-3;

/// What lies between two ends.
pub(super) struct UnevenLink<'a> {
    pub(super) scene: &'a Scene,
    pub(super) uneven: &'a Uneven,
    /// With diffraction.
    pub(super) edges: Option<&'a LitEdges<'a>>,
    /// Transmitter and receiver.
    pub(super) ends: [&'a Vec3; 2],
    pub(super) surfaces: &'a Surfaces<'a>,
}

/// Something that a path meets, with the place that is sought.
#[derive(Clone, Copy)]
enum Step<'a> {
    /// A surface over a point of its face's plane.
    Surface {
        face: u32,
        patch: Patch<'a>,
        axes: [Vec3; 2],
        normal: &'a Vec3,
        foot: Vec3,
    },
    /// A point of an edge.
    Edge { along: Vec3, point: Vec3 },
}

/// A point on the way, and how it moves with its unknowns.
#[derive(Clone, Copy, Default)]
struct Met {
    point: Vec3,
    /// Derivatives by each unknown, and how many there are.
    tangents: [Vec3; 2],
    count: usize,
    /// Second derivatives: twice by the first, by both, twice by the second.
    bends: [Vec3; 3],
    /// Normal of the surface.
    normal: Vec3,
}

impl Step<'_> {
    fn met(&self) -> Met {
        match self {
            Self::Edge { along, point } => Met {
                point: *point,
                tangents: [*along, Vec3::zeros()],
                count: 1,
                ..Met::default()
            },
            Self::Surface {
                patch,
                axes,
                normal,
                foot,
                ..
            } => {
                let shape = patch.shape(foot, axes);
                let [u, v] = [0, 1].map(|i| axes[i] + *normal * shape.slope[i]);
                Met {
                    point: foot + *normal * shape.height_m,
                    tangents: [u, v],
                    count: 2,
                    bends: shape.bend_per_m.map(|bend| *normal * bend),
                    normal: u.cross(&v).normalize(),
                }
            }
        }
    }

    fn advance(&mut self, by_m: &[f64]) {
        match self {
            Self::Edge { along, point } => *point += *along * by_m[0],
            Self::Surface { axes, foot, .. } => *foot += axes[0] * by_m[0] + axes[1] * by_m[1],
        }
    }
}

impl<'a> UnevenLink<'a> {
    /// The path over the surfaces that takes the place of one over the flat faces; `None` where the flat one stays.
    pub(super) fn met(&self, flat: &TracedPath) -> Option<TracedPath> {
        if !flat.faces().iter().any(|&face| self.uneven.is_off(face)) {
            return None;
        }
        let steps = self.settled(flat)?;
        let steps = &steps[..flat.order()];
        let mut met = [Met::default(); MAX_ORDER];
        for (met, step) in met.iter_mut().zip(steps) {
            *met = step.met();
        }
        let met = &met[..steps.len()];
        if !self.lies_on_faces(steps) || !self.reflects(met) || !self.is_clear(flat, steps, met) {
            return None;
        }
        self.path(flat, steps, met)
    }

    /// Steps whose length is stationary, each on the panel that it is over. A point that the panel of its flat path leaves to a
    /// neighbour is sought there; where that one gives it back, the first counts, a little beyond its rim: the joint is
    /// narrower than what the wave sees of it.
    fn settled(&self, flat: &TracedPath) -> Option<[Step<'a>; MAX_ORDER]> {
        let start = self.start(flat)?;
        let count = flat.order();
        let first = self.stationary(start, count)?;
        let over = self.over(&first, count);
        if same_patches(&first[..count], &over[..count]) {
            return Some(first);
        }
        let second = self.stationary(over, count);
        let settled =
            second.filter(|second| same_patches(&second[..count], &self.over(second, count)[..count]));
        settled.or(Some(first))
    }

    /// The flat path as steps.
    fn start(&self, flat: &TracedPath) -> Option<[Step<'a>; MAX_ORDER]> {
        let mut steps = [Step::Edge {
            along: Vec3::zeros(),
            point: Vec3::zeros(),
        }; MAX_ORDER];
        let mut faces = flat.faces().iter();
        for (place, (step, vertex)) in steps.iter_mut().zip(flat.vertices()).enumerate() {
            let foot = Vec3::from(*vertex);
            *step = if flat.kind.edge() == Some(place) {
                let along = self.edges?.along(flat.wedge?);
                Step::Edge { along, point: foot }
            } else {
                let number = *faces.next()?;
                let face = &self.scene.faces()[number as usize];
                Step::Surface {
                    face: number,
                    patch: self.uneven.patch(number, &foot),
                    axes: face.axes(),
                    normal: face.normal(),
                    foot,
                }
            };
        }
        Some(steps)
    }

    /// The same steps on the patches that they are over.
    fn over(&self, steps: &[Step<'a>; MAX_ORDER], count: usize) -> [Step<'a>; MAX_ORDER] {
        let mut over = *steps;
        for step in &mut over[..count] {
            if let Step::Surface {
                face, patch, foot, ..
            } = step
            {
                *patch = self.uneven.patch(*face, foot);
            }
        }
        over
    }

    /// The steps at which the length of the way is stationary, and the least nearby.
    fn stationary(&self, mut steps: [Step<'a>; MAX_ORDER], count: usize) -> Option<[Step<'a>; MAX_ORDER]> {
        for _ in 0..STEPS {
            let (gradient, curvature) = self.length_derivatives(&steps[..count])?;
            if gradient.amax() < STATIONARY {
                return Some(steps);
            }
            let by_m = curvature.cholesky()?.solve(&gradient);
            for (i, step) in steps[..count].iter_mut().enumerate() {
                step.advance(&[-by_m[2 * i], -by_m[2 * i + 1]]);
            }
        }
        None
    }

    /// First and second derivatives of the length of the way; ones on the diagonal where there is no unknown.
    fn length_derivatives(
        &self,
        steps: &[Step<'a>],
    ) -> Option<(SVector<f64, UNKNOWNS>, SMatrix<f64, UNKNOWNS, UNKNOWNS>)> {
        let mut gradient = SVector::zeros();
        let mut curvature = SMatrix::identity();
        let mut before: Option<(usize, Met)> = None;
        let mut from = *self.ends[0];
        // What the leg that arrives adds to the point that it leaves from is added when it is known.
        for place in 0..=steps.len() {
            let here = steps.get(place).map(Step::met);
            let to = here.as_ref().map_or(*self.ends[1], |met| met.point);
            let way = to - from;
            let length_m = way.norm();
            if length_m < LEAST_DISTANCE_M {
                return None;
            }
            let along = way / length_m;
            let across = |a: &Vec3, b: &Vec3| (a.dot(b) - a.dot(&along) * b.dot(&along)) / length_m;
            for (sign, end) in [(-1.0, before), (1.0, here.map(|met| (place, met)))] {
                let Some((number, met)) = end else { continue };
                let arrives = sign > 0.0;
                for a in 0..met.count {
                    gradient[2 * number + a] += sign * met.tangents[a].dot(&along);
                    for b in 0..met.count {
                        let bend = met.bends[a + b].dot(&along) * sign;
                        let entry = across(&met.tangents[a], &met.tangents[b]) + bend;
                        let sum = &mut curvature[(2 * number + a, 2 * number + b)];
                        // The first to come replaces the one on the diagonal.
                        *sum = if arrives { entry } else { *sum + entry };
                    }
                }
            }
            if let (Some((number, near)), Some(far)) = (before, here) {
                for a in 0..near.count {
                    for b in 0..far.count {
                        let entry = -across(&near.tangents[a], &far.tangents[b]);
                        curvature[(2 * number + a, 2 * place + b)] = entry;
                        curvature[(2 * place + b, 2 * number + a)] = entry;
                    }
                }
            }
            before = here.map(|met| (place, met));
            from = to;
        }
        Some((gradient, curvature))
    }

    /// Whether every foot lies in its face, or in another of the same plane.
    fn lies_on_faces(&self, steps: &[Step<'_>]) -> bool {
        steps.iter().all(|step| match step {
            Step::Edge { .. } => true,
            Step::Surface {
                face, normal, foot, ..
            } => {
                let across = *normal * SAME_PLANE_M;
                self.scene.faces()[*face as usize].contains(foot)
                    || self
                        .scene
                        .find_crossed(foot + across, foot - across, |other| {
                            self.is_one(other, *face, foot)
                        })
                        .is_some()
            }
        })
    }

    /// Whether two faces are parts of one plane, at a point of it.
    fn is_one(&self, other: u32, face: u32, at: &Vec3) -> bool {
        let [other, face] = [other, face].map(|number| &self.scene.faces()[number as usize]);
        other.normal().dot(face.normal()) > SAME_NORMAL && other.height_m(at).abs() < SAME_PLANE_M
    }

    /// Whether the wave comes to every surface from its front and leaves it there.
    fn reflects(&self, met: &[Met]) -> bool {
        let place = |i: usize| match i {
            0 => *self.ends[0],
            i => met.get(i - 1).map_or(*self.ends[1], |met| met.point),
        };
        met.iter().enumerate().all(|(i, here)| {
            let rises = |other: &Vec3| (other - here.point).dot(&here.normal) > 0.0;
            here.count == 1 || (rises(&place(i)) && rises(&place(i + 2)))
        })
    }

    /// Whether all legs are free of the flat faces, those aside that a leg starts or ends on and those of the same plane.
    fn is_clear(&self, flat: &TracedPath, steps: &[Step<'_>], met: &[Met]) -> bool {
        let own = |step: Option<&Step<'_>>, crossed: u32| match step {
            None => false,
            Some(Step::Edge { .. }) => {
                let flanks = self
                    .edges
                    .zip(flat.wedge)
                    .map(|(edges, wedge)| edges.flanks(wedge));
                flanks.is_some_and(|flanks| flanks.contains(&crossed))
            }
            Some(Step::Surface { face, foot, .. }) => *face == crossed || self.is_one(crossed, *face, foot),
        };
        (0..=steps.len()).all(|leg| {
            let near = leg.checked_sub(1);
            let from = near.map_or(*self.ends[0], |i| met[i].point);
            let to = met.get(leg).map_or(*self.ends[1], |met| met.point);
            let (near, far) = (near.map(|i| &steps[i]), steps.get(leg));
            self.scene
                .find_crossed(from, to, |face| !own(near, face) && !own(far, face))
                .is_none()
        })
    }

    fn path(&self, flat: &TracedPath, steps: &[Step<'_>], met: &[Met]) -> Option<TracedPath> {
        let mut points = [*self.ends[1]; MAX_ORDER + 2];
        points[0] = *self.ends[0];
        for (point, met) in points[1..].iter_mut().zip(met) {
            *point = met.point;
        }
        let points = &points[..met.len() + 2];
        let mut bounces = steps.iter().zip(met).filter_map(|(step, met)| match step {
            Step::Edge { .. } => None,
            Step::Surface { face, patch, .. } => Some(Bounce {
                normal: &met.normal,
                surface: self.surfaces.at(*face, patch),
            }),
        });
        let frequency_hz = self.scene.frequency_hz();
        if flat.wedge.is_some() {
            let bounce = bounces.next()?;
            let inner = &points[1..=met.len()];
            return self
                .edges?
                .around(flat, inner, &bounce, self.ends, frequency_hz, self.surfaces);
        }
        let length_m = points.windows(2).map(|leg| (leg[1] - leg[0]).norm()).sum();
        let [gain, across] = field::gains(frequency_hz, points, bounces, length_m);
        let places = points[1..].iter().zip(flat.faces()).map(|(point, face)| Place {
            point: *point,
            face: Some(*face),
        });
        let path = TracedPath::through(flat.kind, self.ends[0], places, self.ends[1], gain);
        Some(path.with_across(across))
    }
}

/// Whether steps are on the same patches.
fn same_patches(some: &[Step<'_>], others: &[Step<'_>]) -> bool {
    some.iter().zip(others).all(|pair| match pair {
        (Step::Surface { patch: a, .. }, Step::Surface { patch: b, .. }) => a.is(b),
        _ => true,
    })
}

#[cfg(test)]
mod tests;
