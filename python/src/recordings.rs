//! Files: samples, packets, recorded flights.

use std::path::PathBuf;

use cslam_host_sim::ground::decode::Ears;
use cslam_host_sim::ground::keys::Trust;
use cslam_host_sim::ground::playback::Playback;
use cslam_host_sim::library;
use cslam_host_sim::sigmf::{self, Codebook, Recording};
use numpy::{PyReadonlyArray1, PyReadonlyArray4};
use pyo3::prelude::*;

use crate::estimator::{arrays, blocks};
use crate::interrupted::watched;
use crate::{radio, raised, refused};

/// Samples, beams, exponents, codebook, position of the transmitter and of the UAV, attitude, radio.
type Read<'py> = (
    (Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>),
    &'static str,
    Option<[f64; 3]>,
    Option<[f64; 3]>,
    Option<[f64; 4]>,
    Option<String>,
);

/// See `cslam.read_sigmf`.
#[pyfunction]
pub(crate) fn read_sigmf(py: Python<'_>, name: PathBuf) -> PyResult<Read<'_>> {
    let read = py.detach(|| sigmf::read(&name)).map_err(refused)?;
    Ok((
        arrays(py, &read.blocks)?,
        read.codebook.name(),
        read.gmt_position_m,
        read.uav_position_m,
        read.uav_quaternion_wb,
        radio::text(read.radio)?,
    ))
}

/// See `cslam.write_sigmf`.
#[pyfunction]
#[expect(clippy::too_many_arguments, reason = "the fields of a recording")]
pub(crate) fn write_sigmf(
    py: Python<'_>,
    name: PathBuf,
    iq: PyReadonlyArray4<'_, i16>,
    beams: PyReadonlyArray1<'_, u16>,
    exponents: PyReadonlyArray1<'_, i32>,
    gmt_position_m: Option<[f64; 3]>,
    uav_position_m: Option<[f64; 3]>,
    uav_quaternion_wb: Option<[f64; 4]>,
    radio: Option<&str>,
) -> PyResult<()> {
    let recording = Recording {
        codebook: Codebook::Beams,
        radio: radio::told(radio)?,
        gmt_position_m,
        uav_position_m,
        uav_quaternion_wb,
        blocks: blocks(&iq, &beams, &exponents, Codebook::Beams.len())?,
    };
    py.detach(|| sigmf::write(&name, &recording)).map_err(refused)
}

/// See `cslam.read_packets`. JSON lines.
#[pyfunction]
pub(crate) fn read_packets(
    py: Python<'_>,
    file: PathBuf,
    keys: Vec<PathBuf>,
    trust: &str,
) -> PyResult<String> {
    let trust = match trust {
        "keys" => Trust::from_files(&keys).map_err(refused)?,
        "test" => Trust::Test,
        "unsigned" => Trust::Unsigned,
        other => {
            return Err(refused(format_args!(
                "trust: got \"{other}\", expected keys, test or unsigned"
            )));
        }
    };
    let mut lines = Vec::new();
    let played = Playback::open(&file).map_err(refused)?;
    py.detach(|| played.print(&mut Ears::new(trust), &mut lines))
        .map_err(|e| raised(&e))?;
    String::from_utf8(lines).map_err(refused)
}

/// See `cslam.fly`. The report as JSON. What was flown until Ctrl-C is written.
#[pyfunction]
pub(crate) fn fly(
    py: Python<'_>,
    directory: PathBuf,
    out: PathBuf,
    steps: Option<usize>,
    smooth: bool,
) -> PyResult<String> {
    let report = watched(py, |interrupted| {
        library::fly_recording(&directory, &out, steps, smooth, interrupted)
    })?;
    serde_json::to_string(&report).map_err(refused)
}
