//! The UAV clock: TIM2, 32 bits at 10 MHz from the front end's reference, carried on to 64 bits. It stamps the inertial
//! sensor's edges in hardware (channel 1) and gives the edge at which the front end loads the same time (channel 3).
//!
//! It puts things in order, to 100 ns. What has to be known better, two-way timing above all, the front end measures by its samples
//! (docs/front-end.md section 6).

use core::future::poll_fn;
use core::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use core::task::Poll;

use cslam_firmware::board::{Clock, DataReady};
use embassy_stm32::gpio::{AfType, Flex, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{self, InterruptExt, Priority};
use embassy_stm32::pac::timer::vals::{CcmrInputCcs, OcmGp};
use embassy_stm32::peripherals::{PA0, PB10, TIM2};
use embassy_stm32::{Peri, pac};
use embassy_sync::waitqueue::AtomicWaker;

/// Nanoseconds of a tick.
const TICK_NS: u64 = 100;
/// Ticks a second.
const TICKS_HZ: u32 = 10_000_000;
/// Alternate function of TIM2 on both pins.
const FUNCTION: u8 = 1;

/// Turns of the counter.
static TURNS: AtomicU32 = AtomicU32::new(0);
/// Ticks at the newest edge, and the turns that went with them; whether nobody has taken it yet.
static EDGE: AtomicU32 = AtomicU32::new(0);
static EDGE_TURNS: AtomicU32 = AtomicU32::new(0);
static EDGE_IS_NEW: AtomicBool = AtomicBool::new(false);
static EDGE_WAKER: AtomicWaker = AtomicWaker::new();

/// The clock, once it runs.
#[derive(Clone, Copy)]
pub(crate) struct UavClock(());

/// The inertial sensor's edges.
pub(crate) struct ImuEdge(());

/// The line that sets the front end's clock.
pub(crate) struct Sync(());

/// Starts the clock at 0, by a timer clock of `timer_hz`, a multiple of 10 MHz.
pub(crate) fn start(
    timer_hz: u32,
    _timer: Peri<'static, TIM2>,
    edge: Peri<'static, PA0>,
    sync: Peri<'static, PB10>,
) -> (UavClock, ImuEdge, Sync) {
    pac::RCC.apb1lenr().modify(|w| w.set_tim2en(true));
    let mut edge = Flex::new(edge);
    edge.set_as_af_unchecked(FUNCTION, AfType::input(Pull::Down));
    let mut sync = Flex::new(sync);
    sync.set_as_af_unchecked(FUNCTION, AfType::output(OutputType::PushPull, Speed::High));
    // The pins stay as they are for as long as the board runs.
    core::mem::forget((edge, sync));

    let timer = pac::TIM2;
    timer.psc().write_value((timer_hz / TICKS_HZ - 1) as u16);
    timer.arr().write_value(u32::MAX);
    // Loads the prescaler; the flag that goes with it is no turn.
    timer.egr().write(|w| w.set_ug(true));
    timer.sr().write(|w| w.set_uif(false));
    timer.ccmr_input(0).modify(|w| w.set_ccs(0, CcmrInputCcs::TI4));
    timer.ccer().modify(|w| {
        w.set_cce(0, true);
        w.set_cce(2, true);
    });
    timer.dier().modify(|w| {
        w.set_ccie(0, true);
        w.set_uie(true);
    });
    // Above every executor, so that turns are counted whatever runs.
    interrupt::TIM2.set_priority(Priority::P1);
    // SAFETY: the handler below is made for this, and uses atomics only.
    unsafe { interrupt::TIM2.enable() };
    timer.cr1().modify(|w| w.set_cen(true));
    (UavClock(()), ImuEdge(()), Sync(()))
}

/// Turns that a count belongs to, read with the flag of a turn that nobody has counted yet.
fn turns_of(count: u32, turns: u32, turn_pending: bool) -> u32 {
    // The flag was set after the count was read if the count is high.
    turns.wrapping_add(u32::from(turn_pending && count < 1 << 31))
}

fn ns(turns: u32, count: u32) -> u64 {
    (u64::from(turns) << 32 | u64::from(count)) * TICK_NS
}

impl Clock for UavClock {
    fn now_ns(&self) -> u64 {
        critical_section::with(|_| {
            let count = pac::TIM2.cnt().read();
            let pending = pac::TIM2.sr().read().uif();
            let turns = turns_of(count, TURNS.load(Ordering::Relaxed), pending);
            ns(turns, count)
        })
    }
}

impl DataReady for ImuEdge {
    async fn edge(&mut self) -> u64 {
        poll_fn(|context| {
            EDGE_WAKER.register(context.waker());
            critical_section::with(|_| {
                if EDGE_IS_NEW.swap(false, Ordering::Relaxed) {
                    let (turns, count) = (EDGE_TURNS.load(Ordering::Relaxed), EDGE.load(Ordering::Relaxed));
                    Poll::Ready(ns(turns, count))
                } else {
                    Poll::Pending
                }
            })
        })
        .await
    }
}

impl Sync {
    /// Lets the line rise when the clock reads `at_ns`, rounded down to ticks, less than a turn (429 s) ahead; gives that time.
    pub(crate) fn rise_at(&mut self, at_ns: u64) -> u64 {
        let ticks = at_ns / TICK_NS;
        let timer = pac::TIM2;
        timer
            .ccmr_output(1)
            .modify(|w| w.set_ocm(0, OcmGp::FORCE_INACTIVE));
        timer.ccr(2).write_value(ticks as u32);
        timer
            .ccmr_output(1)
            .modify(|w| w.set_ocm(0, OcmGp::ACTIVE_ON_MATCH));
        ticks * TICK_NS
    }
}

/// TIM2: a turn, an edge, or both.
#[embassy_stm32::interrupt]
unsafe fn TIM2() {
    let timer = pac::TIM2;
    let flags = timer.sr().read();
    let turns = TURNS.load(Ordering::Relaxed);
    if flags.ccif(0) {
        // Reading the count clears the flag.
        let count = timer.ccr(0).read();
        EDGE.store(count, Ordering::Relaxed);
        EDGE_TURNS.store(turns_of(count, turns, flags.uif()), Ordering::Relaxed);
        EDGE_IS_NEW.store(true, Ordering::Relaxed);
        EDGE_WAKER.wake();
    }
    if flags.uif() {
        TURNS.store(turns.wrapping_add(1), Ordering::Relaxed);
        // Written with ones everywhere else, which clears nothing there.
        let mut clear = pac::timer::regs::SrGp16(u32::MAX);
        clear.set_uif(false);
        timer.sr().write_value(clear);
    }
}
