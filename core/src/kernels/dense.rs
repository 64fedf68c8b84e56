//! A dense layer in integers, and the layout of its numbers: the portable kernel, which defines the result.
//!
//! Rows (outputs) go in groups of four, columns (inputs) in quads of four; both are padded with zeros. A group is a record
//! of 32 + 32 q bytes for q quads, little endian, read in order by the kernel:
//!
//! ```text
//! 4 x i32         biases, the offset of the inputs folded in
//! q x 4 x 4 x i16 weights: for each quad of inputs, four weights of each of the four rows; int8 values
//! 4 x i32         multipliers m = round(scale 2^32), 0 <= m < 2^31, of a hidden layer;
//! or 4 x f32      scales of the sums, of the last layer
//! ```
//! The sum of a row is `bias + sum of weight x input`, in `i32`: with weights and inputs within +-127, at most 128 inputs
//! and a bias within +-2^30 it stays under 2^30 + 2^21 and cannot overflow. A hidden layer's output is
//! `((sum m + 2^31) >> 32)` clamped to 0..=127: one rounding, half up, and the rectifier at once.
//!
//! An int8 weight takes an i16 here because the chip multiplies two pairs of i16 in one instruction and has to unpack
//! int8 first (docs/signal-model.md, "Fixed point").
//!
//! Given: the layout above.

/// Four neighbouring activations, int8 values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(8))]
pub struct Quad(pub(crate) [i16; 4]);

impl Quad {
    pub(crate) const ZERO: Self = Self([0; 4]);
}

/// Largest activation and largest magnitude of an input or a weight.
pub(crate) const LARGEST: i32 = 127;

/// Bytes of a group's biases, and of its multipliers or scales.
pub(crate) const ENDS: usize = 16;
/// Bytes of a group's weights for a quad of inputs.
pub(crate) const BLOCK: usize = 32;

/// Bytes of the record of a group of four rows over `quads` quads of inputs.
pub(crate) const fn record_length(quads: usize) -> usize {
    // Saturating, so that whoever divides by it sees that it is not 0.
    BLOCK.saturating_mul(quads).saturating_add(2 * ENDS)
}

/// The records of a layer on `input`: as many groups as there are records and places in `output`. Gives the sums of the
/// last group before requantisation; zeros when there is none.
pub(crate) fn dense(records: &[u8], input: &[Quad], output: &mut [Quad]) -> [i32; 4] {
    let mut sums = [0; 4];
    for (record, quad) in records.chunks_exact(record_length(input.len())).zip(output) {
        let (biases, weights, multipliers) = parts(record);
        sums = biases;
        for (block, x) in weights.iter().zip(input) {
            for (sum, row) in sums.iter_mut().zip(block.as_chunks::<8>().0) {
                for (weight, &x) in row.as_chunks::<2>().0.iter().zip(&x.0) {
                    let product = i32::from(i16::from_le_bytes(*weight)) * i32::from(x);
                    *sum = sum.wrapping_add(product);
                }
            }
        }
        for ((y, &sum), multiplier) in quad.0.iter_mut().zip(&sums).zip(multipliers) {
            *y = requantise(sum, multiplier);
        }
    }
    sums
}

/// `sum m / 2^32`, rounded half up, clamped to 0..=127.
fn requantise(sum: i32, multiplier: i32) -> i16 {
    let scaled = (i64::from(sum) * i64::from(multiplier) + (1 << 31)) >> 32;
    scaled.clamp(0, i64::from(LARGEST)) as i16
}

/// Biases, blocks of weights, and the four words at the end of a record (zeros where it is too short).
pub(crate) fn parts(record: &[u8]) -> ([i32; 4], &[[u8; BLOCK]], [i32; 4]) {
    let words = |bytes: &[u8; ENDS]| {
        let mut words = [0; 4];
        for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
            *word = i32::from_le_bytes(*bytes);
        }
        words
    };
    match record
        .split_first_chunk::<ENDS>()
        .and_then(|(biases, rest)| rest.split_last_chunk::<ENDS>().map(|rest| (biases, rest)))
    {
        Some((biases, (weights, last))) => (words(biases), weights.as_chunks::<BLOCK>().0, words(last)),
        None => ([0; 4], &[], [0; 4]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requantisation_rounds_half_up_once_and_rectifies() {
        // m = 2^31 - 1 is just under a half.
        let half = i32::MAX;
        assert_eq!(requantise(1, 1 << 30), 0);
        assert_eq!(requantise(2, 1 << 30), 1, "0.5 goes up");
        assert_eq!(requantise(6, 1 << 30), 2, "1.5 goes up");
        assert_eq!(requantise(5, 1 << 30), 1);
        assert_eq!(requantise(253, half), 126);
        assert_eq!(requantise(255, half), 127);
        assert_eq!(requantise(1 << 30, half), 127);
        assert_eq!(requantise(-1, half), 0);
        assert_eq!(requantise(i32::MIN, half), 0);
    }

    #[test]
    fn a_layer_is_a_matrix_product() {
        // Five rows over six inputs: two groups over two quads. Row r, column c: weight 10 r - c, bias 100 r.
        let weight = |r: i32, c: i32| if r < 5 && c < 6 { 10 * r - c } else { 0 };
        let mut records = Vec::new();
        for group in 0..2 {
            (0..4_i32).for_each(|r| records.extend_from_slice(&(100 * (4 * group + r)).to_le_bytes()));
            for (quad, row) in (0..2).flat_map(|q| (0..4).map(move |r| (q, r))) {
                (0..4).for_each(|c| {
                    let weight = weight(4 * group + row, 4 * quad + c) as i16;
                    records.extend_from_slice(&weight.to_le_bytes());
                });
            }
            (0..4).for_each(|_| records.extend_from_slice(&(1_i32 << 27).to_le_bytes()));
        }
        assert_eq!(records.len(), 2 * record_length(2));
        let x = [5, -3, 127, 0, -127, 8];
        let input = [Quad([5, -3, 127, 0]), Quad([-127, 8, 99, 99])];
        let mut output = [Quad([7; 4]); 3];
        let sums = dense(&records, &input, &mut output);
        let expected: Vec<i32> = (0..8)
            .map(|r| 100 * r + (0..6).map(|c| weight(r, c) * x[c as usize]).sum::<i32>())
            .collect();
        assert_eq!(sums, expected[4..]);
        for (r, sum) in expected.iter().enumerate() {
            let y = output[r / 4].0[r % 4];
            assert_eq!(i32::from(y), ((sum + 16) >> 5).clamp(0, 127), "row {r}");
        }
        assert_eq!(output[2], Quad([7; 4]), "no record, no output");
    }

    extern crate std;
    use std::vec::Vec;
}
