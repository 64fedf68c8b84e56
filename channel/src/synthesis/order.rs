//! The order in which a front end hands the beams of a sweep over: strongest first (docs/front-end.md section 5).

use super::{Block, Sweep};

impl<const CHANNELS: usize> Block<CHANNELS> {
    /// Mean over the samples of `|x|^2`, all channels added, W.
    #[must_use]
    pub fn power(&self) -> f32 {
        let samples = self.samples.as_flattened();
        let energy: u64 = samples.iter().map(|x| u64::from(x.power())).sum();
        let mean = energy as f64 / self.samples[0].len() as f64;
        libm::scalbn(mean, self.exponent.saturating_mul(2)) as f32
    }
}

/// Blocks, strongest first; of equal ones the first.
pub fn strongest_first<const CHANNELS: usize>(
    blocks: &mut [Block<CHANNELS>],
) -> impl Iterator<Item = &mut Block<CHANNELS>> {
    let mut blocks: Vec<(f32, &mut Block<CHANNELS>)> =
        blocks.iter_mut().map(|block| (block.power(), block)).collect();
    blocks.sort_by(|(a, _), (b, _)| b.total_cmp(a));
    blocks.into_iter().map(|(_, block)| block)
}

impl<const CHANNELS: usize> Sweep<CHANNELS> {
    /// Power of each of so many beams; 0 where it is lost.
    #[must_use]
    pub fn powers<const BEAMS: usize>(&self) -> [f32; BEAMS] {
        let mut powers = [0.0; BEAMS];
        for block in &self.blocks {
            if let Some(power) = powers.get_mut(usize::from(block.beam)) {
                *power = block.power();
            }
        }
        powers
    }

    /// The beams of so many blocks, the strongest ones, strongest first.
    pub fn strongest(&self, count: usize) -> impl Iterator<Item = u16> {
        let mut beams: Vec<(f32, u16)> = self
            .blocks
            .iter()
            .map(|block| (block.power(), block.beam))
            .collect();
        beams.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        beams.into_iter().take(count).map(|(_, beam)| beam)
    }

    /// The blocks, strongest first; of equal ones the lower beam.
    pub fn strongest_first(&mut self) -> impl Iterator<Item = &mut Block<CHANNELS>> {
        strongest_first(&mut self.blocks)
    }
}

#[cfg(test)]
mod tests {
    use cslam_core::signal::Iq;

    use super::*;

    #[test]
    fn the_strongest_beam_comes_first_whatever_its_scale() {
        let block = |beam, exponent, amplitude: i16| {
            let mut block = Block::<32>::zero(beam, exponent);
            block.samples[3][7] = Iq::new(amplitude, 0);
            block
        };
        let mut sweep = Sweep {
            blocks: vec![block(2, 0, 4), block(5, 3, 1), block(9, 0, 4), block(11, 1, 100)],
        };
        let powers: [f32; 72] = sweep.powers();
        assert_eq!(powers[5], 64.0 / 512.0);
        assert_eq!(
            (powers[2], powers[9], powers[0]),
            (16.0 / 512.0, 16.0 / 512.0, 0.0)
        );
        let order: Vec<u16> = sweep.strongest_first().map(|block| block.beam).collect();
        assert_eq!(order, [11, 5, 2, 9]);
    }
}
