//! The paths format: one link a line, JSON, strongest path first.
//!
//! Links come from a ray tracer (with interaction vertices, order and complex gain) or from measurements (without).
//! World frame; angles as everywhere in this project (zenith from +z, azimuth from +x). docs/formats.md, "Path lists", has the keys. A line may
//! hold more than a [`Link`] does: what `cslam estimate` and `cslam trace` write besides, and what reference lists say of a
//! diffraction besides its kind and its point (`keys`). Any other key is refused.

mod keys;
mod kind;
mod measured;

use std::path::Path;

use serde::{Deserialize, Serialize};

use keys::LinkKeys;

use crate::input::limits::{LINK_PATHS, PATH_LIST, SNR_DB};
use crate::input::{InputError, from_json_line, lines, read_text};

pub use kind::{Interaction, Kind};
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
    /// Number of interactions that turn the wave: 0 is line of sight. Absent for measured paths.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<u8>,
    /// What the interactions are; absent where a list knows of reflections alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kind: Option<Kind>,
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
    /// Of the horizontal component along phi-hat of the arrival, on the scale of `gain`; absent for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cross_gain: Option<[f64; 2]>,
    /// First interaction point seen from the transmitter, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_vertex: Option<[f64; 3]>,
    /// Last interaction point seen from the transmitter, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub last_vertex: Option<[f64; 3]>,
    /// Where an edge diffracted the wave, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub edge_point: Option<[f64; 3]>,
    /// SNR per element and active subcarrier, dB.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub snr_db: Option<f64>,
    /// Covariance of (c tau in m, two tangent angles in rad) as `cslam estimate` writes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub covariance: Option<[[f64; 3]; 3]>,
    /// A second, independent tracer found this path too (reference lists only).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmed: Option<bool>,
    /// Rate at which movers on the way shorten it, m/s; the motion of the ends comes on top. Absent for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closing_m_per_s: Option<f64>,
}

impl LinkPath {
    /// What it met: a path without a kind met so many reflections as its order says. `None` when the list says neither.
    pub fn kind_or_order(&self) -> Option<Kind> {
        self.kind
            .or_else(|| self.order.map(|order| Kind::reflections(order.into())))
    }

    /// What it must tell so that it can be heard: complex amplitude, and zenith and azimuth of departure, rad.
    ///
    /// # Errors
    /// What is missing, and what was expected.
    pub fn gain_and_departure(&self) -> Result<([f64; 2], [f64; 2]), &'static str> {
        let gain = self.gain.ok_or("`gain` is missing, expected [re, im]")?;
        let departure = self
            .aod_zenith_rad
            .zip(self.aod_azimuth_rad)
            .ok_or("the angle of departure is missing, expected `aod_zenith_rad` and `aod_azimuth_rad`")?;
        Ok((gain, departure.into()))
    }

    /// Whether it met nothing but mirrors, or nothing at all, as far as the list says.
    pub fn is_specular(&self) -> bool {
        self.kind.is_none_or(|kind| kind.is_specular())
    }

    /// Whether a face scattered it diffusely.
    pub fn is_scattered(&self) -> bool {
        self.met(Interaction::Scattering)
    }

    /// Whether a mover reflected it: its points are none of a static map.
    pub fn is_off_mover(&self) -> bool {
        self.met(Interaction::Mover)
    }

    /// Whether it is line of sight, with nothing in between: not even a pane.
    pub fn is_line_of_sight(&self) -> bool {
        self.order == Some(0) && !self.met(Interaction::Transmission)
    }

    /// Whether a kind of interaction is among those that the list names.
    fn met(&self, what: Interaction) -> bool {
        self.kind.is_some_and(|kind| kind.interactions().contains(&what))
    }

    /// Whether one reflection or diffraction made it: a path of its own, whose one interaction is a point of a surface. The pieces
    /// of a wave that a wall scatters are none, nor is what a mover reflects.
    pub fn is_first_order(&self) -> bool {
        self.order == Some(1) && !self.is_scattered() && !self.is_off_mover()
    }

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
    parse(file, &read_text(file, &PATH_LIST)?)
}

/// Parses the text of a paths file; `file` is for messages only.
///
/// # Errors
/// [`InputError`] naming file and line, and what was expected.
pub fn parse(file: &Path, text: &str) -> Result<Vec<Link>, InputError> {
    let mut links = Vec::new();
    for line in lines(file, text, &PATH_LIST) {
        let (number, line) = line?;
        if line.trim().is_empty() {
            continue;
        }
        links.push(parse_line(file, number, line)?);
    }
    Ok(links)
}

/// Parses a line.
fn parse_line(file: &Path, number: usize, line: &str) -> Result<Link, InputError> {
    let what = "a link of the paths format";
    let at_line = |message| InputError::at_line(file, number, message);
    let keys: LinkKeys = from_json_line(file, number, line, what)?;
    if let Some(message) = keys.missing_end() {
        return Err(at_line(message));
    }
    let mut link: Link = from_json_line(file, number, line, what)?;
    check(&link).map_err(at_line)?;
    measured::check(&link).map_err(at_line)?;
    match keys.frame.as_deref() {
        None | Some("world") => {}
        Some("body") => measured::turn_into_world(&mut link).map_err(at_line)?,
        Some(frame) => {
            return Err(at_line(format!(
                "`frame` is \"{frame}\", expected \"world\" or \"body\""
            )));
        }
    }
    Ok(link)
}

