//! Ripple of the element patterns: in its surroundings an element hears `(1 + r(u))` times what it would hear alone.
//!
//! r is complex and smooth: a sum of spherical harmonics of degree 4 to 12 (features of 15 to 45 deg) with normal
//! coefficients, so its variance is the same in every direction. What surrounds an array is common to its elements.

use std::f64::consts::PI;

use nalgebra::Vector3;

use crate::random::Stream;
use crate::synthesis::C64;
use crate::synthesis::Radio;

/// Degrees of the harmonics.
const LEAST_DEGREE: usize = 4;
const DEGREE: usize = 12;
/// Harmonics of these degrees.
const HARMONICS: usize = (DEGREE + 1) * (DEGREE + 1) - LEAST_DEGREE * LEAST_DEGREE;
/// Share of the variance that is common to the elements of an array.
const COMMON: f64 = 0.7;

/// Coefficients of every element.
#[derive(Clone, Debug)]
pub(crate) struct Ripple<const ARRAYS: usize, const ELEMENTS: usize>(Vec<[[C64; HARMONICS]; ELEMENTS]>);

impl<const ARRAYS: usize, const ELEMENTS: usize> Ripple<ARRAYS, ELEMENTS> {
    /// Draws ripple of an amplitude (dB) and a phase (deg), rms. The arrays of one board have one part in common.
    pub(crate) fn draw((rms_db, rms_deg): (f64, f64), radio: &Radio, mut stream: Stream) -> Self {
        // The squares of all harmonics of a degree sum to (2 l + 1) / 4 pi in every direction.
        let each = (4.0 * PI / HARMONICS as f64).sqrt();
        let (re, im) = (
            each * rms_db * std::f64::consts::LN_10 / 20.0,
            each * rms_deg.to_radians(),
        );
        let mut coefficients = |share: f64| -> [C64; HARMONICS] {
            let root = share.sqrt();
            std::array::from_fn(|_| C64::new(re * stream.normal(), im * stream.normal()) * root)
        };
        let mut of_all = None;
        let mut array = || {
            let common = of_all.unwrap_or_else(|| coefficients(COMMON));
            of_all = radio.is_one_board().then_some(common);
            std::array::from_fn(|_| {
                let own = coefficients(1.0 - COMMON);
                std::array::from_fn(|k| common[k] + own[k])
            })
        };
        Self((0..ARRAYS).map(|_| array()).collect())
    }

    /// `1 + r(u)` of every element of every array.
    pub(crate) fn factors(&self, u: &Vector3<f64>) -> [[C64; ELEMENTS]; ARRAYS] {
        let harmonics = harmonics(u);
        let r = |c: &[C64; HARMONICS]| c.iter().zip(&harmonics).map(|(c, y)| c * *y).sum::<C64>();
        std::array::from_fn(|j| std::array::from_fn(|i| C64::new(1.0, 0.0) + r(&self.0[j][i])))
    }
}

