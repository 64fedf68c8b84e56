//! Accepted points against the surfaces that truly reflected their waves: is it the right wall, and how far off is the point?
//!
//! A point may slide along the right wall and still say where that wall is; a point of the right order on a plane where there is no wall
//! says nothing true.
//!
//! An edge counts as an interaction: what was bent and reflected is no single reflection. Where the bend is slight, the wave was reflected all
//! the same where the point says, so a second figure leaves edges aside.

use nalgebra::Vector3;

use super::figures::share;
use super::surface::Surfaces;
use crate::flight_log::{FlightLog, PointRecord};
use crate::paths::LinkPath;

/// A point this far off the plane of the surface that reflected its wave is on another one, m.
const SAME_FACE_M: f64 = 0.6;
/// A point is far off when it is off any true surface by more than this, m, and by more than so many standard deviations that are
/// claimed for it.
const FAR_M: f64 = 0.3;
const FAR_SIGMAS: f64 = 3.0;

/// What the points of a flight are by their surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct ByFaces {
    /// Share of the accepted points of known truth whose path truly had as many reflections as they presume and that lie on the
    /// surface that reflected it there.
    pub(super) precision: Option<f64>,
    /// The same share where an edge that bent the wave on its way to a wall, or from it, does not make it a wave of another order.
    pub(super) precision_edges_aside: Option<f64>,
    /// Accepted points far off any true surface; none without points.
    pub(super) far: Option<usize>,
}

/// Whether an edge is one of the interactions that a point presumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Edges {
    Count,
    Aside,
}

/// Judges the accepted points. The log's paths must have been matched.
pub(super) fn judge(log: &FlightLog, surfaces: &Surfaces<'_>) -> ByFaces {
    let (mut known, mut right, mut right_edges_aside, mut far) = (0, 0, 0, 0);
    for point in &log.points {
        far += usize::from(is_far(point, surfaces));
        let Some(truth) = log.truth_of(point) else {
            continue;
        };
        let truth = truth.filter(|path| !path.is_off_mover());
        let by = |edges| truth.is_some_and(|path| is_on_its_face(path, point, surfaces, edges));
        let is_right = by(Edges::Count);
        known += 1;
        right += usize::from(is_right);
        right_edges_aside += usize::from(is_right || by(Edges::Aside));
    }
    ByFaces {
        precision: share(right, known),
        precision_edges_aside: share(right_edges_aside, known),
        far: (!log.points.is_empty()).then_some(far),
    }
}

/// Whether a path was turned as often as a point presumes, and the point lies on the surface that turned it there. Of three turns the truth
/// names the outer two, and an edge: another one between must lie on any surface.
fn is_on_its_face(path: &LinkPath, point: &PointRecord, surfaces: &Surfaces<'_>, edges: Edges) -> bool {
    let edge = path.kind.and_then(|kind| kind.edge());
    let aside = edge.filter(|_| edges == Edges::Aside);
    let turns = usize::from(point.order) + usize::from(aside.is_some());
    if path.order.map(usize::from) != Some(turns) {
        return false;
    }
    let among_counted = usize::from(point.reflection).saturating_sub(1);
    let place = among_counted + usize::from(aside.is_some_and(|edge| edge <= among_counted));
    let off_m = |at: [f64; 3]| {
        surfaces
            .nearest(at)
            .map_or(f64::INFINITY, |(_, distance_m)| distance_m)
    };
    let Some(vertex) = turned_at(path, place, turns) else {
        return off_m(point.position_m) <= SAME_FACE_M;
    };
    let apart = Vector3::from(point.position_m) - Vector3::from(vertex);
    surfaces
        .faces_at(vertex)
        .any(|face| face.normal().dot(&apart).abs() <= SAME_FACE_M)
}

/// Where a path was turned for the `place`-th time, from 0, of so many.
fn turned_at(path: &LinkPath, place: usize, turns: usize) -> Option<[f64; 3]> {
    if place + 1 == turns {
        path.last_vertex
    } else if place == 0 {
        path.first_vertex
    } else {
        path.edge_point
            .filter(|_| path.kind.and_then(|kind| kind.edge()) == Some(place))
    }
}

fn is_far(point: &PointRecord, surfaces: &Surfaces<'_>) -> bool {
    let Some((_, off_m)) = surfaces.nearest(point.position_m) else {
        return false;
    };
    off_m > FAR_M && off_m > FAR_SIGMAS * point.covariance_trace_m2.max(0.0).sqrt()
}

