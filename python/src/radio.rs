//! The radio, as JSON in the form of the table `[radio]`.

use cslam_core::radio::RadioConfig;
use cslam_host_sim::radio::RadioFigures;
use pyo3::PyResult;

use crate::refused;

/// The figures of a radio that is told; none without.
pub(crate) fn told(radio: Option<&str>) -> PyResult<Option<RadioFigures>> {
    let Some(text) = radio else { return Ok(None) };
    let figures: RadioFigures =
        serde_json::from_str(text).map_err(|error| refused(format_args!("radio: {error}")))?;
    figures.check().map_err(|error| refused(error.under("radio")))?;
    Ok(Some(figures))
}

/// The radio that is told, or the default one.
pub(crate) fn config(radio: Option<&str>) -> PyResult<RadioConfig> {
    Ok(told(radio)?.unwrap_or_default().config())
}

/// JSON of a radio that a file says.
pub(crate) fn text(radio: Option<RadioFigures>) -> PyResult<Option<String>> {
    radio
        .as_ref()
        .map(serde_json::to_string)
        .transpose()
        .map_err(refused)
}
