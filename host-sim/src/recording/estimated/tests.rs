//! Estimated paths come back bit by bit, and what is wrong with a line is said.

use super::*;
use crate::random::Stream;

/// A finite number of any size, its last bits in use.
fn number(stream: &mut Stream) -> f32 {
    let exponent = 60.0 * stream.uniform() - 30.0;
    (stream.normal() * libm::exp2(exponent)) as f32
}

fn unit<F: Frame>(stream: &mut Stream) -> Direction<F> {
    let vector = Vector3::from_fn(|_, _| stream.normal() as f32);
    Direction::from_vector(vector).expect("a direction")
}

fn path(stream: &mut Stream, departs: bool, grows: bool) -> EstimatedPath {
    EstimatedPath {
        path: path::Path {
            c_tau_m: number(stream),
            aoa: unit(stream),
            aod: departs.then(|| Departure {
                direction: unit(stream),
                sigma_rad: number(stream),
            }),
            covariance: Matrix3::from_fn(|_, _| number(stream)),
        },
        beam: 71,
        snr_db: -0.0,
        energy: f32::from_bits(1),
        range_rate: grows.then(|| RangeRate {
            m_per_s: number(stream),
            sigma_m_per_s: number(stream).abs(),
            period_m_per_s: number(stream).abs(),
        }),
    }
}

fn bearing(stream: &mut Stream, delayed: bool) -> Bearing {
    Bearing {
        face: 2,
        cosines: [number(stream), number(stream)],
        covariance: Matrix2::from_fn(|_, _| number(stream)),
        delay: delayed.then(|| Delay {
            c_tau_m: number(stream),
            variance_m2: number(stream),
        }),
    }
}

/// Sweeps with everything that a line can say.
fn sweeps() -> Vec<Estimated> {
    let mut stream = Stream::new(3, 0);
    let mut sweeps = vec![Estimated::default()];
    for count in 0..10 {
        let paths: heapless::Vec<_, 9> = (0..count)
            .map(|k| path(&mut stream, k % 3 > 0, k % 2 > 0))
            .collect();
        let sighted = (count > 0).then(|| (count - 1, Ok(bearing(&mut stream, count % 2 > 0))));
        sweeps.push(Estimated {
            beams: 72,
            pilots: if count % 2 > 0 { 24 } else { 0 },
            squint_symbols: 33,
            whole: true,
            paths,
            sighted,
        });
    }
    for refusal in Refusal::ALL {
        sweeps.push(Estimated {
            beams: 1,
            paths: std::iter::once(path(&mut stream, true, false)).collect(),
            sighted: Some((0, Err(refusal))),
            ..Estimated::default()
        });
    }
    sweeps
}

/// Reads a file of this text.
fn read_text(text: &str) -> Result<Vec<Estimated>, InputError> {
    let directory = tempfile::tempdir().expect("a directory");
    std::fs::write(directory.path().join(ESTIMATED), text).expect("writable");
    let entry = FileEntry {
        name: ESTIMATED.into(),
        records: text.lines().count() as u64,
        bytes: text.len() as u64,
        crc32: crc32(text.as_bytes()),
    };
    read_file(directory.path(), &entry, &mut Damage::refused())
}

#[test]
fn every_bit_comes_back() {
    let sweeps = sweeps();
    let read = read_text(&text(&sweeps).expect("finite")).expect("what was written");
    assert_eq!(read, sweeps);
    // Equal numbers may differ in their bits: zeros have signs. Of each number, its shortest text tells all.
    assert_eq!(text(&read).expect("finite"), text(&sweeps).expect("finite"));
    assert_eq!(read[2].paths[0].snr_db.to_bits(), (-0.0_f32).to_bits());
    // With rates and without, and the rate's own sign of zero.
    let rates: Vec<bool> = read[3]
        .paths
        .iter()
        .map(|path| path.range_rate.is_some())
        .collect();
    assert_eq!(rates, [false, true]);
    let mut still = sweeps;
    let rate = still[3].paths[1].range_rate.as_mut().expect("a rate");
    rate.m_per_s = -0.0;
    let read = read_text(&text(&still).expect("finite")).expect("what was written");
    let rate = read[3].paths[1].range_rate.expect("a rate");
    assert_eq!(rate.m_per_s.to_bits(), (-0.0_f32).to_bits());
}

