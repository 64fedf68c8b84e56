//! Coarse search: the power over subcarriers against the known power patterns on a grid of directions.
//!
//! A symbol that sweeps one axis tells that cosine only, so its scores are a line of the grid; one that sweeps both is
//! scored over the whole grid. Powers need no phase and hence no delay.

use heapless::Vec;

use super::fit::ReceivedSymbols;
use super::pattern::{Band, Row};
use super::reception::Spectrum;
use super::sighting::Expected;
use crate::array::SquintSymbol;
use crate::numeric::gather;

/// Step of the grid.
/// Derived: a quarter of the distance from a beam's peak to its null (docs/signal-model.md, "Beam squint").
const STEP: f32 = 0.06;
/// Cells along each axis.
/// Derived: cosines from -0.96 to 0.96, and from -0.24 up.
const CELLS: [usize; 2] = [33, 22];
/// Derived: cosines from -0.96, and from -0.24 up.
const FIRST: [f32; 2] = [-0.96, -0.24];
/// Subcarriers added up to one sample of power.
/// Numerical: neither the patterns nor a bounce turn over so few.
const STRIDE: usize = 4;
/// Samples of power.
/// Derived: up to 512 subcarriers.
const SAMPLES: usize = 128;
/// Candidates, and how many cells they are apart at least.
/// Capacity: work of the fits.
pub(super) const CANDIDATES: usize = 3;
/// Derived: a half lobe.
const APART: usize = 2;

type Grid = [[f32; CELLS[1]]; CELLS[0]];

/// Best places of the grid, best first; of those around where the path is expected, if it is.
pub(super) fn candidates<const X: usize, const Z: usize, const SYMBOLS: usize, const ACTIVE: usize>(
    received: &ReceivedSymbols<'_, SYMBOLS, ACTIVE>,
    expected: Option<&Expected>,
) -> Vec<[f32; 2], CANDIDATES> {
    let band = received.band.decimated(STRIDE);
    let mut grid: Grid = [[0.0; CELLS[1]]; CELLS[0]];
    for (symbol, spectrum) in received.symbols() {
        let power = power(spectrum);
        match symbol.delay_ns.map(|delay| delay != 0.0) {
            [true, true] => whole::<X, Z>(symbol, &power, &band, &mut grid),
            [true, false] => {
                for (i, line) in grid.iter_mut().enumerate() {
                    let score = line_score::<X>(symbol, 0, i, &power, &band);
                    line.iter_mut().for_each(|cell| *cell += score);
                }
            }
            [false, true] => {
                let scores: [f32; CELLS[1]] =
                    core::array::from_fn(|i| line_score::<Z>(symbol, 1, i, &power, &band));
                for line in &mut grid {
                    line.iter_mut()
                        .zip(&scores)
                        .for_each(|(cell, score)| *cell += score);
                }
            }
            [false, false] => {}
        }
    }
    best(&grid, expected)
}

/// Power of every [`STRIDE`] subcarriers over what noise adds, in noise variances.
fn power<const ACTIVE: usize>(spectrum: &Spectrum<ACTIVE>) -> Vec<f32, SAMPLES> {
    let scale = 1.0 / spectrum.noise;
    let chunks = spectrum.bins.as_chunks::<STRIDE>().0;
    gather(
        chunks
            .iter()
            .map(|bins| bins.iter().map(|y| y.norm_sqr() * scale - 1.0).sum()),
    )
}

fn cosine(axis: usize, cell: usize) -> f32 {
    FIRST.get(axis).copied().unwrap_or(0.0) + STEP * cell as f32
}

/// Energy of the powers that a power pattern explains, its gain free.
#[derive(Clone, Copy, Default)]
struct Match {
    against: f32,
    square: f32,
}

impl Match {
    fn add(&mut self, amplitude: f32, power: f32) {
        let pattern = amplitude * amplitude;
        self.against += pattern * power;
        self.square += pattern * pattern;
    }

    /// A pattern that only fits upside down explains nothing.
    fn score(&self) -> f32 {
        if self.against > 0.0 {
            self.against * self.against / self.square
        } else {
            0.0
        }
    }
}

fn line_score<const N: usize>(
    symbol: &SquintSymbol,
    axis: usize,
    cell: usize,
    power: &[f32],
    band: &Band,
) -> f32 {
    let mut row = Row::new(symbol, axis, cosine(axis, cell), band);
    let mut sum = Match::default();
    for p in power {
        sum.add(row.response::<N>(), *p);
    }
    sum.score()
}

fn whole<const X: usize, const Z: usize>(symbol: &SquintSymbol, power: &[f32], band: &Band, grid: &mut Grid) {
    for (i, line) in grid.iter_mut().enumerate() {
        let mut row = Row::new(symbol, 0, cosine(0, i), band);
        let across: Vec<f32, SAMPLES> = gather(power.iter().map(|_| row.response::<X>()));
        for (j, cell) in line.iter_mut().enumerate() {
            let mut column = Row::new(symbol, 1, cosine(1, j), band);
            let mut sum = Match::default();
            for (p, x) in power.iter().zip(&across) {
                sum.add(x * column.response::<Z>(), *p);
            }
            *cell += sum.score();
        }
    }
}

/// The best cells that are [`APART`].
fn best(grid: &Grid, expected: Option<&Expected>) -> Vec<[f32; 2], CANDIDATES> {
    let mut taken: Vec<[usize; 2], CANDIDATES> = Vec::new();
    while !taken.is_full() {
        let cells = grid
            .iter()
            .enumerate()
            .flat_map(|(i, line)| line.iter().enumerate().map(move |(j, score)| ([i, j], *score)));
        let away = |[i, j]: &[usize; 2]| {
            let near = |t: &[usize; 2]| t[0].abs_diff(*i) <= APART && t[1].abs_diff(*j) <= APART;
            !taken.iter().any(near)
        };
        let looked_at =
            |[i, j]: &[usize; 2]| expected.is_none_or(|e| e.holds(&[cosine(0, *i), cosine(1, *j)]));
        let Some((cell, _)) = cells
            .filter(|(cell, score)| *score > 0.0 && away(cell) && looked_at(cell))
            .max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            break;
        };
        let _ = taken.push(cell);
    }
    gather(taken.iter().map(|[i, j]| [cosine(0, *i), cosine(1, *j)]))
}
