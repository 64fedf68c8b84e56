//! The point clouds of a flight as PLY: the map, the accepted points it was fused from, and the truth.

use std::collections::HashMap;
use std::io::{self, Write};

use cslam_core::geometry::Position;
use cslam_core::map::Voxel;

use super::ply::{self, Column, Encoding};
use crate::flight_log::{FlightLog, PointRecord};

/// Says that a point has no GMT position.
const NO_GMT: i32 = -1;

/// One row of a cloud.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Row {
    position_m: [f64; 3],
    covariance_trace_m2: f64,
    /// NaN when no classifier judged the path.
    probability: f64,
    time_s: f64,
    /// NaN when it is not known.
    snr_db: f64,
    gmt_index: i32,
    hits: i32,
    /// Reflections that the path is taken to have had; 0 when no point is known.
    order: i32,
}

impl Row {
    fn of(point: &PointRecord) -> Self {
        Self {
            position_m: point.position_m,
            covariance_trace_m2: point.covariance_trace_m2,
            probability: point.probability.unwrap_or(f64::NAN),
            time_s: point.time_s,
            snr_db: point.snr_db.unwrap_or(f64::NAN),
            gmt_index: integer(point.gmt_index),
            hits: 1,
            order: i32::from(point.order),
        }
    }
}

/// The map: a row for each voxel. Probability, time, SNR and GMT position are those of the most certain of the
/// reflections that were fused into it.
pub(super) fn map(out: &mut impl Write, encoding: Encoding, log: &FlightLog) -> io::Result<()> {
    let mut best: HashMap<Voxel, &PointRecord> = HashMap::new();
    for point in &log.points {
        if let Some(voxel) = voxel(point.position_m, log.voxel_edge_m) {
            let known = best.entry(voxel).or_insert(point);
            if point.covariance_trace_m2 < known.covariance_trace_m2 {
                *known = point;
            }
        }
    }
    let rows = log.map.iter().map(|cell| {
        let found = voxel(cell.position_m, log.voxel_edge_m).and_then(|v| best.get(&v));
        let nothing = Row {
            position_m: cell.position_m,
            covariance_trace_m2: f64::NAN,
            probability: f64::NAN,
            time_s: f64::NAN,
            snr_db: f64::NAN,
            gmt_index: NO_GMT,
            hits: 0,
            order: 0,
        };
        Row {
            position_m: cell.position_m,
            covariance_trace_m2: cell.covariance_trace_m2,
            hits: integer(cell.hits),
            ..found.map_or(nothing, |point| Row::of(point))
        }
    });
    write(
        out,
        encoding,
        "cslam map, world frame ENU, metres",
        &rows.collect::<Vec<_>>(),
    )
}

/// The accepted points, before fusion.
pub(super) fn points(out: &mut impl Write, encoding: Encoding, log: &FlightLog) -> io::Result<()> {
    let rows: Vec<Row> = log.points.iter().map(Row::of).collect();
    write(
        out,
        encoding,
        "cslam accepted reflection points, world frame ENU, metres",
        &rows,
    )
}

/// Where waves were truly reflected once, by sweep.
pub(super) fn truth(out: &mut impl Write, encoding: Encoding, log: &FlightLog) -> io::Result<()> {
    let (mut places, mut times, mut stops) = (Vec::new(), Vec::new(), Vec::new());
    for sweep in &log.sweeps {
        let first = sweep
            .truth
            .link
            .iter()
            .flat_map(|l| &l.paths)
            .filter(|p| p.is_first_order());
        for place in first.filter_map(|p| p.last_vertex) {
            places.push(place);
            times.push(sweep.time_s as f32);
            stops.push(integer(sweep.estimate.gmt_index));
        }
    }
    let coordinate = |axis: usize| Column::F32(places.iter().map(|p: &[f64; 3]| p[axis] as f32).collect());
    let columns = [
        ("x", coordinate(0)),
        ("y", coordinate(1)),
        ("z", coordinate(2)),
        ("time_s", Column::F32(times)),
        ("gmt_index", Column::I32(stops)),
    ];
    let comment = "true first-order reflection points, world frame ENU, metres";
    ply::write(out, encoding, comment, &columns)
}

/// A count as a PLY integer, saturating.
fn integer(count: u32) -> i32 {
    i32::try_from(count).unwrap_or(i32::MAX)
}

/// The voxel of a point as the receiver computes it.
fn voxel(position_m: [f64; 3], edge_m: f64) -> Option<Voxel> {
    let [x, y, z] = position_m.map(|c| c as f32);
    Voxel::containing(&Position::new(x, y, z).ok()?, edge_m as f32).ok()
}

fn write(out: &mut impl Write, encoding: Encoding, comment: &str, rows: &[Row]) -> io::Result<()> {
    let column = |pick: &dyn Fn(&Row) -> f64| Column::F32(rows.iter().map(|r| pick(r) as f32).collect());
    let columns = [
        ("x", column(&|r| r.position_m[0])),
        ("y", column(&|r| r.position_m[1])),
        ("z", column(&|r| r.position_m[2])),
        ("covariance_trace", column(&|r| r.covariance_trace_m2)),
        ("probability", column(&|r| r.probability)),
        ("time_s", column(&|r| r.time_s)),
        ("snr_db", column(&|r| r.snr_db)),
        (
            "gmt_index",
            Column::I32(rows.iter().map(|r| r.gmt_index).collect()),
        ),
        ("hits", Column::I32(rows.iter().map(|r| r.hits).collect())),
        ("order", Column::I32(rows.iter().map(|r| r.order).collect())),
    ];
    ply::write(out, encoding, comment, &columns)
}
