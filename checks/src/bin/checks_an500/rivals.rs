//! The same layers by another `no_std` library, embedded-nn, as its users call it: int8 weights, per-channel scales.

use core::hint::black_box;

use embedded_nn::fully_connected::fully_connected_per_channel_s8;
use embedded_nn::types::{Activation, Dims, FcParams, PerChannelQuantParams};

use crate::measure::report;

const PARAMETERS: FcParams = FcParams {
    input_offset: 0,
    filter_offset: 0,
    output_offset: 0,
    activation: Activation { min: 0, max: 127 },
};

/// Counts its layers of both networks.
pub(super) fn count() {
    for (inputs, outputs, name) in [
        (23, 48, "embedded-nn 0.2.3, 23x48"),
        (48, 32, "embedded-nn 0.2.3, 48x32"),
        (32, 3, "embedded-nn 0.2.3, 32x3"),
        (3, 10, "embedded-nn 0.2.3, 3x10"),
        (34, 50, "embedded-nn 0.2.3, 34x50"),
        (50, 100, "embedded-nn 0.2.3, 50x100"),
        (100, 3, "embedded-nn 0.2.3, 100x3"),
    ] {
        report("", name, || layer(black_box(inputs), black_box(outputs)));
    }
}

/// One layer on zeros: the count does not depend on the numbers.
fn layer(inputs: usize, outputs: usize) {
    let (weights, input, mut output) = ([0_i8; 64 * 80], [0_i8; 100], [0_i8; 100]);
    let (biases, multipliers, shifts) = ([0_i32; 100], [1 << 30; 100], [-6; 100]);
    let dims = |n: usize, c: usize| Dims {
        n: n as i32,
        h: 1,
        w: 1,
        c: c as i32,
    };
    let scales = PerChannelQuantParams {
        multiplier: black_box(&multipliers),
        shift: black_box(&shifts),
    };
    let done = fully_connected_per_channel_s8(
        &PARAMETERS,
        &scales,
        &dims(1, inputs),
        black_box(&input),
        &dims(inputs, outputs),
        black_box(&weights),
        Some(black_box(&biases)),
        &dims(1, outputs),
        black_box(&mut output),
    );
    black_box((done.is_ok(), output));
}
