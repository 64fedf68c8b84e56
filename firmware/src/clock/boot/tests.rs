//! Boots of a simulated chip: oscillators, PLL, security system and watchdog after RM0433 (sections 8.5 and 48).

extern crate std;

use std::vec::Vec;

use super::*;

const REVISION: Revision = Revision::V;

/// What the core runs by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Core {
    Hsi,
    Pll,
    /// Its clock has stopped, and nothing noticed.
    Stopped,
}

/// The chip and what comes in at OSC_IN.
struct Chip {
    now_us: u64,
    /// Spans in which the reference is there, us.
    reference: Vec<(u64, u64)>,
    open: bool,
    ready_at_us: Option<u64>,
    security: bool,
    interrupt: bool,
    pll: Option<u64>,
    pll_source: Source,
    /// The PLL locks this long after it was turned on; never when `None`.
    lock_us: Option<u64>,
    /// The PLL does not go off.
    stuck: bool,
    core: Core,
    /// The watchdog bites then.
    bite_us: Option<u64>,
    boots: u32,
}

impl Chip {
    fn new(reference: &[(u64, u64)]) -> Self {
        let mut chip = Self {
            now_us: 0,
            reference: reference.to_vec(),
            open: false,
            ready_at_us: None,
            security: false,
            interrupt: false,
            pll: None,
            pll_source: Source::Internal,
            lock_us: Some(100),
            stuck: false,
            core: Core::Hsi,
            bite_us: None,
            boots: 0,
        };
        chip.reset();
        chip
    }

    fn reset(&mut self) {
        (self.open, self.ready_at_us, self.security) = (false, None, false);
        (self.pll, self.core, self.bite_us) = (None, Core::Hsi, None);
        self.interrupt = false;
        self.boots += 1;
    }

    fn reference_is_there(&self) -> bool {
        let now = self.now_us;
        self.reference
            .iter()
            .any(|(from, to)| (*from..*to).contains(&now))
    }

    /// A microsecond. `false` when the watchdog has bitten: the chip has been reset.
    fn tick(&mut self) -> bool {
        self.now_us += 1;
        let there = self.reference_is_there();
        if self.open && there && self.ready_at_us.is_none() {
            // Counted for a few periods.
            self.ready_at_us = Some(self.now_us + 2);
        }
        let used = self.core == Core::Pll && self.pll_source == Source::Reference;
        if !there && self.ready_at_us.is_some_and(|at| at <= self.now_us) {
            if self.security {
                // HSE goes off, and the PLL with it, and the core onto HSI.
                (self.open, self.ready_at_us, self.interrupt) = (false, None, true);
                if used {
                    (self.core, self.pll) = (Core::Hsi, None);
                }
            } else if used {
                // Nobody looks: the flag stays, the core stands still.
                self.core = Core::Stopped;
            }
        }
        if self.bite_us.is_some_and(|at| at <= self.now_us) {
            self.reset();
            return false;
        }
        true
    }

    /// What the image does from the reset on, until the watchdog bites: the plan, when it gets so far.
    fn boot_once(&mut self) -> Option<Plan> {
        self.bite_us = Some(self.now_us + u64::from(BOOT_WATCHDOG_US));
        let plan = choose(self, REVISION);
        // The library's start: it opens the reference and waits for it, and for the PLL, without a bound.
        if plan.source == Source::Reference {
            self.open_reference();
            // It looks at the flag, which without the security system stays.
            while !(self.reference_is_ready() && self.reference_is_there()) {
                if !self.tick() {
                    return None;
                }
            }
        }
        self.feed_pll(plan.source);
        self.turn_pll(true);
        while !self.pll_is_locked() {
            if !self.tick() {
                return None;
            }
        }
        self.choose_pll();
        self.security = plan.source == Source::Reference;
        Some(plan)
    }

    fn boot(&mut self) -> Plan {
        loop {
            if let Some(plan) = self.boot_once() {
                return plan;
            }
            assert!(self.boots < 10, "it boots for ever");
        }
    }

    /// Flies for so long, feeding the watchdog; `true` when it is still the same program.
    fn fly(&mut self, us: u64) -> bool {
        let boots = self.boots;
        let until = self.now_us + us;
        while self.now_us < until && self.boots == boots {
            if self.core != Core::Stopped {
                self.bite_us = Some(self.now_us + 1_000_000);
            }
            self.tick();
            if self.interrupt && fall_back(self).is_err() {
                // A record and a reset.
                self.reset();
            }
        }
        self.boots == boots
    }

    fn runs_by(&self, source: Source) -> bool {
        self.core == Core::Pll && self.pll_is_locked() && self.pll_source == source
    }
}

