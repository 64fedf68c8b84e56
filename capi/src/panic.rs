//! A panic on a chip. The receiver has none that can be reached; who wraps it must be able to say what happens all the same.

use core::panic::PanicInfo;

unsafe extern "C" {
    /// The application's: must not come back.
    fn cslam_panic() -> !;
}

#[panic_handler]
fn panic(_info: &PanicInfo<'_>) -> ! {
    // SAFETY: the application defines it with this signature (cslam.h); it takes nothing and does not return.
    unsafe { cslam_panic() }
}
