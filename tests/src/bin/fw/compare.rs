//! Board against host, bit for bit.

use std::fmt;

use cslam_core::telemetry::Key;
use cslam_firmware::sensor_stream::UAV;
use cslam_host_sim::evaluation::downlink;

use crate::world::Flown;

/// Where the two went apart.
#[derive(Debug)]
pub(crate) struct Difference(String);

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Difference {}

/// Compares packets, trajectory and map, and has the ground decode what the board sent.
pub(crate) fn compare(flown: &Flown) -> anyhow::Result<()> {
    let (ours, theirs) = (flown.lines.lines(), flown.board.lines.lines());
    for (number, (host, board)) in ours.clone().zip(theirs.clone()).enumerate() {
        if host != board {
            let number = number + 1;
            let text = format!("line {number} differs:\n  host:  {host}\n  board: {board}");
            return Err(Difference(text).into());
        }
    }
    let [host, board] = [ours.count(), theirs.count()];
    if host != board {
        return Err(Difference(format!("the host wrote {host} lines, the board {board}")).into());
    }
    let (host, board) = (&flown.packets, &flown.board.packets);
    if let Some(at) = host.iter().zip(board).position(|(a, b)| a != b) {
        return Err(Difference(format!("packets differ first at byte {at}")).into());
    }
    if host.len() != board.len() {
        let text = format!("the host sent {} bytes, the board {}", host.len(), board.len());
        return Err(Difference(text).into());
    }
    let heard = downlink::decode(board, UAV, &Key::TEST);
    if !heard.refused.is_empty() {
        return Err(Difference(format!("the ground refused packets: {:?}", heard.refused)).into());
    }
    println!(
        "equal on board and host: {} packets ({} bytes), {} lines of trajectory and map; the ground decoded {} points, {} poses, {} sweeps",
        heard.traffic.packets,
        board.len(),
        flown.lines.lines().count(),
        heard.points.len(),
        heard.poses.len(),
        heard.links.len()
    );
    Ok(())
}
