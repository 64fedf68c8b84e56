//! `cslam synth` as a user meets it: recordings of reference links, the same for any thread count, one line for bad input.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cslam_host_sim::channel::Sweep;
use cslam_host_sim::paths;
use cslam_host_sim::sigmf::{self, Codebook};

fn cslam(args: &[&str], threads: &str) -> Output {
    Command::new(env!("CARGO_BIN_EXE_cslam"))
        .args(args)
        .env("RAYON_NUM_THREADS", threads)
        .output()
        .expect("the binary runs")
}

/// The first links of the outdoor reference that have `least` paths or more, as a file.
fn links(folder: &Path, count: usize, least: usize) -> PathBuf {
    let fixture = Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/outdoor_a.jsonl.gz");
    let all = paths::read(&fixture).expect("sound");
    let lines: Vec<String> = all
        .iter()
        .filter(|l| l.paths.len() >= least)
        .take(count)
        .map(|l| serde_json::to_string(l).expect("JSON"))
        .collect();
    assert_eq!(lines.len(), count);
    let file = folder.join("links.jsonl");
    fs::write(&file, lines.join("\n")).expect("written");
    file
}

fn text(path: &Path) -> &str {
    path.to_str().expect("a plain name")
}

fn refused(output: &Output) -> String {
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{message}");
    message
}

#[test]
fn recordings_are_complete_and_the_same_for_one_and_two_threads() {
    let folder = tempfile::tempdir().expect("folder");
    let paths = links(folder.path(), 3, 2);
    for threads in ["1", "2"] {
        let out = folder.path().join(format!("t{threads}"));
        let output = cslam(
            &[
                "synth",
                "--paths",
                text(&paths),
                "--out",
                text(&out),
                "--seed",
                "7",
                "--json",
            ],
            threads,
        );
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        let stdout = String::from_utf8(output.stdout).expect("text");
        assert_eq!(stdout.lines().count(), 3);
        let line: serde_json::Value =
            serde_json::from_str(stdout.lines().nth(2).expect("line")).expect("JSON");
        assert_eq!(
            (line["link"].as_u64(), line["blocks"].as_u64()),
            (Some(2), Some(72))
        );
    }
    for index in 0..3 {
        for end in ["meta", "data"] {
            let [a, b] = ["t1", "t2"].map(|t| {
                fs::read(folder.path().join(format!("{t}-{index:04}.sigmf-{end}"))).expect("written")
            });
            assert!(a == b, "recording {index}, {end}");
        }
    }
    let recording = sigmf::read(&folder.path().join("t1-0001")).expect("readable");
    let link = &paths::read(&paths).expect("sound")[1];
    assert_eq!(recording.codebook, Codebook::Beams);
    assert_eq!(
        (recording.gmt_position_m, recording.uav_position_m),
        (Some(link.tx), Some(link.rx))
    );
    assert_eq!(recording.uav_quaternion_wb, Some([1.0, 0.0, 0.0, 0.0]));
    // Gain control: the strongest channel of each block within one step under -12 dB of full scale (and what 1 % of noise
    // and rounding may add).
    for block in &recording.blocks {
        let rms = |c: &[cslam_core::signal::Iq; 512]| {
            (c.iter().map(|x| f64::from(x.power())).sum::<f64>() / 512.0).sqrt() / 32_768.0
        };
        let strongest = block.samples.iter().map(rms).fold(0.0, f64::max);
        let target = 10_f64.powf(-12.0 / 20.0);
        assert!(
            (0.49..1.01).contains(&(strongest / target)),
            "beam {}: {strongest}",
            block.beam
        );
    }
}

