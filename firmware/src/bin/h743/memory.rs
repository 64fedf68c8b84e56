//! Where things lie, and what the caches may do with it.
//!
//! | memory | holds | cache |
//! |---|---|---|
//! | flash bank 1 | code, constants | instructions and constants |
//! | flash bank 2, last two sectors | settings | none (MPU) |
//! | DTCM | stack; at its top the fault record | needs none |
//! | AXI SRAM | all static data: the receiver | write-back |
//! | SRAM1 + SRAM2 | three buffers of frames, written by DMA | write-back, thrown away around each DMA |
//! | SRAM3 | buffers of the small DMAs: both SPIs, I2C, UART | none (MPU) |
//!
//! What is not in this table may not be touched: the MPU has no background region.
//!
//! Code runs from flash: the kernels' loops fit the instruction cache, and what interrupts them is short. ITCM stays free.

use core::mem::MaybeUninit;
use core::slice;

use cortex_m::peripheral::{CPUID, MPU, SCB};
use cslam_firmware::front_end::{Block, FRAME_LENGTH, HEADER_LENGTH};
use cslam_firmware::mpu::{Kind, Region};
use embassy_stm32::pac;

use crate::protect::protect;

/// Buffers of frames: one that the DMA fills, one that is worked on, one between them.
pub(crate) const FRAMES: usize = 3;
/// Words of a frame.
const FRAME_WORDS: usize = FRAME_LENGTH / 4;

/// A frame as the DMA writes it. A whole number of cache lines that begins on one, so that throwing lines away touches nothing
/// else.
#[repr(C, align(32))]
pub(crate) struct FrameBuffer {
    pub(crate) header: [u8; HEADER_LENGTH],
    pub(crate) samples: Block,
}

const _: () = assert!(size_of::<FrameBuffer>() == FRAME_LENGTH && FRAME_LENGTH.is_multiple_of(32));

impl FrameBuffer {
    /// The buffer as the DMA sees it.
    pub(crate) fn words(&mut self) -> &mut [u32] {
        // SAFETY: the buffer is FRAME_WORDS words long (asserted above), aligned to 32 bytes, has no padding, and every bit pattern is a
        // value of it; the borrow of the whole ends with that of the words.
        unsafe { slice::from_raw_parts_mut((&raw mut *self).cast::<u32>(), FRAME_WORDS) }
    }

    /// Throws away what the cache holds of the buffer: before the DMA writes, so that no old line is written back over the
    /// new frame, and after it, since the processor may have fetched lines on its own account.
    pub(crate) fn forget_cached(&mut self, scb: &mut SCB) {
        // SAFETY: the buffer is whole cache lines, so nothing else loses what was written to it, and what the buffer itself loses is about to
        // be, or has just been, overwritten by the DMA.
        unsafe { scb.invalidate_dcache_by_address(&raw const *self as usize, size_of::<Self>()) };
    }
}

/// All that the program touches, but for the processor's own registers. There is nothing below the DTCM, at address 0 or anywhere
/// else: a stack that is too deep, or a wild pointer, is a fault at its first access.
const REGIONS: [Region; 7] = [
    Region::new(0x0800_0000, 21, Kind::Code),
    // Two sectors of it are written.
    Region::new(crate::flash::BASE, 18, Kind::Uncached),
    Region::new(0x2000_0000, 17, Kind::Data),
    Region::new(0x2400_0000, 19, Kind::Data),
    Region::new(0x3000_0000, 18, Kind::Data),
    Region::new(0x3004_0000, 15, Kind::Uncached),
    // All peripherals, the chip's debug unit with its revision among them.
    Region::new(0x4000_0000, 29, Kind::Device),
];

/// Turns the memories on, sets up MPU and caches. Call it once, before anything uses SRAM1 to SRAM3.
pub(crate) fn set_up(mpu: &mut MPU, scb: &mut SCB, cpuid: &mut CPUID) {
    // The memories of that bus have clocks of their own, which are off after a reset.
    pac::RCC.ahb2enr().modify(|w| {
        w.set_sram1en(true);
        w.set_sram2en(true);
        w.set_sram3en(true);
    });
    // SAFETY: the regions are all that memory.x gives to the program, and the peripherals; code and constants in flash are only read, and
    // written are the settings' sectors alone. The caches are off still.
    unsafe { protect(mpu, &REGIONS) };
    scb.enable_icache();
    scb.enable_dcache(cpuid);
}

/// The buffers of frames.
///
/// # Safety
/// Call it once.
pub(crate) unsafe fn frames() -> &'static mut [FrameBuffer; FRAMES] {
    #[unsafe(link_section = ".sram12")]
    static mut BUFFERS: MaybeUninit<[FrameBuffer; FRAMES]> = MaybeUninit::uninit();
    // SAFETY: the only reference, by the caller's promise; zeros are a value of plain integers.
    unsafe {
        let place = &raw mut BUFFERS;
        place.write_bytes(0, 1);
        (*place).assume_init_mut()
    }
}

/// A place in SRAM3 for a value through which a DMA goes. Only for the one static that the macro makes.
macro_rules! in_sram3 {
    ($type:ty = $value:expr) => {{
        #[unsafe(link_section = ".sram3")]
        static mut PLACE: core::mem::MaybeUninit<$type> = core::mem::MaybeUninit::uninit();
        // SAFETY: whoever uses the macro does so in code that runs once, so this is the only reference. The value is written before it is
        // read: the section is not initialised.
        unsafe { (*(&raw mut PLACE)).write($value) }
    }};
}
pub(crate) use in_sram3;
