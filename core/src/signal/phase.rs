//! Sine and cosine for the scoring loops: one polynomial in single precision, the same bits everywhere.
//!
//! `libm::sinf` works in double precision inside, which costs ten times as much on a core whose fast unit is single. Here
//! angles are in turns, so the reduction to an eighth of a turn is exact, and two short Taylor polynomials do the rest.
//! Largest error over one turn: 1.2e-7 (tested), one unit in the last place of values near one.

use nalgebra::Complex;

/// `exp(j 2 pi turns)`. Any finite argument up to 2^22 turns in magnitude; beyond it the fraction of a turn is lost
/// anyway, and NaN gives NaN.
pub(crate) fn phasor(turns: f32) -> Complex<f32> {
    let quarters = round_half_up(4.0 * turns);
    let x = core::f32::consts::TAU * (turns - 0.25 * quarters as f32);
    let x2 = x * x;
    let sine =
        x * (1.0 - x2 * (1.0 / 6.0 - x2 * (1.0 / 120.0 - x2 * (1.0 / 5040.0 - x2 * (1.0 / 362_880.0)))));
    let cosine = 1.0 - x2 * (0.5 - x2 * (1.0 / 24.0 - x2 * (1.0 / 720.0 - x2 * (1.0 / 40_320.0))));
    match quarters & 3 {
        0 => Complex::new(cosine, sine),
        1 => Complex::new(-sine, cosine),
        2 => Complex::new(-cosine, -sine),
        _ => Complex::new(sine, -cosine),
    }
}

/// Nearest integer, halves up; clamped to the range of `i32`, NaN gives 0.
pub(crate) fn round_half_up(x: f32) -> i32 {
    let shifted = x + 0.5;
    let whole = shifted as i32;
    // The cast truncates towards zero: one too many below zero.
    if (whole as f32) > shifted {
        whole.saturating_sub(1)
    } else {
        whole
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_is_as_published() {
        let mut worst = 0.0_f64;
        for i in -40_000..=40_000 {
            let turns = i as f32 / 16_384.0;
            let (exact, got) = (core::f64::consts::TAU * f64::from(turns), phasor(turns));
            worst = worst
                .max((f64::from(got.re) - libm::cos(exact)).abs())
                .max((f64::from(got.im) - libm::sin(exact)).abs());
        }
        assert!(worst < 1.2e-7, "{worst:e}");
        assert!(worst > 3e-8, "the published figure is out of date: {worst:e}");
    }

    #[test]
    fn rounding_is_half_up() {
        let cases = [
            (-1.5, -1),
            (-0.5, 0),
            (-0.51, -1),
            (0.49, 0),
            (0.5, 1),
            (2.5, 3),
            (-3.0, -3),
        ];
        for (x, expected) in cases {
            assert_eq!(round_half_up(x), expected, "{x}");
        }
        assert_eq!(round_half_up(f32::NAN), 0);
    }
}
