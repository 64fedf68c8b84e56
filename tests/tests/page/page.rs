//! The page in a real browser: `tests/tools/ground_page.mjs` looks, this test does what it asks for.

use std::fs;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, Command, Stdio};
use std::thread;

use cslam_host_sim::ground::model::{Heard, Message, Point};

use crate::fleet::Fleet;
use crate::{Station, any};

/// Ends the browser's driver with the test.
struct Driver(Child);

impl Drop for Driver {
    fn drop(&mut self) {
        let _ended = self.0.kill();
        let _ended = self.0.wait();
    }
}

/// A million points, each in a voxel of its own.
fn million(station: &Station) {
    let point = |k: u32| Point {
        position_m: [k % 1000, k / 1000, (k % 1000) / 50].map(|c| f64::from(c) * 0.3 - 150.0),
        sigma_m: 0.1,
        probability: 0.9,
        sweep: 0,
        gmt_index: (k / 100_000) as u16,
        surface: None,
    };
    let hub = &station.running.hub;
    for chunk in 0..50_u32 {
        let points = (0..20_000).map(|k| point(chunk * 20_000 + k)).collect();
        let heard = Heard {
            uav: 9,
            counter: chunk,
            message: Message::Points { points },
        };
        hub.station().hear(&heard, 100, hub.now_s());
    }
}

#[test]
fn the_page_shows_flights_and_survives_a_restart() {
    let root = cslam_tests::root();
    let pictures = root.join("target/ground-page");
    fs::create_dir_all(&pictures).expect("writable");
    let mut station = Some(Station::start(any(), any(), None, None));
    let (http, udp) = station
        .as_ref()
        .map(|s| (s.running.page, s.udp))
        .expect("running");
    let fleet = Fleet::new(3, udp);
    let child = Command::new("node")
        .arg(root.join("tests/tools/ground_page.mjs"))
        .arg(root.join("target/verify-node/browser/node_modules/playwright-core"))
        .arg(format!("http://{http}/"))
        .arg(&pictures)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("`cargo verify` sets node up");
    let mut driver = Driver(child);
    let mut answers = driver.0.stdin.take().expect("piped");
    let asked = BufReader::new(driver.0.stdout.take().expect("piped"));
    let mut done = false;
    let mut held = None;
    for line in asked.lines() {
        let line = line.expect("text");
        println!("{line}");
        match line.as_str() {
            "FLY" => fleet.fly(true),
            "SILENCE" => fleet.fly(false),
            "STOP" => station
                .take()
                .expect("running")
                .running
                .stop()
                .expect("ends well"),
            "START" => station = Some(Station::start(http, udp, None, None)),
            "HANG" => {
                // Whoever wants the state waits: neither packets nor pages are served.
                let hub = std::sync::Arc::clone(&station.as_ref().expect("running").running.hub);
                let (wake, asleep) = std::sync::mpsc::channel::<()>();
                let (hold, holds) = std::sync::mpsc::channel::<()>();
                let thread = thread::spawn(move || {
                    let guard = hub.station();
                    hold.send(()).expect("awaited");
                    // Until the other end is dropped.
                    let _woken = asleep.recv();
                    drop(guard);
                });
                holds.recv().expect("it hangs");
                held = Some((wake, thread));
            }
            "WAKE" => {
                let (wake, thread) = held.take().expect("it hangs");
                drop(wake);
                thread.join().expect("it wakes");
            }
            "MILLION" => million(station.as_ref().expect("running")),
            "DONE" => {
                done = true;
                continue;
            }
            other => panic!("the driver asks for `{other}`"),
        }
        writeln!(answers, "ok").expect("it waits");
    }
    assert!(done, "the page did not show everything; see above");
    let ply = fs::read(pictures.join("map.ply")).expect("the page gave it");
    assert!(ply.starts_with(b"ply\nformat binary_little_endian 1.0\n") && ply.len() > 30_000);
}
