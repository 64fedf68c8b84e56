//! The path estimator as a whole: its memory.

use core::mem::size_of;

use cslam_core::ltd::{Estimator, Iq};

/// One receiver of the default configuration: 4 arrays of 8, 72 beams, nine paths.
type Receiver = Estimator<4, 8, 32, 72, 3, 8, 8, 360, 9>;

#[test]
fn the_whole_state_fits_its_budget() {
    // Path estimation works in the block's own memory, so one block belongs to it.
    let (state, block) = (size_of::<Receiver>(), size_of::<[[Iq; 512]; 32]>());
    println!(
        "estimator {state} bytes, block {block} bytes, together {}",
        state + block
    );
    assert_eq!(block, 64 * 1024);
    assert!(state + block <= 300 * 1024, "{} bytes", state + block);
}
