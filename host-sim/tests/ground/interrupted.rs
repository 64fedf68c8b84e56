//! An interrupt ends a flight, and what was flown is written whole. The flight is shown live, so that it can be asked how far it is.

use std::fs;
use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use serde_json::Value;

use crate::station::{PATIENCE, signal, status_of};

/// A process that ends with the test.
struct Flight(Child);

impl Drop for Flight {
    fn drop(&mut self) {
        let _ended = self.0.kill();
        let _ended = self.0.wait();
    }
}

#[test]
fn an_interrupted_flight_leaves_complete_files() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut flight = Flight(
        Command::new(env!("CARGO_BIN_EXE_cslam"))
            .current_dir(directory.path())
            .args(["fly", "--seed", "3", "--live", "127.0.0.1:0"])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the binary runs"),
    );
    let mut said = BufReader::new(flight.0.stderr.take().expect("piped")).lines();
    let page: Option<SocketAddr> = said.find_map(|line| {
        let line = line.expect("text");
        let (_, page) = line.split_once("watch the flight at http://")?;
        Some(page.trim_end_matches('/').parse().expect("an address"))
    });
    let page = page.expect("it says where its page is");
    // It may say more, which nobody waits for.
    let rest = std::thread::spawn(move || said.count());
    let start = Instant::now();
    while status_of(page)["uavs"][0]["packets"]["link"].as_u64() < Some(2) {
        assert!(start.elapsed() < PATIENCE, "no two sweeps were flown");
        std::thread::sleep(Duration::from_millis(50));
    }
    signal(&flight.0, Signal::INT);
    assert!(flight.0.wait().expect("it ends").success());
    rest.join().expect("it reads to the end");

    let out = directory.path().join("out");
    let report = fs::read_to_string(out.join("report.json")).expect("written");
    let report: Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["interrupted"], true);
    let sweeps = report["sweeps"].as_u64().expect("a number");
    assert!((2..240).contains(&sweeps), "{sweeps}");
    let map = fs::read_to_string(out.join("map.ply")).expect("written");
    let (header, points) = map.split_once("end_header\n").expect("a header");
    let vertices = format!("element vertex {}\n", report["map"]["points"]);
    assert!(header.contains(&vertices), "{header}");
    assert_eq!(
        Some(points.lines().count() as u64),
        report["map"]["points"].as_u64()
    );
    // A file of MCAP ends with its magic bytes, a page with its last tag.
    let mcap = fs::read(out.join("flight.mcap")).expect("written");
    assert!(mcap.ends_with(b"\x89MCAP0\r\n"));
    let page = fs::read_to_string(out.join("report.html")).expect("written");
    assert!(page.trim_end().ends_with("</html>"));
}
