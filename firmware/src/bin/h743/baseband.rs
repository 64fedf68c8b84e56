//! The link from the front end: DCMI and DMA into three buffers that go round, back-pressure by a line, registers by SPI.
//!
//! [`capture`] runs above the receiver and keeps the DMA busy; [`Link`] is the receiver's end. A buffer is either the DMA's or the
//! receiver's, never both. When READY rises and falls is [`Capture`]'s business; here are its registers.

use core::fmt;
use core::sync::atomic::{AtomicU32, Ordering, fence};

use cortex_m::peripheral::SCB;
use cslam_firmware::board::{Baseband, Clock, Filled};
use cslam_firmware::front_end::{Capture, Control, ControlError, FRAME_WORDS, Look, Port, Step};
use cslam_firmware::supervisor::Progress;
use embassy_futures::select::select;
use embassy_stm32::dcmi::Dcmi;
use embassy_stm32::gpio::Output;
use embassy_stm32::interrupt::typelevel::{self, Handler};
use embassy_stm32::pac;
use embassy_stm32::pac::dma::vals::{Pl, Size};
use embassy_stm32::peripherals::DCMI;
use embassy_stm32::spi;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;
use embassy_sync::zerocopy_channel::{Receiver, Sender};
use embassy_time::{Duration, Instant, Timer, with_timeout};

use crate::bus::OnlyDevice;
use crate::memory::FrameBuffer;
use crate::uav_clock::{Sync, UavClock};

/// A buffer is looked for at least this often.
const ROUND: Duration = Duration::from_millis(50);
/// How long the front end keeps what nobody takes, us: until the next sweep begins.
const PATIENCE_US: u32 = 450_000;
/// From now to the edge that sets the front end's clock, ns: time enough for the registers.
const SYNC_AHEAD_NS: u64 = 20_000_000;

/// [`capture`] goes round.
pub(crate) static CAPTURE: Progress = Progress::new();
/// Frames that this end gave up.
static CUT: AtomicU32 = AtomicU32::new(0);
/// The port has something to say: a frame has ended, or overrun.
static CALLS: Signal<CriticalSectionRawMutex, ()> = Signal::new();

/// The port's interrupt, beside the driver's own handler, which turns off what has called.
pub(crate) struct PortCalls;

impl Handler<typelevel::DCMI> for PortCalls {
    unsafe fn on_interrupt() {
        CALLS.signal(());
    }
}

/// Takes frames as long as the board runs. `_camera` has set up the port and its pins.
#[embassy_executor::task]
pub(crate) async fn capture(
    _camera: Dcmi<'static, DCMI>,
    mut ready: Output<'static>,
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
        let taken = take(&mut Camera {
            ready: &mut ready,
            buffer,
        })
        .await;
        buffer.forget_cached(&mut scb);
        if matches!(taken, Step::Whole) {
            buffers.send_done();
        } else {
            CUT.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Offers a buffer until a frame has come, whole or cut.
async fn take(camera: &mut Camera<'_>) -> Step {
    CALLS.reset();
    let mut capture = Capture::offer(camera, Instant::now().as_micros());
    loop {
        CAPTURE.mark();
        match capture.step(camera, Instant::now().as_micros()) {
            Step::Wait { until_us } => {
                select(CALLS.wait(), Timer::at(Instant::from_micros(until_us))).await;
            }
            done => return done,
        }
    }
}

/// Pin of port G that VSYNC is on.
const VSYNC_PIN: usize = 9;
/// Stream of DMA2 that serves the camera port, the channel of the multiplexer before it (RM0433 section 17.3.1: those of DMA2 follow
/// the eight of DMA1), and the port's request there (table 121).
const DMA_STREAM: usize = 0;
const DMA_CHANNEL: usize = 8;
const DMA_REQUEST: u8 = 75;

/// Port and DMA over a buffer. No other code touches their registers once [`capture`] runs.
struct Camera<'a> {
    ready: &'a mut Output<'static>,
    buffer: &'a mut FrameBuffer,
}

impl Port for Camera<'_> {
    fn arm(&mut self) {
        self.disarm();
        // A reset empties the port, whatever was left in it.
        let settings = pac::DCMI.cr().read();
        pac::RCC.ahb2rstr().modify(|w| w.set_dcmirst(true));
        pac::RCC.ahb2rstr().modify(|w| w.set_dcmirst(false));
        pac::DCMI.cr().write_value(settings);

        let stream = pac::DMA2.st(DMA_STREAM);
        pac::DMA2.ifcr(DMA_STREAM / 4).write(|w| {
            w.set_tcif(DMA_STREAM % 4, true);
            w.set_htif(DMA_STREAM % 4, true);
            w.set_teif(DMA_STREAM % 4, true);
            w.set_dmeif(DMA_STREAM % 4, true);
            w.set_feif(DMA_STREAM % 4, true);
        });
        pac::DMAMUX1
            .ccr(DMA_CHANNEL)
            .write(|w| w.set_dmareq_id(DMA_REQUEST));
        stream.par().write_value(pac::DCMI.dr().as_ptr() as u32);
        stream.m0ar().write_value(self.buffer.words().as_mut_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(FRAME_WORDS as u16));
        // From the port to memory, word by word, without the stream's own FIFO and without interrupts.
        stream.fcr().write(|_| {});
        stream.cr().write(|w| {
            w.set_psize(Size::BITS32);
            w.set_msize(Size::BITS32);
            w.set_minc(true);
            w.set_pl(Pl::VERY_HIGH);
        });
        fence(Ordering::SeqCst);
        stream.cr().modify(|w| w.set_en(true));

        pac::DCMI.ier().write(|w| {
            w.set_frame_ie(true);
            w.set_ovr_ie(true);
        });
        pac::DCMI.cr().modify(|w| w.set_enable(true));
        pac::DCMI.cr().modify(|w| w.set_capture(true));
    }

    fn disarm(&mut self) {
        pac::DCMI.ier().write(|_| {});
        pac::DCMI.cr().modify(|w| {
            w.set_capture(false);
            w.set_enable(false);
        });
        let stream = pac::DMA2.st(DMA_STREAM);
        stream.cr().modify(|w| w.set_en(false));
        // It ends the word in hand: a few cycles of the bus.
        while stream.cr().read().en() {}
        fence(Ordering::SeqCst);
    }

    fn ready(&mut self, high: bool) {
        self.ready.set_level(high.into());
    }

    fn look(&mut self) -> Look {
        let flags = pac::DCMI.ris().read();
        Look {
            // Read after the flags: what these say is not older than how far the DMA is.
            missing: u32::from(pac::DMA2.st(DMA_STREAM).ndtr().read().ndt()),
            on_lines: pac::GPIOG.idr().read().idr(VSYNC_PIN) == pac::gpio::vals::Idr::HIGH,
            ended: flags.frame_ris(),
            overrun: flags.ovr_ris(),
            unfetched: pac::DCMI.sr().read().fne(),
        }
    }
}

impl Drop for Camera<'_> {
    fn drop(&mut self) {
        // The DMA must not outlive its hold on the buffer.
        self.ready(false);
        self.disarm();
    }
}

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
                "front end: {frames} frames were cut: check VSYNC, HSYNC and the pixel clock"
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
