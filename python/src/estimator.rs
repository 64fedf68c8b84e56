//! Path estimation.

use std::sync::{Mutex, PoisonError, TryLockError};

use cslam_core::geometry::{Gmt, Rotation, World};
use cslam_core::paths::{ElementErrors, EstimatedPath, PathEstimator};
use cslam_core::profile::quad_4x8_gmt_72::{BEAMS, CHANNELS};
use cslam_core::profile::{FlightConfig, FlightEstimator};
use cslam_core::signal::{Iq, SAMPLES};
use cslam_host_sim::channel::{Block, strongest_first};
use cslam_host_sim::estimate::{Mode, estimator};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray4,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::{radio, refused};

/// Columns of paths: `c_tau_m`, arrival, departure (NaN where none), its sigma, SNR, beam, covariance, and the lines of text.
type Columns<'py> = (
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<f64>>,
    Bound<'py, PyArray1<u16>>,
    Bound<'py, PyArray3<f64>>,
    String,
);

/// See `cslam.Estimator`.
#[pyclass(frozen)]
pub(crate) struct Estimator {
    mode: Mode,
    follow: bool,
    config: FlightConfig,
    gmt_attitude: Rotation<Gmt, World>,
    flying: Mutex<Box<FlightEstimator>>,
}

#[pymethods]
impl Estimator {
    #[new]
    fn new(
        mode: &str,
        gmt_heading_rad: f64,
        false_alarms_per_sweep: f64,
        dynamic_range_db: f32,
        screening: bool,
        follow: bool,
        radio: Option<&str>,
    ) -> PyResult<Self> {
        let mode = Mode::ALL
            .into_iter()
            .find(|known| known.name() == mode)
            .ok_or_else(|| {
                let names = Mode::ALL.map(Mode::name).join(", ");
                refused(format_args!("mode: got \"{mode}\", expected one of {names}"))
            })?;
        if follow && mode != Mode::Best {
            return Err(refused(
                "follow: only mode \"best\" learns from one sweep for the next",
            ));
        }
        let gmt_attitude = Rotation::from_yaw_pitch_roll(gmt_heading_rad as f32, 0.0, 0.0)
            .map_err(|e| refused(format_args!("gmt_heading_rad: {e}")))?;
        let config = FlightConfig {
            false_alarms_per_sweep,
            dynamic_range_db,
            screening,
            element_errors: if follow {
                FlightConfig::default().element_errors
            } else {
                ElementErrors::BUDGET
            },
            ..FlightConfig::of(&radio::config(radio)?)
        };
        let flying = FlightEstimator::checked(&config).map_err(refused)?;
        Ok(Self {
            mode,
            follow,
            config,
            gmt_attitude,
            flying: Mutex::new(Box::new(flying)),
        })
    }

    /// The paths of one sweep. Arrays are C-contiguous, and of one length in their first axis.
    fn estimate<'py>(
        &self,
        py: Python<'py>,
        iq: PyReadonlyArray4<'py, i16>,
        beams: PyReadonlyArray1<'py, u16>,
        exponents: PyReadonlyArray1<'py, i32>,
    ) -> PyResult<Columns<'py>> {
        let mut blocks = blocks(&iq, &beams, &exponents, BEAMS)?;
        let found = py.detach(|| self.sweep(&mut blocks))?;
        let in_world = found
            .iter()
            .map(|path| path.with_departure_in_world(&self.gmt_attitude));
        Ok(columns(py, &in_world.collect::<Vec<_>>()))
    }
}

impl Estimator {
    fn sweep(&self, blocks: &mut [Block]) -> PyResult<Vec<EstimatedPath>> {
        if self.mode != Mode::Best {
            return Ok(paths_of(&mut *estimator(self.mode, &self.config), blocks));
        }
        if self.follow {
            return match self.flying.try_lock() {
                Ok(mut flying) => Ok(paths_of(&mut **flying, blocks)),
                Err(TryLockError::WouldBlock) => Err(PyRuntimeError::new_err(
                    "another thread uses this estimator, whose sweeps follow each other: one for each flight",
                )),
                Err(TryLockError::Poisoned(_)) => Err(PyRuntimeError::new_err("a sweep failed before")),
            };
        }
        let mut fresh = self.flying.lock().unwrap_or_else(PoisonError::into_inner).clone();
        Ok(paths_of(&mut *fresh, blocks))
    }
}

fn paths_of<E: PathEstimator<32, 9> + ?Sized>(estimator: &mut E, blocks: &mut [Block]) -> Vec<EstimatedPath> {
    for block in strongest_first(blocks) {
        let _report = estimator.push_beam(block.view());
    }
    estimator.finish().to_vec()
}

