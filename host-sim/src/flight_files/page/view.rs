//! Data of the 3-D view: triangles, edges, points and tracks, in centimetres.

use std::io;

use serde::Serialize;

use super::{off_surface_class, size_of};
use crate::evaluation::true_vertices_m;
use crate::flight_files::Outputs;
use crate::scene::triangles;

/// Trajectories are thinned to at most so many places.
const MOST_PLACES: usize = 4000;

#[derive(Serialize)]
struct View {
    /// Middle of everything (x, y, z) and half its width, cm.
    centre: [i64; 4],
    /// Corners of triangles, nine numbers each.
    triangles: Vec<i64>,
    /// Ends of edges, six numbers each.
    edges: Vec<i64>,
    /// Map points: x, y, z, class.
    map: Vec<i64>,
    /// True reflection points.
    vertices: Vec<i64>,
    /// Estimated trajectory.
    estimate: Vec<i64>,
    /// True trajectory.
    truth: Vec<i64>,
    /// Stops of the GMT.
    gmt: Vec<i64>,
}

fn centimetres(metres: f64) -> i64 {
    libm::floor(metres * 100.0 + 0.5) as i64
}

fn all(places: impl Iterator<Item = [f64; 3]>) -> Vec<i64> {
    places.flatten().map(centimetres).collect()
}

/// The data as JSON that may stand in a script element.
pub(super) fn data(outputs: &Outputs<'_>) -> io::Result<String> {
    let log = outputs.log;
    let ([west, south], [east, north]) = size_of(outputs);
    let faces = || outputs.scene.iter().flat_map(|s| s.faces());
    let top = faces()
        .flat_map(|f| f.vertices())
        .map(|v| v.z)
        .fold(0.0, f64::max);
    let edge = |f: &crate::scene::Face| {
        let v = f.vertices().to_vec();
        (0..v.len()).flat_map(move |k| [v[k].into(), v[(k + 1) % v.len()].into()])
    };
    let off = outputs
        .evaluation
        .point_errors
        .surface_m
        .iter()
        .map(Some)
        .chain(std::iter::repeat(None));
    let poses = log.trajectory();
    let thin = poses.len().div_ceil(MOST_PLACES).max(1);
    let view = View {
        centre: [
            (west + east) / 2.0,
            (south + north) / 2.0,
            top / 3.0,
            libm::hypot(east - west, north - south) / 2.0,
        ]
        .map(centimetres),
        triangles: all(faces().flat_map(triangles).flatten().map(Into::into)),
        edges: all(faces().flat_map(edge)),
        map: log
            .map
            .iter()
            .zip(off)
            .flat_map(|(v, off)| {
                let [x, y, z] = v.position_m.map(centimetres);
                [x, y, z, off_surface_class(off) as i64]
            })
            .collect(),
        vertices: all(true_vertices_m(log).into_iter()),
        estimate: all(poses
            .iter()
            .step_by(thin)
            .filter_map(|p| p.estimate)
            .map(|e| e.position_m)),
        truth: all(poses
            .iter()
            .step_by(thin)
            .filter_map(|p| p.truth)
            .map(|t| t.position_m)),
        gmt: all(log.sweeps.iter().filter_map(|s| s.estimate.gmt_position_m)),
    };
    // Nothing in it may end the script element.
    Ok(serde_json::to_string(&view)?.replace("</", "<\\/"))
}
