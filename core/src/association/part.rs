//! Parts of matrices.

use nalgebra::SMatrix;

/// `R` rows and `C` columns from this place on; zero beyond the matrix. The library's own copy of a view holds an assertion that no compiler
/// proves away, and flight code has no panic.
pub(super) fn part<const R: usize, const C: usize, const M: usize, const N: usize>(
    of: &SMatrix<f64, M, N>,
    (row, column): (usize, usize),
) -> SMatrix<f64, R, C> {
    let mut part = SMatrix::<f64, R, C>::zeros();
    for i in 0..R {
        for j in 0..C {
            if let (Some(to), Some(from)) = (part.get_mut((i, j)), of.get((row + i, column + j))) {
                *to = *from;
            }
        }
    }
    part
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_what_stands_there() {
        let all = SMatrix::<f64, 3, 4>::from_fn(|i, j| (10 * i + j) as f64);
        let two: SMatrix<f64, 2, 2> = part(&all, (1, 2));
        assert_eq!(two, SMatrix::<f64, 2, 2>::new(12.0, 13.0, 22.0, 23.0));
        let beyond: SMatrix<f64, 1, 2> = part(&all, (0, 3));
        assert_eq!(beyond, SMatrix::<f64, 1, 2>::new(3.0, 0.0));
    }
}
