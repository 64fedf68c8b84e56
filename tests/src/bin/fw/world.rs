//! The flight: one world for two receivers.

use std::io::IsTerminal as _;
use std::path::Path;
use std::time::Instant;

use anyhow::Context;
use cslam_firmware::front_end::{
    Block, Checksum, FRAME_LENGTH, FRAMES_PER_SWEEP, HEADER_LENGTH, Header, Kind, SAMPLE_BYTES, SoftwareCrc,
    Status, write_samples,
};
use cslam_firmware::sensor_stream::SESSION;
use cslam_host_sim::raw_flight::Recorder;
use cslam_host_sim::scene::Scene;
use cslam_host_sim::sensors::Event;
use cslam_host_sim::world::{HeardSweep, World, WorldConfig};

use crate::arguments::Arguments;
use crate::board::{Board, Left};
use crate::host::{self, Lines, Receiver};

/// What came of a flight.
pub(crate) struct Flown {
    /// Of the board.
    pub(crate) board: Left,
    /// Of the host: packets and lines.
    pub(crate) packets: Vec<u8>,
    pub(crate) lines: String,
    /// Lines of the board's log that are for people.
    pub(crate) log: Vec<String>,
    sweeps: u32,
    points: usize,
    elapsed_s: f64,
}

impl Flown {
    /// What was flown, in a few lines.
    pub(crate) fn summary(&self, arguments: &Arguments) -> String {
        format!(
            "flight in the loop: {} s over {}, seed {}, {} sweeps, {} map points, {} bytes of packets, in {:.0} s",
            arguments.seconds,
            arguments.scene,
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
    let scene = Scene::load(&arguments.scene)?;
    let mut config = WorldConfig::default();
    config.flight.duration_s = arguments.seconds;
    let world = World::new(&scene, config, arguments.seed)?;
    let mut board = Board::start(image, arguments.count, arguments.limit_s)?;
    let mut packets = Vec::new();
    let mut lines = Lines::default();
    host::with_receiver(|receiver| both(&world, &mut board, receiver, &mut lines, &mut packets))?;
    let board = board.wait()?;
    if let Some(directory) = &arguments.out {
        std::fs::create_dir_all(directory)
            .with_context(|| format!("{} cannot be made", directory.display()))?;
        std::fs::write(directory.join("packets.bin"), &board.packets)?;
        std::fs::write(directory.join("flight.txt"), &board.lines)?;
    }
    let log = board
        .log
        .lines()
        .filter(|line| !line.contains("flying"))
        .map(str::to_owned)
        .collect();
    Ok(Flown {
        log,
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
    receiver: &mut Receiver<'_>,
    lines: &mut Lines,
    packets: &mut Vec<u8>,
) -> anyhow::Result<()> {
    let mut recorder = Recorder::default();
    let mut link = Link::new();
    let mut now_ns = 0;
    let terminal = std::io::stderr().is_terminal();
    for stamped in world.flight().events() {
        now_ns = stamped.uav_time_ns;
        let record = recorder.record(&stamped).encode();
        board.record(&record)?;
        receiver.record(&record, lines)?;
        if let Event::Sweep { sweep } = stamped.event {
            if terminal {
                eprint!("\rsweep {sweep} of {}", world.sweeps());
            }
            link.sweep(world.sweep(sweep)?, now_ns, |frame, header, samples| {
                board.frame(frame)?;
                receiver.frame(header, samples, lines)?;
                host::drain(receiver, packets);
                Ok(())
            })?;
        }
        host::drain(receiver, packets);
    }
    if terminal {
        eprint!("\r");
    }
    let record = recorder.end(now_ns).encode();
    board.record(&record)?;
    receiver.record(&record, lines)?;
    receiver.end(lines);
    receiver.close();
    host::drain(receiver, packets);
    lines.map(receiver.cslam().map());
    Ok(())
}

/// The front end's end of its link.
struct Link {
    sequence: u32,
    frame: Box<[u8; FRAME_LENGTH]>,
}

impl Link {
    fn new() -> Self {
        Self {
            sequence: 0,
            frame: Box::new([0; FRAME_LENGTH]),
        }
    }

    /// Makes the frames of a sweep: its begin, its beams, its squint symbols.
    fn sweep(
        &mut self,
        mut heard: HeardSweep,
        sweep_ns: u64,
        mut each: impl FnMut(&[u8; FRAME_LENGTH], &[u8; HEADER_LENGTH], &mut Block) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let begin = Header {
            kind: Kind::Begin,
            session: SESSION,
            sequence: 0,
            sweep: heard.number,
            index: FRAMES_PER_SWEEP - 1,
            exponent: 0,
            sweep_ns,
            offset_ns: 0,
            payload_checksum: 0,
            dropped: 0,
            status: Status::default(),
        };
        let mut nothing = Box::new([[cslam_core::ltd::Iq::ZERO; 512]; 32]);
        self.put(begin, &mut nothing, &mut each)?;
        let beams = heard.beams.blocks.iter_mut().map(|block| (Kind::Beam, block));
        let squint = heard.squint.blocks.iter_mut().map(|block| (Kind::Squint, block));
        for (kind, block) in beams.chain(squint) {
            let view = block.view();
            let header = Header {
                kind,
                index: view.beam,
                exponent: i16::try_from(view.exponent)?,
                payload_checksum: SoftwareCrc.samples(view.samples),
                ..begin
            };
            self.put(header, view.samples, &mut each)?;
        }
        Ok(())
    }

    fn put(
        &mut self,
        header: Header,
        samples: &mut Block,
        each: &mut impl FnMut(&[u8; FRAME_LENGTH], &[u8; HEADER_LENGTH], &mut Block) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let header = Header {
            sequence: self.sequence,
            ..header
        };
        self.sequence = self.sequence.wrapping_add(1);
        let bytes = header.encode();
        let (head, payload) = self.frame.split_at_mut(HEADER_LENGTH);
        head.copy_from_slice(&bytes);
        let payload: &mut [u8; SAMPLE_BYTES] = payload.try_into()?;
        write_samples(samples, payload);
        each(&self.frame, &bytes, samples)
    }
}
