//! What a program leaves behind when it ends itself: written to memory that a reset does not clear, read and cleared by the
//! next start, told to the ground.
//!
//! The memory holds anything after power-on, so a record has a magic number and a checksum. Where it lies is the board's business; it
//! must not be cached, or be written back before the reset.

use core::fmt;

use cslam_core::telemetry::{self, ResetCause};

use crate::front_end::SoftwareCrc;

/// Words of a record.
pub const WORDS: usize = 8;

const MAGIC: u32 = u32::from_le_bytes(*b"CSFR");

/// Why a program ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// A panic: the program found itself in a state that cannot be.
    Panic,
    /// A fault of the processor.
    HardFault,
    /// A task made no progress; the supervisor ended the program.
    Hang,
    /// The stack was too small: the fault is that of the first access below it.
    StackOverflow,
    /// The reference clock died, and the board could not be brought to run by another one.
    Clock,
}

/// The stack, as a fault has left it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultStack {
    /// Lowest address of the stack.
    pub bottom: u32,
    /// Stack pointer after the processor has pushed its frame, or has tried to.
    pub pointer: u32,
}

/// Bits of CFSR: pushing the frame of an exception has failed, by the memory protection (MSTKERR, MLSPERR) or on the bus (STKERR,
/// LSPERR).
const PUSHING_FAILED: u32 = 1 << 4 | 1 << 5 | 1 << 12 | 1 << 13;
/// Bits of CFSR: the address of the fault is known, by the memory protection (MMARVALID) or on the bus (BFARVALID).
const ADDRESS_KNOWN: [u32; 2] = [1 << 7, 1 << 15];
/// An access so far below the stack is one of a frame that did not fit, bytes.
const BELOW: u32 = 64 * 1024;

impl FaultStack {
    /// Whether the frame that the processor pushes lies in the stack and was pushed.
    #[must_use]
    pub const fn holds_frame(&self, status: u32) -> bool {
        self.pointer >= self.bottom && status & PUSHING_FAILED == 0
    }

    /// Why a fault came about: `status` is CFSR, `addresses` are MMFAR and BFAR.
    #[must_use]
    pub fn cause(&self, status: u32, addresses: [u32; 2]) -> Cause {
        let below = |(address, known): (u32, u32)| {
            status & known != 0 && (self.bottom.saturating_sub(BELOW)..self.bottom).contains(&address)
        };
        let overflowed = !self.holds_frame(status) || addresses.into_iter().zip(ADDRESS_KNOWN).any(below);
        if overflowed {
            Cause::StackOverflow
        } else {
            Cause::HardFault
        }
    }
}

/// What is left behind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct FaultRecord {
    /// Why.
    pub cause: Cause,
    /// Program counter of a fault, else 0.
    pub program_counter: u32,
    /// Link register of a fault, else 0.
    pub link_register: u32,
    /// Status of a fault as the processor gives it (CFSR), else 0.
    pub status: u32,
    /// Stage that was at work, or task that hung, by the board's list.
    pub stage: u8,
    /// How long the program had run, ms.
    pub uptime_ms: u32,
}

impl FaultRecord {
    /// The record as it is left behind.
    #[must_use]
    pub fn to_words(&self) -> [u32; WORDS] {
        let cause = match self.cause {
            Cause::Panic => 1,
            Cause::HardFault => 2,
            Cause::Hang => 3,
            Cause::StackOverflow => 4,
            Cause::Clock => 5,
        };
        let content = [
            MAGIC,
            cause | u32::from(self.stage) << 8,
            self.program_counter,
            self.link_register,
            self.status,
            self.uptime_ms,
            0,
        ];
        let [a, b, c, d, e, f, g] = content;
        [a, b, c, d, e, f, g, checksum(&content)]
    }

    /// What the chip began from, as the ground is told.
    #[must_use]
    pub fn reset_cause(&self) -> ResetCause {
        match self.cause {
            Cause::Panic => ResetCause::Panic,
            Cause::HardFault | Cause::StackOverflow | Cause::Clock => ResetCause::Fault,
            Cause::Hang => ResetCause::Watchdog,
        }
    }

    /// The record as the ground is told.
    #[must_use]
    pub fn report(&self) -> telemetry::FaultRecord {
        telemetry::FaultRecord {
            cause: self.reset_cause(),
            program_counter: self.program_counter,
            link_register: self.link_register,
            stage: self.stage,
            uptime_ms: self.uptime_ms,
        }
    }

