//! UART1, a CMSDK APB UART (Arm DDI 0479, section 4.3): the downlink.

use core::convert::Infallible;
use core::ptr;

use embedded_io::{ErrorType, Write};

/// UART1 of the board (Arm AN500, memory map), and its registers.
const BASE: usize = 0x4000_5000;
const DATA: usize = BASE;
const STATE: usize = BASE + 0x04;
const CONTROL: usize = BASE + 0x08;
const BAUD_DIVIDER: usize = BASE + 0x10;

const STATE_TX_FULL: u32 = 1;
const CONTROL_TX_ENABLE: u32 = 1;

/// Clock of the peripheral bus, Hz, and what a telemetry radio expects, baud.
const CLOCK_HZ: u32 = 25_000_000;
const BAUD: u32 = 57_600;

/// The transmitter of UART1.
pub(crate) struct Downlink(());

impl Downlink {
    /// Turns the transmitter on. Call it once: a second one would write between the bytes of the first.
    pub(crate) fn enable() -> Self {
        store(BAUD_DIVIDER, CLOCK_HZ / BAUD);
        store(CONTROL, CONTROL_TX_ENABLE);
        Self(())
    }
}

impl ErrorType for Downlink {
    type Error = Infallible;
}

impl Write for Downlink {
    fn write(&mut self, bytes: &[u8]) -> Result<usize, Infallible> {
        for byte in bytes {
            while load(STATE) & STATE_TX_FULL != 0 {}
            store(DATA, u32::from(*byte));
        }
        Ok(bytes.len())
    }

    /// Waits until the transmitter has taken the last byte.
    fn flush(&mut self) -> Result<(), Infallible> {
        while load(STATE) & STATE_TX_FULL != 0 {}
        Ok(())
    }
}

fn load(register: usize) -> u32 {
    // SAFETY: private; called with the constants above only, which are aligned 32-bit registers of a peripheral that is
    // always clocked. Reading STATE changes nothing.
    unsafe { ptr::read_volatile(register as *const u32) }
}

fn store(register: usize, value: u32) {
    // SAFETY: as in `load`; the registers take any value, and none of them makes the hardware touch memory.
    unsafe { ptr::write_volatile(register as *mut u32, value) }
}
