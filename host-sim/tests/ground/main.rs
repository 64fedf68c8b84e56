//! `cslam ground` as a command: what it refuses and how, what it hears, what it records, and how it ends.
#![cfg(unix)]

mod crowd;
mod endings;
mod interrupted;
mod recording;
mod station;

use std::fs;
use std::io::Write;
use std::net::{TcpListener, UdpSocket};
use std::path::Path;
use std::process::Output;

use cslam_core::telemetry::Key;
use cslam_host_sim::ground::flock::MadeUpUav;
use serde_json::Value;
use station::{Station, TEST_KEY, cslam, received};

/// Runs a command that must refuse: its one line.
fn refused(arguments: &[&str]) -> String {
    let Output { status, stderr, .. } = cslam(arguments).output().expect("it starts");
    let said = String::from_utf8(stderr).expect("text");
    assert_eq!(status.code(), Some(2), "{arguments:?}: {said}");
    assert_eq!(said.lines().count(), 1, "{arguments:?}: {said}");
    said
}

/// Frames of `steps` tenths of a second.
fn frames(uav: u8, key: &Key, steps: usize) -> Vec<Vec<u8>> {
    let mut made_up = MadeUpUav::new(uav, key, 1, 100.0);
    (0..steps).flat_map(|_| made_up.step()).collect()
}

/// A key and its file.
fn key_file(directory: &Path, uav: u8) -> (Key, String) {
    let file = directory.join(format!("{uav}.key"));
    let digits = format!("{uav:02x}").repeat(Key::LENGTH);
    let mut options = fs::OpenOptions::new();
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut new = options
        .write(true)
        .create_new(true)
        .open(&file)
        .expect("a new file");
    write!(new, "cslam-link-key 1\nuav {uav}\nkey {digits}\n").expect("writable");
    (Key::new([uav; Key::LENGTH]), file.display().to_string())
}

#[test]
fn what_cannot_be_used_is_one_line_and_exit_2() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = |name: &str, content: &[u8]| {
        let path = directory.path().join(name);
        fs::write(&path, content).expect("writable");
        path.display().to_string()
    };
    assert!(refused(&[]).contains("give --key FILE, or --test-key"));
    let http = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = http.local_addr().expect("bound").to_string();
    let said = refused(&["--test-key", "--listen", "127.0.0.1:0", "--http", &address]);
    assert!(
        said.contains(&format!("--http {address}: cannot be listened on")),
        "{said}"
    );
    let udp = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let address = udp.local_addr().expect("bound").to_string();
    let said = refused(&["--test-key", "--listen", &address]);
    assert!(
        said.contains(&format!("--listen {address}: cannot be listened on")),
        "{said}"
    );
    let said = refused(&["--test-key", "--serial", "/dev/no-such-port:57600"]);
    assert!(
        said.contains("/dev/no-such-port: cannot be opened as a serial port"),
        "{said}"
    );
    let said = refused(&["--test-key", "--file", "no-such-file.bin"]);
    assert!(said.contains("no-such-file.bin: cannot be read"), "{said}");
    let garbage = file("garbage.bin", &[7; 300]);
    assert!(refused(&["--test-key", "--file", &garbage, "--json"]).contains("no packet that can be taken"));
    let no_key = file("no.key", b"secret");
    let said = refused(&["--key", &no_key, "--listen", "127.0.0.1:0"]);
    assert!(said.contains("no.key:") && !said.contains("secret"), "{said}");
    let there = file("packets.bin", b"");
    let folder = Path::new(&there)
        .parent()
        .expect("a folder")
        .display()
        .to_string();
    let said = refused(&[
        "--test-key",
        "--listen",
        "127.0.0.1:0",
        "--http",
        "127.0.0.1:0",
        "--record",
        &folder,
    ]);
    assert!(
        said.contains("packets.bin: cannot be made"),
        "a recording is never overwritten: {said}"
    );
}

