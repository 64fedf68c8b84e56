//! The paths format: one link a line, JSON, strongest path first.
//!
//! Links come from a ray tracer (with interaction vertices, order and complex gain) or from measurements (without).
//! World frame; angles as everywhere in this project (zenith from +z, azimuth from +x). docs/paths.md has the keys.

mod measured;

use std::path::Path;

use serde::{Deserialize, Serialize};

use crate::input::{InputError, read_text, unpack};

pub use measured::are_measured;

/// One transmitter heard by one receiver: a line of the file.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Link {
    /// Transmitter (GMT) position, m.
    pub tx: [f64; 3],
    /// Receiver (UAV) position, m.
    pub rx: [f64; 3],
    /// Whether the paths were measured: then they have their errors already. One such line makes the whole list measured.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub measured: bool,
    /// When the link was heard, s from the start of the flight.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Attitude of the UAV [w, x, y, z], body (FLU) to world.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub uav_quaternion_wb: Option<[f64; 4]>,
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
    /// Standard deviation of the departure along any tangent, rad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub aod_sigma_rad: Option<f64>,
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
    /// Covariance of (c tau in m, two tangent angles in rad) as `cslam estimate` writes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 3]; 3]>,
    /// A second, independent tracer found this path too (reference lists only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<bool>,
}

impl LinkPath {
    /// Power gain, dB; minus infinity for a path without any power, absent where the list does not say.
    pub fn gain_db(&self) -> Option<f64> {
        self.gain.map(|[re, im]| 10.0 * libm::log10(re * re + im * im))
    }
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
        let link = parse_line(line).map_err(|message| InputError::at_line(file, index + 1, message))?;
        links.push(link);
    }
    Ok(links)
}

/// Parses a line; what is wrong with it in words.
fn parse_line(line: &str) -> Result<Link, String> {
    let mut link: Link = serde_json::from_str(line)
        .map_err(|e| missing_end(line).unwrap_or_else(|| format!("not a link of the paths format: {e}")))?;
    for (path, p) in link.paths.iter().enumerate() {
        if p.aod_zenith_rad.is_some() != p.aod_azimuth_rad.is_some() {
            return Err(format!(
                "path {path}: aod_zenith_rad and aod_azimuth_rad must come together"
            ));
        }
    }
    measured::check(&link)?;
    if is_in_body_axes(line)? {
        measured::turn_into_world(&mut link)?;
    }
    Ok(link)
}

/// What to add to a line that is whole but for the place of an end, as `cslam estimate` writes it of a recording that does not
/// know its places.
fn missing_end(line: &str) -> Option<String> {
    let keys: serde_json::Map<String, serde_json::Value> = serde_json::from_str(line).ok()?;
    keys.get("paths")?;
    let missing = |key: &str, whose: &str, recorded: &str| {
        (!keys.contains_key(key)).then(|| {
            format!(
                "`{key}` is missing: add the {whose}'s position, \"{key}\":[x,y,z] in m, world frame \
                 (`cslam estimate` takes it from `{recorded}` of a recording)"
            )
        })
    };
    missing("rx", "receiver (UAV)", "cslam:uav_position_m")
        .or_else(|| missing("tx", "transmitter (GMT)", "cslam:gmt_position_m"))
}

/// Whether the angles of arrival of a line are in body axes. Without a word they are in the world's.
fn is_in_body_axes(line: &str) -> Result<bool, String> {
    #[derive(Deserialize)]
    struct Named {
        frame: Option<String>,
    }
    let named: Named = serde_json::from_str(line).map_err(|e| format!("`frame`: {e}"))?;
    match named.frame.as_deref() {
        None | Some("world") => Ok(false),
        Some("body") => Ok(true),
        Some(frame) => Err(format!("`frame` is \"{frame}\", expected \"world\" or \"body\"")),
    }
}

/// The path list that comes with the program: five GMT positions, each heard at 200 places of an outdoor scene.
///
/// # Errors
/// None in a sound build; the signature is that of [`read`].
pub fn bundled() -> Result<Vec<Link>, InputError> {
    let packed = include_bytes!("../fixtures/outdoor_a.jsonl.gz");
    let name = Path::new("bundled:outdoor_a.jsonl.gz");
    parse(name, &unpack(name, packed)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: &str = r#"{"delay_s":1e-7,"aoa_zenith_rad":1.5,"aoa_azimuth_rad":0.1}"#;

    fn line(path: &str) -> String {
        format!(r#"{{"tx":[0,0,2],"rx":[10,0,2],"paths":[{path}]}}"#)
    }

    fn error_of(text: &str) -> String {
        parse(Path::new("x.jsonl"), text)
            .expect_err("malformed")
            .to_string()
    }

    #[test]
    fn measured_paths_need_no_truth() {
        let links = parse(Path::new("x"), &format!("{}\n\n{}\n", line(PATH), line(""))).expect("sound");
        assert_eq!(
            (links.len(), links[0].paths.len(), links[1].paths.len()),
            (2, 1, 0)
        );
        assert_eq!(links[0].paths[0].order, None);
    }

    #[test]
    fn malformed_lines_are_named() {
        let good = line(PATH);
        assert!(error_of(&format!("{good}\n\n{{\"tx\":")).starts_with("x.jsonl:3: not a link"));
        assert!(error_of(&good.replace("delay_s", "delay")).contains("missing field `delay_s`"));
        assert!(error_of(&good.replace("1e-7", "\"soon\"")).contains("expected f64"));
        assert!(error_of(&good.replace("1e-7", "1e999")).contains("out of range"));
        assert!(error_of(&good.replace("[10,0,2]", "[10,0]")).contains("array of length 3"));
        let body = good.replace("{\"tx\"", "{\"frame\":\"body\",\"tx\"");
        assert!(error_of(&body).starts_with("x.jsonl:1: `frame` is \"body\", expected \"world\""));
        assert!(parse(Path::new("x"), &body.replace("body", "world")).is_ok());
        let half = line(&PATH.replace("}", r#","aod_zenith_rad":1.0}"#));
        assert!(
            error_of(&half).contains("must come together"),
            "{}",
            error_of(&half)
        );
    }

    #[test]
    fn the_bundled_list_is_sound() {
        let links = bundled().expect("sound");
        assert_eq!(links.len(), 1000);
        assert!(links.iter().map(|l| l.paths.len()).sum::<usize>() >= 1000);
    }
}
