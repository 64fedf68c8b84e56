//! Recordings: the blocks of a sweep as a SigMF pair, NAME.sigmf-meta (JSON) and NAME.sigmf-data.
//!
//! `ci16_le`, 32 channels interleaved sample by sample (channel 8 j + i, array-major), 512 samples a block, one capture
//! segment a block. The global `cslam:` keys are those of docs/formats.md, "Recordings of samples"; docs/formats.md shows them and
//! how other tools open a recording. A reader checks everything before it hands out a sample: what is missing, cut short or
//! contradicts itself is an [`InputError`].

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::signal::{Iq, SAMPLES};

mod meta;

use meta::{ARRAY, Capture, Extension, Global, Meta, check, check_keys};

use crate::channel::Block;
pub use crate::channel::Codebook;
use crate::input::limits::SAMPLES_METADATA;
use crate::input::{InputError, from_json, read_exactly, read_text};
use crate::radio::RadioFigures;

/// Bytes of a block: 32 channels x 512 samples x (I, Q) x 2.
const BLOCK_BYTES: usize = CHANNELS * SAMPLES * 4;
/// What a recording holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Recording {
    /// What was sent.
    pub codebook: Codebook,
    /// The radio, where it is not the default's.
    pub radio: Option<RadioFigures>,
    /// Position of the GMT, world frame, m, as its beacon says.
    pub gmt_position_m: Option<[f64; 3]>,
    /// Position of the UAV, world frame, m, where it is known.
    pub uav_position_m: Option<[f64; 3]>,
    /// Attitude of the UAV, [w, x, y, z], body to world, where it is known.
    pub uav_quaternion_wb: Option<[f64; 4]>,
    /// Blocks, one a transmission of the codebook that was heard.
    pub blocks: Vec<Block>,
}

/// The two files of a recording, from its name or either file.
pub fn files(name: &Path) -> (PathBuf, PathBuf) {
    let text = name.to_string_lossy();
    let stem = text
        .strip_suffix(".sigmf-meta")
        .or_else(|| text.strip_suffix(".sigmf-data"))
        .unwrap_or(&text);
    (
        format!("{stem}.sigmf-meta").into(),
        format!("{stem}.sigmf-data").into(),
    )
}

/// Writes a recording; the metadata last, so that a pair with metadata is complete.
///
/// # Errors
/// [`InputError`] naming the file that cannot be written.
pub fn write(name: &Path, recording: &Recording) -> Result<(), InputError> {
    let waveform = recording.radio.unwrap_or_default().waveform;
    let (meta_file, data_file) = files(name);
    let mut data = Vec::with_capacity(recording.blocks.len() * BLOCK_BYTES);
    for block in &recording.blocks {
        for n in 0..SAMPLES {
            for channel in block.samples.iter() {
                data.extend_from_slice(&channel[n].word().to_le_bytes());
            }
        }
    }
    let captures = recording.blocks.iter().enumerate().map(|(i, block)| Capture {
        sample_start: (i * SAMPLES) as u64,
        frequency_hz: waveform.carrier_hz,
        beam: block.beam,
        exponent: block.exponent,
    });
    let meta = Meta {
        global: Global {
            datatype: "ci16_le".to_owned(),
            version: "1.2.0".to_owned(),
            sample_rate_hz: waveform.sample_rate_hz,
            channels: CHANNELS,
            description: "Blocks of the transmit beams of one sweep, as the UAV's receiver takes them"
                .to_owned(),
            recorder: concat!("cslam ", env!("CARGO_PKG_VERSION")).to_owned(),
            extensions: vec![Extension {
                name: "cslam".to_owned(),
                version: "1.0.0".to_owned(),
                optional: true,
            }],
            waveform: waveform.name(),
            array: ARRAY.to_owned(),
            codebook: recording.codebook.name().to_owned(),
            radio: recording.radio,
            gmt_position_m: recording.gmt_position_m,
            uav_position_m: recording.uav_position_m,
            uav_quaternion_wb: recording.uav_quaternion_wb,
        },
        captures: captures.collect(),
        annotations: Vec::new(),
    };
    let text = serde_json::to_string_pretty(&meta)
        .map_err(|e| InputError::unwritable(&meta_file, "cannot be written", &e.into()))?;
    put(&data_file, &data)?;
    put(&meta_file, text.as_bytes())
}

fn put(file: &Path, bytes: &[u8]) -> Result<(), InputError> {
    fs::File::create(file)
        .and_then(|mut f| f.write_all(bytes))
        .map_err(|e| InputError::unwritable(file, "cannot be written", &e))
}

