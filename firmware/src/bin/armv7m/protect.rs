//! Turns the memory protection on.

use cortex_m::peripheral::MPU;
use cslam_firmware::mpu::Region;

/// Nothing but these regions may be touched from now on, but for the processor's own registers; where they overlap the later one holds.
/// In a fault's handler and in an interrupt that cannot be masked the protection is off.
///
/// # Safety
/// The regions must hold all that the program touches, with no more access taken away than it can do without, and nothing that a region
/// does not cache may be in a cache yet.
pub(crate) unsafe fn protect(mpu: &mut MPU, regions: &[Region]) {
    cortex_m::asm::dmb();
    // SAFETY: off while its regions are written; the caller vouches for what they say.
    unsafe {
        mpu.ctrl.write(0);
        for (number, region) in (0u32..).zip(regions) {
            mpu.rnr.write(number);
            mpu.rbar.write(region.base);
            mpu.rasr.write(region.attributes());
        }
        // On (bit 0); PRIVDEFENA, the default map behind the regions, stays off.
        mpu.ctrl.write(1);
    }
    cortex_m::asm::dsb();
    cortex_m::asm::isb();
}
