//! Recorded flights: written, and read event by event.

use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

use cslam_host_sim::library;
use cslam_host_sim::raw_flight::Source;
use cslam_host_sim::recording::{Damage, RecordedFlight as Recording};
use cslam_host_sim::sensors::{Event, Stamped};
use numpy::IntoPyArray;
use pyo3::prelude::*;

use crate::estimator::arrays;
use crate::interrupted::watched;
use crate::{radio, refused};

/// See `cslam.record`. The description of the recording as JSON.
#[pyfunction]
pub(crate) fn record(
    py: Python<'_>,
    out: PathBuf,
    scene: Option<&str>,
    channel: Option<PathBuf>,
    world: Option<&str>,
    seed: u64,
    sweeps: Option<u32>,
) -> PyResult<String> {
    let manifest = watched(py, |interrupted| {
        library::record(scene, channel.as_deref(), world, seed, sweeps, &out, interrupted)
    })?;
    serde_json::to_string(&manifest).map_err(refused)
}

/// See `cslam.RecordedFlight`.
#[pyclass(frozen)]
pub(crate) struct RecordedFlight {
    recording: Recording,
    /// Index of the event that comes next.
    next: Mutex<usize>,
}

#[pymethods]
impl RecordedFlight {
    #[new]
    fn new(py: Python<'_>, directory: PathBuf) -> PyResult<Self> {
        let recording = py
            .detach(|| Recording::open(&directory, Damage::refused()))
            .map_err(refused)?;
        if recording.is_of_paths() {
            let message = "holds estimated paths and no samples: `cslam.fly` flies it";
            return Err(refused(format_args!("{}: {message}", directory.display())));
        }
        Ok(Self {
            recording,
            next: Mutex::new(0),
        })
    }

    #[getter]
    fn sweeps(&self) -> u32 {
        self.recording.sweeps()
    }

    #[getter]
    fn ground_z_m(&self) -> f64 {
        self.recording.manifest().ground_z_m.unwrap_or(0.0)
    }

    #[getter]
    fn radio(&self) -> PyResult<Option<String>> {
        radio::text(self.recording.manifest().radio)
    }

    #[getter]
    fn gmt_setup_m(&self) -> Option<[f64; 3]> {
        self.recording.manifest().gmt_setup_position_m
    }

    #[getter]
    fn earth_field_ut(&self) -> Option<[f32; 3]> {
        let field = self.recording.manifest().magnetic_field?;
        Some(field.config().earth_ut.into())
    }

    /// Begins with the first event again.
    fn rewind(&self) {
        *self.next.lock().unwrap_or_else(PoisonError::into_inner) = 0;
    }

    /// The next event: its kind, time and data; `None` at the end. Inertial samples that follow each other are one event.
    fn event(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        let mut next = self.next.lock().unwrap_or_else(PoisonError::into_inner);
        let mut events = self.recording.events().skip(*next).peekable();
        let Some(first) = events.next() else {
            return Ok(None);
        };
        *next += 1;
        let time_ns = first.uav_time_ns;
        let event = match first.event {
            Event::Imu(_) => {
                let mut together = vec![first];
                while let Some(also) = events.next_if(|event| matches!(event.event, Event::Imu(_))) {
                    together.push(also);
                }
                *next += together.len() - 1;
                return inertial(py, &together).map(Some);
            }
            Event::Magnetometer(sample) => {
                let field_ut: [f64; 3] = sample.field_ut().into();
                ("magnetometer", time_ns, field_ut).into_pyobject(py)?.into_any()
            }
            Event::Timing(sample) => ("timing", time_ns, sample.clock_offset_s)
                .into_pyobject(py)?
                .into_any(),
            Event::Barometer(sample) => ("barometer", time_ns, sample.pressure_pa())
                .into_pyobject(py)?
                .into_any(),
            Event::Beacon(said) => {
                let place = (
                    said.position_m,
                    said.heading_pitch_roll_rad,
                    said.position_sigma_m,
                );
                ("beacon", time_ns, said.sweep, place, said.sweeps_per_stop)
                    .into_pyobject(py)?
                    .into_any()
            }
            Event::Sweep { sweep } => {
                let given = py.detach(|| self.recording.sweep(sweep)).map_err(refused)?;
                let of = |blocks: &[_]| (!blocks.is_empty()).then(|| arrays(py, blocks)).transpose();
                let [beams, squint, pilots] =
                    [&given.beams, &given.squint, &given.pilots].map(|heard| of(&heard.blocks));
                ("sweep", time_ns, sweep, beams?, squint?, pilots?)
                    .into_pyobject(py)?
                    .into_any()
            }
        };
        Ok(Some(event.unbind()))
    }
}

/// Inertial samples as arrays.
fn inertial(py: Python<'_>, together: &[Stamped]) -> PyResult<Py<PyAny>> {
    let (mut times, mut rates, mut forces) = (Vec::new(), Vec::new(), Vec::new());
    for stamped in together {
        if let Event::Imu(raw) = stamped.event {
            let sample = raw.at(stamped.uav_time_ns);
            times.push(sample.time_ns);
            rates.extend(sample.rate_rad_per_s.iter().copied().map(f64::from));
            forces.extend(sample.specific_force_m_per_s2.iter().copied().map(f64::from));
        }
    }
    let columns = (
        "imu",
        times.into_pyarray(py),
        rates.into_pyarray(py),
        forces.into_pyarray(py),
    );
    Ok(columns.into_pyobject(py)?.into_any().unbind())
}