/// Reads a recording by its name or either of its files.
///
/// # Errors
/// [`InputError`] naming the file and the key, or the length, that is wrong, and what was expected.
pub fn read(name: &Path) -> Result<Recording, InputError> {
    let (meta_file, data_file) = files(name);
    let text = read_text(&meta_file, &SAMPLES_METADATA)?;
    let what = "the metadata of a recording";
    let meta: Meta = from_json(&meta_file, &text, what)?;
    let codebook = check_keys(&from_json(&meta_file, &text, what)?)
        .and_then(|()| check(&meta))
        .map_err(|message| InputError::in_file(&meta_file, message))?;

    let captures = meta.captures.len();
    let data = read_exactly(
        &data_file,
        (captures * BLOCK_BYTES) as u64,
        &format!("for {captures} captures"),
    )?;
    let blocks = data
        .chunks_exact(BLOCK_BYTES)
        .zip(&meta.captures)
        .map(|(bytes, capture)| {
            let mut block = Block::zero(capture.beam, capture.exponent);
            let (words, _) = bytes.as_chunks::<4>();
            for (n, words) in words.chunks_exact(CHANNELS).enumerate() {
                for (word, channel) in words.iter().zip(block.samples.iter_mut()) {
                    channel[n] = Iq::from_word(u32::from_le_bytes(*word));
                }
            }
            block
        });
    Ok(Recording {
        codebook,
        radio: meta.global.radio,
        gmt_position_m: meta.global.gmt_position_m,
        uav_position_m: meta.global.uav_position_m,
        uav_quaternion_wb: meta.global.uav_quaternion_wb,
        blocks: blocks.collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording() -> Recording {
        let block = |beam: u16| {
            let mut block = Block::zero(beam, -30 + i32::from(beam));
            for (c, channel) in block.samples.iter_mut().enumerate() {
                for (n, x) in channel.iter_mut().enumerate() {
                    *x = Iq::new((100 * c + n) as i16, -((7 * n + usize::from(beam)) as i16));
                }
            }
            block
        };
        Recording {
            codebook: Codebook::Beams,
            radio: None,
            gmt_position_m: Some([1.0, 2.0, 0.3]),
            uav_position_m: Some([0.1, -2.0, 30.0]),
            uav_quaternion_wb: Some([0.6, 0.0, 0.8, 0.0]),
            blocks: vec![block(3), block(0), block(71)],
        }
    }

    fn written() -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("folder");
        let name = folder.path().join("one.of.them");
        write(&name, &recording()).expect("written");
        (folder, name)
    }

    #[test]
    fn what_is_written_is_read() {
        let (_folder, name) = written();
        let (meta, data) = files(&name);
        for file in [&name, &meta, &data] {
            assert_eq!(read(file).expect("readable"), recording());
        }
        // Interleaved sample by sample: sample 1 of channel 2 of the first block.
        let bytes = fs::read(&data).expect("data");
        let at = (32 + 2) * 4;
        assert_eq!(bytes[at..at + 4], [201, 0, (-10_i16).to_le_bytes()[0], 255]);
    }

    #[test]
    fn pilots_have_the_numbers_of_twice_as_many_beams() {
        let folder = tempfile::tempdir().expect("folder");
        let name = folder.path().join("pilots");
        let pilots = Recording {
            codebook: Codebook::Pilots,
            // Of each beam the first one and the second one, the strongest beam first.
            blocks: [71, 143, 3, 75, 0, 72].map(|beam| Block::zero(beam, -30)).into(),
            ..recording()
        };
        write(&name, &pilots).expect("written");
        assert_eq!(read(&name).expect("readable"), pilots);
        assert_eq!(Codebook::named("gmt-72-pilots"), Some(Codebook::Pilots));
    }

    #[test]
    fn damage_is_named() {
        type Damage = (&'static str, fn(&mut serde_json::Value), &'static str);
        let cases: [Damage; 17] = [
            (
                "codebook",
                |m| m["global"]["cslam:codebook"] = "x".into(),
                "expected one of gmt-72, gmt-72-pilots, bsm-seq, bsm-raster",
            ),
            (
                "squint",
                |m| m["global"]["cslam:codebook"] = "bsm-seq".into(),
                "`cslam:beam` is 71, expected 0 to 32",
            ),
            (
                "pilots",
                |m| {
                    m["global"]["cslam:codebook"] = "gmt-72-pilots".into();
                    m["captures"][1]["cslam:beam"] = 144.into();
                },
                "`cslam:beam` is 144, expected 0 to 143",
            ),
            (
                "type",
                |m| m["global"]["core:datatype"] = "cf32_le".into(),
                "`core:datatype` is \"cf32_le\"",
            ),
            (
                "channels",
                |m| m["global"]["core:num_channels"] = 16.into(),
                "`core:num_channels` is 16",
            ),
            (
                "rate",
                |m| m["global"]["core:sample_rate"] = 1e6.into(),
                "`core:sample_rate` is 1000000",
            ),
            (
                "waveform",
                |m| m["global"]["cslam:waveform"] = "x".into(),
                "expected \"zc409-273\"",
            ),
            (
                "start",
                |m| m["captures"][1]["core:sample_start"] = 0.into(),
                "capture 1: `core:sample_start` is 0",
            ),
            (
                "beam",
                |m| m["captures"][1]["cslam:beam"] = 72.into(),
                "`cslam:beam` is 72, expected 0 to 71",
            ),
            (
                "twice",
                |m| m["captures"][1]["cslam:beam"] = 3.into(),
                "`cslam:beam` 3 appears twice",
            ),
            (
                "exponent",
                |m| m["captures"][0]["cslam:exponent"] = 999.into(),
                "`cslam:exponent` is 999",
            ),
            (
                "attitude",
                |m| m["global"]["cslam:uav_quaternion_wb"][0] = 0.into(),
                "unit quaternion",
            ),
            (
                "unknown",
                |m| m["global"]["cslam:exponents"] = 1.into(),
                "global: unknown key `cslam:exponents`, expected one of core:datatype",
            ),
            (
                "unknown in a capture",
                |m| m["captures"][1]["core:header_bytes"] = 1.into(),
                "capture 1: unknown key `core:header_bytes`",
            ),
            (
                "unknown at the top",
                |m| m["capture"] = 1.into(),
                "the whole: unknown key `capture`, expected one of global, captures, annotations",
            ),
            (
                "unknown in an extension",
                |m| m["global"]["core:extensions"][0]["versions"] = 1.into(),
                "unknown field `versions`",
            ),
            (
                "missing",
                |m| drop(m["captures"][2].as_object_mut().map(|c| c.remove("cslam:beam"))),
                "missing field",
            ),
        ];
        for (what, damage, expected) in cases {
            let (_folder, name) = written();
            let (meta_file, _) = files(&name);
            let mut meta: serde_json::Value =
                serde_json::from_str(&fs::read_to_string(&meta_file).expect("text")).expect("JSON");
            damage(&mut meta);
            fs::write(&meta_file, meta.to_string()).expect("written");
            let message = read(&name).expect_err(what).to_string();
            assert!(
                message.contains(expected) && message.contains("sigmf-meta"),
                "{what}: {message}"
            );
        }
    }

    #[test]
    fn what_the_standard_adds_is_read_over() {
        let (_folder, name) = written();
        let (meta_file, _) = files(&name);
        let text = fs::read_to_string(&meta_file).expect("text");
        let mut meta: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        meta["global"]["core:author"] = "someone".into();
        meta["captures"][0]["core:datetime"] = "2026-01-01T00:00:00Z".into();
        meta["annotations"] = serde_json::json!([{"core:sample_start": 0, "core:comment": "here"}]);
        fs::write(&meta_file, meta.to_string()).expect("written");
        assert_eq!(read(&name).expect("sound"), recording());
    }

    #[test]
    fn metadata_without_end_are_refused() {
        let (_folder, name) = written();
        let (meta_file, _) = files(&name);
        let mut text = fs::read_to_string(&meta_file).expect("text");
        text += &" ".repeat(SAMPLES_METADATA.bytes as usize);
        fs::write(&meta_file, text).expect("written");
        let message = read(&name).expect_err("too long").to_string();
        assert!(
            message.contains("sigmf-meta: has more than 1048576 bytes"),
            "{message}"
        );
    }

    #[test]
    fn a_cut_or_missing_file_is_named() {
        let (_folder, name) = written();
        let (meta, data) = files(&name);
        let bytes = fs::read(&data).expect("data");
        fs::write(&data, &bytes[..bytes.len() - 2]).expect("written");
        let message = read(&name).expect_err("short").to_string();
        assert!(
            message.contains("is cut short: 196606 bytes, expected 196608 for 3 captures"),
            "{message}"
        );
        fs::write(&data, [bytes.as_slice(), &[0; 4]].concat()).expect("written");
        assert!(read(&name).expect_err("long").to_string().contains("is too long"));
        fs::remove_file(&data).expect("removed");
        assert!(
            read(&name)
                .expect_err("gone")
                .to_string()
                .contains("sigmf-data: cannot be read")
        );
        fs::write(&meta, "{").expect("written");
        assert!(
            read(&name)
                .expect_err("no JSON")
                .to_string()
                .contains("not the metadata")
        );
    }
}