#[test]
fn what_is_absent_of_pilots_is_not_written() {
    let mut without = sweeps();
    for sweep in &mut without {
        sweep.pilots = 0;
        for path in &mut sweep.paths {
            path.range_rate = None;
        }
    }
    let said = text(&without).expect("finite");
    assert!(!said.contains("pilots") && !said.contains("range_rate"), "{said}");
    assert_eq!(read_text(&said).expect("what was written"), without);
}

#[test]
fn what_no_line_can_say_is_not_written() {
    for wrong in [f32::NAN, f32::INFINITY] {
        let mut sweeps = sweeps();
        sweeps[4].paths[1].path.covariance.m23 = wrong;
        let said = text(&sweeps).expect_err("no number").to_string();
        assert!(said.contains("sweep 4") && said.contains("not finite"), "{said}");
        sweeps[4].paths[1].path.covariance.m23 = 0.0;
        assert!(text(&sweeps).is_ok());
        sweeps[4].paths[1].range_rate.as_mut().expect("a rate").m_per_s = wrong;
        let said = text(&sweeps).expect_err("no number").to_string();
        assert!(said.contains("sweep 4") && said.contains("not finite"), "{said}");
    }
}

#[test]
fn what_is_wrong_with_a_line_is_said() {
    let good = text(&sweeps()[..4]).expect("finite");
    let last = good.lines().last().expect("a line").to_owned();
    let parts: serde_json::Value = serde_json::from_str(&last).expect("JSON");
    let edited = |edit: &dyn Fn(&mut serde_json::Value)| {
        let mut line = parts.clone();
        edit(&mut line);
        format!("{}{line}\n", &good[..good.len() - last.len() - 1])
    };
    type Edit = fn(&mut serde_json::Value);
    let cases: [(Edit, &str); 15] = [
        (|line| line["sweep"] = 7.into(), "sweep is 7, expected 3"),
        (|line| line["more"] = 7.into(), "unknown field `more`"),
        (|line| line["paths"][0]["energy"] = "x".into(), "expected f32"),
        (
            |line| line["paths"][1]["aoa"][0] = 7.into(),
            "path 1: aoa: a vector is not of unit length",
        ),
        (
            |line| line["paths"][1]["aod_sigma_rad"] = serde_json::Value::Null,
            "path 1: aod and aod_sigma_rad: expected both or neither",
        ),
        (
            |line| {
                let path = line["paths"][0].clone();
                line["paths"] = vec![path; 10].into();
            },
            "10 paths, expected up to 9",
        ),
        (
            |line| line["paths"][1]["range_rate"]["m_per_s"] = 1e300.into(),
            "not the paths of a sweep: number out of range",
        ),
        (
            |line| line["paths"][1]["range_rate"]["sigma_m_per_s"] = 0.0.into(),
            "path 1: range_rate: sigma_m_per_s is 0, expected above 0",
        ),
        (
            |line| line["paths"][1]["range_rate"]["period_m_per_s"] = (-2.5).into(),
            "path 1: range_rate: period_m_per_s is -2.5, expected above 0",
        ),
        (
            |line| line["paths"][1]["range_rate"]["period_m_per_s"] = 1e-300.into(),
            "path 1: range_rate: period_m_per_s is 0, expected above 0",
        ),
        (
            |line| line["paths"][1]["range_rate"] = serde_json::json!({"m_per_s": 0.5}),
            "missing field `sigma_m_per_s`",
        ),
        (|line| line["pilots"] = (-1).into(), "expected u16"),
        (
            |line| line["sighted"]["path"] = 2.into(),
            "sighted: path is 2, expected one of 2",
        ),
        (
            |line| line["sighted"] = serde_json::json!({"path": 0, "refusal": "tired"}),
            "refusal: found \"tired\"",
        ),
        (
            |line| line["sighted"]["refusal"] = "tired".into(),
            "expected a bearing or a refusal",
        ),
    ];
    assert!(read_text(&edited(&|_| ())).is_ok());
    for (edit, expected) in cases {
        let said = read_text(&edited(&edit)).expect_err("refused").to_string();
        assert!(
            said.contains(expected) && said.contains("estimated_paths.jsonl:4: "),
            "{expected}: {said}"
        );
    }
}
