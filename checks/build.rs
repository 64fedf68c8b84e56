//! The emulated boards of this package. Without one the library builds for a host.

#[path = "../firmware/build/link.rs"]
mod link;

use link::Board;

const BOARDS: [Board; 3] = [
    Board {
        feature: "qemu-an500",
        memory: "memory/mps2-an500.x",
        binaries: &["checks-an500", "faults-an500", "receiver-an500", "sweeps-an500"],
        scripts: &["defmt.x"],
    },
    Board {
        feature: "qemu-an386",
        memory: "memory/mps2-an386.x",
        binaries: &["self-test"],
        scripts: &["defmt.x"],
    },
    Board {
        feature: "qemu-an547",
        memory: "memory/mps3-an547.x",
        binaries: &["self-test"],
        scripts: &["defmt.x"],
    },
];

fn main() {
    link::chosen(&BOARDS);
}
