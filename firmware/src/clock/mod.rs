//! Which oscillator an STM32H743 runs by, and how fast: decided here, without a register, so that a host can test every boot.
//!
//! The board takes its clock from the front end's reference, so that the UAV clock and the converters' clock are one. Whether that
//! is there is not known when power comes on, and it may go away in flight. A board without it flies nothing, but it runs: at the
//! same rates, so that every baud rate and timer stays what it is, from the chip's own oscillator (HSI, 1 % to 2 % off), and says so.
//!
//! ```text
//! reset --> HSI, watchdog --> choose() --> reference there in time --> Plan::Reference, CSS on --> flight
//!                                 |                                                                   | it dies: NMI
//!                                 `--> not there ------------------> Plan::Internal: degraded <--- fall_back()
//! ```
//! A step that waits for the hardware is bounded; what this module does not reach (the start-up of the vendor's library) is bounded by
//! the independent watchdog, which is started before anything else.

mod boot;
mod revision;

pub use boot::{BOOT_WATCHDOG_US, FallBackError, Oscillators, PATIENCE_US, choose, fall_back};
pub use revision::Revision;

/// What feeds the PLL.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Source {
    /// The front end's reference at OSC_IN, 8 MHz: the clock of the converters.
    Reference,
    /// The chip's own oscillator (HSI), 64 MHz.
    Internal,
}

/// Rate at which the PLL compares, Hz: the same from either source, so that all behind it is the same too.
pub const PLL_INPUT_HZ: u32 = 4_000_000;

impl Source {
    /// Its rate, Hz.
    #[must_use]
    pub const fn hz(self) -> u32 {
        match self {
            Self::Reference => 8_000_000,
            Self::Internal => 64_000_000,
        }
    }

    /// What the PLL divides it by (DIVM1).
    #[must_use]
    pub const fn divider(self) -> u32 {
        self.hz() / PLL_INPUT_HZ
    }
}

/// How the board is to run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Plan {
    /// What feeds the PLL.
    pub source: Source,
    /// Which chip it is.
    pub revision: Revision,
}

impl Plan {
    /// Clock of the core, Hz: 480 or 400 MHz, by the revision. Buses and timers run at half of it, peripherals at a quarter.
    #[must_use]
    pub const fn core_hz(self) -> u32 {
        self.revision.core_hz()
    }

    /// Clock of the timers, Hz.
    #[must_use]
    pub const fn timer_hz(self) -> u32 {
        self.core_hz() / 2
    }

    /// What the PLL multiplies [`PLL_INPUT_HZ`] by (N): its oscillator runs at twice the core's clock.
    #[must_use]
    pub const fn multiplier(self) -> u32 {
        2 * self.core_hz() / PLL_INPUT_HZ
    }

    /// Whether time by this clock is not the front end's: no sweep and no two-way exchange can be used.
    #[must_use]
    pub const fn is_degraded(self) -> bool {
        matches!(self.source, Source::Internal)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn either_source_gives_the_same_rates() {
        for (code, core_hz) in [(0x2003_6450, 480_000_000), (0x1003_6450, 400_000_000)] {
            let revision = Revision::from_id_code(code);
            for source in [Source::Reference, Source::Internal] {
                let plan = Plan { source, revision };
                assert_eq!(source.hz() / source.divider() * plan.multiplier() / 2, core_hz);
                // The UAV clock and the time driver want whole prescalers.
                assert_eq!(plan.timer_hz() % 10_000_000, 0);
                assert_eq!(plan.is_degraded(), source == Source::Internal);
            }
        }
    }
}
