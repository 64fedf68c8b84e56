//! One planar polygon: validation, plane, and the point-in-polygon test that every query ends in.

use std::fmt;

use super::{RawFace, Vec3};
use crate::input::limits::FACE_VERTICES;

/// Greatest distance of a vertex from the face's plane, m. Single-precision meshes of a town stay below a tenth of it.
pub const PLANARITY_TOLERANCE_M: f64 = 1e-4;

/// Vertices and edges closer than this are the same, m.
const DISTINCT_M: f64 = 1e-6;

/// Points this far outside an edge still count as inside, m: neighbouring faces leave no slit between them.
const EDGE_TOLERANCE_M: f64 = 1e-9;

/// Greatest absolute coordinate, m: beyond it, rounding would exceed the tracer's tolerances.
pub const MAX_COORDINATE_M: f64 = 1e7;

/// Least cosine between a stated normal and that of the vertices.
const NORMAL_AGREEMENT: f64 = 0.999;

/// Why a polygon is no face.
#[derive(Clone, Debug, PartialEq)]
pub enum FaceError {
    /// Fewer than three vertices.
    TooFewVertices(usize),
    /// More vertices than [`FACE_VERTICES`].
    TooManyVertices(usize),
    /// A coordinate that is NaN, infinite, or beyond [`MAX_COORDINATE_M`], at this vertex.
    OutOfRange(usize),
    /// A vertex repeats its predecessor.
    RepeatedVertex(usize),
    /// No area: all vertices on a line.
    NoArea,
    /// A vertex off the plane of the others, by so many metres.
    NotPlanar {
        /// The vertex farthest off.
        vertex: usize,
        /// Its distance from the plane, m.
        off_m: f64,
    },
    /// Two edges (numbered by their first vertex) that cross or touch.
    SelfIntersecting(usize, usize),
    /// The stated normal is not this one, which follows from the vertices.
    WrongNormal([f64; 3]),
}

impl fmt::Display for FaceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TooFewVertices(n) => write!(f, "has {n} vertices, at least 3 are needed"),
            Self::TooManyVertices(n) => write!(f, "has {n} vertices, at most {FACE_VERTICES} are read"),
            Self::OutOfRange(i) => write!(f, "vertex {i} is not finite or beyond {MAX_COORDINATE_M:e} m"),
            Self::RepeatedVertex(i) => write!(f, "vertex {i} repeats the vertex before it"),
            Self::NoArea => write!(f, "is degenerate: all its vertices lie on a line"),
            Self::NotPlanar { vertex, off_m } => write!(
                f,
                "is not planar: vertex {vertex} lies {off_m:.3e} m off the plane (tolerance {PLANARITY_TOLERANCE_M:e} m)"
            ),
            Self::SelfIntersecting(i, j) => write!(f, "intersects itself: edges {i} and {j} meet"),
            Self::WrongNormal([x, y, z]) => write!(
                f,
                "its normal should be [{x:.3}, {y:.3}, {z:.3}]: vertices run counter-clockwise seen from free space"
            ),
        }
    }
}

impl std::error::Error for FaceError {}

/// An edge in the projection: inside is where `normal . p >= offset`.
#[derive(Clone, Copy, Debug)]
struct Edge {
    from: [f64; 2],
    to: [f64; 2],
    normal: [f64; 2],
    offset: f64,
}

/// A planar simple polygon, possibly non-convex, in metres. Its front is where its vertices run counter-clockwise.
#[derive(Clone, Debug)]
pub struct Face {
    vertices: Vec<Vec3>,
    normal: Vec3,
    offset_m: f64,
    object: u32,
    /// The two axes kept by the point-in-polygon projection: those that the normal points along least.
    axes: [usize; 2],
    edges: Vec<Edge>,
    convex: bool,
    hull: Vec<Vec3>,
}