#[test]
fn options_reach_the_samples() {
    let folder = tempfile::tempdir().expect("folder");
    let paths = links(folder.path(), 1, 3);
    let config = folder.path().join("channel.toml");
    fs::write(
        &config,
        "[world.channel]\nfront_end.adc_bits = 8\nimpairments.dropped_beams = [3]\n[world.channel.motion]\nuav_quaternion_wb = [2, 0, 0, 0]\n",
    )
    .expect("written");
    let make = |name: &str, more: &[&str]| {
        let out = folder.path().join(name);
        let args = [&["synth", "--paths", text(&paths), "--out", text(&out)], more].concat();
        let output = cslam(&args, "2");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        // One link: the name as it is.
        sigmf::read(&out).expect("readable")
    };
    let plain = make("plain", &[]);
    assert_eq!(plain, make("budget", &["--impairments", "budget", "--seed", "1"]));
    assert_ne!(plain, make("none", &["--impairments", "none"]));
    assert_ne!(plain, make("seed", &["--seed", "2"]));
    let weak = make("weak", &["--snr-offset", "-30"]);
    let top = |r: &sigmf::Recording| r.blocks.iter().map(|b| b.exponent).max();
    assert!(top(&weak) < top(&plain));
    let configured = make("configured", &["--config", text(&config)]);
    assert_eq!(configured.blocks.len(), 71);
    assert!(configured.blocks.iter().all(|b| b.beam != 3));
    assert!(
        configured.blocks[0]
            .samples
            .iter()
            .flatten()
            .all(|x| x.re() & 255 == 0)
    );
    assert_eq!(configured.uav_quaternion_wb, Some([1.0, 0.0, 0.0, 0.0]));
    let squint = make("squint", &["--send", "bsm-seq"]);
    assert_eq!(
        (squint.codebook, squint.blocks.len()),
        (Codebook::SquintSequential, 33)
    );
    assert_eq!(make("raster", &["--send", "bsm-raster"]).blocks.len(), 3);
    // The strongest beams' pilots, of each the first and the second one.
    let pilots = make("pilots", &["--send", "pilots"]);
    assert_eq!(pilots.codebook, Codebook::Pilots);
    let numbers: Vec<u16> = pilots.blocks.iter().map(|block| block.beam).collect();
    assert!(
        numbers.chunks(2).all(|pair| pair[1] == pair[0] + 72),
        "{numbers:?}"
    );
    let strongest = Sweep {
        blocks: plain.blocks.clone(),
    };
    let beams: Vec<u16> = numbers.iter().copied().step_by(2).collect();
    assert_eq!(beams, strongest.strongest(12).collect::<Vec<_>>());
}

#[test]
fn bad_input_is_one_line_and_exit_two() {
    let folder = tempfile::tempdir().expect("folder");
    let paths = links(folder.path(), 1, 1);
    let out = folder.path().join("out");
    let synth = |paths: &Path, more: &[&str]| {
        refused(&cslam(
            &[&["synth", "--paths", text(paths), "--out", text(&out)], more].concat(),
            "1",
        ))
    };
    let measured = folder.path().join("measured.jsonl");
    fs::write(
        &measured,
        r#"{"tx":[0,0,1],"rx":[9,0,1],"paths":[{"delay_s":3e-8,"aoa_zenith_rad":1.5,"aoa_azimuth_rad":0.1}]}"#,
    )
    .expect("written");
    let message = synth(&measured, &[]);
    assert!(
        message.contains("measured.jsonl: link 0, path 0: `gain` is missing"),
        "{message}"
    );
    let empty = folder.path().join("empty.jsonl");
    fs::write(&empty, "\n").expect("written");
    assert!(synth(&empty, &[]).contains("holds no link"));
    assert!(synth(&folder.path().join("absent.jsonl"), &[]).contains("cannot be read"));
    assert!(synth(&paths, &["--snr-offset", "nan"]).contains("snr_offset_db is NaN"));
    let config = folder.path().join("bad.toml");
    fs::write(&config, "[world.channel.front_end]\nadc_bits = 17\n").expect("written");
    assert!(synth(&paths, &["--config", text(&config)]).contains("adc_bits is 17, expected 8 to 16"));
    let nowhere = folder.path().join("no/such/folder");
    let output = cslam(&["synth", "--paths", text(&paths), "--out", text(&nowhere)], "1");
    assert!(refused(&output).contains("cannot be written"));
}
