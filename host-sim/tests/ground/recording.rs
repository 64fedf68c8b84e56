//! What a recording holds: after a proper end, after a kill, on a full disk; and how it is played again.

use std::fs;
use std::io::Write;
use std::net::UdpSocket;
use std::path::Path;
use std::time::Instant;

use cslam_core::telemetry::Key;
use cslam_host_sim::ground::flock::MadeUpUav;
use cslam_host_sim::random::Stream;

use crate::frames;
use crate::station::{PATIENCE, Station, TEST_KEY, cslam, limited, received};

/// Topics of which every packet makes one message.
const TOPICS: [&str; 5] = ["points", "state", "link", "health", "event"];

/// Packets in a recording that may be unfinished, read as far as it goes.
fn packets_in(mcap: &[u8]) -> u64 {
    let unfinished = mcap::read::Options::IgnoreEndMagic;
    let messages = mcap::MessageStream::new_with_options(mcap, unfinished.into()).expect("it opens");
    let mut packets = 0;
    for message in messages {
        match message {
            Ok(message) => {
                let (_, what) = message.channel.topic.rsplit_once('/').expect("a topic");
                packets += u64::from(TOPICS.contains(&what));
            }
            // The end of what was written; nothing comes after it.
            Err(mcap::McapError::UnexpectedEof | mcap::McapError::UnexpectedEoc) => break,
            Err(error) => panic!("{error}"),
        }
    }
    packets
}

/// Packets in `packets.bin`, as the station reads it again.
fn packets_again(folder: &Path) -> u64 {
    let file = folder.join("packets.bin");
    if fs::metadata(&file).expect("recorded").len() == 0 {
        return 0;
    }
    let output = cslam(&["--test-key", "--json", "--file", &file.display().to_string()])
        .output()
        .expect("it starts");
    assert!(output.status.success());
    output.stdout.iter().filter(|byte| **byte == b'\n').count() as u64
}

#[test]
fn a_recording_is_whole_and_can_be_played_again() {
    let directory = tempfile::tempdir().expect("a directory");
    let to = directory.path().join("flight");
    let folder = to.display().to_string();
    let station = Station::start(&[&TEST_KEY[..], &["--record", &folder]].concat());
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let frames = frames(4, &Key::TEST, 60);
    // A datagram may hold several frames.
    let datagrams: Vec<Vec<u8>> = frames.chunks(3).map(<[_]>::concat).collect();
    station.send(&socket, &datagrams);
    let all = frames.len() as u64;
    station.wait_for("all is heard", |status| received(status, 4) == all);
    station.terminate();
    assert!(fs::read(to.join("packets.bin")).expect("recorded") == frames.concat());
    let mcap = fs::read(to.join("ground.mcap")).expect("recorded");
    let summary = mcap::Summary::read(&mcap).expect("sound").expect("an index");
    let topics: Vec<&str> = summary.channels.values().map(|c| c.topic.as_str()).collect();
    for topic in [
        "/tf",
        "/uav_4/pose",
        "/uav_4/points",
        "/uav_4/link",
        "/uav_4/health",
        "/uav_4/event",
        "/map",
    ] {
        assert!(topics.contains(&topic), "{topic} is missing: {topics:?}");
    }
    assert!(
        fs::read(to.join("map.ply"))
            .expect("recorded")
            .starts_with(b"ply\n")
    );
    assert_eq!((packets_in(&mcap), packets_again(&to)), (all, all));
}

#[test]
fn a_file_ends_the_station_unless_it_is_followed() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = directory.path().join("packets.bin");
    let (first, later) = {
        let mut frames = frames(4, &Key::TEST, 60);
        let later = frames.split_off(frames.len() / 2);
        (frames, later)
    };
    let mut growing = fs::File::create(&file).expect("writable");
    growing.write_all(&first.concat()).expect("writable");
    let name = file.display().to_string();
    let play = ["--test-key", "--file", &name, "--speed", "0"];
    // Without --follow: to the end of the file.
    assert!(Station::start(&play).wait().success());
    // With it: what another process appends, a frame in two pieces too.
    let station = Station::start(&[&play[..], &["--follow"]].concat());
    station.wait_for("the file is heard", |s| received(s, 4) == first.len() as u64);
    for piece in later.concat().chunks(97) {
        growing.write_all(piece).expect("writable");
    }
    let all = (first.len() + later.len()) as u64;
    station.wait_for("what was appended is heard", |s| received(s, 4) == all);
    station.terminate();
    // A file of which nothing can be taken is no success.
    let output = cslam(&[
        "--unsigned",
        "--file",
        &name,
        "--speed",
        "0",
        "--http",
        "127.0.0.1:0",
    ])
    .output()
    .expect("it starts");
    assert_eq!(output.status.code(), Some(2));
}

/// From then on a flight has packets that came more than a second before its last.
const DUE_S: f64 = 1.5;

