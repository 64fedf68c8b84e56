//! Regions of the memory protection unit of an Armv7-M processor: what may be touched, and how.
//!
//! A board names all memory that its program uses, and turns the default map behind the regions off. An access to anything else is
//! then a fault at once, where it is made: below the stack, at address 0, in memory that is not fitted, and nothing is fetched ahead
//! from there.

/// What a region holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Code and constants: read and executed, never written; write-through.
    Code,
    /// Data: never executed; write-back.
    Data,
    /// Data that a DMA shares, or flash that is written: never executed, not cached.
    Uncached,
    /// Registers: never executed, in order.
    Device,
}

/// A region. Where two overlap, the later one in a board's list holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Region {
    /// First address; a multiple of the size.
    pub base: u32,
    /// Logarithm of the size to base 2: 5..=32.
    pub log2_size: u32,
    /// What it holds.
    pub kind: Kind,
}

impl Region {
    /// A region; does not compile, in a constant, when it is not aligned to its size.
    #[must_use]
    pub const fn new(base: u32, log2_size: u32, kind: Kind) -> Self {
        assert!(
            log2_size >= 5 && log2_size <= 32,
            "a region has 32 bytes to 4 GiB"
        );
        assert!(
            base.trailing_zeros() >= log2_size || base == 0,
            "a region begins at a multiple of its size"
        );
        Self {
            base,
            log2_size,
            kind,
        }
    }

    /// Attributes and size as the register RASR takes them (Armv7-M, B3.5.9), region on.
    #[must_use]
    pub const fn attributes(&self) -> u32 {
        const NEVER_EXECUTED: u32 = 1 << 28;
        const READ_WRITE: u32 = 0b011 << 24;
        const READ_ONLY: u32 = 0b110 << 24;
        const TEX_1: u32 = 1 << 19;
        const SHARED: u32 = 1 << 18;
        const CACHED: u32 = 1 << 17;
        const BUFFERED: u32 = 1 << 16;
        let attributes = match self.kind {
            Kind::Code => READ_ONLY | CACHED,
            Kind::Data => NEVER_EXECUTED | READ_WRITE | TEX_1 | CACHED | BUFFERED,
            Kind::Uncached => NEVER_EXECUTED | READ_WRITE | TEX_1 | SHARED,
            Kind::Device => NEVER_EXECUTED | READ_WRITE | SHARED | BUFFERED,
        };
        attributes | (self.log2_size - 1) << 1 | 1
    }

    /// Whether an address lies in it.
    #[must_use]
    pub const fn holds(&self, address: u32) -> bool {
        address >= self.base && (address - self.base) as u64 >> self.log2_size == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn registers_hold_what_the_manual_says() {
        let attributes = |kind| Region::new(0x2000_0000, 17, kind).attributes();
        // Size 16 stands for 128 KiB.
        assert_eq!(attributes(Kind::Code), 0x0602_0021);
        assert_eq!(attributes(Kind::Data), 0x130b_0021);
        assert_eq!(attributes(Kind::Uncached), 0x130c_0021);
        assert_eq!(attributes(Kind::Device), 0x1305_0021);
    }

    #[test]
    fn a_region_holds_its_addresses_and_no_others() {
        let stack = Region::new(0x2000_0000, 17, Kind::Data);
        assert!(stack.holds(0x2000_0000) && stack.holds(0x2001_ffff));
        assert!(!stack.holds(0x1fff_ffff) && !stack.holds(0x2002_0000));
        assert!(Region::new(0, 32, Kind::Data).holds(u32::MAX));
    }

    #[test]
    #[should_panic(expected = "multiple of its size")]
    fn a_region_that_is_not_aligned_is_refused() {
        let _region = Region::new(0x2000_8000, 17, Kind::Data);
    }
}
