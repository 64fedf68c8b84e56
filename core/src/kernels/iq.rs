//! A complex sample in one 32-bit word, and its 16-bit lane arithmetic.
//!
//! The operations are those of the ARMv7E-M SIMD instructions, lane for lane and bit for bit, so that the stages of the
//! transform can be written once with these and once in assembly. Nothing wraps: additions halve or saturate. The
//! saturating ones report how many lanes clipped.
//!
//! Given: numbers here are those of the format Q15.

/// Complex 16-bit sample: real part in the low half-word, imaginary part in the high one.
///
/// In little-endian memory this is the interleaved `re, im` order of a `ci16_le` stream.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(transparent)]
pub struct Iq(u32);

/// Where stages count the lanes that clipped.
pub(crate) type Clips = u32;

/// Half an LSB of a Q15 product taken at scale 1/2 (bit 16).
const HALF_AT_16: i32 = 1 << 15;
/// Half an LSB of a Q15 product taken at full scale (bit 15).
const HALF_AT_15: i32 = 1 << 14;

impl Iq {
    /// Zero.
    pub const ZERO: Self = Self(0);

    /// A sample from its parts.
    #[must_use]
    pub const fn new(re: i16, im: i16) -> Self {
        Self((re as u16 as u32) | ((im as u16 as u32) << 16))
    }

    /// A sample from its word, real part in the low half.
    #[must_use]
    pub const fn from_word(word: u32) -> Self {
        Self(word)
    }

    /// The word, real part in the low half.
    #[must_use]
    pub const fn word(self) -> u32 {
        self.0
    }

    /// Real part.
    #[must_use]
    pub const fn re(self) -> i16 {
        self.0 as u16 as i16
    }

    /// Imaginary part.
    #[must_use]
    pub const fn im(self) -> i16 {
        (self.0 >> 16) as u16 as i16
    }

    /// `|x|^2`, at most 2^31.
    #[must_use]
    pub const fn power(self) -> u32 {
        let (re, im) = (self.re() as i32, self.im() as i32);
        (re * re) as u32 + (im * im) as u32
    }

    /// `x / 2^bits`, round half up, of at least one bit.
    pub(crate) const fn shifted_right(self, bits: i32) -> Self {
        let half = 1 << (bits - 1);
        Self::narrow(
            (self.re() as i32 + half) >> bits,
            (self.im() as i32 + half) >> bits,
        )
    }

    /// `x 2^bits`, where the caller knows that there is room.
    pub(crate) const fn shifted_left(self, bits: i32) -> Self {
        Self(((self.0 & 0xffff_0000) << bits) | ((self.0 << bits) & 0xffff))
    }

    /// Both parts as magnitudes, or one less than that of a negative one: the bits of all that are set in any of many samples say how
    /// far these can grow.
    pub(crate) const fn magnitudes(self) -> u32 {
        let negative = (self.0 >> 15) & 0x0001_0001;
        self.0 ^ (negative * 0xffff)
    }

    /// `re + j im` of values that are known to fit.
    const fn narrow(re: i32, im: i32) -> Self {
        Self::new(re as i16, im as i16)
    }

    /// `re + j im`, each clipped to 16 bits and counted when it was.
    fn clipped(re: i32, im: i32, clips: &mut Clips) -> Self {
        let out = Self::new(clip(re), clip(im));
        *clips += (out.re() as i32 != re) as u32 + (out.im() as i32 != im) as u32;
        out
    }

    /// `(x + y) / 2`, floor (SHADD16).
    pub(crate) const fn halving_add(self, y: Self) -> Self {
        Self::narrow(
            (self.re() as i32 + y.re() as i32) >> 1,
            (self.im() as i32 + y.im() as i32) >> 1,
        )
    }

    /// `(x - y) / 2`, floor (SHSUB16).
    pub(crate) const fn halving_sub(self, y: Self) -> Self {
        Self::narrow(
            (self.re() as i32 - y.re() as i32) >> 1,
            (self.im() as i32 - y.im() as i32) >> 1,
        )
    }

    /// `(x + j y) / 2`, floor (SHASX).
    pub(crate) const fn halving_add_j(self, y: Self) -> Self {
        Self::narrow(
            (self.re() as i32 - y.im() as i32) >> 1,
            (self.im() as i32 + y.re() as i32) >> 1,
        )
    }

    /// `(x - j y) / 2`, floor (SHSAX).
    pub(crate) const fn halving_sub_j(self, y: Self) -> Self {
        Self::narrow(
            (self.re() as i32 + y.im() as i32) >> 1,
            (self.im() as i32 - y.re() as i32) >> 1,
        )
    }

