//! Mutual coupling of the elements of an array, as far as calibration leaves it.
//!
//! Elements hear `y = C a`: C has one on its diagonal, c1 between neighbours and c2 between next neighbours. The receiver
//! undoes a matrix of measured coefficients, so `C C_cal^-1` is left. In a planar array rows couple like the elements of a row:
//! all hear the product of both.

use crate::random::Stream;
use crate::synthesis::C64;
use crate::synthesis::Radio;
use crate::synthesis::antenna::phasor;

/// Coupling of half-wave patches: amplitude and phase of c1 and c2.
const COEFFICIENTS: [[f64; 2]; 2] = [[0.12, 2.0], [0.04, -1.1]];

type Matrix<const N: usize> = [[C64; N]; N];

/// What is left in each array.
#[derive(Clone, Debug)]
pub(crate) struct Coupling<const ARRAYS: usize, const ELEMENTS: usize> {
    /// Between the elements of an array.
    within: [Matrix<ELEMENTS>; ARRAYS],
    /// Between the rows of a planar array.
    between: Option<Matrix<ARRAYS>>,
}

impl<const ARRAYS: usize, const ELEMENTS: usize> Coupling<ARRAYS, ELEMENTS> {
    /// Draws what calibration measured: each coefficient with a relative error of `unknown_share` rms, for each array, or for the rows and
    /// for the columns of one board.
    pub(crate) fn draw(unknown_share: f64, radio: &Radio, mut stream: Stream) -> Self {
        let truth = COEFFICIENTS.map(|[amplitude, phase]| phasor(phase) * amplitude);
        let mut measured = || {
            truth.map(|c| {
                let error = C64::new(stream.normal(), stream.normal()) * (unknown_share * 0.5_f64.sqrt());
                c + c * error
            })
        };
        if radio.is_one_board() {
            Self {
                within: [left(truth, measured()); ARRAYS],
                between: Some(left(truth, measured())),
            }
        } else {
            Self {
                within: std::array::from_fn(|_| left(truth, measured())),
                between: None,
            }
        }
    }

    /// What the channels hear of `steering`.
    pub(crate) fn of(&self, steering: &[[C64; ELEMENTS]; ARRAYS]) -> [[C64; ELEMENTS]; ARRAYS] {
        let within = std::array::from_fn(|j| {
            self.within[j].map(|row| row.iter().zip(&steering[j]).map(|(c, a)| c * a).sum())
        });
        match &self.between {
            None => within,
            Some(between) => between
                .map(|row| std::array::from_fn(|i| row.iter().zip(&within).map(|(c, a)| c * a[i]).sum())),
        }
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
    fn rows_of_one_board_couple_like_the_elements_of_a_row() {
        let coupling = Coupling::<5, 3>::draw(0.3, &Radio::planar(), Stream::new(4, 0));
        let between = coupling.between.expect("one board");
        assert!(coupling.within.iter().all(|row| *row == coupling.within[0]));
        // One element that hears a wave: its own row and column, and by both all others.
        let mut steering = [[C64::ZERO; 3]; 5];
        steering[3][1] = C64::new(0.0, 2.0);
        let heard = coupling.of(&steering);
        for (j, i) in (0..15).map(|e| (e / 3, e % 3)) {
            let expected = between[j][3] * coupling.within[0][i][1] * C64::new(0.0, 2.0);
            assert!((heard[j][i] - expected).norm() < 1e-14, "{j} {i}");
        }
        assert!(
            Coupling::<5, 3>::draw(0.3, &Radio::default(), Stream::new(4, 0))
                .between
                .is_none()
        );
    }

    #[test]
    fn a_fifth_unknown_leaves_minus_32_db_between_neighbours_and_nothing_unknown_nothing() {
        let (mut power, draws) = (0.0, 400);
        for seed in 0..draws {
            let coupling = Coupling::<4, 8>::draw(0.2, &Radio::default(), Stream::new(seed, 0));
            power += coupling.within.iter().map(|m| m[3][4].norm_sqr()).sum::<f64>() / (4.0 * draws as f64);
        }
        let level_db = 10.0 * libm::log10(power);
        assert!((level_db + 32.0).abs() < 0.7, "{level_db}");
        let clean = Coupling::<4, 8>::draw(0.0, &Radio::default(), Stream::new(1, 0));
        for (row, column) in (0..64).map(|e| (e / 8, e % 8)) {
            let expected = C64::new(f64::from(u8::from(row == column)), 0.0);
            assert!((clean.within[2][row][column] - expected).norm() < 1e-15);
        }
    }
}