impl Face {
    /// Validates a polygon.
    ///
    /// # Errors
    /// [`FaceError`] with the first fault found.
    pub fn new(raw: &RawFace) -> Result<Self, FaceError> {
        let n = raw.vertices.len();
        if n < 3 {
            return Err(FaceError::TooFewVertices(n));
        }
        if n > FACE_VERTICES {
            return Err(FaceError::TooManyVertices(n));
        }
        if let Some(i) = raw
            .vertices
            .iter()
            .position(|v| !v.iter().all(|c| c.abs() <= MAX_COORDINATE_M))
        {
            return Err(FaceError::OutOfRange(i));
        }
        let vertices: Vec<Vec3> = raw.vertices.iter().map(|v| Vec3::from(*v)).collect();
        if let Some(i) = (0..n).find(|&i| (vertices[i] - vertices[(i + n - 1) % n]).norm() < DISTINCT_M) {
            return Err(FaceError::RepeatedVertex(i));
        }
        let centre = vertices.iter().sum::<Vec3>() / n as f64;
        // Newell's normal: twice the area, whatever the shape.
        let area2: Vec3 = (0..n)
            .map(|i| (vertices[i] - centre).cross(&(vertices[(i + 1) % n] - centre)))
            .sum();
        let reach = vertices.iter().map(|v| (v - centre).norm()).fold(0.0, f64::max);
        if area2.norm() < DISTINCT_M * reach {
            return Err(FaceError::NoArea);
        }
        let normal = area2.normalize();
        let offset_m = normal.dot(&centre);
        let (vertex, off_m) = (0..n)
            .map(|i| (i, (normal.dot(&vertices[i]) - offset_m).abs()))
            .fold(
                (0, 0.0),
                |worst, here| if here.1 > worst.1 { here } else { worst },
            );
        if off_m > PLANARITY_TOLERANCE_M {
            return Err(FaceError::NotPlanar { vertex, off_m });
        }
        if let Some((i, j)) = self_intersection(&in_plane(&vertices, &normal)) {
            return Err(FaceError::SelfIntersecting(i, j));
        }
        if let Some(stated) = raw.normal.map(Vec3::from) {
            let agreement = normal.dot(&stated) / stated.norm();
            if agreement.is_nan() || agreement < NORMAL_AGREEMENT {
                return Err(FaceError::WrongNormal(normal.into()));
            }
        }
        let axes = kept_axes(&normal);
        let (edges, convex) = project(&vertices, axes, &normal);
        let hull = if convex {
            vertices.clone()
        } else {
            convex_hull(&vertices, &normal)
        };
        Ok(Self {
            vertices,
            normal,
            offset_m,
            object: 0,
            axes,
            edges,
            convex,
            hull,
        })
    }

    /// Vertices, counter-clockwise seen from the front, m.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Unit normal, towards the front.
    pub fn normal(&self) -> &Vec3 {
        &self.normal
    }

    /// Two axes of the plane: the first one level, unless the plane itself is; the second one so that the normal is the third.
    pub fn axes(&self) -> [Vec3; 2] {
        let level = Vec3::z().cross(&self.normal);
        let u = if level.norm() > 1e-6 {
            level.normalize()
        } else {
            Vec3::x()
        };
        [u, self.normal.cross(&u)]
    }

    /// Number of the solid that the face bounds.
    pub fn object(&self) -> u32 {
        self.object
    }

    pub(super) fn set_object(&mut self, object: u32) {
        self.object = object;
    }

    /// Whether the polygon is convex.
    pub fn is_convex(&self) -> bool {
        self.convex
    }

    /// Convex hull of the polygon, counter-clockwise, m.
    pub(crate) fn hull(&self) -> &[Vec3] {
        &self.hull
    }

    /// Signed distance of a point from the plane, m; positive in front.
    pub fn height_m(&self, point: &Vec3) -> f64 {
        self.normal.dot(point) - self.offset_m
    }

    /// The point mirrored at the plane.
    pub fn mirror(&self, point: &Vec3) -> Vec3 {
        point - self.normal * (2.0 * self.height_m(point))
    }

    /// Whether a point of the plane lies in the polygon, edges included.
    pub fn contains(&self, point: &Vec3) -> bool {
        let p = [point[self.axes[0]], point[self.axes[1]]];
        if self.convex {
            return self
                .edges
                .iter()
                .all(|e| e.normal[0] * p[0] + e.normal[1] * p[1] - e.offset >= -EDGE_TOLERANCE_M);
        }
        let mut inside = false;
        for e in &self.edges {
            if (e.from[1] > p[1]) != (e.to[1] > p[1]) {
                let x = e.from[0] + (p[1] - e.from[1]) / (e.to[1] - e.from[1]) * (e.to[0] - e.from[0]);
                inside ^= p[0] < x;
            }
        }
        inside
            || self
                .edges
                .iter()
                .any(|e| distance_2d(p, e.from, e.to) <= EDGE_TOLERANCE_M)
    }