/// What a line must not say, in words.
fn check(link: &Link) -> Result<(), String> {
    if link.paths.len() > LINK_PATHS {
        return Err(format!(
            "`paths` has {} paths, expected at most {LINK_PATHS}",
            link.paths.len()
        ));
    }
    for (path, p) in link.paths.iter().enumerate() {
        if p.aod_zenith_rad.is_some() != p.aod_azimuth_rad.is_some() {
            return Err(format!(
                "path {path}: aod_zenith_rad and aod_azimuth_rad must come together"
            ));
        }
        if let Some(snr_db) = p.snr_db.filter(|snr_db| snr_db.abs() > SNR_DB) {
            return Err(format!(
                "path {path}: `snr_db` is {snr_db}, expected {} to {SNR_DB}",
                -SNR_DB
            ));
        }
        if let (Some(kind), Some(order)) = (p.kind, p.order)
            && kind.order() != usize::from(order)
        {
            return Err(format!(
                "path {path}: `kind` is \"{kind}\", expected as many letters beside T as `order`, {order}"
            ));
        }
        if p.edge_point.is_some() && p.kind.is_none_or(|kind| kind.edge().is_none()) {
            return Err(format!(
                "path {path}: `edge_point` needs a `kind` with the letter D beside it"
            ));
        }
    }
    Ok(())
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
        assert!(
            error_of(&good.replace("delay_s", "delay")).contains("unknown field `delay`, expected one of")
        );
        let without = good.replace("\"delay_s\":1e-7,", "");
        assert!(error_of(&without).contains("missing field `delay_s`"));
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
    fn every_key_that_is_written_is_read_and_no_other() {
        let more = "\"kind\":\"RD\",\"edge_point\":[0,0,1],\"edge\":[[0,0,0],[0,0,2]],\"wedge_exterior_rad\":4.7,\
            \"phi_in_rad\":1,\"phi_out_rad\":2,\"beta_rad\":1.5,\"faces\":[3],\"vertices\":[[0,0,1]],\"beam\":7,\
            \"aoa_body_zenith_rad\":1,\"aoa_body_azimuth_rad\":2,\"confirmed\":true}";
        let full = line(&PATH.replace(
            '}',
            &format!(",\"aod_zenith_rad\":1.5,\"aod_azimuth_rad\":0.1,\"aod_sigma_rad\":0.1,{more}"),
        ));
        let full = full.replace(
            "{\"tx\"",
            "{\"recording\":\"a\",\"mode\":\"best\",\"beams\":72,\"clips\":0,\"tx\"",
        );
        assert_eq!(parse(Path::new("x"), &full).expect("sound").len(), 1);
        let link = error_of(&full.replace("beams", "beens"));
        assert!(
            link.starts_with("x.jsonl:1: ") && link.contains("unknown field `beens`"),
            "{link}"
        );
        let path = error_of(&format!(
            "\n{}",
            full.replace("snr_db", "snr").replace("beta_rad", "beta")
        ));
        assert!(
            path.starts_with("x.jsonl:2: ") && path.contains("unknown field `beta`"),
            "{path}"
        );
    }

    #[test]
    fn a_kind_agrees_with_the_rest_of_its_path() {
        let path = |more: &str| line(&PATH.replace('}', &format!(",{more}}}")));
        let known = path("\"order\":2,\"kind\":\"RD\",\"edge_point\":[1,2,3]");
        let link = parse(Path::new("x"), &known).expect("sound").remove(0);
        assert_eq!(link.paths[0].edge_point, Some([1.0, 2.0, 3.0]));
        let text = serde_json::to_string(&link).expect("text");
        assert_eq!(parse(Path::new("x"), &text).expect("sound"), [link]);
        assert!(error_of(&path("\"kind\":\"RX\"")).contains("`kind` is \"RX\", expected \"LOS\""));
        assert!(
            error_of(&path("\"order\":1,\"kind\":\"RD\"")).contains("as many letters beside T as `order`, 1")
        );
        assert!(
            error_of(&path("\"order\":1,\"kind\":\"R\",\"edge_point\":[1,2,3]"))
                .contains("`edge_point` needs")
        );
    }

    #[test]
    fn more_than_the_limits_is_refused() {
        let paths = |count| line(&vec![PATH; count].join(","));
        assert!(parse(Path::new("x"), &paths(LINK_PATHS)).is_ok());
        let error = error_of(&paths(LINK_PATHS + 1));
        assert_eq!(error, "x.jsonl:1: `paths` has 1025 paths, expected at most 1024");
        let snr = |db| error_of(&line(&PATH.replace('}', &format!(",\"snr_db\":{db}}}"))));
        assert!(snr(400).contains("path 0: `snr_db` is 400, expected -200 to 200"));
        assert!(snr(-201).contains("`snr_db` is -201"));
        let long = format!("{}{}", line(PATH), " ".repeat(PATH_LIST.line_bytes));
        assert!(
            error_of(&long).contains("x.jsonl:1: has 1048"),
            "{}",
            error_of(&long)
        );
    }
}
