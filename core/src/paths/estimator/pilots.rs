//! A pilot through the estimator's front end.

use nalgebra::Vector3;

use super::super::estimated::EstimatedPath;
use super::super::meter::Meter;
use super::super::pilot::reading::Reading;
use super::Estimator;
use crate::signal::{BeamBlock, REFERENCE_EXPONENT, TAP_EXPONENT};

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
        if time > 1 || !paths.iter().any(is_of) {
            return;
        }
        let scaled = self.correlator.scale(block);
        let exponent = scaled.exponent().saturating_add(TAP_EXPONENT);
        let scale = libm::scalbnf(1.0, exponent.saturating_sub(REFERENCE_EXPONENT));
        let reading = Reading {
            model: &self.model,
            template: &self.template,
            correlator: &self.correlator,
            samples: scaled.samples(),
        };
        for index in 0..paths.len() {
            let Some(path) = paths.get(index).copied().filter(is_of) else {
                continue;
            };
            let gains = reading.gains(index, paths, &mut self.work);
            let told = self.pilots.heard(
                &self.model,
                time > 0,
                (index, &path),
                gains.scaled(scale),
                turn_rad_per_s,
            );
            if let Some(path) = paths.get_mut(index) {
                path.range_rate = told;
            }
        }
    }
}
