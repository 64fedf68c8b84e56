//! What `cargo fw` is asked for.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{ArgGroup, Parser, ValueEnum};
use cslam_host_sim::world::Profile;

/// Flies the firmware on an emulated Cortex-M7 in the loop with the simulated world, and compares it with the host; or puts it on a
/// board.
#[derive(Clone, Parser, Debug)]
#[command(name = "cargo fw", version, group = ArgGroup::new("counting"))]
pub(crate) struct Arguments {
    /// Board: the emulated one flies, a real one is flashed (by probe-rs) and shows its log
    #[arg(long, value_enum, default_value_t = Target::Emulated)]
    pub(crate) board: Target,
    /// Scene to fly in
    #[arg(long, default_value = "outdoor")]
    pub(crate) scene: String,
    /// World, with the figures of its name
    #[arg(long, value_enum, default_value_t)]
    pub(crate) world: Profile,
    /// Seed of the flight, of its sensors and of its channel
    #[arg(long, default_value_t = 1)]
    pub(crate) seed: u64,
    /// Simulated time to fly, s: two sweeps per second
    #[arg(long, default_value_t = 60.0)]
    pub(crate) seconds: f64,
    /// With an inertial sensor that has spikes from 20 s on and stops at 52 s, and samples of it that are lost and doubled, so that what
    /// meets them is compared too
    #[arg(long)]
    pub(crate) faults: bool,
    /// Fly each of these and count instructions: a line for each flight and one for all
    #[arg(long, value_name = "SCENE:SEED", num_args = 1.., conflicts_with_all = ["scene", "seed", "profile", "check", "write", "out"])]
    pub(crate) flights: Vec<Flight>,
    /// Count instructions, stage by stage; slower
    #[arg(long, group = "counting")]
    pub(crate) count: bool,
    /// Count instructions, kernel by kernel, and say how many cycles of a Cortex-M7 they take at least and at most; needs a C compiler, and
    /// the flight of tests/golden/receiver_cost.txt
    #[arg(long, group = "counting")]
    pub(crate) profile: bool,
    /// With --count or --profile: compare with a committed table; more than 2 % over it fails
    #[arg(long, requires = "counting", value_name = "FILE")]
    pub(crate) check: Option<PathBuf>,
    /// With --count or --profile: write that table
    #[arg(long, requires = "counting", value_name = "FILE")]
    pub(crate) write: Option<PathBuf>,
    /// Longest run of the emulator, s
    #[arg(long, default_value_t = 1800)]
    pub(crate) limit_s: u32,
    /// Directory for what the board sent (packets.bin) and its lines (flight.txt)
    #[arg(long)]
    pub(crate) out: Option<PathBuf>,
}

/// A scene and a seed.
#[derive(Clone, Debug)]
pub(crate) struct Flight {
    pub(crate) scene: String,
    pub(crate) seed: u64,
}

impl FromStr for Flight {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        text.rsplit_once(':')
            .and_then(|(scene, seed)| {
                Some(Self {
                    scene: scene.to_owned(),
                    seed: seed.parse().ok()?,
                })
            })
            .ok_or_else(|| "expected SCENE:SEED, such as street:1 or city:1:1".to_owned())
    }
}

/// Boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Target {
    /// MPS2+ with the AN500 image, in QEMU
    Emulated,
    /// STM32H743
    H743,
}

impl Arguments {
    /// Reads the command line; ends the program with a hint when it is wrong.
    pub(crate) fn read() -> Self {
        Self::parse()
    }
}
