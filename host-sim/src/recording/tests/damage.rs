//! What is damaged or strange is refused by its name, or counted where a part is enough.

use super::*;

/// Replaces a file and makes the description agree with it, so that only its content can be at fault.
fn forge(directory: &Path, rank: usize, change: impl Fn(Vec<u8>) -> Vec<u8>) {
    let file = directory.join(EVENT_FILES[rank]);
    let bytes = change(fs::read(&file).expect("recorded"));
    let text = fs::read_to_string(directory.join(MANIFEST)).expect("recorded");
    let mut manifest: Manifest = serde_json::from_str(&text).expect("own output");
    manifest.files[rank].bytes = bytes.len() as u64;
    manifest.files[rank].crc32 = crate::recording::crc32(&bytes);
    fs::write(&file, bytes).expect("writable");
    let text = serde_json::to_string(&manifest).expect("serialisable");
    fs::write(directory.join(MANIFEST), text).expect("writable");
}

fn edit(from: &'static str, to: &'static str) -> impl Fn(Vec<u8>) -> Vec<u8> {
    move |bytes| {
        String::from_utf8(bytes)
            .expect("text")
            .replacen(from, to, 1)
            .into_bytes()
    }
}

#[test]
fn every_truncated_or_changed_file_is_named() {
    for (rank, name) in EVENT_FILES.into_iter().enumerate() {
        let directory = recorded();
        let file = directory.path().join(name);
        let bytes = fs::read(&file).expect("recorded");
        fs::write(&file, &bytes[..bytes.len() - 1]).expect("writable");
        let error = refusal(directory.path());
        assert!(error.contains(name) && error.contains("cut short"), "{error}");
        let mut flipped = bytes.clone();
        flipped[bytes.len() / 2] ^= 1;
        fs::write(&file, &flipped).expect("writable");
        let error = refusal(directory.path());
        assert!(error.contains(name) && error.contains("changed"), "{error}");
        fs::write(&file, [bytes, vec![b'\n']].concat()).expect("writable");
        assert!(refusal(directory.path()).contains("too long"), "rank {rank}");
        fs::remove_file(&file).expect("there");
        assert!(
            refusal(directory.path()).contains("cannot be read"),
            "rank {rank}"
        );
    }
}

#[test]
fn a_file_that_contradicts_the_others_is_refused_with_the_reason() {
    type Change = Box<dyn Fn(Vec<u8>) -> Vec<u8>>;
    let cases: [(usize, &str, Change); 9] = [
        (
            0,
            "has 23 bytes, expected 28",
            Box::new(|b| b[..b.len() - 5].to_vec()),
        ),
        (0, "records, expected", Box::new(|b| b[..b.len() - 28].to_vec())),
        (
            0,
            "not a packet",
            Box::new(|mut b| {
                b[8] = 0;
                b
            }),
        ),
        (
            0,
            "is earlier",
            Box::new(|b| [&b[28..56], &b[..28], &b[56..]].concat()),
        ),
        (1, "expected the columns", Box::new(edit("uav_time_ns", "time"))),
        (
            2,
            "expected uav_time_ns,clock_offset_s",
            Box::new(edit("e-", "x-")),
        ),
        (3, "sweep 7, expected 3", Box::new(edit(",3\n", ",7\n"))),
        (
            5,
            "expected uav_time_ns,pressure",
            Box::new(edit("40000000,", "40000000,-")),
        ),
        (4, "not a beacon", Box::new(edit("\"sweep\":", "\"sweeps\":"))),
    ];
    for (rank, reason, change) in cases {
        let directory = recorded();
        forge(directory.path(), rank, change);
        let error = refusal(directory.path());
        assert!(
            error.contains(EVENT_FILES[rank]) && error.contains(reason),
            "{error}"
        );
    }
}

#[test]
fn a_strange_description_is_refused() {
    let directory = recorded();
    let file = directory.path().join(MANIFEST);
    let text = fs::read_to_string(&file).expect("recorded");
    for (from, to, reason) in [
        (
            "\"version\": 3",
            "\"version\": 1",
            "version 1, expected cslam-flight version 2 or 3",
        ),
        ("\"version\": 3", "\"version\": 2", "expected the files imu.bin"),
        ("imu.bin", "imu.csv", "expected the files"),
        ("\"seed\"", "\"sead\"", "not the description"),
        (
            "\"duration_s\": 8.0",
            "\"duration_s\": 3601.0",
            "duration_s is 3601, expected above 0",
        ),
        ("\"bytes\": ", "\"bytes\": 999999", "bytes of imu.bin is 999999"),
        ("\"samples\": false", "\"samples\": true", "samples of sweep 0"),
    ] {
        fs::write(&file, text.replacen(from, to, 1)).expect("writable");
        let error = refusal(directory.path());
        assert!(error.contains(reason), "{error}");
    }
    fs::remove_file(&file).expect("there");
    assert!(refusal(directory.path()).contains(MANIFEST));
}

