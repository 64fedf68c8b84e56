//! The flight as columns for NumPy: one `.npz` file, a stored zip of `.npy` files. `numpy.load(file, allow_pickle=False)` reads it.
//!
//! A column's name begins with what its rows are (`pose`, `sweep`, `path`, `point`, `map`, `imu`) and ends in its unit; those of the smoothed flight
//! have `smoothed_` before it. What is not known is NaN, or -1 of a whole number.

use std::io::{self, Seek, Write};

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

use super::Outputs;
use crate::flight_log::{FlightLog, PoseEstimate, PoseTruth};
use crate::npy::{self, Element};

/// Columns that go into a file one by one.
struct Columns<W: Write + Seek> {
    zip: ZipWriter<W>,
    /// What names begin with.
    prefix: &'static str,
}

impl<W: Write + Seek> Columns<W> {
    fn put(&mut self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let options = SimpleFileOptions::default().compression_method(CompressionMethod::Stored);
        self.zip
            .start_file(format!("{}{name}.npy", self.prefix), options)?;
        self.zip.write_all(bytes)
    }

    /// A number a row.
    fn scalars<T: Element>(&mut self, name: &str, rows: impl Iterator<Item = T>) -> io::Result<()> {
        self.put(name, &npy::encode(&rows.collect::<Vec<_>>(), None))
    }

    /// `N` numbers a row.
    fn vectors<T: Element, const N: usize>(
        &mut self,
        name: &str,
        rows: impl Iterator<Item = [T; N]>,
    ) -> io::Result<()> {
        let rows: Vec<[T; N]> = rows.collect();
        self.put(name, &npy::encode(rows.as_flattened(), Some(N)))
    }

    /// A text a row.
    fn texts<'t>(&mut self, name: &str, rows: impl Iterator<Item = &'t str>) -> io::Result<()> {
        self.put(name, &npy::encode_texts(&rows.collect::<Vec<_>>()))
    }
}

/// Writes the file.
pub(super) fn write(out: impl Write + Seek, outputs: &Outputs<'_>) -> io::Result<()> {
    let mut columns = Columns {
        zip: ZipWriter::new(out),
        prefix: "",
    };
    let log = outputs.log;
    poses(&mut columns, log)?;
    truths(&mut columns, log)?;
    sweeps(&mut columns, log)?;
    points(&mut columns, log)?;
    let imu = outputs.imu;
    columns.scalars(
        "imu_time_s",
        imu.iter().map(|sample| sample.time_ns as f64 * 1e-9),
    )?;
    columns.vectors(
        "imu_rate_rad_per_s",
        imu.iter().map(|sample| <[f32; 3]>::from(sample.rate_rad_per_s)),
    )?;
    columns.vectors(
        "imu_specific_force_m_per_s2",
        imu.iter()
            .map(|sample| <[f32; 3]>::from(sample.specific_force_m_per_s2)),
    )?;
    if let Some(smoothed) = outputs.smoothed {
        columns.prefix = "smoothed_";
        poses(&mut columns, smoothed)?;
        points(&mut columns, smoothed)?;
    }
    columns.zip.finish()?;
    Ok(())
}

