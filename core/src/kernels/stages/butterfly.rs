//! The butterflies that the stages are made of, each with its scale and its rounding.

use super::{Pass, Twiddles};
use crate::kernels::Iq;

/// Four-point transform of scale 1/4.
pub(super) fn even_half([s0, s1, s2, s3]: [Iq; 4]) -> [Iq; 4] {
    let (t, a) = (s0.halving_add(s2), s0.halving_sub(s2));
    let (b, d) = (s1.halving_add(s3), s1.halving_sub(s3));
    [
        t.halving_add(b),
        a.halving_sub_j(d),
        t.halving_sub(b),
        a.halving_add_j(d),
    ]
}

/// Twiddled four-point transform, scale 1/2.
#[cfg_attr(not(dsp_kernels), inline(always))]
pub(super) fn butterfly(x: [Iq; 4], w: &Twiddles, pass: &mut Pass) -> [Iq; 4] {
    let y0 = x[0].half();
    let y1 = x[1].half_product(w[0]);
    let y2 = x[2].half_product(w[1]);
    let y3 = x[3].half_product(w[2]);
    let (t, a) = (
        y0.saturating_add(y2, &mut pass.clips),
        y0.saturating_sub(y2, &mut pass.clips),
    );
    let (b, d) = (
        y1.saturating_add(y3, &mut pass.clips),
        y1.saturating_sub(y3, &mut pass.clips),
    );
    let results = [
        t.saturating_add(b, &mut pass.clips),
        a.saturating_sub_j(d, &mut pass.clips),
        t.saturating_sub(b, &mut pass.clips),
        a.saturating_add_j(d, &mut pass.clips),
    ];
    pass.watch(results)
}

/// Inverse four-point transform, then the conjugate twiddles, scale 1/2.
#[cfg_attr(not(dsp_kernels), inline(always))]
pub(super) fn inverse_butterfly(z: [Iq; 4], w: &Twiddles, pass: &mut Pass) -> [Iq; 4] {
    let [z0, z1, z2, z3] = z;
    let (t, a) = (
        z0.saturating_add(z2, &mut pass.clips),
        z0.saturating_sub(z2, &mut pass.clips),
    );
    let (b, d) = (
        z1.saturating_add(z3, &mut pass.clips),
        z1.saturating_sub(z3, &mut pass.clips),
    );
    inverse_tail([t, a, b, d], w, pass)
}

/// As [`inverse_butterfly`], scale 1/4: the first sums halve.
#[cfg_attr(not(dsp_kernels), inline(always))]
pub(super) fn inverse_butterfly_halved(z: [Iq; 4], w: &Twiddles, pass: &mut Pass) -> [Iq; 4] {
    let [z0, z1, z2, z3] = z;
    let (t, a) = (z0.halving_add(z2), z0.halving_sub(z2));
    let (b, d) = (z1.halving_add(z3), z1.halving_sub(z3));
    inverse_tail([t, a, b, d], w, pass)
}

/// Second half of an inverse butterfly.
#[cfg_attr(not(dsp_kernels), inline(always))]
pub(super) fn inverse_tail([t, a, b, d]: [Iq; 4], w: &Twiddles, pass: &mut Pass) -> [Iq; 4] {
    let sums = [
        t.saturating_add(b, &mut pass.clips),
        a.saturating_add_j(d, &mut pass.clips),
        t.saturating_sub(b, &mut pass.clips),
        a.saturating_sub_j(d, &mut pass.clips),
    ];
    let [o0, o1, o2, o3] = pass.watch(sums);
    [
        o0.half(),
        o1.half_product_conj(w[0]),
        o2.half_product_conj(w[1]),
        o3.half_product_conj(w[2]),
    ]
}

/// Four-point inverse transform of scale 1/2.
pub(super) fn inverse_half([y0, y1, y2, y3]: [Iq; 4]) -> [Iq; 4] {
    let unbounded = &mut 0;
    let (t, a) = (y0.halving_add(y2), y0.halving_sub(y2));
    let (b, d) = (y1.halving_add(y3), y1.halving_sub(y3));
    [
        t.saturating_add(b, unbounded),
        a.saturating_add_j(d, unbounded),
        t.saturating_sub(b, unbounded),
        a.saturating_sub_j(d, unbounded),
    ]
}