    /// `x / 2`, round half up (SHADD16 with one in both lanes).
    pub(crate) const fn half(self) -> Self {
        self.halving_add(Self::new(1, 1))
    }

    /// `x + y`, saturating (QADD16).
    pub(crate) fn saturating_add(self, y: Self, clips: &mut Clips) -> Self {
        Self::clipped(
            self.re() as i32 + y.re() as i32,
            self.im() as i32 + y.im() as i32,
            clips,
        )
    }

    /// `x - y`, saturating (QSUB16).
    pub(crate) fn saturating_sub(self, y: Self, clips: &mut Clips) -> Self {
        Self::clipped(
            self.re() as i32 - y.re() as i32,
            self.im() as i32 - y.im() as i32,
            clips,
        )
    }

    /// `x + j y`, saturating (QASX).
    pub(crate) fn saturating_add_j(self, y: Self, clips: &mut Clips) -> Self {
        Self::clipped(
            self.re() as i32 - y.im() as i32,
            self.im() as i32 + y.re() as i32,
            clips,
        )
    }

    /// `x - j y`, saturating (QSAX).
    pub(crate) fn saturating_sub_j(self, y: Self, clips: &mut Clips) -> Self {
        Self::clipped(
            self.re() as i32 + y.im() as i32,
            self.im() as i32 - y.re() as i32,
            clips,
        )
    }

    /// `x w / 2` of a Q15 factor with `|w| <= 1`, one rounding, half up (SMLSD, SMLADX, PKHTB). Cannot overflow.
    pub(crate) const fn half_product(self, w: Self) -> Self {
        let (re, im) = self.product(w, HALF_AT_16);
        Self::narrow(re >> 16, im >> 16)
    }

    /// `x conj(w) / 2`, as [`Self::half_product`] (SMLAD, SMLSDX, PKHTB).
    pub(crate) const fn half_product_conj(self, w: Self) -> Self {
        let (a, b) = (self.re() as i32, self.im() as i32);
        let (c, d) = (w.re() as i32, w.im() as i32);
        Self::narrow(
            (a * c + b * d + HALF_AT_16) >> 16,
            (b * c - a * d + HALF_AT_16) >> 16,
        )
    }

    /// `x w` of a Q15 factor with `|w| <= 1`, one rounding, half up, saturating (SMLSD, SMLADX, SSAT, PKHBT).
    pub(crate) fn full_product(self, w: Self, clips: &mut Clips) -> Self {
        let (re, im) = self.product(w, HALF_AT_15);
        Self::clipped(re >> 15, im >> 15, clips)
    }

    /// Sum of the products of samples with Q15 factors whose magnitudes add up to one at most, one rounding, half up (SMLSD, SMLADX). Parts of
    /// samples at both ends of their range may exceed 16 bits by the factor sqrt(2), and are clipped.
    pub(crate) fn weighted_sum<const N: usize>(samples: [Self; N], weights: &[Self; N]) -> Self {
        let (mut re, mut im) = (HALF_AT_15, HALF_AT_15);
        for (x, w) in samples.into_iter().zip(weights) {
            let (a, b) = (i32::from(x.re()), i32::from(x.im()));
            let (c, d) = (i32::from(w.re()), i32::from(w.im()));
            // At most sqrt(2) 2^15 times 2^15 in all: the sum stays within 32 bits, whatever is added first.
            re = re.wrapping_add(a * c - b * d);
            im = im.wrapping_add(a * d + b * c);
        }
        Self::new(clip(re >> 15), clip(im >> 15))
    }

    /// `x w` plus a rounding term, Q15 times Q15. With `|w| <= 1` at most sqrt(2) 2^30 + 2^15 < 2^31.
    const fn product(self, w: Self, rounding: i32) -> (i32, i32) {
        let (a, b) = (self.re() as i32, self.im() as i32);
        let (c, d) = (w.re() as i32, w.im() as i32);
        (a * c - b * d + rounding, a * d + b * c + rounding)
    }
}