/// Where the true path of its order was reflected that an accepted point is of; of three reflections the truth names only the outer two.
pub(super) fn vertex(path: &LinkPath, point: &PointRecord) -> Option<[f64; 3]> {
    turned_at(
        path,
        usize::from(point.reflection).saturating_sub(1),
        usize::from(point.order),
    )
}

#[cfg(test)]
mod tests {
    use super::super::tests::{near, point};
    use super::*;
    use crate::paths::{Interaction, Kind};
    use crate::scene::{DEFAULT_FREQUENCY_HZ, Material, RawFace, Scene};
    use crate::test_flight::{log_of, measured, sweep, true_path};

    /// Walls at y = 10 and, a setback further back, at y = 11.
    fn walls() -> Scene {
        let wall = |x0: f64, x1: f64, y: f64| RawFace {
            vertices: vec![[x0, y, 0.0], [x1, y, 0.0], [x1, y, 5.0], [x0, y, 5.0]],
            ..RawFace::default()
        };
        let faces = vec![wall(0.0, 10.0, 10.0), wall(10.0, 20.0, 11.0)];
        Scene::new("walls", Material::PAPER, DEFAULT_FREQUENCY_HZ, None, faces).expect("polygons")
    }

    /// One accepted point of this path.
    fn judged_of(path: &LinkPath, point: PointRecord) -> ByFaces {
        let mut heard = sweep(0, [5.0, 0.0, 1.5]);
        heard.truth.link.as_mut().expect("known").paths = vec![path.clone()];
        heard.estimate.paths = vec![measured(20.1, [1.5, 1.5])];
        let mut log = log_of(vec![heard]);
        log.points = vec![point];
        super::super::matching::match_paths(&mut log, &super::super::MatchGates::default());
        judge(&log, &Surfaces::new(&walls()))
    }

    /// One accepted point of a path that was reflected once at (5, 10, 1.5).
    fn judged(position_m: [f64; 3], order: u8) -> ByFaces {
        let mut path = true_path(order, 20.0, [1.5, 1.5]);
        path.last_vertex = Some([5.0, 10.0, 1.5]);
        judged_of(&path, point(0, 0, position_m))
    }

    #[test]
    fn a_point_slides_along_its_wall_but_is_on_no_other() {
        // Three metres along the wall and half a metre off it, beyond its claimed 0.3 m.
        let slid = judged([8.0, 10.5, 1.5], 1);
        assert!(near(slid.precision, 1.0));
        assert_eq!(slid.far, Some(1));
        // On the other wall, where nothing was reflected.
        let other = judged([15.0, 11.0, 1.5], 1);
        assert!(near(other.precision, 0.0));
        assert_eq!(other.far, Some(0));
        // The right wall, for a path of another order.
        assert!(near(judged([5.0, 10.0, 1.5], 2).precision, 0.0));
        // Before the wall by less than a third of a metre.
        let close = judged([5.0, 9.75, 1.5], 1);
        assert_eq!((close.precision, close.far), (Some(1.0), Some(0)));
    }

    #[test]
    fn a_wave_that_an_edge_bent_is_of_another_order_and_was_reflected_where_the_point_is_all_the_same() {
        let mut path = true_path(2, 20.0, [1.5, 1.5]);
        path.kind = Some(Kind::of(&[Interaction::Diffraction, Interaction::Reflection]).expect("two"));
        (path.first_vertex, path.last_vertex) = (Some([0.0, 2.0, 1.5]), Some([5.0, 10.0, 1.5]));
        path.edge_point = path.first_vertex;
        let both = |judged: ByFaces| (judged.precision, judged.precision_edges_aside);
        let near_by = point(0, 0, [5.2, 10.1, 1.5]);
        assert_eq!(both(judged_of(&path, near_by)), (Some(0.0), Some(1.0)));
        // On the wall that did not reflect it.
        let elsewhere = judged_of(&path, point(0, 0, [15.0, 11.0, 1.5]));
        assert_eq!(elsewhere.precision_edges_aside, Some(0.0));
        // As what it is, the second of two: right by either.
        let second_of_two = PointRecord {
            order: 2,
            reflection: 2,
            ..near_by
        };
        assert_eq!(both(judged_of(&path, second_of_two)), (Some(1.0), Some(1.0)));
    }
}
