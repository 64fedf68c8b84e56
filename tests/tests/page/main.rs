//! The ground station whole: its page in a real browser while UAVs fly, its MAVLink read by the reference implementation.

mod fleet;
mod mavlink;
mod page;

use std::net::SocketAddr;
use std::path::PathBuf;

use cslam_host_sim::ground::inputs::Udp;
use cslam_host_sim::ground::keys::Trust;
use cslam_host_sim::ground::mavlink::Frame;
use cslam_host_sim::ground::{Inputs, Options, Running};

/// A free port of this machine.
const ANY: &str = "127.0.0.1:0";

/// A running station and where its packets come in.
struct Station {
    running: Running,
    udp: SocketAddr,
}

impl Station {
    /// A station on these addresses that takes packets signed with the published key.
    fn start(
        http: SocketAddr,
        udp: SocketAddr,
        mavlink: Option<(SocketAddr, Frame)>,
        record: Option<PathBuf>,
    ) -> Self {
        let input = Udp::open(udp).expect("a free port");
        let udp = input.address();
        let inputs = Inputs::Live {
            udp: vec![input],
            serial: Vec::new(),
        };
        let options = Options {
            trust: Trust::Test,
            http,
            record,
            mavlink: mavlink.map(|(to, _)| to),
            mavlink_frame: mavlink.map(|(_, frame)| frame).unwrap_or_default(),
            ..Options::default()
        };
        let running = Running::start(inputs, &options).expect("a free port");
        Self { running, udp }
    }
}

fn any() -> SocketAddr {
    ANY.parse().expect("an address")
}