    /// The record that was left behind, if there is one. Clear the memory then, or the next start finds it again.
    #[must_use]
    pub fn from_words(words: &[u32; WORDS]) -> Option<Self> {
        let [content @ .., found] = words;
        let &[MAGIC, kind, program_counter, link_register, status, uptime_ms, 0] = content else {
            return None;
        };
        let [cause, stage, 0, 0] = kind.to_le_bytes() else {
            return None;
        };
        let cause = match cause {
            1 => Cause::Panic,
            2 => Cause::HardFault,
            3 => Cause::Hang,
            4 => Cause::StackOverflow,
            5 => Cause::Clock,
            _ => return None,
        };
        (checksum(content) == *found).then_some(Self {
            cause,
            program_counter,
            link_register,
            status,
            stage,
            uptime_ms,
        })
    }
}

fn checksum(content: &[u32; WORDS - 1]) -> u32 {
    SoftwareCrc.bytes(content.map(u32::to_le_bytes).as_flattened())
}

impl fmt::Display for FaultRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            program_counter: pc,
            link_register: lr,
            ..
        } = self;
        match self.cause {
            Cause::Panic => f.write_str("a panic")?,
            Cause::HardFault => write!(
                f,
                "a fault ({:#010x}) at {pc:#010x}, called from {lr:#010x}",
                self.status
            )?,
            Cause::Hang => f.write_str("a task without progress")?,
            // Where, the processor could not say: there was no room to.
            Cause::StackOverflow => write!(f, "the stack overflowed ({:#010x})", self.status)?,
            Cause::Clock => f.write_str("the reference clock died and no other would do")?,
        }
        write!(
            f,
            " in stage {} after {}.{:03} s",
            self.stage,
            self.uptime_ms / 1000,
            self.uptime_ms % 1000
        )
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    const RECORD: FaultRecord = FaultRecord {
        cause: Cause::HardFault,
        program_counter: 0x0800_1234,
        link_register: 0x0800_4321,
        status: 0x8200,
        stage: 5,
        uptime_ms: 61_007,
    };

    #[test]
    fn it_survives_whatever_the_cause() {
        for cause in [
            Cause::Panic,
            Cause::HardFault,
            Cause::Hang,
            Cause::StackOverflow,
            Cause::Clock,
        ] {
            let record = FaultRecord { cause, ..RECORD };
            assert_eq!(FaultRecord::from_words(&record.to_words()), Some(record));
        }
        assert_eq!(
            RECORD.to_string(),
            "a fault (0x00008200) at 0x08001234, called from 0x08004321 in stage 5 after 61.007 s"
        );
    }

    #[test]
    fn a_stack_that_was_too_small_is_told_from_other_faults() {
        let at = |pointer| FaultStack {
            bottom: 0x2000_0000,
            pointer,
        };
        let deep = at(0x2000_4000);
        // An undefined instruction; a division; an access to address 0, and far below the stack.
        assert_eq!(deep.cause(1 << 16, [0; 2]), Cause::HardFault);
        assert_eq!(deep.cause(1 << 25, [0x1fff_fff0; 2]), Cause::HardFault);
        assert_eq!(deep.cause(1 << 1 | 1 << 7, [0, 0]), Cause::HardFault);
        assert_eq!(deep.cause(1 << 1 | 1 << 7, [0x1ff0_0000, 0]), Cause::HardFault);
        // The first access of a function whose frame does not fit, seen by the memory protection or on the bus.
        assert_eq!(
            deep.cause(1 << 1 | 1 << 7, [0x1fff_fff0, 0]),
            Cause::StackOverflow
        );
        assert_eq!(
            deep.cause(1 << 9 | 1 << 15, [0, 0x1fff_fff0]),
            Cause::StackOverflow
        );
        // There was no room for the frame of the exception itself.
        for status in [1 << 4, 1 << 12] {
            assert!(!deep.holds_frame(status));
            assert_eq!(deep.cause(status, [0; 2]), Cause::StackOverflow);
        }
        let below = at(0x1fff_ffe0);
        assert!(!below.holds_frame(0));
        assert_eq!(below.cause(1 << 16, [0; 2]), Cause::StackOverflow);
    }

    #[test]
    fn memory_that_holds_anything_is_no_record() {
        assert_eq!(FaultRecord::from_words(&[0; WORDS]), None);
        assert_eq!(FaultRecord::from_words(&[u32::MAX; WORDS]), None);
        for bit in 0..32 * WORDS {
            let mut words = RECORD.to_words();
            words[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(FaultRecord::from_words(&words), None, "bit {bit}");
        }
    }
}