fn known(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

const NAN: f64 = f64::NAN;

fn poses<W: Write + Seek>(columns: &mut Columns<W>, log: &FlightLog) -> io::Result<()> {
    let poses = log.trajectory();
    columns.scalars("pose_time_s", poses.iter().map(|pose| pose.time_s))?;
    let estimates = || poses.iter().map(|pose| pose.estimate);
    let triples =
        |of: fn(&PoseEstimate) -> [f64; 3]| estimates().map(move |e| e.map_or([NAN; 3], |e| of(&e)));
    let nines = |of: fn(&PoseEstimate) -> [[f64; 3]; 3]| {
        estimates().map(move |e| {
            let mut flat = [NAN; 9];
            if let Some(e) = e {
                flat.copy_from_slice(of(&e).as_flattened());
            }
            flat
        })
    };
    columns.vectors("pose_position_m", triples(|e| e.position_m))?;
    columns.vectors(
        "pose_quaternion_wb",
        estimates().map(|e| e.map_or([NAN; 4], |e| e.quaternion_wb)),
    )?;
    columns.vectors("pose_velocity_m_per_s", triples(|e| e.velocity_m_per_s))?;
    columns.vectors("pose_position_covariance_m2", nines(|e| e.position_covariance_m2))?;
    columns.vectors(
        "pose_attitude_covariance_rad2",
        nines(|e| e.attitude_covariance_rad2),
    )?;
    columns.vectors(
        "pose_velocity_covariance_m2_per_s2",
        nines(|e| e.velocity_covariance_m2_per_s2),
    )?;
    columns.scalars(
        "pose_clock_offset_s",
        estimates().map(|e| known(e.and_then(|e| e.clock_offset_s))),
    )?;
    columns.scalars(
        "pose_clock_sigma_s",
        estimates().map(|e| known(e.and_then(|e| e.clock_sigma_s))),
    )
}

fn truths<W: Write + Seek>(columns: &mut Columns<W>, log: &FlightLog) -> io::Result<()> {
    let poses = log.trajectory();
    let truths = || poses.iter().map(|pose| pose.truth);
    let triples = |of: fn(&PoseTruth) -> [f64; 3]| truths().map(move |t| t.map_or([NAN; 3], |t| of(&t)));
    columns.vectors("pose_true_position_m", triples(|t| t.position_m))?;
    columns.vectors(
        "pose_true_quaternion_wb",
        truths().map(|t| t.map_or([NAN; 4], |t| t.quaternion_wb)),
    )?;
    columns.vectors("pose_true_velocity_m_per_s", triples(|t| t.velocity_m_per_s))?;
    columns.scalars(
        "pose_true_clock_offset_s",
        truths().map(|t| known(t.map(|t| t.clock_offset_s))),
    )
}

fn sweeps<W: Write + Seek>(columns: &mut Columns<W>, log: &FlightLog) -> io::Result<()> {
    let sweeps = &log.sweeps;
    columns.scalars("sweep_number", sweeps.iter().map(|sweep| sweep.sweep))?;
    columns.scalars("sweep_time_s", sweeps.iter().map(|sweep| sweep.time_s))?;
    columns.vectors(
        "sweep_gmt_position_m",
        sweeps
            .iter()
            .map(|sweep| sweep.estimate.gmt_position_m.unwrap_or([f64::NAN; 3])),
    )?;
    let state = |state: Option<u8>| state.map_or(-1, i32::from);
    columns.scalars(
        "sweep_link_state",
        sweeps
            .iter()
            .map(|sweep| state(sweep.estimate.link.map(|link| link.state))),
    )?;
    columns.scalars(
        "sweep_true_link_state",
        sweeps.iter().map(|sweep| state(sweep.truth.link_state())),
    )?;
    columns.scalars(
        "sweep_los_used",
        sweeps.iter().map(|sweep| u8::from(sweep.estimate.los_used)),
    )?;
    let paths = || {
        sweeps
            .iter()
            .flat_map(|sweep| sweep.estimate.paths.iter().map(|path| (sweep.sweep, path)))
    };
    columns.scalars("path_sweep", paths().map(|(sweep, _)| sweep))?;
    columns.scalars("path_c_tau_m", paths().map(|(_, path)| path.c_tau_m))?;
    columns.vectors(
        "path_aoa_zenith_azimuth_rad",
        paths().map(|(_, path)| [path.aoa_zenith_rad, path.aoa_azimuth_rad]),
    )?;
    columns.scalars("path_snr_db", paths().map(|(_, path)| known(path.snr_db)))?;
    columns.scalars(
        "path_first_order_probability",
        paths().map(|(_, path)| known(path.first_order_probability())),
    )?;
    columns.texts("path_verdict", paths().map(|(_, path)| path.verdict.as_str()))
}

fn points<W: Write + Seek>(columns: &mut Columns<W>, log: &FlightLog) -> io::Result<()> {
    let points = &log.points;
    columns.scalars("point_sweep", points.iter().map(|point| point.sweep))?;
    columns.scalars("point_path", points.iter().map(|point| point.path))?;
    columns.scalars("point_order", points.iter().map(|point| point.order))?;
    columns.scalars("point_reflection", points.iter().map(|point| point.reflection))?;
    columns.scalars(
        "point_surface",
        points.iter().map(|point| point.surface.map_or(-1, i32::from)),
    )?;
    columns.scalars("point_time_s", points.iter().map(|point| point.time_s))?;
    columns.scalars("point_gmt_index", points.iter().map(|point| point.gmt_index))?;
    columns.vectors("point_position_m", points.iter().map(|point| point.position_m))?;
    columns.scalars(
        "point_covariance_trace_m2",
        points.iter().map(|point| point.covariance_trace_m2),
    )?;
    columns.scalars(
        "point_probability",
        points.iter().map(|point| known(point.probability)),
    )?;
    columns.scalars("point_snr_db", points.iter().map(|point| known(point.snr_db)))?;
    let map = &log.map;
    columns.vectors("map_position_m", map.iter().map(|voxel| voxel.position_m))?;
    columns.scalars(
        "map_covariance_trace_m2",
        map.iter().map(|voxel| voxel.covariance_trace_m2),
    )?;
    columns.scalars("map_hits", map.iter().map(|voxel| voxel.hits))
}