#[test]
fn samples_that_the_description_speaks_of_must_be_there() {
    let (flight, directory) = (flight(), tempfile::tempdir().expect("a directory"));
    let manifest = Manifest {
        samples: true,
        ..Manifest::of(Some("street"), None, &flight, 9)
    };
    write(directory.path(), manifest, &flight, 9).expect("recorded");
    for sweep in 0..9 {
        let (meta, data) = crate::sigmf::files(&sweep_base(directory.path(), sweep));
        fs::write(meta, "{}").expect("writable");
        fs::write(data, []).expect("writable");
    }
    let recording = read(directory.path()).expect("sound");
    // Nine sweeps with what was heard before the tenth.
    assert_eq!(recording.manifest().duration_s, 5.0);
    let last_ns = recording.events().last().expect("events").uav_time_ns;
    assert!((4_990_000_000..5_001_000_000).contains(&last_ns), "{last_ns}");
    fs::remove_file(directory.path().join("sweep-0007.sigmf-data")).expect("there");
    assert!(refusal(directory.path()).contains("sweep-0007.sigmf-data"));
}

#[test]
fn what_is_damaged_is_counted_and_the_rest_is_read() {
    let whole = read(recorded().path()).expect("sound").events().to_vec();
    let counted = |directory: &Path| {
        let mut damage = Damage::counted();
        let recording = read_with(directory, &mut damage).expect("counted");
        assert!(!damage.messages().is_empty());
        (recording.events().to_vec(), damage.gaps().clone())
    };
    // A record that is no packet, in the middle of the inertial samples.
    let directory = recorded();
    let file = directory.path().join(EVENT_FILES[0]);
    let mut bytes = fs::read(&file).expect("recorded");
    bytes[28 * 1000 + 8] = 0;
    fs::write(&file, &bytes).expect("writable");
    let (events, gaps) = counted(directory.path());
    assert_eq!(events.len(), whole.len() - 1);
    assert_eq!(gaps, [(EVENT_FILES[0].to_owned(), 1)].into());
    let error = {
        forge(directory.path(), 0, |bytes| bytes);
        refusal(directory.path())
    };
    assert!(
        error.contains("imu.bin") && error.contains("(byte 28000)"),
        "{error}"
    );
    // Half of a file, and none of another.
    let directory = recorded();
    fs::write(file_of(&directory, 0), &bytes[..28 * 4000 + 5]).expect("writable");
    fs::remove_file(file_of(&directory, 1)).expect("there");
    let (events, gaps) = counted(directory.path());
    let of_rank = |events: &[Stamped], rank| events.iter().filter(|s| s.event.rank() == rank).count();
    assert_eq!((of_rank(&events, 0), of_rank(&events, 1)), (3999, 0));
    assert_eq!(gaps["imu.bin"] as usize, of_rank(&whole, 0) - 3999);
    assert_eq!(gaps["magnetometer.csv"] as usize, of_rank(&whole, 1));
    assert_eq!(of_rank(&events, 3), of_rank(&whole, 3));
    // A sweep's beginning; the beacon that follows it goes with it.
    let directory = recorded();
    forge(directory.path(), 3, |bytes| {
        let text = String::from_utf8(bytes).expect("text");
        let lines = text.lines().filter(|line| !line.ends_with(",3"));
        lines
            .flat_map(|line| [line, "\n"])
            .collect::<String>()
            .into_bytes()
    });
    let (events, gaps) = counted(directory.path());
    let expected = (of_rank(&whole, 3) - 1, of_rank(&whole, 4) - 1);
    assert_eq!((of_rank(&events, 3), of_rank(&events, 4)), expected);
    let lost = ["sweeps.csv", "beacons.jsonl"].map(|name| (name.to_owned(), 1));
    assert_eq!(gaps, lost.into());
}
