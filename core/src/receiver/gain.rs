//! From the power of a path to the gain of the way it took.
//!
//! The link state networks look at how much a path lost on its way; the estimator says how strong it came in. Between the
//! two stand the link budget and both antennas: the beam that sent it towards its angle of departure, and the elements
//! that heard it from its angle of arrival. What is left is the gain between two vertical half-wave dipoles, the scale
//! of path lists.

use crate::array::{Codebook, UavArrays, half_wave_dipole};
use crate::geometry::{Direction, Gmt, Rotation, World};
use crate::paths::EstimatedPath;
use crate::signal::Waveform;

/// Transmitted power and known losses.
/// Given: the link budget (docs/signal-model.md).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkBudget {
    /// Transmit power of a beam over all active subcarriers, dBm.
    pub transmit_power_dbm: f32,
    /// Implementation loss, dB.
    pub implementation_loss_db: f32,
}

impl Default for LinkBudget {
    /// docs/signal-model.md, "Default configuration": 30 dBm, 3 dB.
    fn default() -> Self {
        Self {
            transmit_power_dbm: 30.0,
            implementation_loss_db: 3.0,
        }
    }
}

/// Least power gain of a beam that a path gain is computed from, relative to an isotropic antenna.
/// Derived: beside its beam a path shows the errors of the codeword, not its gain.
const LEAST_BEAM_GAIN: f32 = 1.0;

impl LinkBudget {
    /// Power gain from the GMT's antenna port to the UAV's with vertical half-wave dipoles at both ends, dB. `None` when the
    /// angle of departure is unknown, or lies so far beside the beam that its gain means nothing.
    ///
    /// The active subcarriers of the waveform share the power. The estimator's energies must be in watts: amplitude = integer times 2^exponent in square roots of a watt.
    pub fn path_gain_db<
        const A: usize,
        const E: usize,
        const FACES: usize,
        const X: usize,
        const Z: usize,
        const ELEVATIONS: usize,
    >(
        &self,
        estimated: &EstimatedPath<World>,
        arrays: &UavArrays<f32, A, E>,
        codebook: &Codebook<f32, FACES, X, Z, ELEVATIONS>,
        waveform: &Waveform,
        gmt_attitude: &Rotation<Gmt, World>,
    ) -> Option<f32> {
        let departure = estimated.path.aod?.direction;
        let departure: Direction<Gmt> = gmt_attitude.inverse().apply(departure);
        let field = codebook.field(usize::from(estimated.beam), &departure);
        let beam_gain = field.re * field.re + field.im * field.im;
        if beam_gain < LEAST_BEAM_GAIN {
            return None;
        }
        let sum: f32 = arrays.amplitude(&estimated.path.aoa).iter().map(|a| a * a).sum();
        let receive_gain = sum * E as f32;
        // Antenna patterns that are already part of a gain between dipoles.
        let dipoles = half_wave_dipole(departure.vector()) * half_wave_dipole(estimated.path.aoa.vector());
        let transmitted_dbw = self.transmit_power_dbm - 30.0 - self.implementation_loss_db;
        let shares = waveform.active as f32;
        let ratio = estimated.energy * shares * dipoles * dipoles / (beam_gain * receive_gain);
        (ratio > 0.0 && ratio.is_finite()).then(|| 10.0 * libm::log10f(ratio) - transmitted_dbw)
    }
}
