//! The choice at the start, and the way back when the reference dies in flight.

use core::fmt;

use super::{Plan, Revision, Source};

/// How long a start waits for the reference, us. A front end that makes REF in its FPGA has to load its bitstream first.
pub const PATIENCE_US: u32 = 3_000_000;
/// Between two looks, us.
const LOOK_US: u32 = 100;
/// How long the PLL may take to stop, to lock, and to take over, us. It locks within 150 (DS12110, PLL characteristics).
const PLL_PATIENCE_US: u32 = 2000;
/// Between two looks at the PLL, us.
const PLL_LOOK_US: u32 = 10;

/// The watchdog of the start, us: what follows the choice may erase two sectors of the settings' flash, four seconds each. The
/// supervisor tightens it.
pub const BOOT_WATCHDOG_US: u32 = 20_000_000;

/// What of the chip decides about its clock. Nothing here waits by itself.
pub trait Oscillators {
    /// Lets the reference in: external clock on, without a crystal.
    fn open_reference(&mut self);
    /// Shuts it out again.
    fn close_reference(&mut self);
    /// Whether it has been counted to be there.
    fn reference_is_ready(&self) -> bool;
    /// Clears the flag of a failure, so that the interrupt that cannot be masked ends.
    fn acknowledge_failure(&mut self);
    /// Turns the PLL on or off.
    fn turn_pll(&mut self, on: bool);
    /// Whether the PLL is locked; once it is off, that it is off.
    fn pll_is_locked(&self) -> bool;
    /// Feeds the PLL, which is off, from a source through its divider; everything else about it stays.
    fn feed_pll(&mut self, source: Source);
    /// Lets the core and all buses run by the PLL.
    fn choose_pll(&mut self);
    /// Whether they do.
    fn runs_by_pll(&self) -> bool;
    /// Lets time pass, us. The core runs by HSI whenever this is called.
    fn wait_us(&mut self, us: u32);
}

/// Decides how to run, on a chip that has just been reset and runs by HSI. Takes [`PATIENCE_US`] at most.
pub fn choose(oscillators: &mut impl Oscillators, revision: Revision) -> Plan {
    oscillators.open_reference();
    let there = within(oscillators, PATIENCE_US, LOOK_US, |o| o.reference_is_ready());
    if !there {
        oscillators.close_reference();
    }
    let source = if there {
        Source::Reference
    } else {
        Source::Internal
    };
    Plan { source, revision }
}

/// Why a board whose reference has died cannot run on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum FallBackError {
    /// The PLL does not stop.
    StaysOn,
    /// The PLL does not lock on HSI.
    NoLock,
    /// The core does not take the PLL's clock.
    NoSwitch,
}

impl fmt::Display for FallBackError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::StaysOn => "clock: the PLL does not stop after its reference has died",
            Self::NoLock => "clock: the PLL does not lock on the internal oscillator",
            Self::NoSwitch => "clock: the core does not take the PLL's clock",
        })
    }
}

impl core::error::Error for FallBackError {}

/// Brings the board back to its rates by HSI, after the hardware has seen the reference die and has put everything onto HSI itself.
/// Takes a few hundred microseconds, in which every timer runs slow, and 6 ms when it fails.
///
/// # Errors
/// [`FallBackError`]: nothing that counts time is right any more; leave a record and reset.
pub fn fall_back(oscillators: &mut impl Oscillators) -> Result<(), FallBackError> {
    let soon = |o: &mut _, is_so: fn(&_) -> bool| within(o, PLL_PATIENCE_US, PLL_LOOK_US, is_so);
    oscillators.acknowledge_failure();
    oscillators.close_reference();
    oscillators.turn_pll(false);
    if !soon(oscillators, |o| !o.pll_is_locked()) {
        return Err(FallBackError::StaysOn);
    }
    oscillators.feed_pll(Source::Internal);
    oscillators.turn_pll(true);
    if !soon(oscillators, |o| o.pll_is_locked()) {
        return Err(FallBackError::NoLock);
    }
    oscillators.choose_pll();
    if !soon(oscillators, |o| o.runs_by_pll()) {
        return Err(FallBackError::NoSwitch);
    }
    Ok(())
}

/// Looks until it is so, for a bounded time.
fn within<O: Oscillators>(
    oscillators: &mut O,
    patience_us: u32,
    look_us: u32,
    is_so: impl Fn(&O) -> bool,
) -> bool {
    for _ in 0..patience_us / look_us {
        if is_so(oscillators) {
            return true;
        }
        oscillators.wait_us(look_us);
    }
    is_so(oscillators)
}

#[cfg(test)]
mod tests;
