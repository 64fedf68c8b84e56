//! MAVLink, read by pymavlink, the reference implementation: every message is understood and says what the UAV said.

use std::io::{BufRead, BufReader};
use std::net::SocketAddr;
use std::process::{Command, Stdio};

use crate::fleet::Fleet;
use crate::{Station, any};

#[test]
fn the_reference_implementation_reads_every_message() {
    let root = cslam_tests::root();
    let mut reader = Command::new(root.join("target/verify-python/bin/python"))
        .arg(root.join("tests/tools/check_mavlink.py"))
        .stdout(Stdio::piped())
        .spawn()
        .expect("`cargo verify` sets Python up");
    let mut said = BufReader::new(reader.stdout.take().expect("piped")).lines();
    let port = said.next().expect("it tells its port").expect("text");
    let to: SocketAddr = format!("127.0.0.1:{port}").parse().expect("a port");
    let station = Station::start(any(), any(), Some(to), None);
    let fleet = Fleet::new(2, station.udp);
    fleet.fly(true);
    for line in said {
        println!("{}", line.expect("text"));
    }
    let status = reader.wait().expect("it ends");
    drop(fleet);
    station.running.stop().expect("ends well");
    assert!(status.success(), "pymavlink found something wrong; see above");
}