#[test]
fn a_file_becomes_json_lines_whatever_was_done_to_it() {
    let directory = tempfile::tempdir().expect("a directory");
    let frames = frames(3, &Key::TEST, 100);
    let whole: Vec<u8> = frames.concat();
    let mut damaged = whole.clone();
    // In the midst of the second frame, and the last frame is cut.
    damaged[frames[0].len() + frames[1].len() / 2] ^= 0x20;
    damaged.truncate(whole.len() - 3);
    let file = directory.path().join("packets.bin");
    let print = |bytes: &[u8], key: &[&str]| {
        fs::write(&file, bytes).expect("writable");
        let file = file.display().to_string();
        cslam(&[&["--file", &file, "--json"], key].concat())
            .output()
            .expect("it starts")
    };
    let output = print(&whole, &["--test-key"]);
    let lines: Vec<Value> = String::from_utf8(output.stdout)
        .expect("text")
        .lines()
        .map(|line| serde_json::from_str(line).expect("JSON"))
        .collect();
    assert!(output.status.success() && lines.len() == frames.len());
    assert_eq!(lines.iter().filter(|l| l["kind"] == "pose").count(), 100);
    assert!(
        lines
            .iter()
            .enumerate()
            .all(|(k, l)| l["counter"] == k && l["uav"] == 3)
    );
    let output = print(&damaged, &["--test-key"]);
    assert!(output.status.success());
    assert_eq!(
        output.stdout.iter().filter(|b| **b == b'\n').count(),
        frames.len() - 2
    );
    // A key of that UAV, but not the one it signs with.
    let (_, wrong) = key_file(directory.path(), 3);
    let output = print(&whole, &["--key", &wrong]);
    let said = String::from_utf8(output.stderr).expect("text");
    assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0));
    assert!(said.contains("the authentication code is wrong"), "{said}");
    assert_eq!(print(&whole, &["--unsigned"]).status.code(), Some(2));
}

#[test]
fn keys_are_per_uav_and_what_is_refused_is_seen() {
    let directory = tempfile::tempdir().expect("a directory");
    let (first, first_file) = key_file(directory.path(), 1);
    let (second, second_file) = key_file(directory.path(), 2);
    let station = Station::start(&[
        "--listen",
        "127.0.0.1:0",
        "--key",
        &first_file,
        "--key",
        &second_file,
    ]);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let send = |frames: &[Vec<u8>]| station.send(&socket, frames);
    let (good, other) = (frames(1, &first, 30), frames(2, &second, 20));
    send(&good);
    send(&other);
    // Of UAV 2 with the key of UAV 1; of a UAV without a key; and a replay.
    send(&frames(2, &first, 10));
    send(&frames(3, &first, 10));
    send(&good[..5]);
    let status = station.wait_for("all is counted", |status| {
        let refused = &status["refused"];
        refused["the packet came before"] == 5 && received(status, 2) == other.len() as u64
    });
    assert_eq!(received(&status, 1), good.len() as u64);
    assert_eq!(status["uavs"].as_array().map(Vec::len), Some(2));
    assert!(status["refused"]["the authentication code is wrong"].as_u64() > Some(10));
    assert!(status["refused"]["the packet is signed and there is no key to check it"].as_u64() > Some(10));
}

#[test]
fn a_damaged_datagram_spoils_no_other() {
    let station = Station::start(&TEST_KEY);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let frames = frames(5, &Key::TEST, 20);
    for frame in &frames {
        // Half a frame, as anybody can send it from anywhere, before each whole one.
        let datagrams = [frame[..frame.len() / 2].to_vec(), frame.clone()];
        station.send(&socket, &datagrams);
    }
    let all = frames.len() as u64;
    let status = station.wait_for("all is heard", |status| received(status, 5) == all);
    assert_eq!(
        status["refused"]["the frame is cut by the end of its datagram"],
        all
    );
}

#[cfg(target_os = "linux")]
#[test]
fn a_serial_port_is_heard_and_missed() {
    use rustix::pty;

    // The station must not hold this end of it open.
    let flags = pty::OpenptFlags::RDWR | pty::OpenptFlags::NOCTTY | pty::OpenptFlags::CLOEXEC;
    let radio = pty::openpt(flags).expect("a pseudo terminal");
    pty::grantpt(&radio)
        .and_then(|()| pty::unlockpt(&radio))
        .expect("usable");
    let device = pty::ptsname(&radio, Vec::new())
        .expect("a name")
        .into_string()
        .expect("text");
    let station = Station::start(&["--test-key", "--serial", &format!("{device}:57600")]);
    let frames = frames(6, &Key::TEST, 30);
    // What a terminal would translate or swallow must come through: raw bytes.
    let mut radio = fs::File::from(radio);
    for piece in frames.concat().chunks(64) {
        radio.write_all(piece).expect("sent");
    }
    station.wait_for("all is heard", |status| {
        received(status, 6) == frames.len() as u64
    });
    let name = format!("serial {device}");
    assert_eq!(station.status()["inputs"][&name]["trouble"], Value::Null);
    drop(radio);
    let status = station.wait_for("the port is missed", |status| {
        status["inputs"][&name]["trouble"].is_string()
    });
    assert!(
        status["inputs"][&name]["trouble"]
            .as_str()
            .expect("text")
            .contains("waiting for it")
    );
}