    /// Distance of a point of the plane from the nearest edge, m.
    pub fn edge_distance_m(&self, point: &Vec3) -> f64 {
        let n = self.vertices.len();
        (0..n)
            .map(|i| {
                let (a, b) = (self.vertices[i], self.vertices[(i + 1) % n]);
                let along = b - a;
                let t = ((point - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                (point - (a + along * t)).norm()
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Where the segment crosses the polygon, as a fraction of its length; `None` when it does not, or runs in the plane.
    #[inline]
    pub(crate) fn crossing(&self, from: &Vec3, to: &Vec3) -> Option<f64> {
        let (a, b) = (self.height_m(from), self.height_m(to));
        if a * b >= 0.0 {
            return None;
        }
        let t = a / (a - b);
        self.contains(&(from + (to - from) * t)).then_some(t)
    }
}

fn kept_axes(normal: &Vec3) -> [usize; 2] {
    match normal.iamax() {
        0 => [1, 2],
        1 => [2, 0],
        _ => [0, 1],
    }
}

/// Edges of the projected polygon with inward normals, and whether all its corners turn the same way.
fn project(vertices: &[Vec3], axes: [usize; 2], normal: &Vec3) -> (Vec<Edge>, bool) {
    let flat: Vec<[f64; 2]> = vertices.iter().map(|v| [v[axes[0]], v[axes[1]]]).collect();
    let n = flat.len();
    // The kept axes are in cyclic order, so the projection keeps the sense of rotation when the dropped one points up.
    let turn = normal[3 - axes[0] - axes[1]].signum();
    let edges: Vec<Edge> = (0..n)
        .map(|i| {
            let (from, to) = (flat[i], flat[(i + 1) % n]);
            let along = [to[0] - from[0], to[1] - from[1]];
            let length = (along[0] * along[0] + along[1] * along[1]).sqrt();
            let normal = [-along[1] / length * turn, along[0] / length * turn];
            Edge {
                from,
                to,
                normal,
                offset: normal[0] * from[0] + normal[1] * from[1],
            }
        })
        .collect();
    let convex = edges.iter().all(|e| {
        flat.iter()
            .all(|p| e.normal[0] * p[0] + e.normal[1] * p[1] - e.offset >= -EDGE_TOLERANCE_M)
    });
    (edges, convex)
}

/// Coordinates in an orthonormal basis of the plane, counter-clockwise seen from the front.
pub(super) fn in_plane(vertices: &[Vec3], normal: &Vec3) -> Vec<[f64; 2]> {
    let mut axis = Vec3::zeros();
    axis[normal.iamin()] = 1.0;
    let u = axis.cross(normal).normalize();
    let v = normal.cross(&u);
    vertices
        .iter()
        .map(|p| [(p - vertices[0]).dot(&u), (p - vertices[0]).dot(&v)])
        .collect()
}

/// Two edges that meet elsewhere than at a common vertex.
fn self_intersection(flat: &[[f64; 2]]) -> Option<(usize, usize)> {
    let n = flat.len();
    let edge = |i: usize| (flat[i % n], flat[(i + 1) % n]);
    for i in 0..n {
        let (a, b) = edge(i);
        // The next edge may touch this one only at their common vertex: it must not fold back.
        let c = flat[(i + 2) % n];
        if distance_2d(c, a, b) < DISTINCT_M || distance_2d(a, b, c) < DISTINCT_M {
            return Some((i, (i + 1) % n));
        }
        for j in i + 2..n {
            if (j + 1) % n == i {
                continue;
            }
            let (c, d) = edge(j);
            let crossing = side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0;
            let touching = [
                distance_2d(c, a, b),
                distance_2d(d, a, b),
                distance_2d(a, c, d),
                distance_2d(b, c, d),
            ]
            .iter()
            .any(|&gap| gap < DISTINCT_M);
            if crossing || touching {
                return Some((i, j));
            }
        }
    }
    None
}

/// Twice the signed area of the triangle a, b, p; positive when p lies left of a -> b.
fn side(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0])
}

/// Distance of a point from a segment of the plane.
fn distance_2d(p: [f64; 2], a: [f64; 2], b: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let to = [p[0] - a[0], p[1] - a[1]];
    let t =
        ((to[0] * along[0] + to[1] * along[1]) / (along[0] * along[0] + along[1] * along[1])).clamp(0.0, 1.0);
    let off = [to[0] - t * along[0], to[1] - t * along[1]];
    (off[0] * off[0] + off[1] * off[1]).sqrt()
}

/// Convex hull of the vertices within their plane, counter-clockwise (Andrew's monotone chain).
fn convex_hull(vertices: &[Vec3], normal: &Vec3) -> Vec<Vec3> {
    let flat = in_plane(vertices, normal);
    let mut order: Vec<usize> = (0..flat.len()).collect();
    order.sort_by(|&i, &j| {
        flat[i][0]
            .total_cmp(&flat[j][0])
            .then(flat[i][1].total_cmp(&flat[j][1]))
    });
    let chain = |order: &mut dyn Iterator<Item = usize>| {
        let mut hull: Vec<usize> = Vec::new();
        for i in order {
            while let [.., a, b] = hull[..] {
                if side(flat[a], flat[b], flat[i]) > 0.0 {
                    break;
                }
                hull.pop();
            }
            hull.push(i);
        }
        hull.pop();
        hull
    };
    let mut hull = chain(&mut order.iter().copied());
    hull.extend(chain(&mut order.iter().rev().copied()));
    hull.into_iter().map(|i| vertices[i]).collect()
}
