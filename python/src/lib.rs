//! The compiled half of the Python package: arrays in, arrays out. Checks of shapes that a user meets, columns and words are in
//! `package/cslam`, which is Python.

mod estimator;
mod interrupted;
mod radio;
mod receiver;
mod recorded;
mod recordings;
mod solving;
mod world;

use cslam_host_sim::input::InputError;
use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

/// The error of bad input is a `ValueError`, any other a `RuntimeError`.
fn raised(error: &anyhow::Error) -> PyErr {
    if error.downcast_ref::<InputError>().is_some() {
        PyValueError::new_err(format!("{error:#}"))
    } else {
        PyRuntimeError::new_err(format!("{error:#}"))
    }
}

/// The error of bad input.
fn refused(error: impl std::fmt::Display) -> PyErr {
    PyValueError::new_err(error.to_string())
}

#[pymodule]
mod _cslam {
    #[pymodule_export]
    use super::estimator::Estimator;
    #[pymodule_export]
    use super::receiver::Receiver;
    #[pymodule_export]
    use super::recorded::{RecordedFlight, record};
    #[pymodule_export]
    use super::recordings::{fly, read_packets, read_sigmf, write_sigmf};
    #[pymodule_export]
    use super::solving::{classify, solve};
    #[pymodule_export]
    use super::world::{Scene, synth};

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        // Nothing is printed beside what Python prints.
        cslam_host_sim::progress::be_quiet();
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
