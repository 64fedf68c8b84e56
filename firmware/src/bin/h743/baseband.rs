//! The link from the front end: DCMI and DMA into three buffers that go round, back-pressure by a line, registers by SPI.
//!
//! [`capture`] runs above the receiver and keeps the DMA busy; [`Link`] is the receiver's end. A buffer is either the DMA's or the
//! receiver's, never both. READY is high while a buffer waits for a frame, and only then does the front end begin one.

use core::fmt;
use core::pin::pin;
use core::sync::atomic::{AtomicU32, Ordering};

use cortex_m::peripheral::SCB;
use cslam_firmware::board::{Baseband, Clock, Filled};
use cslam_firmware::front_end::{Control, ControlError};
use cslam_firmware::supervisor::Progress;
use embassy_futures::join::join;
use embassy_futures::select::{Either, select};
use embassy_stm32::dcmi::Dcmi;
use embassy_stm32::gpio::Output;
use embassy_stm32::pac;
use embassy_stm32::peripherals::DCMI;
use embassy_stm32::spi;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::zerocopy_channel::{Receiver, Sender};
use embassy_time::{Duration, Timer, with_timeout};

use crate::bus::OnlyDevice;
use crate::memory::FrameBuffer;
use crate::uav_clock::{Sync, UavClock};

/// A buffer is looked after at least this often.
const ROUND: Duration = Duration::from_millis(50);
/// A frame that has begun takes 1.64 ms.
const FRAME: Duration = Duration::from_millis(3);
/// How long the front end keeps what nobody takes, us: until the next sweep begins.
const PATIENCE_US: u32 = 450_000;
/// From now to the edge that sets the front end's clock, ns: time enough for the registers.
const SYNC_AHEAD_NS: u64 = 20_000_000;

/// [`capture`] goes round.
pub(crate) static CAPTURE: Progress = Progress::new();
/// Frames that this end cut: overruns of the DCMI, and frames that began and did not end.
static CUT: AtomicU32 = AtomicU32::new(0);

/// Takes frames as long as the board runs.
#[embassy_executor::task]
pub(crate) async fn capture(
    mut camera: Dcmi<'static, DCMI>,
    mut ready_line: Output<'static>,
    mut buffers: Sender<'static, CriticalSectionRawMutex, FrameBuffer>,
    mut scb: SCB,
) -> ! {
    loop {
        CAPTURE.mark();
        // The receiver may be busy for longer than a round.
        let Ok(buffer) = with_timeout(ROUND, buffers.send()).await else {
            continue;
        };
        buffer.forget_cached(&mut scb);
        let whole = take(&mut camera, &mut ready_line, buffer).await;
        buffer.forget_cached(&mut scb);
        match whole {
            Taken::Whole => buffers.send_done(),
            Taken::Nothing => {}
            Taken::Cut => {
                CUT.fetch_add(1, Ordering::Relaxed);
            }
        }
    }
}

/// What became of a buffer.
enum Taken {
    Whole,
    Nothing,
    Cut,
}

/// Waits a round for a frame.
async fn take(
    camera: &mut Dcmi<'static, DCMI>,
    ready_line: &mut Output<'static>,
    buffer: &mut FrameBuffer,
) -> Taken {
    let words = buffer.words().len();
    let taken = {
        // The first poll of the pair arms the DMA, then raises the line.
        let mut armed = pin!(join(camera.capture(buffer.words()), async {
            ready_line.set_high();
        }));
        let result = match select(&mut armed, Timer::after(ROUND)).await {
            Either::First((result, ())) => Some(result),
            Either::Second(()) => {
                // A frame may have begun in this very moment: it may end, no other one may begin.
                pac::GPIOG.bsrr().write(|w| w.set_br(READY_PIN, true));
                with_timeout(FRAME, &mut armed)
                    .await
                    .ok()
                    .map(|(result, ())| result)
            }
        };
        match result {
            Some(Ok(())) => Taken::Whole,
            Some(Err(_)) => Taken::Cut,
            // Words have come, and their frame has not.
            None if usize::from(pac::DMA2.st(DMA_STREAM).ndtr().read().ndt()) < words => Taken::Cut,
            None => Taken::Nothing,
        }
    };
    ready_line.set_low();
    if !matches!(taken, Taken::Whole) {
        // Whatever is left of a frame in the camera port must not become the beginning of the next one.
        pac::DCMI.cr().modify(|w| {
            w.set_capture(false);
            w.set_enable(false);
        });
    }
    taken
}

/// Pin of port G that READY is on.
const READY_PIN: usize = 12;
/// Stream of DMA2 that serves the camera port.
const DMA_STREAM: usize = 0;

/// What can be wrong with the link.
#[derive(defmt::Format)]
pub(crate) enum LinkError {
    /// The front end's registers.
    Control(ControlError<spi::Error>),
    /// Frames were cut since the last look.
    Cut(u32),
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Control(error) => error.fmt(f),
            Self::Cut(frames) => write!(
                f,
                "front end: {frames} frames did not end: check VSYNC, HSYNC and the pixel clock"
            ),
        }
    }
}

impl fmt::Debug for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

/// The receiver's end.
pub(crate) struct Link {
    control: &'static mut Control<OnlyDevice>,
    sync: Sync,
    clock: UavClock,
    buffers: Receiver<'static, CriticalSectionRawMutex, FrameBuffer>,
    holds: bool,
    cut: u32,
}

impl Link {
    pub(crate) fn new(
        control: &'static mut Control<OnlyDevice>,
        sync: Sync,
        clock: UavClock,
        buffers: Receiver<'static, CriticalSectionRawMutex, FrameBuffer>,
    ) -> Self {
        Self {
            control,
            sync,
            clock,
            buffers,
            holds: false,
            cut: 0,
        }
    }

    /// Gives the buffer of the last frame back.
    pub(crate) fn release(&mut self) {
        if core::mem::take(&mut self.holds) {
            self.buffers.receive_done();
        }
    }
}

impl Baseband for Link {
    type Error = LinkError;

    async fn open(&mut self, session: u16) -> Result<(), LinkError> {
        self.release();
        let sync_ns = self.sync.rise_at(self.clock.now_ns() + SYNC_AHEAD_NS);
        let prepared = self.control.prepare(session, sync_ns, PATIENCE_US).await;
        prepared.map_err(LinkError::Control)?;
        let left_ns = sync_ns.saturating_sub(self.clock.now_ns());
        Timer::after(Duration::from_nanos(left_ns) + Duration::from_millis(1)).await;
        self.control.run().await.map_err(LinkError::Control)
    }

    async fn frame(&mut self) -> Result<Filled<'_>, LinkError> {
        self.release();
        let cut = CUT.load(Ordering::Relaxed);
        let more = cut.wrapping_sub(core::mem::replace(&mut self.cut, cut));
        if more > 0 {
            return Err(LinkError::Cut(more));
        }
        let buffer = self.buffers.receive().await;
        self.holds = true;
        Ok(Filled {
            header: &buffer.header,
            samples: &mut buffer.samples,
        })
    }
}
