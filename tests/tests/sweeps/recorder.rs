//! The recorded sweeps: scenes at several SNRs through the channel and the front end, and captures that no AGC delivers.

use cslam_core::array::{Codebook, phasor};
use cslam_core::constants::SPEED_OF_LIGHT_M_PER_S;
use cslam_core::geometry::{Direction, Frame};
use cslam_host_sim::channel::{ChannelConfig, Impairments, Instant, Ray, Simulator, Sweep};
use cslam_host_sim::random::Stream;

/// Draws scenes.
pub(crate) struct Recorder {
    simulator: Simulator,
    codebook: Codebook<f64>,
    stream: Stream,
}

impl Recorder {
    pub(crate) fn new(impairments: Impairments, seed: u64) -> Self {
        let config = ChannelConfig {
            impairments,
            ..ChannelConfig::default()
        };
        Self {
            simulator: Simulator::new(config, seed),
            codebook: Codebook::default(),
            stream: Stream::new(seed, 1 << 40),
        }
    }

    /// A path with this SNR per subcarrier at an element of gain one, in the beam that favours it most.
    pub(crate) fn ray(&mut self, snr_db: f64) -> Ray {
        let arrival = direction(&mut self.stream, -45.0..60.0);
        let departure = direction(&mut self.stream, -3.0..30.0);
        let c_tau_m = 20.0 + 280.0 * self.stream.uniform();
        let field = (0..self.codebook.len())
            .map(|m| self.codebook.field(m, &departure).norm_sqr().sqrt())
            .fold(0.0, f64::max);
        let noise = self.simulator.noise_power_w() * 416.0 / 512.0;
        let amplitude =
            (libm::exp10(snr_db / 10.0) * noise).sqrt() / (field * self.simulator.signal_amplitude());
        Ray {
            amplitude: phasor(std::f64::consts::TAU * self.stream.uniform()) * amplitude,
            across: nalgebra::Complex::ZERO,
            delay_s: c_tau_m / SPEED_OF_LIGHT_M_PER_S,
            arrival,
            departure,
            doppler_hz: 0.0,
        }
    }

    /// Nine paths: the strongest at `snr_db`, the others uniform over 30 dB below.
    pub(crate) fn nine(&mut self, snr_db: f64) -> Vec<Ray> {
        (0..9)
            .map(|i| {
                let down = if i == 0 { 0.0 } else { 30.0 * self.stream.uniform() };
                self.ray(snr_db - down)
            })
            .collect()
    }

    pub(crate) fn sweep(&self, rays: &[Ray], index: u32) -> Sweep {
        self.simulator.sweep_rays(rays, &Instant::at_rest(), index)
    }
}

fn direction<F: Frame>(stream: &mut Stream, elevation_deg: std::ops::Range<f64>) -> Direction<F, f64> {
    let [low, high] = [elevation_deg.start, elevation_deg.end].map(|deg| libm::sin(deg.to_radians()));
    let z = low + (high - low) * stream.uniform();
    let azimuth = std::f64::consts::TAU * (stream.uniform() - 0.5);
    Direction::from_zenith_azimuth(libm::acos(z), azimuth).expect("finite")
}
