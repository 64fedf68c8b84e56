//! Delays are cyclic: the length of a way is known but for whole delay periods.

use super::SAMPLES;
use crate::constants::SPEED_OF_LIGHT_M_PER_S;

/// Length after which delays repeat, m.
/// Given: 512 samples at 245.76 Msps, times the speed of light (docs/signal-model.md, "Default configuration").
pub const DELAY_PERIOD_M: f64 = SPEED_OF_LIGHT_M_PER_S * SAMPLES as f64 / 245.76e6;

/// A length wrapped to half a delay period on either side of zero, m.
// Rounding down takes 180 bytes, and there are thirty callers.
#[inline(never)]
pub fn wrap_delay_m(length_m: f64) -> f64 {
    length_m - DELAY_PERIOD_M * libm::floor(length_m / DELAY_PERIOD_M + 0.5)
}
