//! The whole receiver, fed by its caller.

use std::collections::VecDeque;
use std::sync::{Mutex, MutexGuard};

use cslam_core::estimator::{Pose, Setup};
use cslam_core::geometry::{Vector3, World};
use cslam_core::inertial::{ImuSample, MagneticField};
use cslam_core::paths::EstimatedPath;
use cslam_core::profile::quad_4x8_gmt_72::BEAMS;
use cslam_core::receiver::{Localization, MappedPoint, PATHS, SweepReport};
use cslam_core::telemetry::{BeaconReport, Decoder, Key, MAX_FRAME, Sender, Uplink};
use cslam_firmware::app::{Downlink, Ground, Observer};
use cslam_host_sim::channel::{Codebook, Sweep};
use cslam_host_sim::flight_log::PoseEstimate;
use cslam_host_sim::raw_flight::{
    self, BoardMemory, BoardReceiver, Given, board_config, pose_estimate, verdict,
};
use numpy::{Element, IntoPyArray, PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray4};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use self_cell::{MutBorrow, self_cell};

use crate::estimator::blocks;
use crate::{radio, raised, refused};

self_cell!(
    /// A receiver with the memory that it works in.
    struct Flying {
        owner: MutBorrow<BoardMemory>,
        #[not_covariant]
        dependent: BoardReceiver,
    }
);

/// Reports of sweeps that have ended, until they are taken.
#[derive(Default)]
struct Reports(VecDeque<SweepReport<PATHS>>);

impl Observer for Reports {
    fn swept(&mut self, report: &SweepReport<PATHS>) {
        self.0.push_back(report.clone());
    }
}

/// A receiver, what it has reported, and the GMT's end of the link.
struct Parts {
    flying: Flying,
    reports: Reports,
    gmt: Sender<Uplink>,
}

/// See `cslam.Receiver`.
#[pyclass(frozen)]
pub(crate) struct Receiver(Mutex<Parts>);

/// Samples, beams and exponents of a sweep, of its squint symbols, or of its pilots.
type Blocks<'py> = (
    PyReadonlyArray4<'py, i16>,
    PyReadonlyArray1<'py, u16>,
    PyReadonlyArray1<'py, i32>,
);

/// Time, position, quaternion, velocity, clock offset and its sigma as times, covariances of position, attitude and velocity, jumps.
type PoseColumns = (
    u64,
    [f64; 3],
    [f64; 4],
    [f64; 3],
    Option<f64>,
    Option<f64>,
    [[f64; 3]; 3],
    [[f64; 3]; 3],
    [[f64; 3]; 3],
    u32,
);

#[pymethods]
impl Receiver {
    #[new]
    fn new(
        ground_z_m: Option<f64>,
        earth_field_ut: Option<[f32; 3]>,
        gmt_setup: Option<([f64; 3], f64)>,
        uav: u8,
        key: Option<[u8; Key::LENGTH]>,
        radio: Option<&str>,
    ) -> PyResult<Self> {
        let setup = gmt_setup.map(|(position_m, within_m)| Setup {
            position_m: position_m.into(),
            within_m,
        });
        let mut config = board_config().map_err(|e| raised(&e))?;
        config.radio = radio::config(radio)?;
        if let Localization::Filter(filter) = &mut config.localization {
            filter.beacon.setup = setup;
        }
        config.accept.point.ground_z_m = ground_z_m.map(|z_m| z_m as f32);
        config.magnetic_field = earth_field_ut.map(|field_ut| MagneticField {
            earth_ut: field_ut.into(),
            ..MagneticField::new(0.0, 0.0, 0.0)
        });
        let key = key.map_or(Key::TEST, Key::new);
        let ground = Ground {
            downlink: Downlink::new(uav, &key, 0),
            uplink: Decoder::new(uav, &key),
        };
        let memory = BoardMemory::new(&config).map_err(|e| raised(&e))?;
        let flying = Flying::new(MutBorrow::new(memory), |memory| {
            memory.borrow_mut().receiver(config, ground)
        });
        Ok(Self(Mutex::new(Parts {
            flying,
            reports: Reports::default(),
            gmt: Sender::new(uav, &key, 0),
        })))
    }

