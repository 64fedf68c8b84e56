//! Pilots of a recording: those that were heard, none where it says nothing of them, and damage where it says that they are there.

use std::sync::atomic::AtomicBool;

use super::*;
use crate::channel::{Block, Sweep};
use crate::config::Config;
use crate::library;
use crate::raw_flight::Source;
use crate::recording::{KIND, Keeper, RecordedFlight, pilots_base, squint_base};
use crate::sigmf::{self, Codebook, Recording};
use crate::world::Profile;

const SWEEPS: u32 = 3;

fn blocks(directory: &Path, base: fn(&Path, u32) -> std::path::PathBuf, codebook: Codebook, numbers: &[u16]) {
    for sweep in 0..SWEEPS {
        let recording = Recording {
            codebook,
            radio: None,
            gmt_position_m: None,
            uav_position_m: None,
            uav_quaternion_wb: None,
            blocks: numbers
                .iter()
                .map(|number| Block::zero(*number, sweep as i32))
                .collect(),
        };
        sigmf::write(&base(directory, sweep), &recording).expect("written");
    }
}

/// A recording with a beam, its pilots and a squint symbol of each sweep.
fn with_pilots() -> tempfile::TempDir {
    let (flight, directory) = (flight(), tempfile::tempdir().expect("a directory"));
    let manifest = Manifest {
        samples: true,
        pilots: true,
        ..Manifest::of(Some("street"), None, &flight, SWEEPS)
    };
    write(directory.path(), manifest, &flight, SWEEPS).expect("recorded");
    let at = directory.path();
    blocks(at, sweep_base, Codebook::Beams, &[71]);
    blocks(at, pilots_base, Codebook::Pilots, &[71, 143]);
    blocks(at, squint_base, Codebook::SquintSequential, &[0]);
    directory
}

/// Says something else in the description.
fn say(directory: &Path, from: &str, to: &str) {
    let file = directory.join(MANIFEST);
    let text = fs::read_to_string(&file).expect("recorded");
    assert_eq!(text.matches(from).count(), 1, "{from}");
    fs::write(file, text.replace(from, to)).expect("writable");
}

fn numbers(sweep: &Sweep) -> Vec<u16> {
    sweep.blocks.iter().map(|block| block.beam).collect()
}

fn open(directory: &Path) -> RecordedFlight {
    RecordedFlight::open(directory, Damage::refused()).expect("sound")
}

#[test]
fn a_recorded_flight_gives_the_blocks_that_were_heard() {
    let directory = tempfile::tempdir().expect("a directory");
    let at = directory.path().join("recorded");
    let never = AtomicBool::new(false);
    let told = library::record(Some("street"), None, Some("budget"), 5, Some(SWEEPS), &at, &never);
    let told = told.expect("recorded");
    assert!(told.samples && told.pilots);
    let config = Config::of(Profile::Budget);
    let scene = config.scene("street").expect("built in");
    let world = config.world_in(&scene, 5).expect("a flight");
    let recorded = open(&at);
    for sweep in 0..SWEEPS {
        let (heard, given) = (
            world.sweep(sweep).expect("heard"),
            recorded.sweep(sweep).expect("read"),
        );
        assert_eq!(heard.pilots.blocks.len(), 24, "sweep {sweep}");
        // Equal blocks have the same integers and the same exponents, in the same order.
        assert!(given.pilots == heard.pilots, "pilots of sweep {sweep}");
        assert!(given.beams == heard.beams, "beams of sweep {sweep}");
        assert!(given.squint == heard.squint, "squint symbols of sweep {sweep}");
    }
}