/// Records a flight and kills the station when it has heard so much of it, by its own clock. Returns how many packets a whole recording
/// up to a second before would hold, and how many this one holds, in its MCAP and as its packets are read again.
fn killed(moment_s: f64) -> (u64, u64, u64) {
    let directory = tempfile::tempdir().expect("a directory");
    let to = directory.path().join("flight");
    let folder = to.display().to_string();
    let station = Station::start(&[&TEST_KEY[..], &["--record", &folder]].concat());
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let mut uav = MadeUpUav::new(7, &Key::TEST, 1, 100.0);
    // Time of the station and packets that it had taken by then.
    let mut taken = Vec::new();
    let mut due = 0;
    let start = Instant::now();
    let heard = |taken: &[(f64, f64, u64)]| {
        let of_uav = || taken.iter().filter(|(_, _, packets)| *packets > 0);
        let (first, last) = (of_uav().next(), of_uav().next_back());
        first.zip(last).map_or(0.0, |(first, last)| last.0 - first.0)
    };
    while heard(&taken) < moment_s || (moment_s > DUE_S && due == 0) {
        assert!(start.elapsed() < PATIENCE, "the station hears nothing");
        if uav.time_s() <= start.elapsed().as_secs_f64() {
            station.send(&socket, &uav.step());
        }
        let status = station.status();
        let heard_s = status["uavs"][0]["seen_s"].as_f64().unwrap_or_default();
        let now_s = status["now_s"].as_f64().expect("a number");
        taken.push((heard_s, now_s.max(heard_s), received(&status, 7)));
        // By the station's own clock: on a busy machine it hears later, and still writes within a second of what it heard.
        let before = taken.iter().rfind(|(_, now_s, _)| *now_s <= heard_s - 1.0);
        due = before.map_or(0, |(_, _, packets)| *packets);
    }
    station.kill();
    let mcap = fs::read(to.join("ground.mcap")).expect("it is there");
    (due, packets_in(&mcap), packets_again(&to))
}

#[test]
fn a_recording_that_is_killed_holds_all_but_the_last_second() {
    /// Stations at once.
    const AT_ONCE: u64 = 5;
    const MOMENTS: u64 = 50;
    let results: Vec<_> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..AT_ONCE)
            .map(|thread| {
                scope.spawn(move || {
                    let mut random = Stream::new(1, thread);
                    let moments = (0..MOMENTS / AT_ONCE).map(|_| 2.5 * random.uniform());
                    moments
                        .map(|moment_s| (moment_s, killed(moment_s)))
                        .collect::<Vec<_>>()
                })
            })
            .collect();
        threads
            .into_iter()
            .flat_map(|thread| thread.join().expect("no panic"))
            .collect()
    });
    assert_eq!(results.len() as u64, MOMENTS);
    for (moment_s, (due, in_mcap, in_packets)) in &results {
        println!("{moment_s:.2} s: {due} due, {in_mcap} and {in_packets} recorded");
    }
    let with_due = results.iter().filter(|(moment_s, _)| *moment_s > DUE_S);
    assert!(with_due.count() > 10);
    for (moment_s, (due, in_mcap, in_packets)) in results {
        assert!(
            in_mcap >= due && in_packets >= due,
            "killed after {moment_s:.3} s: {due} packets were due, {in_mcap} and {in_packets} are recorded"
        );
    }
}

#[test]
fn a_full_disk_ends_the_recording_and_loses_nothing_of_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let to = directory.path().join("flight");
    let folder = to.display().to_string();
    // A file that may not grow is a full disk for whoever writes it, without a disk to fill: 32 or 64 KiB, as shells count.
    let station = Station::from(limited(
        "trap '' XFSZ; ulimit -f 64",
        &[&TEST_KEY[..], &["--record", &folder]].concat(),
    ));
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let frames = frames(4, &Key::TEST, 1200);
    assert!(frames.concat().len() > 2 * 65_536, "more than fits");
    let mut sent = 0;
    // No more at once than the system keeps for a station that is not heard by a processor just now.
    for some in frames.chunks(400) {
        let datagrams: Vec<Vec<u8>> = some.chunks(20).map(<[_]>::concat).collect();
        station.send(&socket, &datagrams);
        sent += some.len() as u64;
        station.wait_for("all is heard, recorded or not", |s| received(s, 4) == sent);
    }
    let status = station.status();
    let trouble = status["inputs"]["recording"]["trouble"].as_str().expect("told");
    assert!(trouble.contains("cannot be written"), "{trouble}");
    assert_eq!(station.end().code(), Some(3));
    let packets = fs::read(to.join("packets.bin")).expect("recorded");
    let mcap = fs::read(to.join("ground.mcap")).expect("recorded");
    let larger = packets.len().max(mcap.len());
    assert!(larger == 32_768 || larger == 65_536, "{larger} bytes");
    assert!(frames.concat().starts_with(&packets), "as it came");
    // What was written can be read: all of it but the frame or chunk that did not fit.
    let (in_mcap, again) = (packets_in(&mcap), packets_again(&to));
    assert!(in_mcap > 0 && again > 0, "{in_mcap} and {again}");
    let whole = packets.iter().filter(|byte| **byte == 0).count() as u64;
    assert_eq!(again, whole);
}
