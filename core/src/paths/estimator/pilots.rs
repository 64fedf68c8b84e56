//! A pilot through the estimator's front end.

use heapless::Vec;
use nalgebra::Vector3;

use super::super::estimated::EstimatedPath;
use super::super::meter::Meter;
use super::super::pilot;
use super::Estimator;
use crate::signal::BeamBlock;

/// Amplitudes are compared in units of 2^-34.
/// Derived: thermal noise in sqrt(W) is then of the order of one.
const REFERENCE_EXPONENT: i32 = -34;

impl<
    const A: usize,
    const E: usize,
    const C: usize,
    const BEAMS: usize,
    const FACES: usize,
    const X: usize,
    const Z: usize,
    const MOST: usize,
    const K: usize,
    M: Meter,
> Estimator<A, E, C, BEAMS, FACES, X, Z, MOST, K, M>
{
    /// A pilot: gains of the paths in it, and how fast those grow whose second one it is.
    pub(super) fn hear_pilot(
        &mut self,
        block: BeamBlock<'_, C>,
        turn_rad_per_s: &Vector3<f32>,
        paths: &mut [EstimatedPath],
    ) {
        let (beam, time) = (usize::from(block.beam) % BEAMS, usize::from(block.beam) / BEAMS);
        let is_of = |path: &EstimatedPath| usize::from(path.beam) == beam;
        // A beam is sent twice again.
        if time > 1 || !pilot::is_heard(paths, is_of) {
            return;
        }
        let scaled = self.correlator.scale(block);
        let taps = self.correlator.correlate(scaled, &mut self.work).into_block();
        let scale = libm::scalbnf(1.0, taps.exponent.saturating_sub(REFERENCE_EXPONENT));
        let gains: Vec<_, K> =
            pilot::gains::<A, E, C, K>(&self.model, &self.template, taps.samples, paths, is_of);
        for (index, (path, gains)) in paths.iter_mut().zip(gains.iter().copied()).enumerate() {
            if is_of(path) {
                let told = self.pilots.heard(
                    &self.model,
                    time > 0,
                    (index, path),
                    gains.scaled(scale),
                    turn_rad_per_s,
                );
                path.range_rate = told;
            }
        }
    }
}
