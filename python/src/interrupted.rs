//! Long work that Ctrl-C ends.

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::raised;

/// How often Python is asked whether somebody wants the work to end.
const PATIENCE: Duration = Duration::from_millis(50);

/// Does work on a thread of its own, with a flag that Ctrl-C raises; other threads of Python go on meanwhile.
pub(crate) fn watched<R: Send>(
    py: Python<'_>,
    work: impl FnOnce(&AtomicBool) -> anyhow::Result<R> + Send,
) -> PyResult<R> {
    let interrupted = AtomicBool::new(false);
    thread::scope(|scope| {
        let working = scope.spawn(|| work(&interrupted));
        let mut signal = Ok(());
        while !working.is_finished() {
            py.detach(|| thread::sleep(PATIENCE));
            if signal.is_ok() {
                signal = py.check_signals();
                interrupted.store(signal.is_err(), Ordering::Relaxed);
            }
        }
        let done = working
            .join()
            .map_err(|_| PyRuntimeError::new_err("the work panicked"))?;
        // What was asked to end has failed for that reason.
        signal?;
        done.map_err(|e| raised(&e))
    })
}
