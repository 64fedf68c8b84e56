//! Inputs of the paper's network: delay and angle of arrival of each path, as they were measured.

use super::Received;

/// Inputs of each path of the paper's network: c tau in m, zenith and azimuth of arrival in rad.
pub const PAPER_INPUTS_PER_PATH: usize = 3;

/// Names of [`PAPER_INPUTS_PER_PATH`].
pub const PAPER_NAMES: [&str; PAPER_INPUTS_PER_PATH] = ["c_tau_m", "aoa_zenith_rad", "aoa_azimuth_rad"];

/// Inputs of the paper's network: c tau (m), zenith and azimuth of arrival (rad) of each path, strongest first, as many
/// as there is room for. Where there are fewer paths, zeros.
pub fn paper_inputs(paths: &[Received], inputs: &mut [f32]) {
    inputs.fill(0.0);
    for (path, place) in paths.iter().zip(inputs.chunks_exact_mut(PAPER_INPUTS_PER_PATH)) {
        let values = [
            path.path.c_tau_m,
            path.path.aoa.zenith_rad(),
            path.path.aoa.azimuth_rad(),
        ];
        place
            .iter_mut()
            .zip(values)
            .for_each(|(place, value)| *place = value);
    }
}
