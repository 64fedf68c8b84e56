//! The front end's end of its link: sweeps as frames.

use cslam_core::signal::Iq;
use cslam_firmware::front_end::{
    Block, Checksum, FRAME_LENGTH, FRAMES_PER_SWEEP, HEADER_LENGTH, Header, Kind, SAMPLE_BYTES, SoftwareCrc,
    Status, powers_checksum, write_powers, write_samples,
};
use cslam_firmware::sensor_stream::SESSION;

use crate::world::HeardSweep;

/// Numbers frames and puts sums under them.
#[derive(Debug, Default)]
pub struct FrontEndLink {
    sequence: u32,
}

/// A frame as it lies on the link.
pub type FrameBytes = [u8; FRAME_LENGTH];

impl FrontEndLink {
    /// The frames of [`Self::sweep`], all at once.
    ///
    /// # Errors
    /// An exponent that no header holds.
    pub fn frames(&mut self, heard: &mut HeardSweep, sweep_ns: u64) -> anyhow::Result<Vec<Box<FrameBytes>>> {
        let mut frames = Vec::new();
        self.sweep(heard, sweep_ns, |frame| {
            frames.push(Box::new(*frame));
            Ok(())
        })?;
        Ok(frames)
    }

    /// The frames of a sweep in their order: its begin, its beams, strongest first, its pilots, its squint symbols. A begin has the powers of the
    /// beams; its frame is as long as the others, with zeros.
    pub fn sweep(
        &mut self,
        heard: &mut HeardSweep,
        sweep_ns: u64,
        mut each: impl FnMut(&FrameBytes) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let powers = heard.beams.powers();
        let begin = Header {
            kind: Kind::Begin,
            session: SESSION,
            sequence: 0,
            sweep: heard.number,
            index: FRAMES_PER_SWEEP - 1,
            exponent: 0,
            sweep_ns,
            offset_ns: 0,
            powers: true,
            payload_checksum: powers_checksum(&powers),
            dropped: 0,
            status: Status::default(),
        };
        let mut frame = Box::new([0; FRAME_LENGTH]);
        let mut filled = Box::new([[Iq::ZERO; 512]; 32]);
        write_powers(&powers, &mut filled);
        self.put(begin, &filled, &mut frame)?;
        each(&frame)?;
        let beams = heard.beams.strongest_first().map(|block| (Kind::Beam, block));
        let squint = heard.squint.blocks.iter_mut().map(|block| (Kind::Squint, block));
        let pilots = heard.pilots.blocks.iter_mut().map(|block| (Kind::Pilot, block));
        for (kind, block) in beams.chain(pilots).chain(squint) {
            let view = block.view();
            let header = Header {
                kind,
                index: view.beam,
                exponent: i16::try_from(view.exponent)?,
                powers: false,
                payload_checksum: SoftwareCrc.samples(view.samples),
                ..begin
            };
            self.put(header, view.samples, &mut frame)?;
            each(&frame)?;
        }
        Ok(())
    }

    fn put(&mut self, header: Header, samples: &Block, frame: &mut FrameBytes) -> anyhow::Result<()> {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let (head, payload) = frame.split_at_mut(HEADER_LENGTH);
        head.copy_from_slice(&Header { sequence, ..header }.encode());
        let payload: &mut [u8; SAMPLE_BYTES] = payload.try_into()?;
        write_samples(samples, payload);
        Ok(())
    }
}
