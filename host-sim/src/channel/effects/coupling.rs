//! Mutual coupling of the elements of a linear array, as far as calibration leaves it.
//!
//! Elements hear `y = C a`: C has one on its diagonal, c1 between neighbours and c2 between next neighbours. The receiver
//! undoes a matrix of measured coefficients, so `C C_cal^-1` is left.

use crate::channel::C64;
use crate::channel::antenna::phasor;
use crate::random::Stream;

/// Coupling of half-wave patches: amplitude and phase of c1 and c2.
const COEFFICIENTS: [[f64; 2]; 2] = [[0.12, 2.0], [0.04, -1.1]];

type Matrix<const N: usize> = [[C64; N]; N];

/// What is left in each array.
#[derive(Clone, Debug)]
pub(in crate::channel) struct Coupling<const ARRAYS: usize, const ELEMENTS: usize>(
    [Matrix<ELEMENTS>; ARRAYS],
);

impl<const ARRAYS: usize, const ELEMENTS: usize> Coupling<ARRAYS, ELEMENTS> {
    /// Draws what calibration measured: each coefficient with a relative error of `unknown_share` rms.
    pub(in crate::channel) fn draw(unknown_share: f64, mut stream: Stream) -> Self {
        let truth = COEFFICIENTS.map(|[amplitude, phase]| phasor(phase) * amplitude);
        let residual = |_| {
            let measured = truth.map(|c| {
                let error = C64::new(stream.normal(), stream.normal()) * (unknown_share * 0.5_f64.sqrt());
                c + c * error
            });
            left(truth, measured)
        };
        Self(std::array::from_fn(residual))
    }

    /// What the channels of array `array` hear of `steering`.
    pub(in crate::channel) fn of(&self, array: usize, steering: &[C64; ELEMENTS]) -> [C64; ELEMENTS] {
        self.0[array].map(|row| row.iter().zip(steering).map(|(c, a)| c * a).sum())
    }
}

fn matrix<const N: usize>([neighbour, next]: [C64; 2]) -> Matrix<N> {
    let entry = |row: usize, column: usize| match row.abs_diff(column) {
        0 => C64::new(1.0, 0.0),
        1 => neighbour,
        2 => next,
        _ => C64::new(0.0, 0.0),
    };
    std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)))
}

/// `C C_cal^-1`. Both matrices are symmetric, so row k of it solves `C_cal x = (column k of C)`.
fn left<const N: usize>(truth: [C64; 2], measured: [C64; 2]) -> Matrix<N> {
    let mut a = matrix::<N>(measured);
    // One right-hand side a column.
    let mut b = matrix::<N>(truth);
    // The diagonal outweighs its row at any measurement that is a measurement: no pivots are sought.
    for pivot in 0..N {
        for row in (0..N).filter(|row| *row != pivot) {
            let factor = a[row][pivot] / a[pivot][pivot];
            for column in 0..N {
                let (of_a, of_b) = (a[pivot][column] * factor, b[pivot][column] * factor);
                a[row][column] -= of_a;
                b[row][column] -= of_b;
            }
        }
    }
    std::array::from_fn(|row| std::array::from_fn(|column| b[column][row] / a[column][column]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_elements_are_left_with_what_the_hand_computes() {
        let (c, d) = (C64::new(-0.05, 0.11), C64::new(-0.03, 0.14));
        let zero = C64::new(0.0, 0.0);
        let left = left::<2>([c, zero], [d, zero]);
        let one = C64::new(1.0, 0.0);
        let expected = [[one - c * d, c - d], [c - d, one - c * d]].map(|row| row.map(|x| x / (one - d * d)));
        for (a, b) in left.iter().flatten().zip(expected.iter().flatten()) {
            assert!((a - b).norm() < 1e-15, "{a} {b}");
        }
    }

    #[test]
    fn coupling_reaches_neighbours_and_next_neighbours() {
        let (c1, c2) = (C64::new(0.1, 0.2), C64::new(0.3, 0.4));
        let (one, none) = (C64::new(1.0, 0.0), C64::new(0.0, 0.0));
        let rows = [
            [one, c1, c2, none],
            [c1, one, c1, c2],
            [c2, c1, one, c1],
            [none, c2, c1, one],
        ];
        assert_eq!(matrix::<4>([c1, c2]), rows);
    }

    #[test]
    fn what_is_left_times_what_was_measured_is_the_coupling() {
        let (truth, measured) = (
            [C64::new(-0.05, 0.11), C64::new(0.02, -0.03)],
            [C64::new(-0.08, 0.09), C64::new(0.03, -0.01)],
        );
        let (left, known, coupling) = (
            left::<8>(truth, measured),
            matrix::<8>(measured),
            matrix::<8>(truth),
        );
        for row in 0..8 {
            for column in 0..8 {
                let product: C64 = (0..8).map(|k| left[row][k] * known[k][column]).sum();
                assert!((product - coupling[row][column]).norm() < 1e-14);
            }
        }
    }

    #[test]
    fn a_fifth_unknown_leaves_minus_32_db_between_neighbours_and_nothing_unknown_nothing() {
        let (mut power, draws) = (0.0, 400);
        for seed in 0..draws {
            let coupling = Coupling::<4, 8>::draw(0.2, Stream::new(seed, 0));
            power += coupling.0.iter().map(|m| m[3][4].norm_sqr()).sum::<f64>() / (4.0 * draws as f64);
        }
        let level_db = 10.0 * libm::log10(power);
        assert!((level_db + 32.0).abs() < 0.7, "{level_db}");
        let clean = Coupling::<4, 8>::draw(0.0, Stream::new(1, 0));
        for (row, column) in (0..64).map(|e| (e / 8, e % 8)) {
            let expected = C64::new(f64::from(u8::from(row == column)), 0.0);
            assert!((clean.0[2][row][column] - expected).norm() < 1e-15);
        }
    }
}