/// The blocks of a sweep out of arrays, their numbers below `numbers`.
pub(crate) fn blocks(
    iq: &PyReadonlyArray4<'_, i16>,
    beams: &PyReadonlyArray1<'_, u16>,
    exponents: &PyReadonlyArray1<'_, i32>,
    numbers: usize,
) -> PyResult<Vec<Block>> {
    let shape = iq.shape();
    if shape[1..] != [CHANNELS, SAMPLES, 2] || shape[0] == 0 || shape[0] > numbers {
        return Err(refused(format_args!(
            "iq: got shape {shape:?}, expected [1 to {numbers}, {CHANNELS}, {SAMPLES}, 2]"
        )));
    }
    for (name, length) in [("beams", beams.len()), ("exponents", exponents.len())] {
        if length != shape[0] {
            return Err(refused(format_args!(
                "{name}: got shape [{length}], expected [{}], one a beam",
                shape[0]
            )));
        }
    }
    let samples = iq.as_slice().map_err(refused)?;
    let beams = beams.as_array();
    let exponents = exponents.as_array();
    let mut seen = vec![false; numbers];
    let each = samples.as_chunks::<{ CHANNELS * SAMPLES * 2 }>().0;
    each.iter()
        .zip(beams)
        .zip(exponents)
        .map(|((samples, &beam), &exponent)| {
            let mut block = Block::zero(beam, exponent);
            match seen.get_mut(usize::from(beam)) {
                None => {
                    return Err(refused(format_args!(
                        "beams: got {beam}, expected 0 to {}",
                        numbers - 1
                    )));
                }
                Some(true) => return Err(refused(format_args!("beams: {beam} comes twice"))),
                Some(seen) => *seen = true,
            }
            if !(-100..=100).contains(&exponent) {
                return Err(refused(format_args!(
                    "exponents: got {exponent}, expected -100 to 100"
                )));
            }
            for (x, pair) in block
                .samples
                .as_flattened_mut()
                .iter_mut()
                .zip(samples.as_chunks::<2>().0)
            {
                *x = Iq::new(pair[0], pair[1]);
            }
            Ok(block)
        })
        .collect()
}

/// Samples, beams and exponents of blocks as arrays.
pub(crate) fn arrays<'py>(
    py: Python<'py>,
    blocks: &[Block],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let samples: Vec<i16> = blocks
        .iter()
        .flat_map(|block| block.samples.as_flattened().iter().flat_map(|x| [x.re(), x.im()]))
        .collect();
    let iq = samples
        .into_pyarray(py)
        .reshape([blocks.len(), CHANNELS, SAMPLES, 2])?;
    let beams: Vec<u16> = blocks.iter().map(|block| block.beam).collect();
    let exponents: Vec<i32> = blocks.iter().map(|block| block.exponent).collect();
    Ok((
        iq.into_any(),
        beams.into_pyarray(py).into_any(),
        exponents.into_pyarray(py).into_any(),
    ))
}

fn columns<'py>(py: Python<'py>, found: &[EstimatedPath<World>]) -> Columns<'py> {
    let n = found.len();
    let column =
        |f: &dyn Fn(&EstimatedPath<World>) -> f64| found.iter().map(f).collect::<Vec<f64>>().into_pyarray(py);
    let rows = |f: &dyn Fn(&EstimatedPath<World>) -> [f32; 3]| {
        let flat: Vec<f64> = found.iter().flat_map(|p| f(p).map(f64::from)).collect();
        numpy::ndarray::Array2::from_shape_vec([n, 3], flat)
            .unwrap_or_default()
            .into_pyarray(py)
    };
    let covariance: Vec<f64> = found
        .iter()
        .flat_map(|p| {
            p.path
                .covariance
                .transpose()
                .iter()
                .map(|x| f64::from(*x))
                .collect::<Vec<_>>()
        })
        .collect();
    let text: String = std::iter::once(EstimatedPath::COLUMNS.to_owned())
        .chain(found.iter().map(ToString::to_string))
        .map(|line| line + "\n")
        .collect();
    (
        column(&|p| f64::from(p.path.c_tau_m)),
        rows(&|p| (*p.path.aoa.vector()).into()),
        rows(&|p| {
            p.path
                .aod
                .map_or([f32::NAN; 3], |aod| (*aod.direction.vector()).into())
        }),
        column(&|p| p.path.aod.map_or(f64::NAN, |aod| f64::from(aod.sigma_rad))),
        column(&|p| f64::from(p.snr_db)),
        found
            .iter()
            .map(|p| p.beam)
            .collect::<Vec<u16>>()
            .into_pyarray(py),
        numpy::ndarray::Array3::from_shape_vec([n, 3, 3], covariance)
            .unwrap_or_default()
            .into_pyarray(py),
        text,
    )
}
