//! A sweep of all transmit beams: what arrives in each slot, through the front end.

use super::air::SweepState;
use super::pieces;
use super::rays::{Instant, Ray, RayError};
use super::simulator::{Simulator, Sweep};
use crate::paths::Link;

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    Simulator<ARRAYS, ELEMENTS, CHANNELS>
{
    /// The sweep over a link at an instant. `index` numbers the sweeps of a run: it chooses the noise.
    ///
    /// # Errors
    /// [`RayError`] when a path of the link cannot be synthesised.
    pub fn sweep(&self, link: &Link, instant: &Instant, index: u32) -> Result<Sweep<CHANNELS>, RayError> {
        let (rays, pieces) = self.divided(link, instant)?;
        Ok(self.sweep_of(&rays, &pieces, instant, index))
    }

    /// The rays of a link, and the pieces of diffusely scattered waves.
    fn divided(&self, link: &Link, instant: &Instant) -> Result<(Vec<Ray>, Vec<Ray>), RayError> {
        let rays = self.rays(link, instant)?;
        Ok(pieces::divide(rays, |path| link.paths[path].is_scattered()))
    }

    /// The sweep of rays that are already in the frames of the arrays.
    pub fn sweep_rays(&self, rays: &[Ray], instant: &Instant, index: u32) -> Sweep<CHANNELS> {
        self.sweep_of(rays, &[], instant, index)
    }

    /// The pilots of some beams of a sweep over a link, the first and then the second of each: blocks whose `beam` is that of the beam, and with the
    /// number of all beams added for the second one. `index` is that of the sweep.
    ///
    /// # Errors
    /// [`RayError`] when a path of the link cannot be synthesised.
    pub fn pilots(
        &self,
        link: &Link,
        instant: &Instant,
        index: u32,
        beams: impl Iterator<Item = u16>,
    ) -> Result<Sweep<CHANNELS>, RayError> {
        let (rays, pieces) = self.divided(link, instant)?;
        Ok(self.pilots_of(&rays, &pieces, instant, index, beams))
    }

    /// The same of rays that are already in the frames of the arrays.
    pub fn pilots_of_rays(
        &self,
        rays: &[Ray],
        instant: &Instant,
        index: u32,
        beams: impl Iterator<Item = u16>,
    ) -> Sweep<CHANNELS> {
        self.pilots_of(rays, &[], instant, index, beams)
    }

    fn pilots_of(
        &self,
        rays: &[Ray],
        pieces: &[Ray],
        instant: &Instant,
        index: u32,
        beams: impl Iterator<Item = u16>,
    ) -> Sweep<CHANNELS> {
        let mut state = SweepState::new(self, rays, instant, index).with_pieces(pieces);
        let mut sweep = Sweep::default();
        for beam in beams.map(usize::from) {
            for again in 0..2 {
                let slot = self.pilot_slot(beam, again);
                if state.air(slot, false, |state, ray| state.fields[ray][beam]) {
                    let number = beam + again * self.beams();
                    sweep.blocks.push(state.digitise(slot, number as u16));
                }
            }
        }
        sweep
    }

    fn sweep_of(&self, rays: &[Ray], pieces: &[Ray], instant: &Instant, index: u32) -> Sweep<CHANNELS> {
        let mut state = SweepState::new(self, rays, instant, index).with_pieces(pieces);
        let mut sweep = Sweep::default();
        for beam in 0..self.beams() {
            let listed = self.config.impairments.dropped_beams.contains(&(beam as u16));
            if state.air(beam, listed, |state, ray| state.fields[ray][beam]) {
                sweep.blocks.push(state.digitise(beam, beam as u16));
            }
        }
        sweep
    }
}