impl Oscillators for Chip {
    fn open_reference(&mut self) {
        self.open = true;
    }
    fn close_reference(&mut self) {
        (self.open, self.ready_at_us) = (false, None);
    }
    fn reference_is_ready(&self) -> bool {
        self.ready_at_us.is_some_and(|at| at <= self.now_us)
    }
    fn acknowledge_failure(&mut self) {
        self.interrupt = false;
    }
    fn turn_pll(&mut self, on: bool) {
        if on {
            self.pll = Some(self.now_us);
        } else if !self.stuck {
            self.pll = None;
        }
    }
    fn pll_is_locked(&self) -> bool {
        let fed = self.pll_source == Source::Internal || self.reference_is_there();
        let locked = |since: u64| self.lock_us.is_some_and(|us| since + us <= self.now_us);
        self.stuck || fed && self.pll.is_some_and(locked)
    }
    fn feed_pll(&mut self, source: Source) {
        assert!(
            self.pll.is_none(),
            "the source is written while the PLL is off only"
        );
        self.pll_source = source;
    }
    fn choose_pll(&mut self) {
        self.core = Core::Pll;
    }
    fn runs_by_pll(&self) -> bool {
        self.core == Core::Pll
    }
    fn wait_us(&mut self, us: u32) {
        assert_eq!(self.core, Core::Hsi, "waits are counted by HSI");
        (0..us).for_each(|_| {
            self.tick();
        });
    }
}

const ALWAYS: (u64, u64) = (0, u64::MAX);

#[test]
fn with_its_reference_the_board_runs_by_it() {
    let mut chip = Chip::new(&[ALWAYS]);
    let plan = chip.boot();
    assert_eq!((plan.source, chip.boots), (Source::Reference, 1));
    assert!(chip.now_us < 1000, "{} us", chip.now_us);
    assert!(chip.fly(3_000_000) && chip.runs_by(Source::Reference));
}

#[test]
fn without_a_reference_it_runs_degraded_after_the_patience() {
    let mut chip = Chip::new(&[]);
    let plan = chip.boot();
    assert!(plan.is_degraded() && chip.boots == 1 && !chip.open);
    let waited_us = chip.now_us - u64::from(PATIENCE_US);
    assert!(waited_us < 1000, "{} us", chip.now_us);
    assert!(chip.fly(3_000_000) && chip.runs_by(Source::Internal));
    assert_eq!(plan.core_hz(), 480_000_000);
}

#[test]
fn a_late_reference_is_waited_for_and_one_that_is_too_late_is_not() {
    let mut chip = Chip::new(&[(2_900_000, u64::MAX)]);
    assert_eq!((chip.boot().source, chip.boots), (Source::Reference, 1));
    let mut chip = Chip::new(&[(3_100_000, u64::MAX)]);
    assert_eq!((chip.boot().source, chip.boots), (Source::Internal, 1));
    // It comes in flight, and changes nothing.
    assert!(chip.fly(2_000_000) && chip.runs_by(Source::Internal));
}

#[test]
fn a_reference_that_dies_between_choice_and_use_costs_one_boot() {
    // There for the choice, gone before the PLL has locked on it.
    let mut chip = Chip::new(&[(0, 150)]);
    let plan = chip.boot();
    assert_eq!((plan.source, chip.boots), (Source::Internal, 2));
    assert!(chip.fly(1_000_000));
}

#[test]
fn a_reference_that_dies_in_flight_leaves_the_same_program_at_the_same_rates() {
    let mut chip = Chip::new(&[(0, 5_000_000), (7_000_000, u64::MAX)]);
    assert_eq!(chip.boot().source, Source::Reference);
    assert!(chip.fly(10_000_000), "it has been reset");
    assert!(chip.runs_by(Source::Internal) && !chip.open);
}

#[test]
fn without_the_security_system_the_watchdog_ends_a_board_that_stands_still() {
    let mut chip = Chip::new(&[(0, 5_000_000)]);
    chip.boot();
    chip.security = false;
    assert!(!chip.fly(10_000_000), "nobody noticed");
    assert!(chip.boot().is_degraded());
}

#[test]
fn a_pll_that_does_not_lock_on_hsi_or_does_not_stop_is_an_error_in_bounded_time() {
    for (lock_us, stuck, error) in [
        (None, false, FallBackError::NoLock),
        (Some(100), true, FallBackError::StaysOn),
    ] {
        let mut chip = Chip::new(&[(0, 1_000_000)]);
        chip.boot();
        chip.stuck = stuck;
        chip.lock_us = lock_us;
        (chip.core, chip.pll) = (Core::Hsi, None);
        let began_us = chip.now_us;
        assert_eq!(fall_back(&mut chip), Err(error));
        assert!(chip.now_us - began_us <= 3 * u64::from(PLL_PATIENCE_US));
    }
}
