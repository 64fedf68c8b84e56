//! The Gram matrix of the unfolding, and its leading eigenvectors: the left singular vectors that stand for paths.
//!
//! Given: numbers here are those of the paper's method, or bounds of its work; it is a baseline.

use nalgebra::Complex;

/// Power iterations for one singular vector.
const ITERATIONS: usize = 60;

/// `Y Y^H` of columns of `C` channels.
#[derive(Clone, Debug)]
pub(super) struct Gram<const C: usize> {
    rows: [[Complex<f32>; C]; C],
}

impl<const C: usize> Gram<C> {
    /// Of no column.
    pub(super) const fn zero() -> Self {
        Self {
            rows: [[Complex::new(0.0, 0.0); C]; C],
        }
    }

    /// Of these columns.
    pub(super) fn of(columns: impl Iterator<Item = [Complex<f32>; C]>) -> Self {
        let mut gram = Self::zero();
        for column in columns {
            for (row, a) in gram.rows.iter_mut().zip(&column) {
                for (sum, b) in row.iter_mut().zip(&column) {
                    *sum += a * b.conj();
                }
            }
        }
        gram
    }

    /// Leading eigenvector of the Gram matrix, unit norm, taken out of it, and its eigenvalue. None when nothing is left.
    pub(super) fn next_vector(&mut self) -> Option<([Complex<f32>; C], f32)> {
        // Start from the strongest row: it has the largest part of the leading vector.
        let power = |row: &[Complex<f32>; C]| row.iter().map(|x| x.norm_sqr()).sum::<f32>();
        let mut vector = *self.rows.iter().max_by(|a, b| power(a).total_cmp(&power(b)))?;
        for x in &mut vector {
            *x = x.conj();
        }
        let mut value = normalise(&mut vector)?;
        for _ in 0..ITERATIONS {
            let mut next = [Complex::new(0.0, 0.0); C];
            for (sum, row) in next.iter_mut().zip(&self.rows) {
                for (g, x) in row.iter().zip(&vector) {
                    *sum += g * x;
                }
            }
            vector = next;
            value = normalise(&mut vector)?;
        }
        for (row, a) in self.rows.iter_mut().zip(&vector) {
            for (g, b) in row.iter_mut().zip(&vector) {
                *g -= a * b.conj() * value;
            }
        }
        Some((vector, value))
    }
}

/// Scales to unit norm; gives the norm, or none where there is nothing to scale.
fn normalise<const C: usize>(vector: &mut [Complex<f32>; C]) -> Option<f32> {
    let norm = libm::sqrtf(vector.iter().map(|x| x.norm_sqr()).sum());
    if !(norm > 0.0 && norm.is_finite()) {
        return None;
    }
    for x in vector {
        *x /= norm;
    }
    Some(norm)
}
