//! What passes a screen, by the knife edge of 3GPP TR 38.901, 7.6.4.2 (blockage model B).
//!
//! An edge takes `F = atan(+-(pi/2) sqrt((pi/lambda) (D1 + D2 - r)))/pi` of the amplitude, D1 and D2 from the ends to the edge and r from
//! end to end; plus where the edge lies beyond the straight line, as both edges of a screen in the way do. A screen of two pairs
//! of edges leaves `1 - (F_h1 + F_h2)(F_w1 + F_w2)`; an opening of the same shape leaves the product itself.

use core::f64::consts::{FRAC_PI_2, PI};

/// F of an edge so far off a straight line, m, at distances along it from both ends, m; negative unless the line passes inside.
pub(super) fn edge(off_m: f64, inside: bool, ends_m: [f64; 2], wavelength_m: f64) -> f64 {
    let detour_m = detour_m(off_m, ends_m);
    let share = libm::atan(FRAC_PI_2 * (PI / wavelength_m * detour_m).sqrt()) / PI;
    if inside { share } else { -share }
}

/// F of the two edges of a strip across a straight line, 0 to 1: the strip reaches from one distance to another (signed, m), at
/// distances from both ends along the line, m.
pub(super) fn strip([low_m, high_m]: [f64; 2], ends_m: [f64; 2], wavelength_m: f64) -> f64 {
    edge(low_m, low_m < 0.0, ends_m, wavelength_m) + edge(high_m, high_m > 0.0, ends_m, wavelength_m)
}

/// How much longer the way is by a point off a straight line, at distances from its ends along it, m. Without cancellation.
fn detour_m(off_m: f64, ends_m: [f64; 2]) -> f64 {
    let of_end = |along_m: f64| match (along_m * along_m + off_m * off_m).sqrt() + along_m {
        0.0 => 0.0,
        sum => off_m * off_m / sum,
    };
    ends_m.map(of_end).iter().sum()
}
