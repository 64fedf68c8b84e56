//! The chip's revision and what it may be clocked at.

use core::fmt;

/// DEV_ID of STM32H742, H743, H750 and H753 (RM0433, DBGMCU_IDC).
const DEVICE: u32 = 0x450;

/// Revision of the chip, by REV_ID of DBGMCU_IDC (RM0433 section 60.5.8).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Revision {
    /// 0x1001.
    Z,
    /// 0x1003: 400 MHz at VOS1; it has no VOS0.
    Y,
    /// 0x2001.
    X,
    /// 0x2003: 480 MHz at VOS0.
    V,
    /// Another one, or another chip: the register as it was read.
    Unknown(u32),
}

impl Revision {
    /// The revision by the register DBGMCU_IDC.
    #[must_use]
    pub const fn from_id_code(code: u32) -> Self {
        match (code & 0xfff, code >> 16) {
            (DEVICE, 0x1001) => Self::Z,
            (DEVICE, 0x1003) => Self::Y,
            (DEVICE, 0x2001) => Self::X,
            (DEVICE, 0x2003) => Self::V,
            _ => Self::Unknown(code),
        }
    }

    /// Highest clock of the core, Hz. 480 MHz only where the data sheet promises it (DS12110, revision V); a chip that is not known
    /// runs by the lower limit, which holds for all of them.
    #[must_use]
    pub const fn core_hz(self) -> u32 {
        match self {
            Self::V => 480_000_000,
            Self::Z | Self::Y | Self::X | Self::Unknown(_) => 400_000_000,
        }
    }
}

impl fmt::Display for Revision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Z => f.write_str("Z"),
            Self::Y => f.write_str("Y"),
            Self::X => f.write_str("X"),
            Self::V => f.write_str("V"),
            Self::Unknown(code) => write!(f, "unknown ({code:#010x})"),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;

    use std::string::ToString;

    use super::*;

    #[test]
    fn only_revision_v_runs_at_480_mhz() {
        let cases = [
            (0x1001_6450, "Z", 400),
            (0x1003_6450, "Y", 400),
            (0x2001_6450, "X", 400),
            (0x2003_6450, "V", 480),
            // A later one, another chip of the line, and a register that reads nothing.
            (0x3003_6450, "unknown (0x30036450)", 400),
            (0x2003_6480, "unknown (0x20036480)", 400),
            (0, "unknown (0x00000000)", 400),
        ];
        for (code, name, mhz) in cases {
            let revision = Revision::from_id_code(code);
            assert_eq!(revision.to_string(), name);
            assert_eq!(revision.core_hz(), mhz * 1_000_000, "{name}");
        }
    }
}