    /// Inertial samples, one after the other.
    fn imu(
        &self,
        py: Python<'_>,
        time_ns: PyReadonlyArray1<'_, u64>,
        rate_rad_per_s: PyReadonlyArray2<'_, f64>,
        specific_force_m_per_s2: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<()> {
        let rows = |array: &PyReadonlyArray2<'_, f64>| -> PyResult<Vec<Vector3<f32>>> {
            let (rows, _) = array.as_slice().map_err(refused)?.as_chunks::<3>();
            Ok(rows
                .iter()
                .map(|row| Vector3::from(row.map(|x| x as f32)))
                .collect())
        };
        let times = time_ns.as_slice().map_err(refused)?.iter();
        let vectors = rows(&rate_rad_per_s)?
            .into_iter()
            .zip(rows(&specific_force_m_per_s2)?);
        let samples: Vec<ImuSample> = times
            .zip(vectors)
            .map(
                |(&time_ns, (rate_rad_per_s, specific_force_m_per_s2))| ImuSample {
                    time_ns,
                    rate_rad_per_s,
                    specific_force_m_per_s2,
                },
            )
            .collect();
        self.work(py, |receiver, reports| {
            for sample in &samples {
                receiver.imu(sample, reports);
            }
        })
    }

    fn magnetometer(&self, py: Python<'_>, time_ns: u64, field_ut: [f32; 3]) -> PyResult<()> {
        self.work(py, |receiver, reports| {
            receiver.magnetometer(time_ns, &field_ut.into(), reports);
        })
    }

    fn timing(&self, py: Python<'_>, time_ns: u64, clock_offset_s: f64) -> PyResult<()> {
        self.work(py, |receiver, reports| {
            receiver.timing(time_ns, clock_offset_s, reports);
        })
    }

    /// All blocks of a sweep, of the squint symbols behind it, and of its pilots. `False` when the sweep has ended before.
    #[pyo3(signature = (sweep, time_ns, beams, squint, pilots=None))]
    fn sweep(
        &self,
        py: Python<'_>,
        sweep: u32,
        time_ns: u64,
        beams: Blocks<'_>,
        squint: Option<Blocks<'_>>,
        pilots: Option<Blocks<'_>>,
    ) -> PyResult<bool> {
        let taken = |(iq, numbers, exponents): &Blocks<'_>, most| blocks(iq, numbers, exponents, most);
        let or_none = |told: Option<Blocks<'_>>, most| {
            let taken = told.map(|blocks| taken(&blocks, most)).transpose()?;
            Ok::<_, PyErr>(Sweep {
                blocks: taken.unwrap_or_default(),
            })
        };
        let mut heard = Given {
            beams: Sweep {
                blocks: taken(&beams, BEAMS)?,
            },
            squint: or_none(squint, BEAMS)?,
            pilots: or_none(pilots, Codebook::Pilots.len())?,
            ..Given::default()
        };
        self.work(py, |receiver, reports| {
            // One whose beacon never came ends now.
            receiver.elapse(time_ns, reports);
            raw_flight::hear(receiver, &mut heard, sweep, time_ns, reports)
        })
    }

    /// What the GMT says of a sweep, as the packet that it sends.
    fn beacon(
        &self,
        py: Python<'_>,
        time_ns: u64,
        sweep: u32,
        place: ([f64; 3], [f64; 3], f64),
        sweeps_per_stop: u32,
    ) -> PyResult<()> {
        let (position_m, heading_pitch_roll_rad, sigma_m) = place;
        let said = BeaconReport {
            sweep,
            position_m,
            sigma_m,
            heading_pitch_roll_rad,
            sweeps_per_stop,
        };
        let packet = {
            let mut parts = self.parts()?;
            let mut frame = [0; MAX_FRAME];
            let packet = parts.gmt.encode(&Uplink::Beacon(said), &mut frame);
            packet
                .map_err(|_| refused("the GMT has sent all packets that its key allows"))?
                .to_vec()
        };
        self.work(py, |receiver, reports| {
            receiver.uplink(time_ns, &packet, |_| None, reports);
        })
    }

    fn elapse(&self, py: Python<'_>, time_ns: u64) -> PyResult<()> {
        self.work(py, |receiver, reports| receiver.elapse(time_ns, reports))
    }

    /// The flight has ended.
    fn end(&self, py: Python<'_>) -> PyResult<()> {
        self.work(py, |receiver, reports| {
            receiver.end(reports);
            receiver.close();
        })
    }

    fn pose(&self, py: Python<'_>) -> PyResult<Option<PoseColumns>> {
        self.work(py, |receiver, _| {
            let pose = receiver.cslam().pose()?;
            let clock_offset_m = receiver.cslam().clock_offset_m(&pose);
            Some(pose_columns(&pose, clock_offset_m))
        })
    }

    /// Position, trace of its covariance, hits and surface of each point of the map.
    fn map(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let (mut position, mut variance, mut hits, mut surface) = (vec![], vec![], vec![], vec![]);
        self.work(py, |receiver, _| {
            for point in receiver.cslam().map().points() {
                position.extend(point.position.to_array().map(f64::from));
                variance.push(f64::from(point.variance_m2));
                hits.push(point.hits);
                surface.push(point.surface().map_or(-1, i32::from));
            }
        })?;
        let columns = (
            position.into_pyarray(py),
            variance.into_pyarray(py),
            hits.into_pyarray(py),
            surface.into_pyarray(py),
        );
        Ok(columns.into_pyobject(py)?.into_any().unbind())
    }

    /// What waits for the radio.
    fn take_packets(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        self.work(py, |receiver, _| {
            let mut packets = Vec::new();
            raw_flight::drain(receiver.downlink(), &mut packets);
            packets
        })
    }

    /// The sweeps that have ended since the last call.
    fn take_sweeps(&self, py: Python<'_>) -> PyResult<Vec<Py<PyAny>>> {
        let reports = self.work(py, |_, reports| std::mem::take(&mut reports.0))?;
        reports.iter().map(|report| swept(py, report)).collect()
    }
}