/// Clips to 16 bits.
fn clip(x: i32) -> i16 {
    x.clamp(i32::from(i16::MIN), i32::from(i16::MAX)) as i16
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A word, with the extremes often enough to meet each other.
    fn any_iq() -> impl Strategy<Value = Iq> {
        let part = || prop_oneof![any::<i16>(), Just(i16::MIN), Just(i16::MAX), -1..=1_i16];
        (part(), part()).prop_map(|(re, im)| Iq::new(re, im))
    }

    /// Exact parts.
    fn wide(x: Iq) -> [i64; 2] {
        [i64::from(x.re()), i64::from(x.im())]
    }

    /// Saturated parts, and how many were.
    fn limited(exact: [i64; 2]) -> ([i64; 2], u32) {
        let limited = exact.map(|x| x.clamp(-32_768, 32_767));
        let clips = (limited[0] != exact[0]) as u32 + (limited[1] != exact[1]) as u32;
        (limited, clips)
    }

    /// `x * 2^-bits`, round half up.
    fn rounded([re, im]: [i64; 2], bits: u32) -> [i64; 2] {
        [re, im].map(|x| (x as f64 / f64::from(1_u32 << bits) + 0.5).floor() as i64)
    }

    fn times([a, b]: [i64; 2], [c, d]: [i64; 2]) -> [i64; 2] {
        [a * c - b * d, a * d + b * c]
    }

    proptest! {
        #[test]
        fn sums_and_differences_halve_or_saturate(x in any_iq(), y in any_iq()) {
            let ([a, b], [c, d]) = (wide(x), wide(y));
            let exact = [[a + c, b + d], [a - c, b - d], [a - d, b + c], [a + d, b - c]];
            let mut clips = [0; 4];
            let [n0, n1, n2, n3] = &mut clips;
            let saturating = [
                x.saturating_add(y, n0),
                x.saturating_sub(y, n1),
                x.saturating_add_j(y, n2),
                x.saturating_sub_j(y, n3),
            ];
            let halving = [x.halving_add(y), x.halving_sub(y), x.halving_add_j(y), x.halving_sub_j(y)];
            for i in 0..4 {
                prop_assert_eq!((wide(saturating[i]), clips[i]), limited(exact[i]));
                prop_assert_eq!(wide(halving[i]), exact[i].map(|x| x.div_euclid(2)));
            }
            prop_assert_eq!(wide(x.half()), rounded(wide(x), 1));
            prop_assert_eq!(i64::from(x.power()), a * a + b * b);
        }

        #[test]
        fn products_round_half_up_and_never_wrap(x in any_iq(), phase in 0.0..core::f64::consts::TAU) {
            let q15 = |x: f64| (x * 32_768.0 + 0.5).floor().clamp(-32_768.0, 32_767.0) as i16;
            let w = Iq::new(q15(libm::cos(phase)), q15(libm::sin(phase)));
            let conj = [i64::from(w.re()), -i64::from(w.im())];
            prop_assert_eq!(wide(x.half_product(w)), rounded(times(wide(x), wide(w)), 16));
            prop_assert_eq!(wide(x.half_product_conj(w)), rounded(times(wide(x), conj), 16));
            let mut clips = 0;
            let full = wide(x.full_product(w, &mut clips));
            prop_assert_eq!((full, clips), limited(rounded(times(wide(x), wide(w)), 15)));
        }

        #[test]
        fn shifts_are_exact_and_magnitudes_tell_the_room(x in any_iq(), bits in 1..9_i32) {
            prop_assert_eq!(wide(x.shifted_right(bits)), rounded(wide(x), bits as u32));
            let small = x.shifted_right(bits);
            let room = |m: u32| ((m | (m >> 16)) as u16).leading_zeros() as i32 - 1;
            let room = room(small.magnitudes());
            prop_assert!((0..=15).contains(&room));
            let left = room.min(bits);
            prop_assert_eq!(wide(small.shifted_left(left)), wide(small).map(|part| part << left));
            let grown = wide(small).map(|part| part << (room + 1));
            prop_assert!(room == 15 || grown != limited(grown).0, "there was more room");
        }

        #[test]
        fn a_weighted_sum_rounds_once_and_clips(
            x in [any_iq(), any_iq(), any_iq()],
            w in proptest::array::uniform3((0.0..1.0_f64, 0.0..core::f64::consts::TAU)),
        ) {
            // Magnitudes that add up to one, each part cut towards zero, as callers do.
            let total: f64 = w.iter().map(|(size, _)| size).sum::<f64>().max(1e-9);
            let q15 = |x: f64| (x * 32_767.0 / total) as i16;
            let w = w.map(|(size, phase)| Iq::new(q15(size * libm::cos(phase)), q15(size * libm::sin(phase))));
            let exact = x.into_iter().zip(w).fold([0; 2], |[re, im], (x, w)| {
                let [a, b] = times(wide(x), wide(w));
                [re + a, im + b]
            });
            prop_assert_eq!(wide(Iq::weighted_sum(x, &w)), limited(rounded(exact, 15)).0);
        }
    }
}