/// Real orthonormal spherical harmonics of degree 4 to 12 towards a unit vector, by the recursion of the normalised
/// Legendre functions; the powers of `x + j y` carry the azimuth, so there is no pole.
fn harmonics(u: &Vector3<f64>) -> [f64; HARMONICS] {
    let mut out = [0.0; HARMONICS];
    let mut next = 0;
    let mut put = |degree: usize, value: f64| {
        if degree >= LEAST_DEGREE {
            out[next] = value;
            next += 1;
        }
    };
    let mut sectoral = 0.5 / PI.sqrt();
    let mut azimuth = C64::new(1.0, 0.0);
    for m in 0..=DEGREE {
        if m > 0 {
            let order = m as f64;
            sectoral *= ((2.0 * order + 1.0) / (2.0 * order)).sqrt();
            azimuth *= C64::new(u.x, u.y);
        }
        let (mut before, mut legendre) = (0.0, sectoral);
        for l in m..=DEGREE {
            if l > m {
                let (l, m) = (l as f64, m as f64);
                let scale = ((4.0 * l * l - 1.0) / (l * l - m * m)).sqrt();
                let k = l - 1.0;
                let back = ((k * k - m * m) / (4.0 * k * k - 1.0)).sqrt();
                (before, legendre) = (legendre, scale * (u.z * legendre - back * before));
            }
            if m == 0 {
                put(l, legendre);
            } else {
                put(l, std::f64::consts::SQRT_2 * legendre * azimuth.re);
                put(l, std::f64::consts::SQRT_2 * legendre * azimuth.im);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Directions spread evenly over the sphere.
    fn sphere(count: usize) -> impl Iterator<Item = Vector3<f64>> {
        (0..count).map(move |i| {
            let z = (i as f64 + 0.5) * 2.0 / count as f64 - 1.0;
            let (s, c) = libm::sincos(2.399_963_229_728_653 * i as f64);
            let horizontal = (1.0 - z * z).sqrt();
            Vector3::new(horizontal * c, horizontal * s, z)
        })
    }

    #[test]
    fn harmonics_are_orthonormal_and_alike_in_every_direction() {
        let count = 20_000;
        let mut gram = vec![[0.0; HARMONICS]; HARMONICS];
        for u in sphere(count) {
            let y = harmonics(&u);
            let sum: f64 = y.iter().map(|y| y * y).sum();
            assert!((sum - HARMONICS as f64 / (4.0 * PI)).abs() < 1e-9, "{sum}");
            for (row, a) in gram.iter_mut().zip(y) {
                for (entry, b) in row.iter_mut().zip(y) {
                    *entry += a * b * 4.0 * PI / count as f64;
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (k, entry) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == k));
                assert!((entry - expected).abs() < 1e-2, "{i} {k}: {entry}");
            }
        }
    }

    #[test]
    fn ripple_has_its_rms_its_width_and_its_common_share() {
        let (count, draws) = (60, 40);
        let (mut square, mut own, mut common, mut other) = ([0.0; 2], 0.0, 0.0, 0.0);
        let (mut near, mut far) = (0.0, 0.0);
        let n = (count * draws) as f64;
        for seed in 0..draws {
            let ripple = Ripple::<4, 8>::draw((1.0, 5.0), &Radio::default(), Stream::new(seed, 0));
            for u in sphere(count as usize) {
                let at = |u: &Vector3<f64>| ripple.factors(u).map(|a| a.map(|f| f - 1.0));
                let across = u.cross(&Vector3::new(0.3, 0.5, -0.8)).normalize();
                let turned =
                    |deg: f64| u * libm::cos(deg.to_radians()) + across * libm::sin(deg.to_radians());
                let r = at(&u);
                let product = |a: C64, b: C64| (a * b.conj()).re / n;
                square[0] += r[1][3].re * r[1][3].re / n;
                square[1] += r[1][3].im * r[1][3].im / n;
                own += product(r[1][3], r[1][3]);
                common += product(r[1][3], r[1][4]);
                other += product(r[1][3], r[2][3]);
                near += product(r[1][3], at(&turned(2.0))[1][3]);
                far += product(r[1][3], at(&turned(60.0))[1][3]);
            }
        }
        let [db, deg] = [
            square[0].sqrt() * 20.0 / std::f64::consts::LN_10,
            square[1].sqrt().to_degrees(),
        ];
        assert!(
            (db - 1.0).abs() < 0.06 && (deg - 5.0).abs() < 0.3,
            "{db} dB, {deg} deg"
        );
        assert!((common / own - COMMON).abs() < 0.08, "{}", common / own);
        assert!((other / own).abs() < 0.08, "{}", other / own);
        assert!(
            near / own > 0.9 && (far / own).abs() < 0.2,
            "{} {}",
            near / own,
            far / own
        );
    }

    #[test]
    fn rows_of_one_board_have_their_common_share_in_common() {
        let (mut own, mut other, draws) = (0.0, 0.0, 200);
        for seed in 0..draws {
            let ripple = Ripple::<5, 2>::draw((1.0, 5.0), &Radio::planar(), Stream::new(seed, 0));
            for u in sphere(10) {
                let r = ripple.factors(&u).map(|row| row.map(|f| f - 1.0));
                own += r[1][0].norm_sqr();
                other += (r[1][0] * r[3][1].conj()).re;
            }
        }
        assert!((other / own - COMMON).abs() < 0.04, "{}", other / own);
    }

    #[test]
    fn no_ripple_is_one() {
        let none = Ripple::<4, 8>::draw((0.0, 0.0), &Radio::default(), Stream::new(3, 0));
        let factors = none.factors(&Vector3::new(0.6, 0.0, 0.8));
        assert!(factors.iter().flatten().all(|f| *f == C64::new(1.0, 0.0)));
    }
}
