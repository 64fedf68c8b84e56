//! Power of every path in every transmit beam: what words between the ends live on.

use super::rays::{Instant, RayError, rays};
use super::simulator::Simulator;
use crate::paths::Link;

impl<const ARRAYS: usize, const ELEMENTS: usize, const CHANNELS: usize>
    Simulator<ARRAYS, ELEMENTS, CHANNELS>
{
    /// Power gain from the input of each transmit beam to an isotropic antenna at the UAV, for every path of a link.
    ///
    /// # Errors
    /// [`RayError`] when a path of the link cannot be synthesised.
    pub fn beam_gains(&self, link: &Link, instant: &Instant) -> Result<Vec<Vec<f64>>, RayError> {
        let rays = rays(link, instant, self.maker.waveform().carrier_hz)?;
        let gains = rays.iter().map(|ray| {
            let fields = self.transmitter.fields(&ray.departure, &self.device);
            fields
                .iter()
                .map(|beam| (ray.amplitude * beam.field).norm_sqr())
                .collect()
        });
        Ok(gains.collect())
    }
}
