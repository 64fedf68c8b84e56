//! Samples side by side, in the widest lanes that the processor has.
//!
//! Every sample has its own sums, over the rays in their order, and no product is fused with a sum. So lanes of any width give the same bits, and
//! which are taken can be asked of the processor.

use pulp::{Arch, Simd, WithSimd};

/// Elements handled at a time: their sums stay in registers, and a wave is read once for all of them.
const ELEMENTS_AT_ONCE: usize = 4;

/// Does some work in the widest lanes: work that is written in lanes, or a closure, of whose loops the compiler makes what it can. What either calls
/// must be inlined into it.
#[inline(always)]
pub(super) fn in_widest_lanes<W: WithSimd>(work: W) -> W::Output {
    Arch::new().dispatch(work)
}

/// `a b`, real and imaginary parts.
#[inline(always)]
pub(super) fn product<S: Simd>(simd: S, a: [f32; 2], [b_re, b_im]: [S::f32s; 2]) -> [S::f32s; 2] {
    let (a_re, a_im) = (simd.splat_f32s(a[0]), simd.splat_f32s(a[1]));
    [
        simd.sub_f32s(simd.mul_f32s(a_re, b_re), simd.mul_f32s(a_im, b_im)),
        simd.add_f32s(simd.mul_f32s(a_re, b_im), simd.mul_f32s(a_im, b_re)),
    ]
}

/// `a + b`, real and imaginary parts.
#[inline(always)]
pub(super) fn sum<S: Simd>(simd: S, [a_re, a_im]: [S::f32s; 2], [b_re, b_im]: [S::f32s; 2]) -> [S::f32s; 2] {
    [simd.add_f32s(a_re, b_re), simd.add_f32s(a_im, b_im)]
}

/// What each element of an array hears of rays, `sum_l steering[l][i] wave[l]`: `hear` takes it, element by element.
#[inline(always)]
pub(super) fn add_up<'r, S: Simd, const ELEMENTS: usize>(
    simd: S,
    rays: impl Iterator<Item = (&'r [[f32; 2]; ELEMENTS], [S::f32s; 2])> + Clone,
    mut hear: impl FnMut(usize, [S::f32s; 2]),
) {
    let whole = ELEMENTS - ELEMENTS % ELEMENTS_AT_ONCE;
    for first in (0..whole).step_by(ELEMENTS_AT_ONCE) {
        let sums: [_; ELEMENTS_AT_ONCE] = sums(simd, rays.clone(), first);
        for (place, sum) in sums.into_iter().enumerate() {
            hear(first + place, sum);
        }
    }
    for element in whole..ELEMENTS {
        let [sum] = sums(simd, rays.clone(), element);
        hear(element, sum);
    }
}

/// The sums of some elements that stand side by side, from the first of them on.
#[inline(always)]
fn sums<'r, S: Simd, const ELEMENTS: usize, const SOME: usize>(
    simd: S,
    rays: impl Iterator<Item = (&'r [[f32; 2]; ELEMENTS], [S::f32s; 2])>,
    first: usize,
) -> [[S::f32s; 2]; SOME] {
    let mut sums = [[simd.splat_f32s(0.0); 2]; SOME];
    for (steering, wave) in rays {
        for (total, steering) in sums.iter_mut().zip(&steering[first..first + SOME]) {
            *total = sum(simd, *total, product(simd, *steering, wave));
        }
    }
    sums
}

#[cfg(test)]
mod tests {
    use cslam_core::signal::SAMPLES;

    use super::*;
    use crate::synthesis::waves::Plane;

    /// What an array hears of rays, in lanes.
    struct Heard<'r, const ELEMENTS: usize>(&'r [([[f32; 2]; ELEMENTS], Plane)], &'r mut [Plane]);

    impl<const ELEMENTS: usize> WithSimd for Heard<'_, ELEMENTS> {
        type Output = ();

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) {
            for chunk in 0..SAMPLES / S::F32_LANES {
                let rays = self
                    .0
                    .iter()
                    .map(|(steering, plane)| (steering, plane.lanes::<S>(chunk)));
                add_up(simd, rays, |element, heard| {
                    self.1[element].put_lanes::<S>(chunk, heard)
                });
            }
        }
    }

    /// Every element of an array of any size hears the sum of its own products, to the last bit.
    fn check<const ELEMENTS: usize>() {
        let ray = |l: usize| {
            let number = |i: usize| ((7 * l + 3 * i) % 11) as f32 / 7.0 - 0.6;
            let plane = Plane {
                re: std::array::from_fn(number),
                im: std::array::from_fn(|n| number(n + 2)),
            };
            (std::array::from_fn(|i| [number(i), number(i + 4)]), plane)
        };
        let rays: [([[f32; 2]; ELEMENTS], Plane); 3] = [0, 1, 2].map(ray);
        let mut heard = vec![Plane::new(); ELEMENTS];
        in_widest_lanes(Heard(&rays, &mut heard));
        for (element, heard) in heard.iter().enumerate() {
            for n in 0..SAMPLES {
                let [mut re, mut im] = [0.0; 2];
                for (steering, wave) in &rays {
                    let ([c, s], x, y) = (steering[element], wave.re[n], wave.im[n]);
                    (re, im) = (re + (c * x - s * y), im + (c * y + s * x));
                }
                assert_eq!(
                    [heard.re[n], heard.im[n]],
                    [re, im],
                    "element {element}, sample {n}"
                );
            }
        }
    }

    #[test]
    fn every_element_hears_all_rays() {
        check::<1>();
        check::<4>();
        check::<7>();
        check::<8>();
    }
}
