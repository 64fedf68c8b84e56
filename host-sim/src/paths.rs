//! The paths format: one link a line, JSON, strongest path first.
//!
//! Links come from a ray tracer (with interaction vertices, order and complex gain) or from measurements (without).
//! World frame; angles as everywhere in this project (zenith from +z, azimuth from +x).

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::input::{InputError, read_text};

/// One transmitter heard by one receiver: a line of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Transmitter (GMT) position, m.
    pub tx: [f64; 3],
    /// Receiver (UAV) position, m.
    pub rx: [f64; 3],
    /// Paths, strongest first; empty when nothing arrives.
    pub paths: Vec<LinkPath>,
}

/// One propagation path of a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkPath {
    /// Number of reflections: 0 is line of sight. Absent for measured paths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<u8>,
    /// Absolute delay, s.
    pub delay_s: f64,
    /// Zenith angle of arrival, rad.
    pub aoa_zenith_rad: f64,
    /// Azimuth of arrival, rad.
    pub aoa_azimuth_rad: f64,
    /// Zenith angle of departure, rad; absent when the receiver does not know it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aod_zenith_rad: Option<f64>,
    /// Azimuth of departure, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aod_azimuth_rad: Option<f64>,
    /// Complex amplitude [re, im] for vertical half-wave dipoles, carrier phase excluded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gain: Option<[f64; 2]>,
    /// First interaction point seen from the transmitter, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_vertex: Option<[f64; 3]>,
    /// Last interaction point seen from the transmitter, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_vertex: Option<[f64; 3]>,
    /// SNR per element and active subcarrier, dB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snr_db: Option<f64>,
    /// A second, independent tracer found this path too (reference lists only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<bool>,
}

/// Reads a paths file (`.jsonl` or `.jsonl.gz`). Empty lines are skipped; the index of a link is its place among the
/// non-empty lines, from 0.
///
/// # Errors
/// [`InputError`] naming file and line, and what was expected.
pub fn read(file: &Path) -> Result<Vec<Link>, InputError> {
    parse(file, &read_text(file)?)
}

/// Parses the text of a paths file; `file` is for messages only.
///
/// # Errors
/// [`InputError`] naming file and line, and what was expected.
pub fn parse(file: &Path, text: &str) -> Result<Vec<Link>, InputError> {
    let mut links = Vec::new();
    for (index, line) in text.lines().enumerate() {
        if line.trim().is_empty() {
            continue;
        }
        let link: Link = serde_json::from_str(line).map_err(|e| {
            InputError::at_line(file, index + 1, format!("not a link of the paths format: {e}"))
        })?;
        links.push(link);
    }
    Ok(links)
}
