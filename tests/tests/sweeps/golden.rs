//! Golden sweeps: what the emulated chip makes of recorded sweeps is, bit for bit, what this machine makes of them.

use cslam_checks::sweep::run;
use cslam_core::paths::{BeamReport, EstimatedPath, EstimatorConfig, PathEstimator};
use cslam_core::profile::quad_4x8_gmt_72::{CHANNELS, PATHS};
use cslam_core::profile::{FlightEstimator, PaperFlightEstimator, Samples};
use cslam_core::signal::{BeamBlock, Correlator, Iq, SAMPLES, Workspace};

use crate::chip;
use crate::recordings::{self, Recording};

fn estimator(mode: &str) -> Box<dyn PathEstimator<CHANNELS, PATHS>> {
    let config = EstimatorConfig::single_sweeps();
    match mode {
        "best" => Box::new(FlightEstimator::new(&config)),
        _ => Box::new(PaperFlightEstimator::new(&config)),
    }
}

/// Lines of this machine.
fn expected(recording: &Recording, estimator: &mut dyn PathEstimator<CHANNELS, PATHS>) -> String {
    let mut lines = String::new();
    let mut block: Box<Samples> = vec![[Iq::ZERO; SAMPLES]; CHANNELS]
        .try_into()
        .expect("as many channels");
    let sweeps = run(
        &mut recording.bytes.as_slice(),
        estimator,
        &mut block,
        &mut (),
        &mut lines,
    );
    assert_eq!(sweeps, Ok(recording.names.len() as u32));
    lines
}

/// Lines of the chip.
fn found(mode: &str, recording: &Recording) -> String {
    chip::run(mode, recording, None).lines
}

/// The first line in which two texts differ, with its number, as each has it.
fn first_difference<'a>(expected: &'a str, found: &'a str) -> Option<(usize, &'a str, &'a str)> {
    let count = expected.lines().count().max(found.lines().count());
    let (mut a, mut b) = (expected.lines(), found.lines());
    (1..=count)
        .map(|number| {
            (
                number,
                a.next().unwrap_or("the end"),
                b.next().unwrap_or("the end"),
            )
        })
        .find(|(_, a, b)| a != b)
}

fn compare(mode: &str) {
    let recording = recordings::all();
    assert!(recording.names.len() >= 20);
    let expected = expected(&recording, estimator(mode).as_mut());
    // Every kind of sweep does what it is for.
    for (index, (name, least)) in recording.names.iter().enumerate() {
        let paths = expected
            .lines()
            .filter(|line| line.starts_with(&format!("sweep {index} path")))
            .count();
        println!("{mode}: {name}: {paths} paths");
        assert!(paths >= *least, "{name}: {paths} paths");
    }
    let found = found(mode, &recording);
    if let Some((line, host, chip)) = first_difference(&expected, &found) {
        panic!("{mode} mode, line {line}: the host has\n{host}\nthe chip\n{chip}");
    }
}

#[test]
fn best_mode_gives_the_bits_of_the_host() {
    compare("best");
}

#[test]
fn paper_mode_gives_the_bits_of_the_host() {
    compare("paper");
}

/// An estimator that gives one bit of one path another value.
struct Flipped(Box<dyn PathEstimator<CHANNELS, PATHS>>);

impl PathEstimator<CHANNELS, PATHS> for Flipped {
    fn push_beam(&mut self, block: BeamBlock<'_, CHANNELS>) -> BeamReport {
        self.0.push_beam(block)
    }

    fn finish(&mut self) -> heapless::Vec<EstimatedPath, PATHS> {
        let mut paths = self.0.finish();
        if let Some(last) = paths.last_mut() {
            let bits = last.path.covariance.m33.to_bits();
            last.path.covariance.m33 = f32::from_bits(bits ^ 1);
        }
        paths
    }

    fn front_end(&mut self) -> (&Correlator, &mut Workspace) {
        self.0.front_end()
    }
}

#[test]
fn one_bit_of_one_float_is_a_difference() {
    let recording = recordings::few();
    let [right, wrong] = [
        expected(&recording, estimator("best").as_mut()),
        expected(&recording, &mut Flipped(estimator("best"))),
    ];
    assert_eq!(first_difference(&right, &right), None);
    let (line, a, b) = first_difference(&right, &wrong).expect("they differ");
    assert!(line > 1 && a.starts_with("sweep 0 path") && b.starts_with("sweep 0 path"));
    assert!(first_difference(&right, right.trim_end()).is_none());
    assert!(first_difference(&right, &right[..right.len() / 2]).is_some());
}
