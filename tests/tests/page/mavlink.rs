//! MAVLink, read by pymavlink, the reference implementation: every message is understood and says what the UAV said.

use std::io::{BufRead, BufReader};
use std::net::{SocketAddr, UdpSocket};
use std::process::{Command, Stdio};

use cslam_core::estimator::Health;
use cslam_core::telemetry::{Key, MAX_FRAME, Message, PoseReport, Sender, Spread};
use cslam_host_sim::ground::mavlink::Frame;
use serde_json::{Value, json};

use crate::fleet::Fleet;
use crate::{Station, any};

/// The UAV that says [`poses`], beside those of the fleet.
const SYSTEM: u8 = 3;

#[test]
fn the_reference_implementation_reads_every_message() {
    reads("frd", Frame::Frd);
}

#[test]
fn the_reference_implementation_reads_poses_whose_north_is_true() {
    reads("ned", Frame::Ned);
}

fn reads(name: &str, frame: Frame) {
    let root = cslam_tests::root();
    let poses = poses();
    let said: Vec<Value> = poses.iter().map(as_json).collect();
    let mut reader = Command::new(root.join("target/verify-python/bin/python"))
        .arg(root.join("tests/tools/check_mavlink.py"))
        .args([name, &json!({"system": SYSTEM, "poses": said}).to_string()])
        .stdout(Stdio::piped())
        .spawn()
        .expect("`cargo verify` sets Python up");
    let mut said = BufReader::new(reader.stdout.take().expect("piped")).lines();
    let port = said.next().expect("it tells its port").expect("text");
    let to: SocketAddr = format!("127.0.0.1:{port}").parse().expect("a port");
    let station = Station::start(any(), any(), Some((to, frame)), None);
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a free port");
    let mut sender = Sender::new(SYSTEM, &Key::TEST, 0);
    for pose in poses {
        let mut bytes = [0; MAX_FRAME];
        let packet = sender.encode(&Message::Pose(pose), &mut bytes).expect("it fits");
        socket
            .send_to(packet, station.udp)
            .expect("the loopback takes it");
    }
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

/// Poses of which no two components, standard deviations or correlations are alike, with every quality and every kind of jump. The
/// deviations are such as the wire format can say: 0.0001 times a power of two.
fn poses() -> Vec<PoseReport> {
    let spread = |sigma: [f32; 3], correlation: [f32; 3]| Spread {
        sigma,
        correlation: correlation.map(|c| c / 127.0),
    };
    let pose = |time_ms: u64, resets: u8, quaternion_wb: [f32; 4], health: Health| {
        let length = quaternion_wb.iter().map(|c| c * c).sum::<f32>().sqrt();
        PoseReport {
            time_ns: time_ms * 1_000_000,
            position_m: [12.345 + time_ms as f64, -6.789, 23.456],
            velocity_m_per_s: [3.21, -1.23, 0.45],
            quaternion_wb: quaternion_wb.map(|c| c / length),
            clock: None,
            position: spread([0.1024, 0.4096, 0.0256], [30.0, -20.0, 50.0]),
            velocity: spread([0.0512, 0.2048, 0.8192], [-40.0, 10.0, 25.0]),
            attitude: spread([0.0032, 0.0128, 0.0512], [15.0, 35.0, -45.0]),
            resets,
            health,
            line_of_sight: false,
        }
    };
    let sound = Health::default();
    let contested = Health {
        contested: true,
        ..sound
    };
    let dead_reckoning = Health {
        dead_reckoning: true,
        ..sound
    };
    let lost = Health { lost: true, ..sound };
    vec![
        pose(1000, 250, [1.0, 0.0, 0.0, 0.0], sound),
        pose(1100, 250, [0.8, 0.1, -0.2, 0.5], contested),
        pose(1200, 251, [0.3, -0.7, 0.4, 0.2], dead_reckoning),
        pose(1300, 251, [-0.1, 0.2, 0.3, 0.9], lost),
        // Found again without being set anew, then set anew.
        pose(1400, 251, [0.5, 0.5, -0.5, 0.6], sound),
        pose(1500, 252, [0.9, 0.1, 0.1, -0.6], sound),
        // The receiver was switched off and on.
        pose(100, 0, [0.7, 0.0, 0.1, -0.7], sound),
    ]
}

/// What Python is told: the pose as the UAV has it.
fn as_json(pose: &PoseReport) -> Value {
    let spread = |spread: &Spread| json!({"sigma": spread.sigma, "correlation": spread.correlation});
    json!({
        "time_us": pose.time_ns / 1000,
        "position_m": pose.position_m,
        "velocity_m_per_s": pose.velocity_m_per_s,
        "quaternion_wb": pose.quaternion_wb,
        "position": spread(&pose.position),
        "velocity": spread(&pose.velocity),
        "attitude": spread(&pose.attitude),
        "resets": pose.resets,
        "contested": pose.health.contested,
        "dead_reckoning": pose.health.dead_reckoning,
        "lost": pose.health.lost,
    })
}
