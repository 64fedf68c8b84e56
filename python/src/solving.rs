//! Reflection points and link states of columns of paths.

use cslam_core::geometry::{Body, Direction, Matrix3, Position, Real, Rotation, Vector3, World};
use cslam_core::link_state::{Classifier, LinkGeometry, Received, models};
use cslam_core::path::{Departure, Path};
use cslam_core::reflection::{Bounds, Ends, Form, Gates, InputError, Verdict};
use cslam_core::signal::Waveform;
use numpy::{
    IntoPyArray, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::refused;

/// Columns of paths as they come: NaN in `aod` and `gain_db` where unknown; `attitude` turns the arrivals into the world.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Columns<'py> {
    c_tau_m: PyReadonlyArray1<'py, f64>,
    aoa: PyReadonlyArray2<'py, f64>,
    aod: PyReadonlyArray2<'py, f64>,
    aod_sigma_rad: PyReadonlyArray1<'py, f64>,
    covariance: PyReadonlyArray3<'py, f64>,
    gain_db: PyReadonlyArray1<'py, f64>,
    attitude_wxyz: Option<[f64; 4]>,
    attitude_covariance_rad2: [[f64; 3]; 3],
    uav_m: [f64; 3],
    uav_covariance_m2: [[f64; 3]; 3],
    gmt_m: [f64; 3],
}

/// Gates of a point.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct Thresholds {
    open_gates: bool,
    ground_z_m: Option<f64>,
    bounds_m: Option<[[f64; 3]; 2]>,
    max_sigma_m: Option<f64>,
}

fn matrix<T: Real>(rows: [[f64; 3]; 3]) -> Matrix3<T> {
    Matrix3::from_fn(|r, c| T::of(rows[r][c]))
}

fn position<T: Real>(p: [f64; 3]) -> Result<Position<World, T>, InputError> {
    Ok(Position::new(T::of(p[0]), T::of(p[1]), T::of(p[2]))?)
}

impl Columns<'_> {
    /// Number of paths, where all columns agree.
    fn count(&self) -> PyResult<usize> {
        let n = self.c_tau_m.len();
        let shapes: [(&str, &[usize], &[usize]); 5] = [
            ("aoa", self.aoa.shape(), &[n, 3]),
            ("aod", self.aod.shape(), &[n, 3]),
            ("aod_sigma_rad", self.aod_sigma_rad.shape(), &[n]),
            ("covariance", self.covariance.shape(), &[n, 3, 3]),
            ("gain_db", self.gain_db.shape(), &[n]),
        ];
        match shapes.iter().find(|(_, got, expected)| got != expected) {
            Some((name, got, expected)) => Err(refused(format_args!(
                "{name}: got shape {got:?}, expected {expected:?}"
            ))),
            None => Ok(n),
        }
    }

    fn ends<T: Real>(&self) -> Result<Ends<T>, InputError> {
        Ok(Ends {
            uav: position(self.uav_m)?,
            uav_covariance: matrix(self.uav_covariance_m2),
            gmt: position(self.gmt_m)?,
        })
    }

    fn attitude<T: Real>(&self) -> Result<Option<Rotation<Body, World, T>>, InputError> {
        let quaternion = self.attitude_wxyz.map(|q| q.map(T::of));
        Ok(quaternion.map(Rotation::from_quaternion).transpose()?)
    }

    /// Path `i` in world axes.
    fn path<T: Real>(
        &self,
        i: usize,
        attitude: Option<&Rotation<Body, World, T>>,
    ) -> Result<Path<World, T>, InputError> {
        let (aoa, aod, covariance) = (
            self.aoa.as_array(),
            self.aod.as_array(),
            self.covariance.as_array(),
        );
        let row = |a: &numpy::ndarray::ArrayView2<'_, f64>| {
            Vector3::new(T::of(a[[i, 0]]), T::of(a[[i, 1]]), T::of(a[[i, 2]]))
        };
        let left = row(&aod);
        let aod = if left.iter().any(|c| c.to_f64().is_nan()) {
            None
        } else {
            Some(Departure {
                direction: Direction::from_vector(left)?,
                sigma_rad: T::of(self.aod_sigma_rad.as_array()[i]),
            })
        };
        let (c_tau_m, covariance) = (
            T::of(self.c_tau_m.as_array()[i]),
            Matrix3::from_fn(|r, c| T::of(covariance[[i, r, c]])),
        );
        Ok(match attitude {
            Some(attitude) => Path::<Body, T> {
                c_tau_m,
                aoa: Direction::from_vector(row(&aoa))?,
                aod,
                covariance,
            }
            .to_world(attitude, &matrix(self.attitude_covariance_rad2)),
            None => Path {
                c_tau_m,
                aoa: Direction::from_vector(row(&aoa))?,
                aod,
                covariance,
            },
        })
    }
}

