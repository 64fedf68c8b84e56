//! The boards of this package. Without one the library half builds for a host.

#[path = "build/link.rs"]
mod link;

use link::Board;

const BOARDS: [Board; 2] = [
    Board {
        feature: "stm32h743",
        memory: "../memory.x",
        binaries: &["cslam-h743"],
        scripts: &["defmt.x", "device.x"],
    },
    // Not a board: the memory map of one, to link the flight path against.
    Board {
        feature: "link-check",
        memory: "../memory.x",
        binaries: &["panic-free"],
        scripts: &[],
    },
];

fn main() {
    link::chosen(&BOARDS);
}
