//! The clock tree, by the plan of `cslam_firmware::clock`: 480 or 400 MHz from the front end's 8 MHz reference, so that the UAV
//! clock and the sampling clock are one; from HSI when the reference is not there, or no longer.

use core::sync::atomic::{AtomicBool, Ordering};

use cortex_m_rt::exception;
use cslam_firmware::clock::{BOOT_WATCHDOG_US, Oscillators, Plan, Revision, Source, choose, fall_back};
use embassy_stm32::Config;
use embassy_stm32::pac::iwdg::vals::{Key, Pr};
use embassy_stm32::pac::rcc::vals::{Pllm, Plln, Pllsrc, Sw};
use embassy_stm32::pac::{DBGMCU, IWDG1, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Pll, PllDiv, PllSource, Sysclk, VoltageScale,
};
use embassy_stm32::time::Hertz;

use crate::fault;

/// The board runs by HSI.
static DEGRADED: AtomicBool = AtomicBool::new(false);

/// Whether time is not the front end's.
pub(crate) fn are_degraded() -> bool {
    DEGRADED.load(Ordering::Relaxed)
}

/// Starts the watchdog with time enough for a start, before anything can hang.
pub(crate) fn start_watchdog() {
    /// Clock of the watchdog (LSI), and what it is divided by: the longest there is.
    const LSI_HZ: u32 = 32_000;
    const DIVIDER: u32 = 256;
    const RELOAD: u32 = BOOT_WATCHDOG_US / 1_000_000 * LSI_HZ / DIVIDER;
    const _: () = assert!(RELOAD < 1 << 12);
    // In this order: what is written before it is started waits for a clock that is not on yet (RM0433 section 48.3.4).
    IWDG1.kr().write(|w| w.set_key(Key::START));
    IWDG1.kr().write(|w| w.set_key(Key::ENABLE));
    IWDG1.pr().write(|w| w.set_pr(Pr::DIVIDE_BY256));
    IWDG1.rlr().write(|w| w.set_rl(RELOAD as u16));
    // Taken over within five periods of LSI. Bounded, like everything here: if not, it bites after the 512 ms of the reset.
    for _ in 0..100_000 {
        if IWDG1.sr().read().0 == 0 {
            break;
        }
    }
    feed_watchdog();
}

/// For a start that is under way and a board that refuses to fly; in flight that is the supervisor's business.
pub(crate) fn feed_watchdog() {
    IWDG1.kr().write(|w| w.set_key(Key::RESET));
}

/// Chooses how to run, on a chip that has just been reset.
pub(crate) fn plan() -> Plan {
    let plan = choose(&mut Chip, Revision::from_id_code(DBGMCU.idc().read().0));
    DEGRADED.store(plan.is_degraded(), Ordering::Relaxed);
    plan
}

/// Lets the hardware look after the reference: from now on its end is an interrupt that cannot be masked. Once the board runs by it.
pub(crate) fn watch_reference(plan: Plan) {
    if plan.source == Source::Reference {
        RCC.cr().modify(|w| w.set_hsecsson(true));
    }
}

/// Core at the plan's rate, buses and timers at half, peripherals at a quarter.
pub(crate) fn config(plan: Plan) -> Config {
    let mut config = Config::default();
    let rcc = &mut config.rcc;
    rcc.voltage_scale = if plan.core_hz() > 400_000_000 {
        VoltageScale::Scale0
    } else {
        VoltageScale::Scale1
    };
    // HSI stays on: it is what the hardware falls back to.
    rcc.hse = (plan.source == Source::Reference).then_some(Hse {
        freq: Hertz(plan.source.hz()),
        mode: HseMode::Bypass,
    });
    rcc.pll1 = Some(Pll {
        source: match plan.source {
            Source::Reference => PllSource::HSE,
            Source::Internal => PllSource::HSI,
        },
        prediv: divider(plan.source),
        // The register holds one less.
        mul: Plln::from_bits(plan.multiplier() as u16 - 1),
        fracn: None,
        divp: Some(PllDiv::DIV2),
        divq: Some(PllDiv::DIV8),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.d1c_pre = AHBPrescaler::DIV1;
    rcc.ahb_pre = AHBPrescaler::DIV2;
    rcc.apb1_pre = APBPrescaler::DIV2;
    rcc.apb2_pre = APBPrescaler::DIV2;
    rcc.apb3_pre = APBPrescaler::DIV2;
    rcc.apb4_pre = APBPrescaler::DIV2;
    config
}

fn divider(source: Source) -> Pllm {
    Pllm::from_bits(source.divider() as u8)
}

/// The registers.
struct Chip;

impl Oscillators for Chip {
    fn open_reference(&mut self) {
        RCC.cr().modify(|w| w.set_hsebyp(true));
        RCC.cr().modify(|w| w.set_hseon(true));
    }

    fn close_reference(&mut self) {
        RCC.cr().modify(|w| w.set_hseon(false));
    }

    fn reference_is_ready(&self) -> bool {
        RCC.cr().read().hserdy()
    }

    fn acknowledge_failure(&mut self) {
        RCC.cicr().write(|w| w.set_hsecssc(true));
    }

    fn turn_pll(&mut self, on: bool) {
        RCC.cr().modify(|w| w.set_pllon(0, on));
    }

    fn pll_is_locked(&self) -> bool {
        RCC.cr().read().pllrdy(0)
    }

    fn feed_pll(&mut self, source: Source) {
        RCC.pllckselr().modify(|w| {
            w.set_divm(0, divider(source));
            w.set_pllsrc(match source {
                Source::Reference => Pllsrc::HSE,
                Source::Internal => Pllsrc::HSI,
            });
        });
    }

    fn choose_pll(&mut self) {
        RCC.cfgr().modify(|w| w.set_sw(Sw::PLL1_P));
    }

    fn runs_by_pll(&self) -> bool {
        RCC.cfgr().read().sws() == Sw::PLL1_P
    }

    fn wait_us(&mut self, us: u32) {
        cortex_m::asm::delay(us * (Source::Internal.hz() / 1_000_000));
    }
}

// SAFETY: nothing that a critical section protects is touched: the registers are written by nobody else once the board runs, and the flag
// is atomic.
#[exception]
unsafe fn NonMaskableInt() {
    let failed = RCC.cifr().read().hsecssf();
    DEGRADED.store(true, Ordering::Relaxed);
    if !failed || fall_back(&mut Chip).is_err() {
        fault::clock_lost();
    }
}
