//! Accepted points against the surfaces that truly reflected their waves: is it the right wall, and how far off is the point?
//!
//! A point may slide along the right wall and still say where that wall is; a point of the right order on a plane where there is no wall
//! says nothing true.

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
    /// Accepted points far off any true surface; none without points.
    pub(super) far: Option<usize>,
}

/// Judges the accepted points. The log's paths must have been matched.
pub(super) fn judge(log: &FlightLog, surfaces: &Surfaces<'_>) -> ByFaces {
    let (mut known, mut right, mut far) = (0, 0, 0);
    for point in &log.points {
        far += usize::from(is_far(point, surfaces));
        if let Some(is_right) = is_right(log, point, surfaces) {
            known += 1;
            right += usize::from(is_right);
        }
    }
    ByFaces {
        precision: share(right, known),
        far: (!log.points.is_empty()).then_some(far),
    }
}

/// Whether a point is of the order that it presumes and lies on the surface that reflected its path; `None` when the truth is not known.
pub(super) fn is_right(log: &FlightLog, point: &PointRecord, surfaces: &Surfaces<'_>) -> Option<bool> {
    let truth = log.truth_of(point)?;
    let of_order = truth.filter(|path| path.order == Some(point.order) && !path.is_off_mover());
    Some(of_order.is_some_and(|path| is_on_face(path, point, surfaces)))
}

/// Whether a point lies on the surface where its true path was reflected. Of three reflections the truth names only the outer two: the
/// one between must lie on any.
fn is_on_face(path: &LinkPath, point: &PointRecord, surfaces: &Surfaces<'_>) -> bool {
    let off_m = |at: [f64; 3]| {
        surfaces
            .nearest(at)
            .map_or(f64::INFINITY, |(_, distance_m)| distance_m)
    };
    let Some(vertex) = vertex(path, point) else {
        return off_m(point.position_m) <= SAME_FACE_M;
    };
    let apart = Vector3::from(point.position_m) - Vector3::from(vertex);
    surfaces
        .faces_at(vertex)
        .any(|face| face.normal().dot(&apart).abs() <= SAME_FACE_M)
}

fn is_far(point: &PointRecord, surfaces: &Surfaces<'_>) -> bool {
    let Some((_, off_m)) = surfaces.nearest(point.position_m) else {
        return false;
    };
    off_m > FAR_M && off_m > FAR_SIGMAS * point.covariance_trace_m2.max(0.0).sqrt()
}

/// Where the true path was reflected that an accepted point is of; of three reflections the truth names only the outer two.
pub(super) fn vertex(path: &LinkPath, point: &PointRecord) -> Option<[f64; 3]> {
    if point.reflection == point.order {
        path.last_vertex
    } else if point.reflection == 1 {
        path.first_vertex
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{near, point};
    use super::*;
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

    /// One accepted point of a path that was reflected once at (5, 10, 1.5).
    fn judged(position_m: [f64; 3], order: u8) -> ByFaces {
        let mut heard = sweep(0, [5.0, 0.0, 1.5]);
        let mut path = true_path(order, 20.0, [1.5, 1.5]);
        path.last_vertex = Some([5.0, 10.0, 1.5]);
        heard.truth.link.as_mut().expect("known").paths = vec![path];
        heard.estimate.paths = vec![measured(20.1, [1.5, 1.5])];
        let mut log = log_of(vec![heard]);
        log.points = vec![point(0, 0, position_m)];
        super::super::matching::match_paths(&mut log, &super::super::MatchGates::default());
        judge(&log, &Surfaces::new(&walls()))
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
}
