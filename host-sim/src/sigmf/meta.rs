//! The metadata file, and what a recording's must say.

use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::SAMPLES;
use serde::{Deserialize, Serialize};

use crate::channel::Codebook;
use crate::radio::RadioFigures;

/// Exponents a block may have: an `f64` holds every amplitude.
const EXPONENTS: std::ops::RangeInclusive<i32> = -200..=200;
/// Name of the array geometry.
pub(super) const ARRAY: &str = "quad-tilted-4x8";

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Meta {
    pub(super) global: Global,
    pub(super) captures: Vec<Capture>,
    #[serde(default)]
    pub(super) annotations: Vec<serde_json::Value>,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Global {
    #[serde(rename = "core:datatype")]
    pub(super) datatype: String,
    #[serde(rename = "core:version")]
    pub(super) version: String,
    #[serde(rename = "core:sample_rate")]
    pub(super) sample_rate_hz: f64,
    #[serde(rename = "core:num_channels")]
    pub(super) channels: usize,
    #[serde(rename = "core:description", default)]
    pub(super) description: String,
    #[serde(rename = "core:recorder", default)]
    pub(super) recorder: String,
    #[serde(rename = "core:extensions", default)]
    pub(super) extensions: Vec<Extension>,
    #[serde(rename = "cslam:waveform")]
    pub(super) waveform: String,
    #[serde(rename = "cslam:array")]
    pub(super) array: String,
    #[serde(rename = "cslam:codebook")]
    pub(super) codebook: String,
    #[serde(rename = "cslam:radio", default, skip_serializing_if = "Option::is_none")]
    pub(super) radio: Option<RadioFigures>,
    #[serde(
        rename = "cslam:gmt_position_m",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub(super) gmt_position_m: Option<[f64; 3]>,
    #[serde(
        rename = "cslam:uav_position_m",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub(super) uav_position_m: Option<[f64; 3]>,
    #[serde(
        rename = "cslam:uav_quaternion_wb",
        default,
        skip_serializing_if = "Option::is_none"
    )]
    pub(super) uav_quaternion_wb: Option<[f64; 4]>,
}

#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Extension {
    pub(super) name: String,
    pub(super) version: String,
    pub(super) optional: bool,
}

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Capture {
    #[serde(rename = "core:sample_start")]
    pub(super) sample_start: u64,
    #[serde(rename = "core:frequency")]
    pub(super) frequency_hz: f64,
    #[serde(rename = "cslam:beam")]
    pub(super) beam: u16,
    #[serde(rename = "cslam:exponent")]
    pub(super) exponent: i32,
}

/// Keys of the metadata: those above, and those of SigMF 1.2 that describe a recording and do not change what its samples mean.
const TOP_KEYS: &[&str] = &["global", "captures", "annotations"];
const GLOBAL_KEYS: &[&str] = &[
    "core:datatype",
    "core:version",
    "core:sample_rate",
    "core:num_channels",
    "core:description",
    "core:recorder",
    "core:extensions",
    "cslam:waveform",
    "cslam:array",
    "cslam:codebook",
    "cslam:radio",
    "cslam:gmt_position_m",
    "cslam:uav_position_m",
    "cslam:uav_quaternion_wb",
    "core:author",
    "core:collection",
    "core:data_doi",
    "core:dataset",
    "core:geolocation",
    "core:hw",
    "core:license",
    "core:meta_doi",
    "core:sha512",
];
const CAPTURE_KEYS: &[&str] = &[
    "core:sample_start",
    "core:frequency",
    "cslam:beam",
    "cslam:exponent",
    "core:datetime",
    "core:geolocation",
    "core:global_index",
];

/// Refuses a key that is none of those.
pub(super) fn check_keys(meta: &serde_json::Value) -> Result<(), String> {
    let check = |place: &str, object: &serde_json::Value, known: &[&str]| {
        let mut keys = object.as_object().into_iter().flat_map(|object| object.keys());
        match keys.find(|key| !known.contains(&key.as_str())) {
            None => Ok(()),
            Some(key) => Err(format!(
                "{place}: unknown key `{key}`, expected one of {}",
                known.join(", ")
            )),
        }
    };
    check("the whole", meta, TOP_KEYS)?;
    check("global", &meta["global"], GLOBAL_KEYS)?;
    let mut captures = meta["captures"].as_array().into_iter().flatten().enumerate();
    captures.try_for_each(|(i, capture)| check(&format!("capture {i}"), capture, CAPTURE_KEYS))
}

/// Checks metadata against what this receiver takes and against itself.
pub(super) fn check(meta: &Meta) -> Result<Codebook, String> {
    let g = &meta.global;
    let radio = g.radio.unwrap_or_default();
    radio
        .check()
        .map_err(|error| error.under("cslam:radio").to_string())?;
    let waveform = radio.waveform;
    let named = waveform.name();
    let names = [
        ("core:datatype", &g.datatype, "ci16_le"),
        ("cslam:waveform", &g.waveform, named.as_str()),
        ("cslam:array", &g.array, ARRAY),
    ];
    for (key, value, expected) in names {
        if value != expected {
            return Err(format!("`{key}` is \"{value}\", expected \"{expected}\""));
        }
    }
    let codebook = Codebook::named(&g.codebook).ok_or_else(|| {
        let known = Codebook::ALL.map(Codebook::name).join(", ");
        format!("`cslam:codebook` is \"{}\", expected one of {known}", g.codebook)
    })?;
    if g.channels != CHANNELS {
        return Err(format!(
            "`core:num_channels` is {}, expected {CHANNELS}",
            g.channels
        ));
    }
    if g.sample_rate_hz != waveform.sample_rate_hz {
        return Err(format!(
            "`core:sample_rate` is {}, expected {}",
            g.sample_rate_hz, waveform.sample_rate_hz
        ));
    }
    if let Some(q) = g.uav_quaternion_wb {
        let norm = q.iter().map(|c| c * c).sum::<f64>().sqrt();
        if (norm - 1.0).abs() > 1e-3 {
            return Err(format!(
                "`cslam:uav_quaternion_wb` has length {norm}, expected a unit quaternion [w, x, y, z]"
            ));
        }
    }
    let mut seen = vec![false; codebook.len()];
    for (i, c) in meta.captures.iter().enumerate() {
        if c.sample_start != (i * SAMPLES) as u64 {
            return Err(format!(
                "capture {i}: `core:sample_start` is {}, expected {}: blocks of {SAMPLES} samples, none left out",
                c.sample_start,
                i * SAMPLES
            ));
        }
        if c.frequency_hz != waveform.carrier_hz {
            return Err(format!(
                "capture {i}: `core:frequency` is {}, expected {}",
                c.frequency_hz, waveform.carrier_hz
            ));
        }
        match seen.get_mut(usize::from(c.beam)) {
            None => {
                return Err(format!(
                    "capture {i}: `cslam:beam` is {}, expected 0 to {}",
                    c.beam,
                    codebook.len() - 1
                ));
            }
            Some(true) => return Err(format!("capture {i}: `cslam:beam` {} appears twice", c.beam)),
            Some(seen) => *seen = true,
        }
        if !EXPONENTS.contains(&c.exponent) {
            return Err(format!(
                "capture {i}: `cslam:exponent` is {}, expected -200 to 200",
                c.exponent
            ));
        }
    }
    Ok(codebook)
}