impl Thresholds {
    fn gates(&self) -> PyResult<Gates<f64>> {
        let mut gates = if self.open_gates {
            Gates::open()
        } else {
            Gates::default()
        };
        if self.ground_z_m.is_some_and(|z| !z.is_finite()) {
            return Err(refused("ground_z_m: expected a finite height"));
        }
        gates.ground_z_m = self.ground_z_m;
        if let Some(most) = self.max_sigma_m {
            if most.is_nan() || most < 0.0 {
                return Err(refused(format_args!(
                    "max_sigma_m: got {most}, expected 0 or more"
                )));
            }
            gates.max_sigma_m = most;
        }
        if let Some([min, max]) = self.bounds_m {
            if !(0..3).all(|i| min[i] < max[i]) {
                return Err(refused(
                    "bounds_m: expected [[x0, y0, z0], [x1, y1, z1]] with x0 < x1, y0 < y1, z0 < z1",
                ));
            }
            gates.bounds = Some(Bounds {
                min: position(min).map_err(refused)?,
                max: position(max).map_err(refused)?,
            });
        }
        Ok(gates)
    }
}

/// Points (NaN where none), their covariances (NaN), and verdicts in words.
type Points<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
    Vec<&'static str>,
);

/// See `cslam.solve`.
#[pyfunction]
pub(crate) fn solve<'py>(py: Python<'py>, paths: Columns<'py>, gates: Thresholds) -> PyResult<Points<'py>> {
    let (n, gates) = (paths.count()?, gates.gates()?);
    let ends = paths.ends::<f64>().map_err(refused)?;
    let attitude = paths
        .attitude::<f64>()
        .map_err(|e| refused(format_args!("attitude_wxyz: {e}")))?;
    let mut points = numpy::ndarray::Array2::from_elem([n, 3], f64::NAN);
    let mut covariance = numpy::ndarray::Array3::from_elem([n, 3, 3], f64::NAN);
    let mut verdicts = Vec::with_capacity(n);
    for i in 0..n {
        let verdict = paths
            .path(i, attitude.as_ref())
            .and_then(|path| cslam_core::reflection::solve(&ends, &path, Form::Vector, &gates));
        verdicts.push(match verdict {
            Ok(Verdict::Accepted(point)) => {
                for (axis, c) in point.position.to_array().into_iter().enumerate() {
                    points[[i, axis]] = c;
                }
                for r in 0..3 {
                    for c in 0..3 {
                        covariance[[i, r, c]] = point.covariance[(r, c)];
                    }
                }
                "ok"
            }
            Ok(Verdict::Rejected(reason)) => reason.as_str(),
            Err(error) => error.as_str(),
        });
    }
    Ok((points.into_pyarray(py), covariance.into_pyarray(py), verdicts))
}

/// See `cslam.classify`.
#[pyfunction]
pub(crate) fn classify<'py>(py: Python<'py>, paths: Columns<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let n = paths.count()?;
    let ends = paths.ends::<f32>().map_err(refused)?;
    let attitude = paths
        .attitude::<f32>()
        .map_err(|e| refused(format_args!("attitude_wxyz: {e}")))?;
    let gains = paths.gain_db.as_array();
    let received = (0..n).map(|i| {
        Ok(Received {
            path: paths
                .path(i, attitude.as_ref())
                .map_err(|e| refused(format_args!("path {i}: {e}")))?,
            gain_db: Some(gains[i] as f32).filter(|gain| gain.is_finite()),
        })
    });
    let received = received.collect::<PyResult<Vec<Received>>>()?;
    let mut probabilities = numpy::ndarray::Array2::from_elem([n, 3], f64::NAN);
    if n > 0 {
        let damaged =
            |e: &dyn std::fmt::Display| PyRuntimeError::new_err(format!("the library is damaged: {e}"));
        let with = models::geometric().map_err(|e| damaged(&e))?;
        let without = models::geometric_without_departure().map_err(|e| damaged(&e))?;
        let classifier = Classifier::new(with, without).map_err(|e| damaged(&e))?;
        let geometry = LinkGeometry::new(&ends, &received, &Waveform::default()).map_err(refused)?;
        for (i, path) in received.iter().enumerate() {
            if let Ok(p) = classifier.path(&geometry, path) {
                for (state, p) in p.to_array().into_iter().enumerate() {
                    probabilities[[i, state]] = f64::from(p);
                }
            }
        }
    }
    Ok(probabilities.into_pyarray(py))
}