impl Receiver {
    fn parts(&self) -> PyResult<MutexGuard<'_, Parts>> {
        // A panic would have left the receiver in the middle of its work.
        let failed = |_| PyRuntimeError::new_err("an earlier call of this receiver failed");
        self.0.lock().map_err(failed)
    }

    /// Works with the receiver, other threads of Python meanwhile as well.
    fn work<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut BoardReceiver<'_>, &mut Reports) -> R + Send,
    ) -> PyResult<R> {
        py.detach(|| {
            let mut parts = self.parts()?;
            let Parts { flying, reports, .. } = &mut *parts;
            Ok(flying.with_dependent_mut(|_, receiver| work(receiver, reports)))
        })
    }
}

fn pose_columns(pose: &Pose, clock_offset_m: Option<f64>) -> PoseColumns {
    let PoseEstimate {
        position_m,
        quaternion_wb,
        velocity_m_per_s,
        clock_offset_s,
        clock_sigma_s,
        position_covariance_m2,
        attitude_covariance_rad2,
        velocity_covariance_m2_per_s2,
    } = pose_estimate(pose, clock_offset_m);
    (
        pose.time_ns,
        position_m,
        quaternion_wb,
        velocity_m_per_s,
        clock_offset_s,
        clock_sigma_s,
        position_covariance_m2,
        attitude_covariance_rad2,
        velocity_covariance_m2_per_s2,
        pose.resets,
    )
}

/// Numbers as an array.
fn column<'py, T: Element>(py: Python<'py>, numbers: impl Iterator<Item = T>) -> Bound<'py, PyArray1<T>> {
    numbers.collect::<Vec<T>>().into_pyarray(py)
}

/// A sweep: what it is, its pose, columns of its paths, columns of the points that it added, surfaces that were withdrawn.
fn swept(py: Python<'_>, report: &SweepReport<PATHS>) -> PyResult<Py<PyAny>> {
    let estimated = || report.paths.iter().map(|path| &path.estimated);
    let arrival = |path: &EstimatedPath<World>| <[f32; 3]>::from(*path.path.aoa.vector());
    let paths = (
        column(py, estimated().map(|path| f64::from(path.path.c_tau_m))),
        column(py, estimated().flat_map(arrival).map(f64::from)),
        column(py, estimated().map(|path| f64::from(path.snr_db))),
        report.paths.iter().map(verdict).collect::<Vec<String>>(),
    );
    let points = report.points.iter();
    let position = |mapped: &MappedPoint| mapped.point.position.to_array();
    let points = (
        column(py, points.clone().flat_map(position).map(f64::from)),
        column(
            py,
            points
                .clone()
                .map(|mapped| f64::from(mapped.point.covariance.trace())),
        ),
        column(py, points.clone().map(|mapped| f64::from(mapped.probability))),
        column(py, points.map(|mapped| mapped.surface.map_or(-1, i32::from))),
    );
    let told = (
        report.sweep,
        report.time_ns,
        report.link as u8,
        report.verdict.is_taken(),
        report.verdict.as_str(),
        report
            .pose
            .as_ref()
            .map(|pose| pose_columns(pose, report.clock_offset_m)),
    );
    let withdrawn: Vec<u16> = report.surfaces.withdrawn.to_vec();
    Ok((told, paths, points, withdrawn)
        .into_pyobject(py)?
        .into_any()
        .unbind())
}
