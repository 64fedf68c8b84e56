//! The simulated world: scenes, ray tracing, what a front end would hear.

use cslam_host_sim::channel::{ChannelConfig, Instant, Simulator};
use cslam_host_sim::paths::{self, Link};
use cslam_host_sim::tracer::{LEAST_DISTANCE_M, MAX_ORDER, Tracer, for_each_link};
use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::estimator::arrays;
use crate::refused;

/// See `cslam.Scene`.
#[pyclass(frozen)]
pub(crate) struct Scene {
    scene: cslam_host_sim::scene::Scene,
}

#[pymethods]
impl Scene {
    #[new]
    fn new(py: Python<'_>, name: &str) -> PyResult<Self> {
        let scene = py
            .detach(|| cslam_host_sim::scene::Scene::load(name))
            .map_err(refused)?;
        Ok(Self { scene })
    }

    #[getter]
    fn name(&self) -> &str {
        self.scene.name()
    }

    #[getter]
    fn frequency_hz(&self) -> f64 {
        self.scene.frequency_hz()
    }

    #[getter]
    fn bounds_m(&self) -> [[f64; 3]; 2] {
        let bounds = self.scene.bounds();
        [bounds.min_m, bounds.max_m]
    }

    #[getter]
    fn faces(&self) -> usize {
        self.scene.faces().len()
    }

    /// Every transmitter with every receiver, as lines of the paths format.
    fn trace(
        &self,
        py: Python<'_>,
        tx_m: PyReadonlyArray2<'_, f64>,
        rx_m: PyReadonlyArray2<'_, f64>,
        max_order: usize,
    ) -> PyResult<Vec<String>> {
        let (tx_m, rx_m) = (points("tx_m", &tx_m)?, points("rx_m", &rx_m)?);
        for tx in &tx_m {
            for rx in &rx_m {
                let square = (0..3).map(|i| (tx[i] - rx[i]).powi(2)).sum::<f64>();
                if square < LEAST_DISTANCE_M * LEAST_DISTANCE_M {
                    return Err(refused(format_args!(
                        "transmitter and receiver both stand at {rx:?}: expected at least {LEAST_DISTANCE_M} m between them"
                    )));
                }
            }
        }
        let tracer = Tracer::new(&self.scene, max_order).ok_or_else(|| {
            refused(format_args!(
                "max_order: got {max_order}, expected 0 to {MAX_ORDER}"
            ))
        })?;
        py.detach(|| {
            let mut lines = Vec::new();
            for_each_link(
                &tracer,
                &tx_m,
                &rx_m,
                |tree, rx_m, found| serde_json::to_string(&tree.to_link(rx_m, &found)),
                |line| -> PyResult<()> {
                    lines.push(line.map_err(refused)?);
                    Ok(())
                },
            )?;
            Ok(lines)
        })
    }
}

/// Points out of an array.
fn points(name: &str, array: &PyReadonlyArray2<'_, f64>) -> PyResult<Vec<[f64; 3]>> {
    let shape = array.shape();
    if shape[1] != 3 || shape[0] == 0 {
        return Err(refused(format_args!(
            "{name}: got shape {shape:?}, expected [1 or more, 3]"
        )));
    }
    let rows = array.as_array();
    let points: Vec<[f64; 3]> = rows
        .rows()
        .into_iter()
        .map(|row| [row[0], row[1], row[2]])
        .collect();
    if points.iter().flatten().any(|c| !c.is_finite()) {
        return Err(refused(format_args!("{name}: a coordinate is not finite")));
    }
    Ok(points)
}

/// See `cslam.synth`.
#[pyfunction]
pub(crate) fn synth<'py>(
    py: Python<'py>,
    link: &str,
    seed: u64,
    snr_offset_db: f64,
    impairments: bool,
    attitude_wxyz: [f64; 4],
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let links: Vec<Link> = paths::parse("link".as_ref(), link).map_err(refused)?;
    let [link] = &links[..] else {
        return Err(refused(format_args!("got {} links, expected one", links.len())));
    };
    let mut config = if impairments {
        ChannelConfig::default()
    } else {
        ChannelConfig::ideal()
    };
    config.front_end.snr_offset_db += snr_offset_db;
    config.motion.uav_quaternion_wb = attitude_wxyz;
    config.check().map_err(refused)?;
    let instant = Instant::of(&config.motion).map_err(|e| refused(format_args!("attitude_wxyz: {e}")))?;
    let sweep = py
        .detach(|| Simulator::new(config, seed).sweep(link, &instant, 0))
        .map_err(refused)?;
    arrays(py, &sweep.blocks)
}