#[test]
fn a_recording_that_says_nothing_of_pilots_has_none() {
    let directory = with_pilots();
    let at = directory.path();
    assert_eq!(numbers(&open(at).sweep(1).expect("read").pilots), [71, 143]);
    // Its files of this name are not read, whatever they hold.
    say(at, "\"pilots\": true,", "");
    fs::write(sigmf::files(&pilots_base(at, 0)).0, "{").expect("writable");
    let given = open(at).sweep(0).expect("read");
    assert_eq!(
        (numbers(&given.beams), numbers(&given.squint)),
        (vec![71], vec![0])
    );
    assert!(given.pilots.blocks.is_empty());
    for sweep in 0..SWEEPS {
        let (meta, data) = sigmf::files(&pilots_base(at, sweep));
        for file in [meta, data] {
            fs::remove_file(file).expect("there");
        }
    }
    assert!(open(at).sweep(2).expect("read").pilots.blocks.is_empty());
    // What is absent stays absent when it is written again.
    let text = fs::read_to_string(at.join(MANIFEST)).expect("recorded");
    let manifest: Manifest = serde_json::from_str(&text).expect("own output");
    assert!(
        !serde_json::to_string(&manifest)
            .expect("serialisable")
            .contains("pilots")
    );
}

#[test]
fn pilots_that_a_recording_speaks_of_are_missed_and_damage_to_them_is_counted_as_theirs() {
    for (damage, reason) in [
        ("missing", "missing, expected the pilots of sweep 1"),
        ("cut", "is cut short"),
        ("squint", "cslam:codebook is bsm-seq, expected gmt-72-pilots"),
    ] {
        let directory = with_pilots();
        let at = directory.path();
        let (meta, data) = sigmf::files(&pilots_base(at, 1));
        match damage {
            "missing" => fs::remove_file(&data).expect("there"),
            "cut" => fs::write(&data, [0; 5]).expect("writable"),
            _ => {
                let (of_squint, its_data) = sigmf::files(&squint_base(at, 1));
                fs::copy(of_squint, &meta).expect("writable");
                fs::copy(its_data, &data).map(|_| ()).expect("writable");
            }
        }
        let refused = RecordedFlight::open(at, Damage::refused())
            .and_then(|flight| flight.sweep(1))
            .expect_err(damage)
            .to_string();
        assert!(
            refused.contains("pilots-0001.sigmf-") && refused.contains(reason),
            "{damage}: {refused}"
        );
        // Missing files are found before a sweep is flown, as those of beams are.
        assert_eq!(read(at).is_err(), damage == "missing");
        let flight = RecordedFlight::open(at, Damage::counted()).expect("counted");
        let given = [0, 1, 2].map(|sweep| flight.sweep(sweep).expect("counted"));
        assert_eq!(
            given.each_ref().map(|given| given.pilots.blocks.len()),
            [2, 0, 2],
            "{damage}"
        );
        // The sweep loses nothing else.
        assert!(
            given.iter().all(|given| numbers(&given.beams) == [71]),
            "{damage}"
        );
        assert_eq!(
            flight.damage().gaps(),
            &[("pilots".to_owned(), 1)].into(),
            "{damage}"
        );
    }
}

#[test]
fn pilots_lie_beside_samples_alone() {
    let directory = with_pilots();
    say(directory.path(), "\"samples\": true", "\"samples\": false");
    let error = refusal(directory.path());
    assert!(
        error.contains("flight.json") && error.contains("pilots is true, expected false"),
        "{error}"
    );
}

#[test]
fn a_recording_with_pilots_is_known_by_its_names() {
    let directory = with_pilots();
    for entry in fs::read_dir(directory.path()).expect("a directory") {
        let name = entry.expect("an entry").file_name();
        assert!((KIND.writes)(&name.to_string_lossy()), "{}", name.display());
    }
    assert!(!(KIND.writes)("pilots-001.sigmf-data") && !(KIND.writes)("pilots-0001.wav"));
}

#[test]
fn kept_paths_count_the_pilots_that_they_were_made_of() {
    let directory = with_pilots();
    let recorded = open(directory.path());
    let keeper = Keeper::new(&recorded);
    for sweep in 0..SWEEPS {
        keeper.sweep(sweep).expect("read");
    }
    let kept = keeper.estimated().expect("all sweeps");
    let counts = kept.iter().map(|it| (it.beams, it.pilots, it.squint_symbols));
    assert_eq!(counts.collect::<Vec<_>>(), [(1, 2, 1); SWEEPS as usize]);
}
