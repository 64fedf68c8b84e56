//! What a flight leaves on disk: whole wherever the flight was cut, the same bytes for the same flight, and read by the
//! tools of the field with the figures of the report; and what another program writes, flown.

mod animation;
#[cfg(feature = "outputs")]
mod browser;
#[cfg(feature = "outputs")]
mod float_model;
mod synthetic;
#[cfg(feature = "outputs")]
mod tools;
mod whole;
#[cfg(feature = "outputs")]
mod written;

use std::path::Path;

use cslam_core::geometry::{Matrix3, Position, Vector3};
use cslam_core::map::PointCloud;
use cslam_core::reflection::ReflectionPoint;
use cslam_host_sim::evaluation::evaluate;
use cslam_host_sim::flight_files::ply::Encoding;
use cslam_host_sim::flight_files::{Export, Outputs};
use cslam_host_sim::flight_log::{FlightLog, MapVoxel};
use cslam_host_sim::report::Report;
use cslam_host_sim::scene::Scene;

/// Evaluates a log and writes every file of it.
fn write(log: &mut FlightLog, scene: &Scene, out: &Path, encoding: Encoding) -> Report {
    let evaluation = evaluate(log, Some(scene));
    let report = Report::new(log, &evaluation, 12.5);
    let outputs = Outputs {
        log,
        scene: Some(scene),
        evaluation: &evaluation,
        report: &report,
        packets: &[1, 2, 3],
        imu: &synthetic::imu(log),
        smoothed: None,
    };
    outputs
        .write(out, encoding, &[Export::Npz, Export::Ros2, Export::Animation])
        .expect("a directory to write to");
    report
}

/// A log that ends after so many sweeps, as an interrupt leaves it.
fn cut(log: &FlightLog, sweeps: usize) -> FlightLog {
    let mut cut = log.clone();
    cut.sweeps.truncate(sweeps);
    let end_s = cut.sweeps.last().map_or(0.0, |s| s.time_s);
    cut.poses.retain(|p| p.time_s <= end_s);
    cut.points.retain(|p| (p.sweep as usize) < sweeps);
    let mut map = Box::new(PointCloud::<4096>::new());
    for point in &cut.points {
        let position =
            Position::from_vector(Vector3::from(point.position_m).map(|c| c as f32)).expect("finite");
        let covariance = Matrix3::identity() * (point.covariance_trace_m2 / 3.0) as f32;
        let distance_m = 1.0;
        map.insert(&ReflectionPoint {
            position,
            covariance,
            distance_m,
        })
        .expect("near the origin");
    }
    cut.map = map.points().map(MapVoxel::from).collect();
    cut
}
