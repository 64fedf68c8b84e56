//! The flight: one world for two receivers.

use std::io::IsTerminal as _;
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use cslam_core::signal::Iq;
use cslam_firmware::front_end::{HEADER_LENGTH, read_samples};
use cslam_host_sim::raw_flight::{BoardReceiver, FrontEndLink, Recorder, drain, with_board_receiver};
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{World, WorldConfig};

use crate::arguments::Arguments;
use crate::board::{Board, Left};
use crate::host::Lines;

/// What came of a flight.
pub(crate) struct Flown {
    /// Of the board.
    pub(crate) board: Left,
    /// Of the host: packets and lines.
    pub(crate) packets: Vec<u8>,
    pub(crate) lines: String,
    sweeps: u32,
    points: usize,
    elapsed_s: f64,
}

/// What `--faults` means.
const FAULTS: &str = r#"{
    "imu": [
        {"kind": "spike", "start_s": 20.0, "duration_s": 30.0, "spikes_per_s": 2.0},
        {"kind": "stop", "start_s": 52.0, "duration_s": 0.3}
    ],
    "transport": [{"events": ["imu"], "lost": 0.002, "doubled": 0.002}]
}"#;

impl Flown {
    /// What was flown, in a few lines.
    pub(crate) fn summary(&self, arguments: &Arguments) -> String {
        format!(
            "flight in the loop: {} s over {}, world {}, seed {}, {} sweeps, {} map points, {} bytes of packets, in {:.0} s",
            arguments.seconds,
            arguments.scene,
            arguments.world.name(),
            arguments.seed,
            self.sweeps,
            self.points,
            self.board.packets.len(),
            self.elapsed_s
        )
    }
}

/// Flies both receivers.
pub(crate) fn fly(arguments: &Arguments, image: &Path) -> anyhow::Result<Flown> {
    let started = Instant::now();
    let mut config = WorldConfig::of(arguments.world);
    config.flight.duration_s = arguments.seconds;
    if arguments.faults {
        config.sensors.faults = serde_json::from_str(FAULTS).context("the faults of --faults")?;
    }
    let scene = config.scene(&arguments.scene)?;
    let world = World::new(&scene, config, arguments.seed)?;
    let mut board = Board::start(image, arguments)?;
    let mut packets = Vec::new();
    let mut lines = Lines::default();
    with_board_receiver(|receiver| both(&world, &mut board, receiver, &mut lines, &mut packets))?;
    let board = board.wait()?;
    if let Some(directory) = &arguments.out {
        std::fs::create_dir_all(directory)
            .with_context(|| format!("{} cannot be made", directory.display()))?;
        std::fs::write(directory.join("packets.bin"), &board.packets)?;
        std::fs::write(directory.join("flight.txt"), &board.lines)?;
    }
    Ok(Flown {
        sweeps: lines.sweeps,
        points: lines
            .text
            .lines()
            .filter(|line| line.starts_with("point"))
            .count(),
        packets,
        lines: lines.text,
        board,
        elapsed_s: started.elapsed().as_secs_f64(),
    })
}

/// Hands every event to both.
fn both(
    world: &World<'_>,
    board: &mut Board,
    receiver: &mut BoardReceiver<'_>,
    lines: &mut Lines,
    packets: &mut Vec<u8>,
) -> anyhow::Result<()> {
    let mut recorder = Recorder::default();
    let mut link = FrontEndLink::default();
    let mut samples = Box::new([[Iq::ZERO; 512]; 32]);
    let mut now_ns = 0;
    let terminal = std::io::stderr().is_terminal();
    for stamped in world.flight().events() {
        now_ns = stamped.uav_time_ns;
        let Some(record) = recorder.record(&stamped) else {
            continue;
        };
        let record = record.encode();
        board.record(&record)?;
        receiver.record(&record, lines)?;
        if let Event::Sweep { sweep } = stamped.event {
            if terminal {
                eprint!("\rsweep {sweep} of {}", world.sweeps());
            }
            link.sweep(&mut world.sweep(sweep)?, now_ns, |frame| {
                board.frame(frame)?;
                let (header, payload) = frame.split_at(HEADER_LENGTH);
                read_samples(payload.try_into()?, &mut samples);
                receiver.frame(header.try_into()?, &mut samples, lines)?;
                drain(receiver.downlink(), packets);
                Ok(())
            })?;
        }
        drain(receiver.downlink(), packets);
    }
    if terminal {
        eprint!("\r");
    }
    let record = recorder.end(now_ns).encode();
    board.record(&record)?;
    receiver.record(&record, lines)?;
    receiver.end(lines);
    receiver.close();
    drain(receiver.downlink(), packets);
    lines.map(receiver.cslam().map());
    Ok(())
}
