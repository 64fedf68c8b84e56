//! The planes that reflected a path, as mirrors of the GMT, with the derivatives of its image.

use nalgebra::Vector3;

use super::{MAX_BOUNCES, MappedPlane, wide};
use crate::estimator::row::Row;
use crate::geometry::Real;

/// The mirrors of a path: each shows the image that the one before it made.
pub(super) fn mirrors(
    gmt_m: &Vector3<f64>,
    bounces: &[(&MappedPlane, usize)],
) -> heapless::Vec<Mirror, MAX_BOUNCES> {
    let mut mirrors = heapless::Vec::<Mirror, MAX_BOUNCES>::new();
    for (plane, state) in bounces {
        let from = mirrors.last().map_or(*gmt_m, |m| m.image_m);
        let mirror = Mirror::new(plane, *state, &from);
        // What moves an image moves the images of that image, mirrored.
        for earlier in &mut mirrors {
            earlier.image_by = earlier.image_by.map(|by| mirror.turn(&by));
        }
        let _ = mirrors.push(mirror);
    }
    mirrors
}

/// A plane as a mirror of the GMT.
pub(super) struct Mirror {
    state: usize,
    normal: Vector3<f64>,
    tangents: [Vector3<f64>; 2],
    /// The image of the GMT, m.
    pub(super) image_m: Vector3<f64>,
    /// Derivative of the image with respect to offset and tilts.
    image_by: [Vector3<f64>; 3],
}

impl Mirror {
    fn new(plane: &MappedPlane, state: usize, gmt_m: &Vector3<f64>) -> Self {
        let n = wide(plane.plane.normal.vector());
        let (t1, t2) = plane.plane.tangents();
        let (t1, t2) = (wide(&t1), wide(&t2));
        let from_centre = gmt_m - wide(plane.plane.centre.vector());
        let height = n.dot(&from_centre);
        let tilted = |t: &Vector3<f64>| (n * t.dot(&from_centre) + t * height) * -2.0;
        Self {
            state,
            normal: n,
            tangents: [t1, t2],
            image_m: gmt_m - n * (2.0 * height),
            image_by: [n * 2.0, tilted(&t1), tilted(&t2)],
        }
    }

    /// A vector mirrored at the plane.
    pub(super) fn turn(&self, v: &Vector3<f64>) -> Vector3<f64> {
        v - self.normal * (2.0 * self.normal.dot(v))
    }

    /// Adds the derivatives with respect to the plane: through the image, and what is given for the tilts besides.
    pub(super) fn push<T: Real>(&self, row: &mut Row<T>, by_image: &Vector3<f64>, tilts: [f64; 2]) {
        let [offset, first, second] = self.image_by.map(|d| by_image.dot(&d));
        row.push(self.state, offset);
        row.push(self.state + 1, first + tilts[0]);
        row.push(self.state + 2, second + tilts[1]);
    }

    /// Derivatives of the cosine of departure along `axis` with respect to the tilts, at a fixed image; `arriving` is the
    /// direction from the image to the UAV.
    pub(super) fn departure_tilts(&self, axis: &Vector3<f64>, arriving: &Vector3<f64>) -> [f64; 2] {
        self.tangents.map(|t| {
            -2.0 * (t.dot(arriving) * self.normal.dot(axis) + self.normal.dot(arriving) * t.dot(axis))
        })
    }
}
