//! What the default radio's front end sends over its link: frames of 32 channels.
//!
//! Blocks of any other radio come by [`Application::capture`].

use cslam_core::profile::quad_4x8_gmt_72::CHANNELS;
use cslam_core::receiver::Radio;
use cslam_core::signal::BeamBlock;

use super::{Application, Capture, Observer, Stage, Symbol};
use crate::front_end::{Block, Checksum, Content, Exchange, FrameError, HEADER_LENGTH};

impl<R, const VOXELS: usize, const STATES: usize, C: Checksum> Application<'_, R, VOXELS, STATES, C>
where
    R: for<'b> Radio<Block<'b> = BeamBlock<'b, CHANNELS>>,
{
    /// A frame of the front end, as it lies in memory; its samples are worked on in place.
    ///
    /// # Errors
    /// [`FrameError`]: nothing was used. The link's counters know.
    pub fn frame(
        &mut self,
        header: &[u8; HEADER_LENGTH],
        samples: &mut Block,
        observer: &mut impl Observer,
    ) -> Result<(), FrameError> {
        let front_end = &mut self.front_end;
        let frame = observer.stage(Stage::Frame, || front_end.receive(header, samples))?;
        let (sweep, sweep_ns) = (frame.header.sweep, frame.header.sweep_ns);
        // Every frame tells when its sweep began, so none of them is indispensable.
        let symbol = match frame.content {
            Content::Begin { powers, .. } => {
                match powers {
                    Some(powers) => self.powers(sweep, sweep_ns, &powers, observer),
                    None => {
                        let _new = self.enter(sweep, sweep_ns, observer);
                    }
                }
                // It comes again with every sweep until there is a newer one.
                let exchange = Exchange::of(header).filter(|it| it.number != self.last_exchange);
                if let Some(exchange) = exchange {
                    self.last_exchange = exchange.number;
                    self.timing(sweep_ns, exchange.clock_offset_s(), observer);
                }
                return Ok(());
            }
            Content::Beam(block) => Symbol::Beam(block),
            Content::Pilot(block) => Symbol::Pilot(block),
            Content::Squint(block) => Symbol::Squint(block),
        };
        let capture = Capture {
            sweep,
            sweep_ns,
            symbol,
        };
        let _counted = self.capture(capture, observer);
        Ok(())
    }
}
